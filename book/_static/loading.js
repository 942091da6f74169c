/* Load on demand what only some readers ask for: the viewer of surfaces, and data in small scripts.

   Script tags, not fetch or modules, because a book opened by double-click (file://) may use nothing else. A data file
   is one call, spectralNotes.register("scenes/fig-08-egg", {...}), and lies at _static/scenes/fig-08-egg.js. */
(function () {
  "use strict";
  const folder = new URL(".", document.currentScript.src);
  const loading = new Map();
  const registered = new Map();

  /** Load a script of the folder _static once; the promise fails, and may be asked again, where it is missing. */
  function script(path) {
    if (!loading.has(path)) {
      loading.set(path, new Promise((resolve, reject) => {
        const tag = document.createElement("script");
        tag.src = new URL(path, folder);
        tag.onload = resolve;
        tag.onerror = () => {
          loading.delete(path);
          tag.remove();
          reject(new Error(`${path} did not load`));
        };
        document.head.append(tag);
      }));
    }
    return loading.get(path);
  }

  const registry = {
    script,
    /** Called by a data file. */
    register: (name, value) => registered.set(name, value),
    /** Promise of what the data file of this name registers. */
    data: (name) => script(`${name}.js`).then(() => registered.get(name)),
    /** Promise of the viewer. */
    viewer: () => ["arrays", "viewer", "stage"].reduce((before, name) => before.then(() => script(`viewer/${name}.js`)), Promise.resolve()),
    /** Promise of a scene and of what draws it. */
    scene: (name) => Promise.all([registry.data(name), registry.viewer()]).then(([scene]) => scene),
  };
  window.spectralNotes = registry;
})();
