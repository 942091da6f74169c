/* Let a reader turn the surfaces of a figure, in place, on a click.

   A figure is a still picture; a hidden list beside it names its scenes. A button over the still opens one of them: the
   still makes room for a stage with the scene, a choice of the figure's pictures, and the way back. Plotly.js and the
   scene's data are loaded at the first click (loading.js). A browser allows few WebGL contexts, so at most LIVE stages
   and labs are open on a page: opening one more closes the oldest. */
(function () {
  "use strict";
  const LIVE = 4;
  const STEP = Math.PI / 18; // of one key press
  const live = (spectralNotes.live ??= []); // what is open and can be stopped, oldest first; the labs are in it too

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name in made && typeof value !== "string") made[name] = value;
      else made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  }

  /** Wrap the still of a figure and put the button on it. */
  function prepare(list) {
    const figure = document.getElementById(list.dataset.figure);
    const still = figure && figure.querySelector("img");
    if (!still) return;
    const number = figure.querySelector(".caption-number");
    const name = number ? number.textContent.trim() : "the picture";
    const button = element("button", { type: "button", class: "scene-turn", "aria-label": `Turn it: ${name}` },
      element("span", { "aria-hidden": "true" }, "\u27f2 "), "Turn it");
    const frame = element("div", { class: "scene-frame" });
    const message = element("p", { class: "scene-message", role: "status" });
    still.replaceWith(frame);
    frame.append(still, button);
    frame.after(message);
    const place = { frame, still, button, message, name, scenes: JSON.parse(list.dataset.scenes) };
    button.addEventListener("click", () => open(place, 0));
    still.addEventListener("click", (event) => open(place, pictureAt(place, event)));
  }

  /** Name of a picture for the choice, with its number where it has no name of its own. */
  function named(scenes, k) {
    const { name } = scenes[k];
    const alone = name && scenes.filter((other) => other.name === name).length === 1;
    return alone ? name : `${k + 1}: ${name || "picture"}`;
  }

  /** Number of the picture under the pointer, 0 where there is none. */
  function pictureAt({ still, scenes }, event) {
    const box = still.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width;
    const y = (event.clientY - box.top) / box.height;
    const found = scenes.findIndex(({ box: [left, top, width, height] }) =>
      left <= x && x <= left + width && top <= y && y <= top + height);
    return Math.max(found, 0);
  }

  function hasWebGL() {
    const context = document.createElement("canvas").getContext("webgl");
    if (context) context.getExtension("WEBGL_lose_context")?.loseContext();
    return Boolean(context);
  }

  /** Open the stage of a figure with one of its pictures. */
  async function open(place, chosen) {
    if (place.opening) return;
    place.opening = true;
    place.message.textContent = "Loading the scene \u2026";
    try {
      if (!hasWebGL()) throw new Error("This browser draws no scenes: WebGL is missing or switched off.");
      const [scene] = await Promise.all([spectralNotes.data(place.scenes[chosen].file), spectralNotes.plotly()]);
      while (live.length >= LIVE) live[0].stop();
      const stage = build(place, chosen);
      await draw(stage, scene);
      place.message.textContent = "";
      stage.view.focus({ preventScroll: true });
    } catch (error) {
      place.message.textContent = error.message;
    } finally {
      place.opening = false;
    }
  }

  /** Make the stage, in the still's place. */
  function build(place, chosen) {
    const { width, height } = place.still.getBoundingClientRect();
    const view = element("div", {
      class: "scene-view", tabindex: "0", role: "application", "aria-roledescription": "scene to turn",
      style: `height: ${Math.round(Math.min(Math.max(height, 0.62 * width, 260), 560))}px`,
    });
    const tool = (label, text, action) => {
      const button = element("button", { type: "button", "aria-label": label, title: label }, text);
      button.addEventListener("click", action);
      return button;
    };
    const stage = { place, view, chosen, stop: () => close(stage) };
    const bar = element("div", { class: "scene-bar" });
    if (place.scenes.length > 1) {
      const options = place.scenes.map((_, k) => element("option", { value: String(k) }, named(place.scenes, k)));
      stage.choice = element("select", { "aria-label": `Picture of ${place.name}` }, ...options);
      stage.choice.value = String(chosen);
      stage.choice.addEventListener("change", () => change(stage, Number(stage.choice.value)));
      bar.append(stage.choice);
    }
    bar.append(
      tool("Closer", "+", () => zoom(stage, 1.25)),
      tool("Farther", "\u2212", () => zoom(stage, 0.8)),
      tool("As at first", "\u21ba", () => reset(stage)),
      tool("Back to the still picture", "\u2715", () => close(stage, true)),
    );
    stage.element = element("div", { class: "scene-stage" }, view, bar);
    view.addEventListener("keydown", (event) => press(stage, event));
    place.frame.after(stage.element);
    place.frame.hidden = true;
    live.push(stage);
    return stage;
  }

  /** Draw a scene on a stage; `camera` is kept from the scene before. */
  async function draw(stage, scene, camera) {
    const { place, view, chosen } = stage;
    const picture = place.scenes.length > 1 ? `, ${named(place.scenes, chosen)}` : "";
    view.setAttribute("aria-label",
      `${place.name}${picture}. Drag, or use the arrow keys, to turn; plus and minus change the size; Escape leads back.`);
    stage.scene = scene;
    const layout = structuredClone(scene.layout);
    const barred = scene.data.some((trace) => trace.colorbar || trace.marker?.colorbar);
    layout.scene.domain = { y: [barred ? 0.16 : 0, 1] };
    if (camera) layout.scene.camera = camera;
    const shape = view.clientWidth / (view.clientHeight * (barred ? 0.84 : 1));
    const [halfWidth, halfHeight] = layout.meta.half;
    stage.fit = 1 / (1.08 * Math.max(halfHeight, halfWidth / shape));
    layout.scene.aspectratio = { x: stage.fit, y: stage.fit, z: stage.fit };
    delete layout.meta;
    await Plotly.react(view, structuredClone(scene.data), layout, { displayModeBar: false, responsive: true, scrollZoom: false });
  }

  /** Show another picture of the figure; a turned camera stays, where the pictures are seen from the same side. */
  async function change(stage, chosen) {
    const before = stage.scene;
    stage.chosen = chosen;
    try {
      const scene = await spectralNotes.data(stage.place.scenes[chosen].file);
      if (stage.chosen !== chosen) return; // the newest choice wins
      const same = JSON.stringify(scene.layout.scene.camera) === JSON.stringify(before.layout.scene.camera);
      await draw(stage, scene, same ? stage.view.layout.scene.camera : undefined);
    } catch (error) {
      stage.place.message.textContent = error.message;
    }
  }

  function zoom(stage, factor) {
    const size = stage.view.layout.scene.aspectratio.x * factor;
    if (size > stage.fit / 3 && size < stage.fit * 12) {
      Plotly.relayout(stage.view, { "scene.aspectratio": { x: size, y: size, z: size } });
    }
  }

  function reset(stage) {
    const camera = structuredClone(stage.scene.layout.scene.camera);
    Plotly.relayout(stage.view, { "scene.camera": camera, "scene.aspectratio": { x: stage.fit, y: stage.fit, z: stage.fit } });
  }

  /** Turn by angles around the vertical and towards the top. */
  function turn(stage, around, upward) {
    const { x, y, z } = stage.view.layout.scene.camera.eye;
    const radius = Math.hypot(x, y, z);
    const longitude = Math.atan2(y, x) + around;
    const latitude = Math.min(Math.max(Math.asin(z / radius) + upward, -1.55), 1.55);
    const eye = {
      x: radius * Math.cos(latitude) * Math.cos(longitude),
      y: radius * Math.cos(latitude) * Math.sin(longitude),
      z: radius * Math.sin(latitude),
    };
    Plotly.relayout(stage.view, { "scene.camera.eye": eye });
  }

  function press(stage, event) {
    const actions = {
      ArrowLeft: () => turn(stage, STEP, 0),
      ArrowRight: () => turn(stage, -STEP, 0),
      ArrowUp: () => turn(stage, 0, -STEP),
      ArrowDown: () => turn(stage, 0, STEP),
      "+": () => zoom(stage, 1.25),
      "-": () => zoom(stage, 0.8),
      Home: () => reset(stage),
      Escape: () => close(stage, true),
    };
    if (actions[event.key] && !event.ctrlKey && !event.metaKey && !event.altKey) {
      event.preventDefault();
      actions[event.key]();
    }
  }

  /** Give the place back to the still. */
  function close(stage, focus = false) {
    live.splice(live.indexOf(stage), 1);
    Plotly.purge(stage.view);
    stage.element.remove();
    stage.place.frame.hidden = false;
    stage.place.message.textContent = "";
    if (focus) stage.place.button.focus();
  }

  document.addEventListener("DOMContentLoaded", () => document.querySelectorAll(".scenes").forEach(prepare));
})();
