"use strict";
// A shape from k of its modes: slide k, or keep a band, and watch the error move along its curve.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics } = notes;
  const EVERY = 50; // modes between two sums that are kept

  /** Return a function (from, to) -> coordinates: differences of running sums, so that a step adds few modes. */
  function bandSums(evecs, coefficients, n) {
    const kept = coefficients.map((c) => {
      const sums = [new Float32Array(n)];
      for (let k = 0; k < c.length; k += EVERY) {
        const part = numerics.synthesize(evecs, c, n, k, Math.min(k + EVERY, c.length));
        sums.push(part.map((value, i) => value + sums.at(-1)[i]));
      }
      return sums;
    });
    const upTo = (d, k) => {
      const near = Math.floor(k / EVERY);
      const rest = numerics.synthesize(evecs, coefficients[d], n, near * EVERY, k);
      return rest.map((value, i) => value + kept[d][near][i]);
    };
    return (from, to) =>
      coefficients.map((_, d) => {
        const [high, low] = [upTo(d, to), upTo(d, from)];
        return high.map((value, i) => value - low[i]);
      });
  }

  async function start(lab, [file], load) {
    const shape = await load(file);
    const { n, k: all, mass } = shape;
    const parts = (array, length) => [0, 1, 2].map((d) => array.subarray(d * length, (d + 1) * length));
    const coordinates = parts(shape.vertices, n);
    const coefficients = parts(shape.coefficients, all);
    const evecs = numerics.joinBasis(shape);
    const band = bandSums(evecs, coefficients, n);
    const area = numerics.integral(mass, new Float32Array(n).fill(1));
    const span = (x) => Math.max(...x) - Math.min(...x);
    const diagonal = Math.hypot(...coordinates.map(span));
    const percent = (distance) => (100 * distance) / diagonal;
    const errorOfAll = numerics.rmsDistance(mass, coordinates, band(0, all));
    const errors = numerics.truncationErrors(coefficients, errorOfAll, area).map(percent);

    const last = lab.slider("Modes k", { min: 1, max: all, value: Math.min(50, all) }, (k) => {
      if (k <= +first.value) first.set(k - 1);
      update();
    });
    const first = lab.slider("Leave out the first", { max: all - 1, value: 0 }, (k) => {
      if (k >= +last.value) last.set(k + 1);
      update();
    });
    const error = lab.number("RMS error, % of the diagonal");
    const numbers = lab.number("Numbers kept");
    const scene = new notes.Scene(lab, `The ${shape.name} from its first modes`, [shape], shape);
    const chart = new notes.Chart(lab, "Error against the number of modes, both on logarithmic axes", {
      x: { name: "modes k", range: [1, all], log: true },
      y: { name: "RMS error", range: [Math.min(...errors.slice(1)) / 1.3, Math.max(...errors.slice(1)) * 1.3], log: true, unit: " %" },
    });
    chart.curve("values", errors.slice(1).map((_, k) => k + 1), errors.slice(1));

    const update = lab.steps(
      () => {
        const [from, to] = [+first.value, +last.value];
        const positions = band(from, to);
        return { from, to, positions, distance: numerics.rmsDistance(mass, coordinates, positions) };
      },
      ({ from, to, positions, distance }) => {
        error(percent(distance).toFixed(3));
        numbers(`${3 * (to - from)} of ${3 * n}`);
        chart.dot(to, percent(distance));
        scene.paint([{ vertices: Float32Array.from({ length: 3 * n }, (_, i) => positions[Math.floor(i / n)][i % n]) }]);
      },
    );
    update();
  }

  notes.defineLab("reconstruction", {
    title: "Spectral reconstruction",
    spatial: true,
    prompts: [
      [
        "Slide k from 1 up to 500. When do you first see a goat? When can you count its legs?",
        "One mode is a single point, five make a wedge from tail to nose. The trunk comes first; legs start as spikes and fill out; horns are high frequencies and come last.",
      ],
      [
        "Watch the dot between k = 10 and 100, and then between 100 and 500.",
        "The error falls in steps: one whenever the modes become fine enough for another thin part.",
      ],
      [
        "Set k to 500 and leave out the first mode, then the first five, then fifty.",
        "Mode 0 is only the place. Without the first few the body collapses and its detail is left standing near the origin.",
      ],
    ],
    start,
  });
})();
