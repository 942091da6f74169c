"use strict";
// What the labs draw with: a scene in space (Plotly.js), and a small chart (SVG) that takes the colours of the page.
(() => {
  const notes = globalThis.spectralNotes;
  const { element } = notes;

  function svg(tag, attributes = {}, ...children) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  // --- surfaces in space ---------------------------------------------------------------------------------------------

  const LIGHT = { ambient: 0.62, diffuse: 0.58, specular: 0.05, roughness: 0.8, fresnel: 0 };
  const PLAIN = "#d9dde3";
  const point = ([x, y, z]) => ({ x, y, z });

  function cross(a, b) {
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  }

  /** Turn a vector about a unit axis (Rodrigues). */
  function turned(v, axis, angle) {
    const along = v.reduce((sum, value, d) => sum + value * axis[d], 0);
    const side = cross(axis, v);
    return v.map((value, d) => value * Math.cos(angle) + side[d] * Math.sin(angle) + axis[d] * along * (1 - Math.cos(angle)));
  }

  /** Axes that are not seen and do not change when the surfaces do. */
  function axesAround(surfaces) {
    const shapes = surfaces.flatMap(({ coordinates, room }) => room ?? [coordinates]);
    const ranges = [0, 1, 2].map((d) => {
      const ends = shapes.flatMap((shape) => [Math.min(...shape[d]), Math.max(...shape[d])]);
      return [Math.min(...ends) - 0.02, Math.max(...ends) + 0.02];
    });
    const longest = Math.max(...ranges.map(([low, high]) => high - low));
    const [x, y, z] = ranges.map(([low, high]) => (high - low) / longest);
    const [xaxis, yaxis, zaxis] = ranges.map((range) => ({ visible: false, range }));
    return { xaxis, yaxis, zaxis, aspectmode: "manual", aspectratio: { x, y, z } };
  }

  /** Move the second of two shapes to the right of the first, as seen from the eye. */
  function beside(first, second, eye, up) {
    const right = cross(up, eye);
    const length = Math.hypot(...right);
    const along = (shape) => Array.from(shape[0], (_, i) => right.reduce((sum, r, d) => sum + (r * shape[d][i]) / length, 0));
    const gap = 1.1 * (Math.max(...along(first)) - Math.min(...along(second)));
    return second.map((x, d) => x.map((value) => value + (gap * right[d]) / length));
  }

  /** A scene of surfaces = { coordinates: [x, y, z], faces, room }: `room` holds all coordinates that a surface will take,
      where it moves far. Arrow keys turn the scene, plus and minus come closer. */
  class Scene {
    constructor(lab, label, surfaces, { eye, up }) {
      this.box = element("div", { class: "lab-scene", tabindex: 0, role: "group", "aria-label": `${label}. Arrow keys turn it.` });
      lab.stage.append(this.box);
      this.meshes = surfaces.map(({ coordinates: [x, y, z], faces }) => ({
        type: "mesh3d", x, y, z, color: PLAIN, hoverinfo: "none", showscale: false, lighting: LIGHT,
        lightposition: point(eye.map((value) => 1e5 * value)),
        ...Object.fromEntries(["i", "j", "k"].map((name, c) => [name, faces.filter((_, at) => at % 3 === c)])),
      }));
      const marks = { type: "scatter3d", hoverinfo: "skip", x: [null], y: [null], z: [null] };
      this.lines = { ...marks, mode: "lines", line: { color: "#000", width: 4 } };
      this.dots = { ...marks, mode: "markers", marker: { color: "#ffd200", size: 5, line: { color: "#111", width: 2 } } };
      const length = Math.hypot(...eye);
      this.eye = eye.map((value) => (1.45 * value) / length);
      this.up = up;
      this.layout = {
        margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", showlegend: false, uirevision: "one", autosize: true,
        scene: { dragmode: "orbit", camera: { eye: point(this.eye), up: point(up) }, ...axesAround(surfaces) },
      };
      this.box.addEventListener("keydown", (event) => this.key(event));
      lab.stopping.push(() => globalThis.Plotly.purge(this.box));
    }

    /** Paint what changed: surfaces[i] = { coordinates, values, colors, limits, onFaces }, lines, dots (coordinate lists). */
    async paint({ surfaces = [], lines, dots }) {
      surfaces.forEach(({ coordinates, values, colors, limits, onFaces }, i) => {
        if (coordinates) ["x", "y", "z"].forEach((name, d) => (this.meshes[i][name] = coordinates[d]));
        if (values) {
          const [cmin, cmax] = limits;
          Object.assign(this.meshes[i], { intensity: values, colorscale: colors, cmin, cmax });
          this.meshes[i].intensitymode = onFaces ? "cell" : "vertex";
        }
      });
      for (const [trace, places] of [[this.lines, lines], [this.dots, dots]]) {
        if (places) ["x", "y", "z"].forEach((name, d) => (trace[name] = places[d].length ? places[d] : [null]));
      }
      const traces = [...this.meshes, this.lines, this.dots].map((trace) => ({ ...trace }));
      await globalThis.Plotly.react(this.box, traces, this.layout, { displayModeBar: false, responsive: true });
      if (!this.listening) this.listen();
    }

    /** Call with (surface, vertex) when a vertex is clicked. */
    onClick(picked) {
      this.picked = picked;
    }

    listen() {
      this.listening = true;
      this.box.on("plotly_click", ({ points: [hit] }) => {
        if (hit.curveNumber < this.meshes.length) this.picked?.(hit.curveNumber, hit.pointNumber);
      });
    }

    key(event) {
      const axis = { ArrowLeft: [this.up, -1], ArrowRight: [this.up, 1], ArrowUp: [null, -1], ArrowDown: [null, 1] }[event.key];
      const scale = { "+": 0.9, "-": 1.1 }[event.key];
      if (!axis && !scale) return;
      event.preventDefault();
      const { eye, up } = this.box._fullLayout.scene.camera;
      this.eye = [eye.x, eye.y, eye.z];
      this.up = [up.x, up.y, up.z];
      if (axis) {
        const side = cross(this.eye, this.up);
        const about = axis[0] ? this.up : side.map((value) => value / Math.hypot(...side));
        this.eye = turned(this.eye, about, 0.2 * axis[1]);
        if (!axis[0]) this.up = turned(this.up, about, 0.2 * axis[1]);
      } else {
        this.eye = this.eye.map((value) => value * scale);
      }
      globalThis.Plotly.relayout(this.box, { "scene.camera.eye": point(this.eye), "scene.camera.up": point(this.up) });
    }
  }

  // --- curves --------------------------------------------------------------------------------------------------------

  const [WIDTH, HEIGHT, LEFT, RIGHT, BOTTOM] = [420, 260, 72, 24, 56];

  function ticks([low, high], log) {
    if (!log) return [low, high > 10 ? Math.round((low + high) / 2) : (low + high) / 2, high];
    const first = Math.ceil(Math.log10(low) - 1e-9);
    return Array.from({ length: Math.floor(Math.log10(high) + 1e-9) - first + 1 }, (_, i) => 10 ** (first + i));
  }

  /** A chart with fixed axes, x = { name, range, log }. */
  class Chart {
    constructor(lab, label, { x, y }) {
      this.scales = [x, y];
      this.root = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": label, class: "lab-chart" });
      this.root.append(svg("path", { class: "axis", d: `M${LEFT} 8V${HEIGHT - BOTTOM}H${WIDTH - RIGHT}` }));
      for (const [tick, d] of [...ticks(x.range, x.log).map((t) => [t, 0]), ...ticks(y.range, y.log).map((t) => [t, 1])]) {
        const at = this.place(d, tick);
        const where = d ? { x: LEFT - 6, y: at + 4, "text-anchor": "end" } : { x: at, y: HEIGHT - BOTTOM + 22, "text-anchor": "middle" };
        this.root.append(svg("text", where, +tick.toPrecision(3) + (this.scales[d].unit ?? "")));
      }
      this.root.append(svg("text", { x: (LEFT + WIDTH - RIGHT) / 2, y: HEIGHT - 8, "text-anchor": "middle" }, x.name));
      const middle = (HEIGHT - BOTTOM) / 2;
      this.root.append(svg("text", { x: 16, y: middle, "text-anchor": "middle", transform: `rotate(-90 16 ${middle})` }, y.name));
      lab.stage.append(this.root);
    }

    /** Pixels of a value along x (0) or y (1). */
    place(d, value) {
      const { range, log } = this.scales[d];
      const [low, high, at] = log ? [...range, Math.max(value, range[0])].map(Math.log10) : [...range, value];
      const part = (at - low) / (high - low);
      return d ? HEIGHT - BOTTOM - part * (HEIGHT - BOTTOM - 8) : LEFT + part * (WIDTH - RIGHT - LEFT);
    }

    value(d, pixels) {
      const { range: [low, high] } = this.scales[d];
      const part = d ? (HEIGHT - BOTTOM - pixels) / (HEIGHT - BOTTOM - 8) : (pixels - LEFT) / (WIDTH - RIGHT - LEFT);
      return low + Math.min(Math.max(part, 0), 1) * (high - low);
    }

    /** Draw or redraw the curve of a name through (xs[i], ys[i]). */
    curve(name, xs, ys) {
      const d = Array.from(xs, (x, i) => `${i ? "L" : "M"}${this.place(0, x).toFixed(1)} ${this.place(1, ys[i]).toFixed(1)}`).join("");
      this.mark("path", name).setAttribute("d", d);
    }

    dot(x, y) {
      const mark = this.mark("circle", "dot");
      for (const [name, value] of [["cx", this.place(0, x)], ["cy", this.place(1, y)], ["r", 6]]) mark.setAttribute(name, value);
    }

    mark(tag, name) {
      return this.root.querySelector(`.${name}`) ?? this.root.appendChild(svg(tag, { class: name }));
    }
  }

  Object.assign(notes, { svg, beside, Scene, Chart });
})();
