"use strict";
// The parts of a shape, found in each pose by itself: slide their number, switch the pose, see that the labels stay.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics } = notes;

  /** A face takes the label that two of its corners share. */
  function labelsOfFaces(faces, labels) {
    return Float32Array.from({ length: faces.length / 3 }, (_, t) => {
      const [a, b, c] = [0, 1, 2].map((corner) => labels[faces[3 * t + corner]]);
      return (b === c ? b : a) + 0.5;
    });
  }

  async function start(lab, [file], load) {
    const { n, poses, counts, faces, vertices, labels, mass, name, eye, up } = await load(file);
    const shapes = poses.map((_, pose) => vertices.subarray(3 * pose * n, 3 * (pose + 1) * n));
    const total = numerics.integral(mass, new Float32Array(n).fill(1));
    const names = poses.map((pose) => pose.replaceAll("_", " "));
    const labelsOf = (pose, count) => {
      const at = (pose * counts.length + counts.indexOf(count)) * n;
      return labels.subarray(at, at + n);
    };

    const number = lab.slider("Parts", { min: counts[0], max: counts.at(-1), value: Math.min(7, counts.at(-1)) }, () => update());
    const pose = lab.choice("Pose", names, () => update());
    lab.button("Next pose", () => {
      pose.selectedIndex = (pose.selectedIndex + 1) % poses.length;
      update();
    });
    const parts = lab.number("Parts");
    const agreement = lab.number(`Agreement with ${names[0]} (adjusted Rand index, by vertices)`);
    const smallest = lab.number("Smallest part, % of the area");
    const scene = new notes.Scene(lab, `The ${name}, one colour for each part`, [{ vertices: shapes[0], faces, room: shapes, onFaces: true }], { eye, up });

    const update = lab.steps(
      () => {
        const found = labelsOf(pose.selectedIndex, +number.value);
        const sizes = {};
        found.forEach((label, i) => (sizes[label] = (sizes[label] ?? 0) + mass[i]));
        return {
          values: labelsOfFaces(faces, found),
          sizes: Object.values(sizes),
          rand: numerics.adjustedRand(labelsOf(0, +number.value), found),
        };
      },
      ({ values, sizes, rand }) => {
        parts(sizes.length);
        agreement(rand.toFixed(3));
        smallest(((100 * Math.min(...sizes)) / total).toFixed(1));
        scene.paint([{ vertices: shapes[pose.selectedIndex], values, colors: numerics.labelScale(), limits: [0, 12] }]);
      },
    );
    update();
  }

  notes.defineLab("clusters", {
    title: "Clusters that survive a pose",
    spatial: true,
    prompts: [
      [
        "Set seven parts and go through the poses.",
        "The parts were found in every pose afresh, without knowing the others. Only their colours were matched afterwards.",
      ],
      [
        "Slide from the smallest number of parts to the largest. Which part splits next?",
        "From seven on, most of the body keeps its colours at each step: one part splits, and the cuts between the others hold.",
      ],
      [
        "Look for numbers of parts at which the agreement falls below 0.9.",
        "Two parts can be had in several ways that cost nearly the same, so a pose decides; the wave breaks nine, ten and twelve. A number on which all poses agree is a better choice.",
      ],
    ],
    start,
  });
})();
