"use strict";
// Drop heat on a surface, pluck it like a drum, or place a quantum particle on it: each scales the same coefficients.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics } = notes;
  const POSITIONS = 400;
  const EQUATIONS = ["Heat", "Wave", "Schrödinger"];

  async function start(lab, [file], load) {
    const shape = await load(file);
    const { n, k, evals, mass } = shape;
    const evecs = numerics.joinBasis(shape);
    const coordinates = [0, 1, 2].map((d) => shape.vertices.subarray(d * n, (d + 1) * n));
    const shortest = 6 / evals[k - 1]; // heat that old has no modes beyond the last
    const longest = { Heat: 1 / evals[1], Wave: 20 / Math.sqrt(evals[1]), Schrödinger: 2 / evals[1] };
    let drops = [];

    const equation = lab.choice("Equation", EQUATIONS, () => clear());
    const place = lab.choice("Where", numerics.PLACES, () => 0);
    lab.button("Drop it there", () => drop(numerics.farthest(coordinates, place.selectedIndex)));
    lab.button("Clear", () => clear());
    const name = () => EQUATIONS[equation.selectedIndex];
    const timeAt = (position) => {
      const part = position / POSITIONS;
      return name() === "Heat" ? shortest * (longest.Heat / shortest) ** part : part * longest[name()];
    };
    const clock = lab.slider("Time", { max: POSITIONS, value: 0, text: (position) => timeAt(position).toPrecision(2) }, () => update());
    lab.player(clock, 10);
    const conserved = lab.number("Kept for ever");
    const highest = lab.number("Highest value");
    const lowest = lab.number("Lowest value");
    const scene = new notes.Scene(lab, `Heat or waves on the ${shape.name}; click to drop some`, [shape], shape);

    /** The coefficients at time zero: point sources, smoothed to what the modes can hold. */
    function beginning() {
      const c = new Float32Array(k);
      for (const vertex of drops) numerics.row(evecs, n, k, vertex).forEach((value, mode) => (c[mode] += value));
      return name() === "Heat" ? c : numerics.heatAt(evals, c, 2 * shortest);
    }

    const compute = {
      Heat: (c, t) => {
        const f = numerics.synthesize(evecs, numerics.heatAt(evals, c, t), n);
        return { f, kept: `heat ${numerics.integral(mass, f).toFixed(3)}` };
      },
      Wave: (c, t) => {
        const position = numerics.waveAt(evals, c, t);
        const energy = numerics.waveEnergy(evals, position, numerics.waveSpeedAt(evals, c, t));
        return { f: numerics.synthesize(evecs, position, n), kept: `energy ${energy.toPrecision(4)}` };
      },
      Schrödinger: (c, t) => {
        const size = Math.hypot(...c) || 1;
        const part = (turn) => numerics.synthesize(evecs, c.map((value, mode) => (value / size) * turn(evals[mode] * t)), n);
        const [real, imaginary] = [part(Math.cos), part(Math.sin)];
        const f = real.map((value, i) => value ** 2 + imaginary[i] ** 2);
        return { f, kept: `probability ${numerics.integral(mass, f).toFixed(3)}` };
      },
    };

    const update = lab.steps(
      () => compute[name()](beginning(), timeAt(+clock.value)),
      ({ f, kept }) => {
        const [low, high] = [Math.min(...f), Math.max(...f)];
        conserved(kept);
        highest(high.toPrecision(3));
        lowest(Math.abs(low) < 1e-3 * high ? "0" : low.toPrecision(3));
        const signed = name() === "Wave";
        const colors = numerics.colorScale(signed ? numerics.SIGNED : numerics.POSITIVE);
        const top = Math.max(high, -low, 1e-9);
        const points = Float32Array.from(coordinates.flatMap((x) => drops.map((vertex) => x[vertex])));
        scene.paint([{ values: f, colors, limits: [signed ? -top : 0, top], nodal: false, points }]);
      },
    );

    function drop(vertex) {
      drops.push(vertex);
      update();
    }

    function clear() {
      drops = [];
      clock.set(0);
      drop(numerics.farthest(coordinates, place.selectedIndex));
    }

    lab.hint("Click the shape to drop more; drag it to turn it.");
    clear();
    scene.onClick((_, vertex) => drop(vertex));
  }

  notes.defineLab("heat", {
    title: "Heat and waves",
    spatial: true,
    prompts: [
      [
        "Let time run with heat. Which number changes, and which does not?",
        "The highest value falls and the lowest rises until all is even; the total stays: mode 0 alone carries it, and it never decays.",
      ],
      [
        "Clear, choose the −y end (on the goat a hoof), drop heat there, and slide time slowly. A click on the shape drops it elsewhere.",
        "The leg fills first and then feeds the body; to the end of the slider the hottest point is on that leg. What hangs by a narrow neck exchanges heat slowly.",
      ],
      [
        "Switch to the wave, then to Schrödinger's equation, and let them run.",
        "Nothing settles. The factors e^(−λt) became cosines: every mode keeps its share of the energy, and fronts travel and return.",
      ],
    ],
    start,
  });
})();
