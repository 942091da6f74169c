"use strict";
// Place arrows on a surface: the smoothest field of arrows, lines or crosses goes through them, and its indices sum to chi.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics } = notes;
  const MOST = 8; // arrows of the reader
  const [HAIR, PLACED] = [0.04, 0.11]; // lengths, on a surface of area one
  const KINDS = { arrows: 1, lines: 2, crosses: 4 };
  const INK = "#007a5e"; // seen on a light surface and beside it in the dark
  const SHORTEST = 0.02; // time of the heat step; the longest is 5,000 times as long
  const timeAt = (position) => SHORTEST * 5000 ** (position / 40);

  async function start(lab, [file], load) {
    const shape = await load(file);
    const { n } = shape;
    const at = (array, vertex) => [0, 1, 2].map((d) => array[d * n + vertex]);
    const end = (i) => numerics.farthest([0, 1, 2].map((d) => shape.vertices.subarray(d * n, (d + 1) * n)), i);
    const facing = (vertex) => { // high where the eye looks first: in front, and in the middle
      const [p, far] = [at(shape.vertices, vertex), Math.hypot(...shape.eye)];
      const front = numerics.dot(p, shape.eye) / far;
      return front - 4 * Math.sqrt(Math.max(numerics.dot(p, p) - front ** 2, 0));
    };
    const middle = shape.mass.reduce((best, _, i) => (facing(i) > facing(best) ? i : best), 0);
    let nFold = 1;
    let placed = []; // { vertex, from, angle }: the last one is under the slider
    let columns = new Map(); // vertex -> the field of a unit load there, as long as kind and time stay
    let field, apply;

    lab.choice("Field of", Object.keys(KINDS), (i) => {
      nFold = Object.values(KINDS)[i];
      again();
    });
    const place = lab.choice("Where", ["its middle", ...numerics.PLACES], () => 0);
    lab.button("Place it there", () => put(place.selectedIndex ? end(place.selectedIndex - 1) : middle));
    lab.button("Take the newest away", () => {
      if (placed.length > 1) placed.pop();
      hold();
    });
    lab.button("Start again", () => begin());
    const turn = lab.slider("Turn the newest", { min: -180, max: 180, step: 5, value: 0, text: (degrees) => `${degrees}°` }, (degrees) => {
      placed.at(-1).angle = placed.at(-1).from + (degrees * Math.PI) / 180;
      update();
    });
    const time = lab.slider("Time", { max: 40, value: 40, text: (position) => String(+timeAt(position).toPrecision(2)) }, () => again());
    const energy = lab.number("Energy");
    const singular = lab.number("Singular faces");
    const sum = lab.number("Sum of their indices");
    const scene = new notes.Scene(lab, `The ${shape.name}, combed; click to place an arrow`, [{ name: shape.name, vertices: shape.vertices, faces: shape.faces, ink: INK }], shape);
    lab.hint("Click the shape to place an arrow, or click the foot of one of yours to turn it. Red: a positive index, blue: a negative one.");

    const power = ({ angle }) => [Math.cos(nFold * angle), Math.sin(nFold * angle)];

    function comb() {
      apply ??= numerics.heatStep(shape, nFold, timeAt(+time.value));
      for (const { vertex } of placed) {
        const load = new Float64Array(2 * n);
        load[vertex] = 1;
        if (!columns.get(vertex)?.whole) columns.set(vertex, { z: numerics.conjugateGradients(apply, load, columns.get(vertex)?.z ?? load), whole: true });
      }
      field = numerics.fieldThrough(placed.map(({ vertex }) => columns.get(vertex).z), n, placed.map(({ vertex }) => vertex), placed.map(power));
    }

    /** All roots of a power at a vertex, as [foot, way] in space. */
    function roots(vertex, [x, y], length) {
      const [first, second] = [shape.first, shape.second].map((array) => at(array, vertex));
      return Array.from({ length: nFold }, (_, k) => {
        const angle = (Math.atan2(y, x) + 2 * Math.PI * k) / nFold;
        return [at(shape.above, vertex), first.map((value, d) => length * (Math.cos(angle) * value + Math.sin(angle) * second[d]))];
      });
    }

    const update = lab.steps(
      () => {
        comb();
        const differs = apply(field).map((value, i) => value - shape.mass[i % n] * field[i]); // t L z
        return { indices: numerics.fieldIndices(shape, nFold, field), spent: numerics.dot(field, differs) / timeAt(+time.value) };
      },
      ({ indices, spent }) => {
        const unit = nFold > 1 ? `1/${nFold}` : "1";
        const count = (sign) => indices.reduce((all, index) => all + Math.max(sign * index, 0), 0);
        energy(spent.toFixed(3));
        singular(`${count(1)} of index ${unit}, ${count(-1)} of −${unit}`);
        sum((count(1) - count(-1)) / nFold + (shape.euler === undefined ? "" : ` (χ is ${shape.euler})`));
        const values = new Float32Array(n);
        indices.forEach((index, t) => index && [0, 1, 2].forEach((c) => (values[shape.faces[3 * t + c]] = Math.sign(index))));
        const arrows = placed.flatMap((arrow) => roots(arrow.vertex, power(arrow), PLACED));
        for (const vertex of shape.hairs) arrows.push(...roots(vertex, [field[vertex], field[n + vertex]], HAIR));
        const column = (rows) => Float32Array.from([0, 1, 2].flatMap((d) => rows.map((row) => row[d])));
        scene.paint([{
          values, colors: numerics.colorScale(numerics.SIGNED), limits: [-1.6, 1.6], points: column(placed.map(({ vertex }) => at(shape.above, vertex))),
          feet: column(arrows.map(([foot]) => foot)), vectors: column(arrows.map(([, way]) => way)),
        }]);
      },
    );

    /** Put an arrow at a vertex as the field points there, the first one up; or take the one that stands there in hand. */
    function put(vertex) {
      if (placed.length) comb();
      const up = () => Math.atan2(...[shape.second, shape.first].map((array) => numerics.dot(at(array, vertex), shape.up)));
      const angle = placed.length ? Math.atan2(field[n + vertex], field[vertex]) / nFold : up();
      const there = placed.find((arrow) => arrow.vertex === vertex) ?? { vertex, angle };
      placed = [...placed.filter((arrow) => arrow !== there), there].slice(-MOST);
      hold();
    }

    function hold() {
      placed.at(-1).from = placed.at(-1).angle;
      turn.set(0);
      update();
    }

    /** Solve anew, from what was there before. */
    function again() {
      apply = null;
      for (const column of columns.values()) column.whole = false;
      update();
    }

    function begin() {
      placed = [];
      put(end(0));
      put(middle);
    }

    begin();
    scene.onClick((_, vertex) => put(vertex));
  }

  notes.defineLab("arrows", {
    title: "Arrows on a surface",
    spatial: true,
    prompts: [
      [
        "Place a third arrow on the body. Then turn it, and watch the energy.",
        "It begins as the field already pointed there. That is the turn of least energy: any other, and the whole field pays.",
      ],
      [
        "Make red and blue spots appear and vanish, by turning or by more arrows. Which number never moves?",
        "They come and go in pairs, one of each sign; others wander. The indices sum to the Euler characteristic, 2 for a goat.",
      ],
      [
        "Shorten the time; then take lines or crosses.",
        "In a short time the nearer arrow decides alone at each place, and the energy is higher. Lines turn by halves round a face and crosses by quarters, so more faces share the same sum.",
      ],
    ],
    start,
  });
})();
