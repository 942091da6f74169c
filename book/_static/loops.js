/* Let a reader play the pictures that move: a button over the still shows the loop in its place, and the still again.
   Nothing is loaded before; who prefers less motion keeps the still. */
(function () {
  "use strict";

  function prepare(figure) {
    const images = [...figure.querySelectorAll("img")];
    const stills = images.map((image) => image.getAttribute("src"));
    const number = figure.querySelector(".caption-number")?.textContent.trim() ?? "the picture";
    const make = (tag, className) => Object.assign(document.createElement(tag), { className });
    const [frame, button] = [make("div", "loop-frame"), make("button", "loop-play")];
    let moves = false;

    function show(wanted) {
      moves = wanted;
      button.textContent = moves ? "\u25a0 Stop" : "\u25b6 Play";
      button.setAttribute("aria-label", `${moves ? "Stop" : "Play"}: ${number}`);
      images.forEach((image, i) => (image.src = moves ? stills[i].replace("_images/", "_static/loops/") : stills[i]));
    }

    button.type = "button";
    button.addEventListener("click", () => show(!moves));
    for (const image of images) image.addEventListener("error", () => moves && show(false));
    images[0].before(frame);
    frame.append(...images, button);
    show(false);
  }

  document.addEventListener("DOMContentLoaded", () => {
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) document.querySelectorAll("figure.loop").forEach(prepare);
  });
})();
