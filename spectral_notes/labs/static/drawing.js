"use strict";
// What the labs draw with: a scene in space (viewer.js), and a small chart (SVG) that takes the colours of the page.
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

  /** A scene of surfaces = { name, vertices, faces, room }, side by side: `room` holds all coordinates that a surface will
      take, where it moves far. */
  class Scene {
    constructor(lab, label, surfaces, { eye, up }) {
      this.box = element("div", { class: "lab-scene" });
      lab.stage.append(this.box);
      this.viewer = new notes.Viewer(this.box, `${label}. Drag, or use the arrow keys, to turn; plus and minus change the size.`);
      this.viewer.show(surfaces.map((surface) => ({ ...surface, eye, up })));
      this.viewer.onLost(() => lab.stop());
      lab.stopping.push(() => this.viewer.free());
    }

    /** Change surfaces[i] = { vertices, values, colors, limits, points }. */
    paint(surfaces) {
      surfaces.forEach((changes, i) => this.viewer.change(i, changes));
    }

    /** Call with (surface, vertex) when a vertex is clicked. */
    onClick(picked) {
      this.viewer.onPick(picked);
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

    dot(x, y, name = "dot") {
      const mark = this.mark("circle", name);
      for (const [name, value] of [["cx", this.place(0, x)], ["cy", this.place(1, y)], ["r", 6]]) mark.setAttribute(name, value);
    }

    mark(tag, name) {
      return this.root.querySelector(`.${name}`) ?? this.root.appendChild(svg(tag, { class: name }));
    }

    /** Let the reader change the chart: began(x, y) and moved(x, y) by the pointer, actions = { key: act } by keys. */
    answer(began, moved, actions) {
      const { root } = this;
      root.setAttribute("tabindex", 0);
      root.setAttribute("role", "application");
      const inside = (event) => {
        const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(root.getScreenCTM().inverse());
        return [this.value(0, place.x), this.value(1, place.y)];
      };
      root.addEventListener("pointerdown", (event) => {
        root.setPointerCapture(event.pointerId);
        began(...inside(event));
      });
      root.addEventListener("pointermove", (event) => {
        if (root.hasPointerCapture(event.pointerId)) moved(...inside(event));
      });
      root.addEventListener("keydown", (event) => {
        if (!actions[event.key]) return;
        event.preventDefault();
        actions[event.key]();
      });
    }
  }

  Object.assign(notes, { svg, Scene, Chart });
})();
