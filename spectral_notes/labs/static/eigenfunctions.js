"use strict";
// Slide through the modes of a shape: nodal lines, the eigenvalue, and its place on Weyl's line.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics } = notes;

  async function start(lab, files, load) {
    let shape = await surface(files[0]);
    if (files.length > 1) {
      const names = files.map((file) => file.split("-").at(-1));
      lab.choice("Shape", names, async (i) => {
        shape = await surface(files[i]);
        mode.max = shape.k - 1;
        mode.say();
        open();
      });
    }
    const mode = lab.slider("Mode", { max: shape.k - 1, value: 5 }, () => update());
    const eigenvalue = lab.number("Eigenvalue λ (area 1)");
    const weyl = lab.number("Weyl says 4πk");
    const wavelength = lab.number("Wavelength 2π/√λ");
    const domains = lab.number("Nodal domains");
    let scene, chart;

    async function surface(file) {
      const data = await load(file);
      return { ...data, evecs: numerics.joinBasis(data) };
    }

    function open() {
      scene?.viewer.free();
      lab.stage.replaceChildren();
      scene = new notes.Scene(lab, `The ${shape.name}, coloured by one mode`, [shape], shape);
      const top = 500 * Math.ceil(Math.max(shape.evals[shape.k - 1], 4 * Math.PI * shape.k) / 500);
      chart = new notes.Chart(lab, "Eigenvalues against the number of the mode, beside Weyl's line", {
        x: { name: "mode k", range: [0, shape.k - 1] },
        y: { name: "eigenvalue", range: [0, top] },
      });
      chart.curve("weyl", [0, shape.k - 1], [0, 4 * Math.PI * (shape.k - 1)]);
      chart.curve("values", shape.evals.map((_, k) => k), shape.evals);
      update();
    }

    const update = lab.steps(
      () => {
        const k = +mode.value;
        const f = shape.evecs.subarray(k * shape.n, (k + 1) * shape.n);
        const top = f.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
        return { k, f, top };
      },
      ({ k, f, top }) => {
        const value = Math.max(shape.evals[k], 0);
        eigenvalue(value.toFixed(1));
        weyl((4 * Math.PI * k).toFixed(1));
        wavelength(k ? ((2 * Math.PI) / Math.sqrt(value)).toFixed(2) : "∞");
        domains(`${shape.domains[k]} (Courant allows ${k + 1})`);
        chart.dot(k, value);
        const colors = numerics.colorScale(numerics.SIGNED);
        scene.paint([{ values: f, colors, limits: [-top, top], nodal: true }]);
      },
    );
    open();
  }

  notes.defineLab("eigenfunctions", {
    title: "Eigenfunction explorer",
    spatial: true,
    prompts: [
      [
        "Slide slowly from mode 0 to mode 10. Guess before each step where the black lines will go.",
        "Mode 0 is constant. Mode 1 cuts the shape once, across its long axis. The lines grow in number, and the wavelength shrinks.",
      ],
      [
        "Watch the number of nodal domains against what Courant allows, up to mode 100.",
        "It meets the bound at the start, never exceeds it, and falls far behind.",
      ],
      [
        "Choose another shape and watch the dot beside Weyl's straight line.",
        "Every shape follows the same line, because all have area one: high modes know the area. How each wobbles about it is its own.",
      ],
    ],
    start,
  });
})();
