"use strict";
// A cap that is pushed in: a ruler on the ground and a spectrum see nothing of it, a ruler in the air does.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics } = notes;
  const STEPS = 400; // of the way on the ground
  const EVERY = 8; // of them, the steps that show a dot
  const MEASURES = ["pole to rim", "rim to rim", "pole to half way"];

  async function start(lab, [file], load) {
    const cap = await load(file);
    const { n, rings, angle, faces, evecs } = cap;
    const [x, y, z] = [0, 1, 2].map((d) => cap.vertices.subarray(d * n, (d + 1) * n));
    const firstOf = (ring) => (ring ? 1 + 3 * ring * (ring - 1) : 0);
    const pairs = [[0, firstOf(rings)], [firstOf(rings), firstOf(rings) + 3 * rings], [0, firstOf(rings / 2)]];
    let [from, to] = pairs[0];

    const pushed = lab.slider("Rings pushed in", { max: rings, value: rings / 2 }, () => update());
    const height = lab.slider("Height, %", { min: 50, max: 150, value: 100 }, () => update());
    const mode = lab.slider("Mode", { min: 1, max: cap.k - 1, value: 1 }, () => update());
    lab.choice("Measure", MEASURES, (i) => {
      [from, to] = pairs[i];
      update();
    });
    const ground = lab.number("On the ground");
    const air = lab.number("Through the air");
    const edges = lab.number("Largest change of an edge");
    const eigenvalue = lab.number("Eigenvalue of the mode");

    /** The height of a point of the ball above the plane of the mirror, mirrored where it is inside, and stretched. */
    function lift(up, inside) {
      const mirror = Math.cos((angle * +pushed.value) / rings);
      return (inside ? 2 * mirror - up : up) * (+height.value / 100);
    }

    const place = () => [x, y, z.map((up, i) => lift(up, i < firstOf(+pushed.value)))];

    /** The shortest way on the ball between two vertices, taken along to where the cap now is. */
    function way() {
      const [p, q] = [from, to].map((i) => [x[i], y[i], z[i]]);
      const whole = Math.acos(Math.min(1, p.reduce((sum, value, d) => sum + value * q[d], 0)));
      const mirror = Math.cos((angle * +pushed.value) / rings);
      return Array.from({ length: STEPS + 1 }, (_, k) => {
        const [a, b] = [Math.sin(whole * (1 - k / STEPS)), Math.sin((whole * k) / STEPS)];
        const [px, py, up] = p.map((value, d) => (whole ? (a * value + b * q[d]) / Math.sin(whole) : value));
        return [px, py, lift(up, up > mirror)];
      });
    }

    const room = [0, rings].map((count) => {
      const [, , up] = [pushed.set(count), height.set(150), place()[2]];
      return Float32Array.from([...x, ...y, ...up]);
    });
    pushed.set(rings / 2);
    height.set(100);
    const scene = new notes.Scene(lab, "A cap of a ball; click to move the end of the ruler", [{ ...cap, room }], cap);
    const lengths = numerics.edgeLengths([x, y, z], faces);

    const update = lab.steps(
      () => {
        const now = place();
        const f = evecs.subarray(+mode.value * n, (+mode.value + 1) * n);
        const after = numerics.edgeLengths(now, faces);
        const change = after.reduce((most, length, i) => Math.max(most, Math.abs(length / lengths[i] - 1)), 0);
        return { now, f, change, path: way(), quotient: numerics.rayleighQuotient(now, faces, f) };
      },
      ({ now, f, change, path, quotient }) => {
        const far = (p, q) => Math.hypot(...p.map((value, d) => value - q[d]));
        ground(path.slice(1).reduce((sum, p, k) => sum + far(p, path[k]), 0).toFixed(3));
        air(far(path[0], path.at(-1)).toFixed(3));
        edges(change < 1e-5 ? "none" : `${(100 * change).toFixed(1)} %`);
        eigenvalue(quotient.toFixed(3));
        const dots = path.filter((_, k) => k % EVERY === 0);
        const top = f.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
        scene.paint([{
          vertices: Float32Array.from(now.flatMap((part) => [...part])), values: f, limits: [-top, top], nodal: true,
          colors: numerics.colorScale(numerics.SIGNED), points: Float32Array.from([0, 1, 2].flatMap((d) => dots.map((p) => p[d]))),
        }]);
      },
    );

    lab.hint("Click the cap to move the end of the ruler; drag it to turn it.");
    scene.onClick((_, vertex) => {
      to = vertex;
      update();
    });
    update();
  }

  notes.defineLab("bump-dent", {
    title: "Bump and dent",
    spatial: true,
    prompts: [
      [
        "Push the rings in, one by one. Which of the four numbers change?",
        "Only the way through the air. No edge becomes longer or shorter, so neither does any way on the ground: all stages have one metric.",
      ],
      [
        "Step through the modes while half of the rings are pushed in, then let them out again. Does an eigenvalue move, or a black line?",
        "None. The weights of the Laplacian come from the lengths of edges alone, so the bump and the dent have the same matrices, and the same modes. You cannot hear which way it bulges.",
      ],
      [
        "Now change the height.",
        "All numbers change at once: edges are stretched, and that is what the Laplacian sees.",
      ],
    ],
    start,
  });
})();
