"use strict";
// A stage on which a scene turns: the viewer, a choice of its pictures, the tools, and the bar of colours below.
(() => {
  const notes = globalThis.spectralNotes;

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  /** Coordinates that Python packed as whole numbers: x of all, then y, then z. */
  function unpacked({ low, step }, numbers) {
    const n = numbers.length / 3;
    return Float32Array.from(numbers, (value, i) => low[Math.floor(i / n)] + step * value);
  }

  function pieces(points, ends) {
    const n = points.length / 3;
    return ends.map((end, k) => {
      const axes = [0, 1, 2].flatMap((d) => [...points.subarray(d * n + (k ? ends[k - 1] : 0), d * n + end)]);
      return Float32Array.from(axes);
    });
  }

  /** The pictures of a scene as the viewer takes them. */
  async function picturesOf(scene) {
    const surfaces = new Map();
    for (const name of new Set(scene.pictures.map(({ mesh }) => mesh))) {
      const { facts, arrays } = await notes.data(name);
      const { vertices, faces } = await notes.decodeAll(arrays);
      surfaces.set(name, { vertices: unpacked(facts, vertices), faces });
    }
    return Promise.all(scene.pictures.map(async ({ name, mesh, facts, arrays }) => {
      const given = await notes.decodeAll(arrays);
      const marks = {};
      for (const key of ["curves", "points", "feet", "tips"]) if (given[key]) marks[key] = unpacked(facts[key], given[key]);
      if (marks.tips) marks.vectors = marks.tips.map((x, i) => x - marks.feet[i]);
      if (marks.curves) marks.curves = pieces(marks.curves, facts.ends);
      return { ...facts, ...surfaces.get(mesh), ...marks, values: given.values, name };
    }));
  }

  /** Name of a picture for the choice, with its number where it has no name of its own. */
  function named(pictures, k) {
    const { name } = pictures[k];
    const alone = name && pictures.filter((other) => other.name === name).length === 1;
    return alone ? name : `${k + 1}: ${name || "picture"}`;
  }

  /** A bar of colours with its ends and its label. */
  function colorBar({ label, limits }, { colors }) {
    const stops = colors.map(([share, color]) => `${color} ${100 * share}%`).join(", ");
    const text = (value) => Number(value.toPrecision(3)).toString().replace("-", "\u2212");
    return element("p", { class: "scene-colors" },
      text(limits[0]), " ", element("span", { style: `background: linear-gradient(to right, ${stops})` }), " ", text(limits[1]),
      element("br"), label);
  }

  /** Put a stage for a scene into a place of the page; `close` is called by its last button and by Escape. */
  class Stage {
    constructor(host, scene, pictures, { name = "The scene", close } = {}) {
      this.pictures = pictures;
      this.view = element("div", { class: "scene-view" });
      const bar = element("div", { class: "scene-bar" });
      this.element = element("div", { class: "scene-stage" }, bar, this.view);
      if (scene.bar) this.element.append(colorBar(scene.bar, pictures[0]));
      host.append(this.element);
      this.viewer = new notes.Viewer(this.view,
        `${name}. Drag, or use the arrow keys, to turn; plus and minus change the size${close ? "; Escape leads back" : ""}.`);
      if (pictures.length > 1) {
        const options = ["All pictures", ...pictures.map((_, k) => named(pictures, k))];
        const choice = element("select", { "aria-label": `Pictures of ${name}` }, ...options.map((text) => element("option", {}, text)));
        choice.addEventListener("change", () => this.show(choice.selectedIndex - 1));
        bar.append(choice);
      }
      const tool = (label, text, action) => {
        const button = element("button", { type: "button", "aria-label": label, title: label }, text);
        button.addEventListener("click", action);
        bar.append(button);
      };
      tool("Closer", "+", () => this.viewer.zoom(1.25));
      tool("Farther", "\u2212", () => this.viewer.zoom(0.8));
      tool("As at first", "\u21ba", () => this.viewer.home());
      if (close) {
        tool("Back to the still picture", "\u2715", close);
        this.element.addEventListener("keydown", (event) => event.key === "Escape" && close());
      }
      this.show(-1);
    }

    /** Show one picture, or all of them (-1). */
    show(chosen) {
      this.viewer.show(chosen < 0 ? this.pictures : [this.pictures[chosen]]);
    }

    free() {
      this.viewer.free();
      this.element.remove();
    }
  }

  Object.assign(notes, { element, picturesOf, Stage });

  // A page that is a scene and nothing else, as a notebook and a report show it.
  addEventListener("DOMContentLoaded", () => document.querySelectorAll(".scene-alone").forEach(async (place) => {
    try {
      const scene = await notes.data(place.dataset.scene);
      new Stage(place, scene, await picturesOf(scene));
    } catch (error) {
      place.textContent = error.message;
    }
  }));
})();
