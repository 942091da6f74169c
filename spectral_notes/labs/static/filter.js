"use strict";
// Draw the response of a filter; see the filtered signal on a graph, by the modes and by a polynomial of the Laplacian.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics, svg } = notes;
  const KNOBS = 9;
  const SIZE = 240; // of the picture of a graph
  const at = (rule) => Array.from({ length: KNOBS }, (_, i) => rule(i / (KNOBS - 1)));
  const RESPONSES = {
    "low-pass": at((part) => Math.exp(-6 * part)),
    "ideal low-pass": at((part) => +(part < 0.3)),
    "band-pass": at((part) => 4 * part * Math.exp(1 - 4 * part)),
    "high-pass": at((part) => part),
    "all pass": at(() => 1),
  };

  async function start(lab, [file], load) {
    const { n, names, points, edges, weights, evals, evecs, signals } = await load(file);
    const b = evals[n - 1] * (1 + 1e-6); // the largest eigenvalue is known here; no Gershgorin is needed
    const apply = (f) => numerics.graphLaplacian(edges, weights, f);
    let knobs = [...RESPONSES["low-pass"]];
    let f, c;

    const signal = lab.choice("Signal", names, (i) => take(i));
    lab.choice("Response", Object.keys(RESPONSES), (i) => {
      knobs = [...Object.values(RESPONSES)[i]];
      choose(+knob.value);
    });
    const knob = lab.slider("Knob", { max: KNOBS - 1, value: 1 }, (i) => choose(i));
    const gain = lab.slider("Its gain", { max: 1, step: 0.01, value: 0, text: (value) => value.toFixed(2) }, (value) => pull(value));
    const degree = lab.slider("Degree", { max: 60, value: 8 }, () => update());
    const gap = lab.number("Largest difference of the two");
    const reached = lab.number("Nodes that the polynomial reaches");
    const total = lab.number("Sum over the nodes");
    const energy = lab.number("Energy kept, %");
    const chart = new notes.Chart(lab, "The response. Drag its knobs; or arrow keys: left and right choose a knob, up and down move it.", {
      x: { name: "eigenvalue", range: [0, Math.ceil(b)] }, y: { name: "gain", range: [-0.2, 1.2] },
    });
    const xs = Array.from({ length: 201 }, (_, i) => (b * i) / 200);
    const graphs = ["by all modes", "by the polynomial"].map(graph);
    lab.hint("Drag the knobs of the response up and down, or press the arrow keys on it. Dashed: what you ask for; solid: the polynomial.");

    function graph(title) {
      const place = (i) => [0, 1].map((d) => 8 + (SIZE - 16) * points[d * n + i]);
      const lines = Array.from(weights, (_, e) => `M${place(edges[2 * e])}L${place(edges[2 * e + 1])}`).join("");
      const nodes = Array.from(evals, (_, i) => svg("circle", { cx: place(i)[0], cy: place(i)[1], r: 4.5 }));
      lab.stage.append(svg(
        "svg", { viewBox: `0 0 ${SIZE} ${SIZE + 22}`, role: "img", "aria-label": `The graph, filtered ${title}`, class: "lab-chart lab-graph" },
        svg("path", { d: lines }), ...nodes, svg("text", { x: SIZE / 2, y: SIZE + 16, "text-anchor": "middle" }, title),
      ));
      return nodes;
    }

    const update = lab.steps(
      () => {
        const g = numerics.polyline(knobs, b);
        const a = numerics.chebyshev(g, +degree.value, b);
        const exact = numerics.synthesize(evecs, c.map((value, k) => g(evals[k]) * value), n);
        return { exact, found: numerics.chebyshevSum(a, b, apply, f), polynomial: numerics.chebyshevSum(a, b, (u) => u.map((value, i) => xs[i] * value), xs.map(() => 1)) };
      },
      ({ exact, found, polynomial }) => {
        const square = (values) => values.reduce((sum, value) => sum + value ** 2, 0);
        gap(exact.reduce((most, value, i) => Math.max(most, Math.abs(value - found[i])), 0).toExponential(1));
        reached(`${found.filter((value) => value !== 0).length} of ${n}`);
        total(exact.reduce((sum, value) => sum + value, 0).toFixed(3));
        energy(((100 * square(exact)) / square(f)).toFixed(1));
        chart.curve("given", knobs.map((_, i) => (b * i) / (KNOBS - 1)), knobs);
        chart.curve("values", xs, polynomial.map((value) => Math.min(Math.max(value, -0.2), 1.2)));
        knobs.forEach((value, i) => chart.dot((b * i) / (KNOBS - 1), value, `knob-${i}`));
        chart.root.querySelectorAll("circle").forEach((dot, i) => dot.setAttribute("r", i === +knob.value ? 8 : 5));
        const top = exact.reduce((most, value) => Math.max(most, Math.abs(value)), 1e-9);
        [exact, found].forEach((values, which) => values.forEach((value, i) => {
          graphs[which][i].style.setProperty("fill", `rgb(${numerics.colorAt(numerics.SIGNED, 0.5 + value / top / 2)})`);
        }));
      },
    );

    function take(i) {
      f = Float64Array.from(signals.subarray(i * n, (i + 1) * n));
      c = Float64Array.from(evals, (_, k) => f.reduce((sum, value, at) => sum + value * evecs[k * n + at], 0));
      choose(+knob.value);
    }

    function choose(i) {
      knob.set(Math.min(Math.max(i, 0), KNOBS - 1));
      gain.set(knobs[+knob.value]);
      update();
    }

    function pull(value) {
      knobs[+knob.value] = Math.min(Math.max(value, 0), 1);
      choose(+knob.value);
    }

    chart.answer((x, y) => {
      choose(Math.round((x / b) * (KNOBS - 1)));
      pull(y);
    }, (_, y) => pull(y), {
      ArrowLeft: () => choose(+knob.value - 1), ArrowRight: () => choose(+knob.value + 1),
      ArrowUp: () => pull(knobs[+knob.value] + 0.05), ArrowDown: () => pull(knobs[+knob.value] - 0.05),
    });
    take(signal.selectedIndex);
  }

  notes.defineLab("filter", {
    title: "A filter on a graph",
    prompts: [
      [
        "Take the spark and raise the degree from 0. Watch how many nodes the polynomial reaches, and what the modes do.",
        "A polynomial of degree d sees d edges far and nothing beyond. The filter by modes reaches every node at once, though most of them hardly.",
      ],
      [
        "Choose the ideal low-pass, and look at the solid line beside the dashed one as the degree grows.",
        "It overshoots beside the flank, which is steep, and the difference falls slowly. The low-pass needs a far lower degree: smooth responses are cheap.",
      ],
      [
        "Move one knob after the other. Which of them changes the sum over the nodes?",
        "Only the first. The constant is mode 0, with eigenvalue 0, and all other modes sum to nothing.",
      ],
    ],
    start,
  });
})();
