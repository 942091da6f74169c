/* Let a reader turn the surfaces of a figure, in place, on a click.

   A figure is a still picture; a hidden list beside it names its scene. A button over the still opens it: the still makes
   room for a stage with all pictures of the figure, which turn together. The viewer and the data are loaded at the first
   click (loading.js). A browser allows few WebGL contexts, so at most LIVE stages and labs are open on a page: opening
   one more closes the oldest. */
(function () {
  "use strict";
  const LIVE = 4;
  const live = (spectralNotes.live ??= []); // what is open and can be stopped, oldest first; the labs are in it too

  /** Wrap the still of a figure and put the button on it. */
  function prepare(list) {
    const figure = document.getElementById(list.dataset.figure);
    const stills = figure ? [...figure.querySelectorAll("img")].map((still) => still.closest("picture") ?? still) : [];
    if (!stills.length) return;
    const number = figure.querySelector(".caption-number");
    const name = number ? number.textContent.trim() : "the picture";
    const make = (tag, className, text = "") => Object.assign(document.createElement(tag), { className, textContent: text });
    const button = make("button", "scene-turn", "\u27f2 Turn it");
    button.type = "button";
    button.setAttribute("aria-label", `Turn it: ${name}`);
    const frame = make("div", "scene-frame");
    const message = make("p", "scene-message");
    message.setAttribute("role", "status");
    stills[0].before(frame);
    frame.append(...stills, button);
    frame.after(message);
    const place = { frame, button, message, name, file: list.dataset.scene };
    for (const one of [button, ...stills]) one.addEventListener("click", () => open(place));
  }

  /** Open the stage of a figure. */
  async function open(place) {
    if (place.opening) return;
    place.opening = true;
    place.message.textContent = "Loading the scene \u2026";
    try {
      const scene = await spectralNotes.scene(place.file);
      const pictures = await spectralNotes.picturesOf(scene);
      while (live.length >= LIVE) live[0].stop();
      const { width, height } = place.frame.getBoundingClientRect();
      const wanted = Math.round(Math.min(Math.max(height, (pictures.length > 3 ? 0.8 : 0.62) * width, 260), 640));
      const stage = { stop: () => close(place, stage) };
      const host = Object.assign(document.createElement("div"), { className: "scene-host" });
      host.style.setProperty("--wanted", `${wanted}px`);
      place.frame.after(host);
      try {
        stage.inner = new spectralNotes.Stage(host, scene, pictures, { name: place.name, close: () => close(place, stage, true) });
      } catch (error) {
        host.remove();
        throw error;
      }
      stage.host = host;
      stage.inner.viewer.onLost(() => close(place, stage));
      live.push(stage);
      place.frame.hidden = true;
      place.message.textContent = "";
      stage.inner.view.focus({ preventScroll: true });
      stage.inner.element.scrollIntoView({ block: "nearest" });
    } catch (error) {
      place.message.textContent = error.message;
    } finally {
      place.opening = false;
    }
  }

  /** Give the place back to the still. */
  function close(place, stage, focus = false) {
    live.splice(live.indexOf(stage), 1);
    stage.inner.free();
    stage.host.remove();
    place.frame.hidden = false;
    place.message.textContent = "";
    if (focus) place.button.focus();
  }

  document.addEventListener("DOMContentLoaded", () => document.querySelectorAll(".scenes").forEach(prepare));
})();
