/* What a reader does with a page: follow a link into what is folded, search, print, predict, tick off exercises.

   What was predicted and ticked off stays in this browser (localStorage) and is sent nowhere; the side bar counts it, and a
   button there writes it to a file. */
(function () {
  "use strict";
  const KEY = "spectral-geometry-notes";
  const read = () => JSON.parse(localStorage.getItem(KEY) ?? "{}");
  const page = () => DOCUMENTATION_OPTIONS.pagename;

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  /** Open everything folded around a place of the page. */
  function unfold(place) {
    for (let around = place; around; around = around.parentElement) {
      if (around.tagName === "DETAILS") around.open = true;
      if (around.classList.contains("toggle-hidden")) around.querySelector(".toggle-button")?.click();
    }
  }

  function follow() {
    const place = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (!place) return;
    unfold(place);
    place.scrollIntoView();
  }

  // --- predictions and exercises --------------------------------------------------------------------------------------

  function keep(kind, name, value) {
    const all = read();
    const mine = ((all[page()] ??= {})[kind] ??= {});
    if (value) mine[name] = value;
    else delete mine[name];
    localStorage.setItem(KEY, JSON.stringify(all));
    count();
  }

  /** A box that asks for a prediction gets a line to write it on; the answer opens when it is given. */
  function predictions() {
    const boxes = [...document.querySelectorAll("article .admonition")].filter((box) =>
      box.querySelector(":scope > .admonition-title")?.textContent.trim() === "Predict");
    boxes.forEach((box, k) => {
      const answer = box.querySelector(":scope > .admonition.dropdown");
      if (!answer) return;
      const line = element("input", { type: "text", "aria-label": "Your prediction", placeholder: "Your prediction", autocomplete: "off" });
      const form = element("form", { class: "prediction" }, line, element("button", { type: "submit" }, "Compare"));
      line.value = read()[page()]?.predictions?.[k] ?? "";
      form.addEventListener("submit", (event) => {
        event.preventDefault();
        keep("predictions", k, line.value.trim());
        if (answer.classList.contains("toggle-hidden")) answer.querySelector(".toggle-button").click();
        answer.querySelector(".toggle-button")?.focus();
      });
      answer.before(form);
    });
    return boxes.length;
  }

  /** An exercise can be ticked off. */
  function exercises() {
    const found = [...document.querySelectorAll("article .admonition.exercise[id]")];
    for (const exercise of found) {
      const box = element("input", { type: "checkbox" });
      box.checked = Boolean(read()[page()]?.exercises?.[exercise.id]);
      box.addEventListener("change", () => keep("exercises", exercise.id, box.checked));
      exercise.append(element("label", { class: "ticked" }, box, " Done"));
    }
    return found.length;
  }

  /** In the side bar: how many exercises of this page are done, and a way to take everything along. */
  function count() {
    const here = document.querySelector("#pst-primary-sidebar .current.active > a");
    const done = Object.keys(read()[page()]?.exercises ?? {}).length;
    if (!here || !total) return;
    const mark = here.querySelector(".progress-mark") ?? here.appendChild(element("span", { class: "progress-mark" }));
    mark.textContent = done ? ` ${done}/${total}` : "";
    mark.title = done ? `${done} of ${total} exercises done` : "";
    const list = here.closest(".bd-links") ?? here.closest("nav");
    if (list.querySelector(".take-along") || !Object.keys(read()).length) return;
    const button = element("button", { type: "button", class: "take-along" }, "Save what I wrote");
    button.addEventListener("click", () => {
      const file = new Blob([JSON.stringify(read(), null, 2)], { type: "application/json" });
      const link = element("a", { href: URL.createObjectURL(file), download: `${KEY}.json` });
      link.click();
      URL.revokeObjectURL(link.href);
    });
    list.append(button);
  }
  let total = 0;

  // --- search, print ----------------------------------------------------------------------------------------------------

  // A page opened from a folder may not read its neighbours: the results come without excerpts, and without errors.
  if (location.protocol === "file:") DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;

  const sought = localStorage.getItem("sphinx_highlight_terms") ?? ""; // read before Sphinx clears it, and stops at file://

  /** Mark what was searched for, where Sphinx did not. */
  function mark() {
    const article = document.querySelector("article");
    if (!article || page() === "search" || document.querySelector("article .highlighted")) return;
    for (const term of sought.toLowerCase().split(/\s+/).filter(Boolean)) _highlightText(article, term, "highlighted");
  }

  /** Paper is white: the light pictures are loaded and shown while it prints. */
  function paper() {
    const { theme } = document.documentElement.dataset;
    addEventListener("afterprint", () => (document.documentElement.dataset.theme = theme), { once: true });
    document.documentElement.dataset.theme = "light";
    for (const image of document.querySelectorAll("img[loading=lazy]")) image.loading = "eager";
  }

  /** What is wider than its column scrolls, by keys too: it becomes a stop of the Tab key, and only then. */
  function scrolling() {
    for (const one of document.querySelectorAll("mjx-container[display=true], article :is(table, figure, .scene-frame)")) {
      if (one.scrollWidth > one.clientWidth && getComputedStyle(one).overflowX !== "visible") one.tabIndex = 0;
      else one.removeAttribute("tabindex");
    }
  }

  // --- other versions ---------------------------------------------------------------------------------------------------

  /** Offer the versions that lie beside this one; a script brings their list, which a folder may read, too. */
  function versions() {
    const place = document.querySelector("[data-versions]");
    if (!place) return;
    const site = new URL(`${document.documentElement.dataset.content_root}../`, location.href);
    window.spectralNotesVersions = (names) => {
      const here = location.href.slice(site.href.length).split("/")[0];
      const select = element("select", { "aria-label": "Version of the book" });
      for (const name of names) select.append(new Option(name, name, false, name === here));
      select.addEventListener("change", () => (location.href = `${site.href}${select.value}/index.html`));
      place.append(" · ", select);
    };
    document.head.append(element("script", { src: `${site.href}versions.js` }));
  }

  addEventListener("beforeprint", paper);
  addEventListener("hashchange", follow);
  document.addEventListener("DOMContentLoaded", () => {
    predictions();
    total = exercises();
    count();
    versions();
  });
  addEventListener("load", () => {
    follow(); // the folding buttons are made by then
    mark();
    window.MathJax?.startup?.promise?.then(() => {
      scrolling();
      addEventListener("resize", scrolling);
    });
  });
})();
