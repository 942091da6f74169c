"use strict";
// The frame of every lab: <spectral-lab name="heat" data="heat">a still picture</spectral-lab>.
// The still picture stays until the reader starts the lab; only then are its script and its data loaded.
(() => {
  const notes = (globalThis.spectralNotes ??= {});
  const recipes = new Map(); // name -> { title, prompts, spatial, start }
  const MAX_LIVE = 4; // labs and turned figures that hold a WebGL context; starting another stops the oldest
  const live = (notes.live ??= []); // shared with scenes.js

  /** Called by a lab's file: what the lab is named, what to try and notice, and how it starts. */
  notes.defineLab = (name, recipe) => recipes.set(name, recipe);

  const reducedMotion = () => matchMedia("(prefers-reduced-motion: reduce)").matches;
  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  class SpectralLab extends HTMLElement {
    connectedCallback() {
      if (this.still) return;
      const begin = () => {
        this.still = [...this.childNodes];
        this.rest();
      };
      // While the page is being read, what stands inside is not there yet.
      if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", begin);
      else begin();
    }

    disconnectedCallback() {
      if (this.still) this.stop();
    }

    /** Show the still picture and the button that starts the lab. */
    rest() {
      const start = element("button", { type: "button", class: "lab-start" }, "Start the lab");
      start.addEventListener("click", () => this.start());
      this.replaceChildren(...this.still, start);
      if (this.hasAttribute("started")) this.removeAttribute("started") ?? this.start(); // a page that is a lab and nothing else
    }

    async start() {
      const button = this.querySelector(".lab-start");
      button.disabled = true;
      button.textContent = "Loading …";
      try {
        const name = this.getAttribute("name");
        for (const file of ["viewer/arrays", "viewer/viewer", "labs/numerics", "labs/drawing", `labs/${name}`]) {
          await notes.script(`${file}.js`); // each needs the last
        }
        const recipe = recipes.get(name);
        const files = (this.getAttribute("data") ?? "").split(" ").filter(Boolean);
        const load = async (file) => {
          const { facts, arrays } = await notes.data(`labs/data/${file}`);
          return { ...facts, ...(await notes.decodeAll(arrays)) };
        };
        this.stopping = [];
        this.build(recipe);
        if (recipe.spatial) live.push(this);
        if (live.length > MAX_LIVE) live[0].stop();
        await recipe.start(this, files, load);
        this.querySelector("input, select, button").focus({ preventScroll: true });
      } catch (error) {
        this.stop();
        this.append(element("p", { role: "alert" }, `The lab did not start: ${error.message}. The picture stays.`));
      }
    }

    /** Free what the lab holds, and show the still picture again. */
    stop() {
      if (live.includes(this)) live.splice(live.indexOf(this), 1);
      for (const free of this.stopping?.splice(0) ?? []) free();
      this.rest();
    }

    build({ title, prompts }) {
      const items = prompts.map(([what, notice]) => {
        const answer = element("details", {}, element("summary", {}, "What to notice"), notice);
        return element("li", {}, what, answer);
      });
      const stop = element("button", { type: "button", class: "lab-stop" }, "Back to the picture");
      stop.addEventListener("click", () => {
        this.stop();
        this.querySelector(".lab-start").focus();
      });
      this.stage = element("div", { class: "lab-stage" });
      this.controls = element("div", { class: "lab-controls" });
      this.numbers = element("dl", { class: "lab-numbers" });
      this.replaceChildren(
        element(
          "section", { class: "lab", "aria-label": title },
          element("p", { class: "lab-title" }, title), this.stage, this.controls, this.numbers,
          element("p", { class: "lab-try" }, "Try this"), element("ol", {}, ...items), stop,
        ),
      );
    }

    // --- controls ----------------------------------------------------------------------------------------------------

    /** Add a slider; `text` says the value in words. Returns the input, whose `.set(value)` moves it by script. */
    slider(label, { min = 0, max, step = 1, value, text = String }, changed) {
      const input = element("input", { type: "range", min, max, step, value, "aria-label": label });
      const said = element("output", { "aria-live": "off" });
      const say = () => {
        said.textContent = text(+input.value);
        input.setAttribute("aria-valuetext", said.textContent);
      };
      input.addEventListener("input", () => {
        say();
        changed(+input.value);
      });
      input.set = (position) => {
        input.value = position;
        say();
      };
      input.say = say;
      say();
      this.controls.append(element("label", {}, element("span", {}, label), input, said));
      return input;
    }

    choice(label, options, changed) {
      const select = element("select", { "aria-label": label }, ...options.map((text, i) => element("option", { value: i }, text)));
      select.addEventListener("change", () => changed(select.selectedIndex));
      this.controls.append(element("label", {}, element("span", {}, label), select));
      return select;
    }

    button(text, pressed) {
      const made = element("button", { type: "button" }, text);
      made.addEventListener("click", () => pressed(made));
      this.controls.append(made);
      return made;
    }

    /** Say how to use what stands on the stage. */
    hint(text) {
      this.stage.after(element("p", { class: "lab-hint" }, text));
    }

    /** Add a number with its name; returns the function that changes it. */
    number(name) {
      const value = element("dd", { "data-name": name }, "–");
      this.numbers.append(element("div", {}, element("dt", {}, name), value));
      return (text) => (value.textContent = text);
    }

    /** A button that lets a slider run; where the reader wants less motion, each press is one tenth of the way. */
    player(input, seconds) {
      const move = (part) => {
        const span = input.max - input.min;
        input.set(input.min - -((+input.value - input.min + part * span) % span));
        input.dispatchEvent(new Event("input"));
      };
      if (reducedMotion()) return this.button("Step", () => move(0.1));
      let last = null;
      const tick = (now) => {
        if (last === null || !this.isConnected) return;
        move((now - last) / 1000 / seconds);
        last = now;
        requestAnimationFrame(tick);
      };
      const pause = () => {
        last = null;
        play.textContent = "Play";
      };
      const play = this.button("Play", () => {
        if (last !== null) return pause();
        play.textContent = "Pause";
        last = performance.now();
        return requestAnimationFrame(tick);
      });
      this.stopping.push(pause);
      return play;
    }

    // --- steps -------------------------------------------------------------------------------------------------------

    /** Return a function that asks for a step: compute, then paint. One step at a time, the newest position wins. */
    steps(compute, paint) {
      let wanted = false;
      let running = false;
      const run = async () => {
        running = true;
        this.setAttribute("aria-busy", "true");
        while (wanted) {
          wanted = false;
          await new Promise(requestAnimationFrame);
          const start = performance.now();
          const result = compute();
          this.stepMilliseconds = performance.now() - start;
          await paint(result);
        }
        running = false;
        this.removeAttribute("aria-busy");
      };
      return () => {
        wanted = true;
        if (!running) run();
      };
    }
  }

  notes.element = element;
  customElements.define("spectral-lab", SpectralLab);
})();
