"use strict";
// The modes of a cortex, their wavelengths in millimetres, and a map of it from the first k of them.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics } = notes;

  async function start(lab, [file], load) {
    const shape = await load(file);
    const { n, k: all, evals, mass, maps, map_coefficients, millimetres } = shape;
    const evecs = numerics.joinBasis(shape);
    const surfaces = [shape.vertices, shape.inflated];
    const signed = { colors: numerics.colorScale(numerics.SIGNED), nodal: false };
    const wave = (k) => (2 * Math.PI * millimetres) / Math.sqrt(evals[k]);
    const chosen = shape.maps_of.map((_, i) => {
      const [f, c] = [maps.subarray(i * n, (i + 1) * n), map_coefficients.subarray(i * all, (i + 1) * all)];
      const rest = numerics.rmsDistance(mass, [f], [numerics.synthesize(evecs, c, n)]);
      const errors = numerics.truncationErrors([c], rest, numerics.integral(mass, new Float32Array(n).fill(1)));
      const top = Float32Array.from(f, Math.abs).sort()[Math.floor(0.98 * n)];
      return { f, c, top, errors: errors.slice(1).map((error) => error / errors[0]) }; // from mode 0, the mean, which is zero
    });

    const mode = lab.slider("Mode", { min: 1, max: all - 1, value: 10 }, () => update());
    const last = lab.slider("Modes k", { min: 1, max: all - 1, value: 50 }, () => update());
    const map = lab.choice("Map", shape.maps_of, () => update());
    const beside = lab.choice("Beside it", ["one mode", "the whole map"], () => update());
    const form = lab.choice("Surface", ["folded", "inflated"], () => update());
    const length = lab.number("Wavelength of the mode, mm");
    const shortest = lab.number("Shortest wave of the sum, mm");
    const error = lab.number("Relative error of the sum");
    const scene = new notes.Scene(lab, "A left hemisphere twice", ["one mode", "the sum"].map((name) => ({ ...shape, name, room: surfaces })), shape);
    scene.box.style.flexBasis = "100%";
    const chart = new notes.Chart(lab, "Relative error of the map against the number of modes", {
      x: { name: "modes k", range: [0, all - 1] }, y: { name: "relative error", range: [0, 1] },
    });

    const update = lab.steps(
      () => numerics.synthesize(evecs, chosen[map.selectedIndex].c, n, 0, +last.value + 1),
      (sum) => {
        const [{ f, top, errors }, j, k] = [chosen[map.selectedIndex], +mode.value, +last.value];
        const shown = beside.selectedIndex ? f : evecs.subarray(j * n, (j + 1) * n);
        const most = beside.selectedIndex ? top : shown.reduce((high, value) => Math.max(high, Math.abs(value)), 0);
        length(wave(j).toFixed(0));
        shortest(wave(k).toFixed(0));
        error(errors[k].toFixed(3));
        chart.curve("values", errors.map((_, i) => i), errors);
        chart.dot(k, errors[k]);
        const vertices = surfaces[form.selectedIndex];
        const titles = [["one mode", "the whole map"][beside.selectedIndex], `from ${k} modes`];
        scene.paint([{ values: shown, limits: [-most, most] }, { values: sum, limits: [-top, top] }].map((one, i) => ({ ...signed, ...one, vertices, name: titles[i] })));
      },
    );
    update();
  }

  notes.defineLab("cortex", {
    title: "Modes of a cortex",
    spatial: true,
    prompts: [
      [
        "Slide through the first ten modes, folded and inflated. Where does mode 1 change its sign?",
        "Half-way between front and back: the first wave is more than 400 mm long, and runs along the cortex, in and out of every fold.",
      ],
      [
        "Show the whole depth beside its sum, and raise k. At which wavelength do folds appear?",
        "Hardly any are seen with 50 modes; with 100 to 200, waves of 50 to 35 mm, they are there. The folds are as wide as that.",
      ],
      [
        "Compare the two curves of error: first ten modes, and last hundred.",
        "Thickness loses an eighth in ten modes, as it differs between front and back, and then falls slowly. Depth hardly moves there; in the last hundred it falls twice as fast as thickness.",
      ],
    ],
    start,
  });
})();
