"use strict";
// A map between two shapes as a small matrix: click a point, see its image; change the matrix, and watch the map break.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics, element } = notes;
  const SAMPLES = 40; // points whose images are checked at every step

  async function start(lab, [file], load) {
    const data = await load(file);
    const all = data.k_1;
    const side = (which) => {
      const n = data[`n_${which}`];
      const vertices = data[`vertices_${which}`];
      return {
        n, vertices, name: data[`name_${which}`].replaceAll("_", " "), evecs: data[`evecs_${which}`], faces: data[`faces_${which}`],
        coordinates: [0, 1, 2].map((d) => vertices.slice(d * n, (d + 1) * n)),
      };
    };
    const [one, two] = [side(1), side(2)];
    const span = (x) => Math.max(...x) - Math.min(...x);
    const size = Math.hypot(...one.coordinates.map(span));
    let C = Float32Array.from(data.C_12);
    let cell = [1, 1];
    let point = 0;

    const modes = lab.slider("Modes k", { min: 4, max: all, value: Math.min(30, all) }, () => update());
    lab.choice("Point", numerics.PLACES, (i) => choose(numerics.farthest(one.coordinates, i)));
    const entry = lab.slider("Entry of C", { min: -1.5, max: 1.5, step: 0.05, value: 1, text: (value) => `${value.toFixed(2)} (row ${cell[0]}, column ${cell[1]})` }, (value) => {
      C[cell[0] * all + cell[1]] = value;
      update();
    });
    const damages = {
      "The map as it is": (r, c, value) => value,
      "Only its diagonal": (r, c, value) => (r === c ? value : 0),
      "The identity": (r, c) => +(r === c),
      "One sign turned": (r, c, value) => (r === cell[0] ? -value : value),
      "Noise added": (r, c, value) => value + 0.35 * Math.sin(12.9898 * r + 78.233 * c + r * c),
    };
    lab.choice("Matrix", Object.keys(damages), (i) => {
      C = data.C_12.map((value, at) => Object.values(damages)[i](Math.floor(at / all), at % all, value));
      update();
    });
    const right = lab.number(`Of ${SAMPLES} points, within 5 % of the truth`);
    const meanMiss = lab.number("Their mean miss, % of the size");
    const miss = lab.number("This point misses by, % of the size");
    const orthogonal = lab.number("|CᵀC − 1|, root mean square of an entry");
    const scene = new notes.Scene(lab, "Two poses; click a point on the left one", [one, two], { eye: data.eye_1, up: data.up_1 });
    const matrix = element("canvas", {
      class: "lab-matrix", tabindex: 0, role: "application",
      "aria-label": "The matrix C. Arrow keys choose an entry, plus and minus change it, 0 clears it.",
    });
    lab.stage.append(matrix);
    lab.hint("Click a point of the left shape; click an entry of the matrix, then change it with its slider.");

    const image = (vertex, k, halves) => {
      const c = numerics.mapCoefficients(C, all, numerics.row(one.evecs, one.n, k, vertex), k);
      return { c, vertex: numerics.nearestRow(two.evecs, two.n, c, halves) };
    };
    /** How far the image is from the truth, on the first shape, as a share of its size. */
    const distance = (vertex, found) => {
      const truth = data.p2p_21[found];
      return Math.hypot(...one.coordinates.map((x) => x[truth] - x[vertex])) / size;
    };

    const update = lab.steps(
      () => {
        const k = +modes.value;
        const halves = numerics.halfSquares(two.evecs, two.n, k);
        const { c, vertex } = image(point, k, halves);
        const samples = Array.from({ length: SAMPLES }, (_, i) => Math.floor(((i + 0.5) * one.n) / SAMPLES));
        const misses = samples.map((sample) => distance(sample, image(sample, k, halves).vertex));
        const good = misses.filter((distance) => distance < 0.05).length;
        const mean = misses.reduce((sum, distance) => sum + distance / SAMPLES, 0);
        let off = 0;
        for (let r = 0; r < k; r++) {
          for (let s = 0; s < k; s++) {
            let product = r === s ? -1 : 0;
            for (let q = 0; q < k; q++) product += C[q * all + r] * C[q * all + s];
            off += product ** 2;
          }
        }
        const source = numerics.synthesize(one.evecs, numerics.row(one.evecs, one.n, k, point), one.n);
        return { k, vertex, good, mean, off: Math.sqrt(off) / k, source, target: numerics.synthesize(two.evecs, c, two.n) };
      },
      ({ k, vertex, good, mean, off, source, target }) => {
        right(`${good}`);
        meanMiss((100 * mean).toFixed(2));
        miss((100 * distance(point, vertex)).toFixed(1));
        orthogonal(off.toFixed(3));
        drawMatrix(k);
        const colors = numerics.colorScale(numerics.SIGNED);
        const painted = [source, target].map((values) => {
          const top = values.reduce((most, value) => Math.max(most, Math.abs(value)), 1e-9);
          return { values, colors, limits: [-top, top] };
        });
        painted.forEach((changes, which) => {
          changes.points = Float32Array.from([one, two][which].coordinates, (x) => x[[point, vertex][which]]);
        });
        scene.paint(painted);
      },
    );

    function drawMatrix(k) {
      matrix.width = matrix.height = k;
      const context = matrix.getContext("2d");
      const picture = context.createImageData(k, k);
      for (let r = 0; r < k; r++) {
        for (let c = 0; c < k; c++) {
          const color = numerics.colorAt(numerics.SIGNED, 0.5 + C[r * all + c] / 2);
          picture.data.set([...(r === cell[0] && c === cell[1] ? [255, 210, 0] : color), 255], 4 * (r * k + c));
        }
      }
      context.putImageData(picture, 0, 0);
    }

    function choose(vertex) {
      point = vertex;
      update();
    }

    function select(r, c) {
      const k = +modes.value;
      cell = [Math.min(Math.max(r, 0), k - 1), Math.min(Math.max(c, 0), k - 1)];
      entry.set(C[cell[0] * all + cell[1]]);
      update();
    }

    matrix.addEventListener("click", (event) => {
      const box = matrix.getBoundingClientRect();
      const cells = (part) => Math.floor(part * +modes.value);
      select(cells((event.clientY - box.top) / box.height), cells((event.clientX - box.left) / box.width));
    });
    matrix.addEventListener("keydown", (event) => {
      const [r, c] = cell;
      const move = { ArrowLeft: [r, c - 1], ArrowRight: [r, c + 1], ArrowUp: [r - 1, c], ArrowDown: [r + 1, c] }[event.key];
      const change = { "+": 0.1, "-": -0.1, 0: -C[r * all + c] }[event.key];
      if (move) select(...move);
      if (change !== undefined) {
        C[r * all + c] += change;
        select(r, c);
      }
      if (move || change !== undefined) event.preventDefault();
    });
    choose(numerics.farthest(one.coordinates, 0));
    select(1, 1);
    scene.onClick((which, vertex) => which === 0 && choose(vertex));
  }

  notes.defineLab("functional-map", {
    title: "Functional map viewer",
    spatial: true,
    prompts: [
      [
        "Click points on the left doll, or choose them from the list, with 10, 30 and 60 modes.",
        "The point's image is the peak of a blurred bump. More modes, a sharper bump, and more of the points land where they should.",
      ],
      [
        "With 60 modes, keep only the diagonal of C; then try the identity. Watch the mean miss.",
        "Off the diagonal stands how the pose mixed neighbouring modes: without it the mean miss more than doubles. The identity is worse still, because some modes changed their sign.",
      ],
      [
        "With 10 modes, turn one sign. Then go up to 60 modes.",
        "Of ten coordinates each has a say, and the mean miss grows by a third or more. Of sixty, fifty-nine outvote the wrong one.",
      ],
    ],
    start,
  });
})();
