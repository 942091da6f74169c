"use strict";
// Surfaces that turn: one canvas of WebGL 2 for any number of pictures side by side, all turned together.
//
// A picture is { name, vertices, faces, values, onFaces, limits, colors, color, nodal, edges, curves, feet, vectors,
// points, ink, eye, up, room }: vertices (x of all, then y, then z), faces in threes (none: a cloud), values at
// vertices or faces, colours as stops [share, "#rrggbb"], curves as lists of coordinates, `ink` the colour of curves,
// arrows and points, `room` all coordinates that a surface will take. The axes of a picture are those of its camera: x
// to the right, y away from the eye, z up.
(() => {
  const notes = (globalThis.spectralNotes ??= {});
  const STEP = Math.PI / 18; // of one key press
  const STEEPEST = 1.55; // of a look from above, in radians
  const TURNED = 0.75; // of the farthest reach that a picture shows upward, even where the first sight is flatter
  const INK = "#111111";
  const TITLE = 22; // pixels above a picture

  const PLACE = `#version 300 es
    precision highp float;
    uniform mat3 turn; uniform vec3 center, scale;
    vec4 place(vec3 p) { vec3 q = turn * (p - center) * scale; return vec4(q.xy, -q.z, 1.0); }`;
  const SURFACE = [`${PLACE}
    in vec3 position, normal, corner; in float value;
    out vec3 side, within; out float shown;
    void main() { gl_Position = place(position); side = turn * normal; within = corner; shown = value; }`,
  `#version 300 es
    precision highp float;
    in vec3 side, within; in float shown;
    uniform sampler2D colors; uniform vec2 limits; uniform vec3 plain; uniform float pixel; uniform bool colored, nodal, edges;
    out vec4 color;
    void main() {
      vec3 n = normalize(side);
      n *= n.z < 0.0 ? -1.0 : 1.0;
      float part = (shown - limits.x) / (limits.y - limits.x);
      vec3 base = colored ? texture(colors, vec2(clamp(part, 0.002, 0.998), 0.5)).rgb : plain;
      float light = 0.42 + 0.4 * max(dot(n, vec3(0.35, 0.6, 0.72)), 0.0) + 0.24 * n.z + 0.06 * max(dot(n, vec3(-0.8, 0.0, 0.6)), 0.0);
      vec3 seen = base * min(light, 1.05);
      float change = fwidth(shown);
      if (nodal && change > 1e-9 * (limits.y - limits.x)) seen *= smoothstep(0.8, 1.6, abs(shown) / change / pixel);
      if (edges) {
        vec3 away = smoothstep(vec3(0.2), vec3(1.2), within / max(fwidth(within), vec3(1e-9)) / pixel);
        seen *= mix(0.25, 1.0, min(away.x, min(away.y, away.z)));
      }
      color = vec4(seen, 1.0);
    }`];
  const LINES = [`${PLACE}
    in vec3 from, to; in vec2 where;
    uniform vec2 size; uniform float width;
    void main() {
      vec4 a = place(from), b = place(to);
      vec2 along = (b.xy - a.xy) * size;
      along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
      gl_Position = mix(a, b, where.x);
      gl_Position.xy += width * (vec2(-along.y, along.x) * where.y + along * (where.x - 0.5) * 0.5) / size;
      gl_Position.z -= 0.012;
    }`,
  `#version 300 es
    precision highp float;
    uniform vec3 plain; out vec4 color;
    void main() { color = vec4(plain, 1.0); }`];
  const POINTS = [`${PLACE}
    in vec3 position; in float value; uniform float width, nearer; out float shown;
    void main() { gl_Position = place(position); gl_Position.z -= nearer; gl_PointSize = width; shown = value; }`,
  `#version 300 es
    precision highp float;
    in float shown; uniform sampler2D colors; uniform vec2 limits; uniform vec3 plain; uniform bool colored; out vec4 color;
    void main() {
      vec2 at = 2.0 * gl_PointCoord - 1.0;
      if (dot(at, at) > 1.0) discard;
      float part = (shown - limits.x) / (limits.y - limits.x);
      vec3 base = colored ? texture(colors, vec2(clamp(part, 0.002, 0.998), 0.5)).rgb : plain;
      color = vec4(base * (1.0 - 0.35 * dot(at, at)), 1.0);
    }`];

  // --- small algebra -----------------------------------------------------------------------------------------------

  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = (v) => v.map((x) => x / Math.hypot(...v));
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const rgb = (color) => [1, 3, 5].map((at) => parseInt(color.slice(at, at + 2), 16) / 255);

  /** Axes of a camera, the height of its eye, and what it must show of the coordinates in `room`. */
  function frameOf({ eye, up, room }) {
    const right = unit(cross(up, eye));
    const axes = [right, unit(cross(up, right)), unit(up)];
    const low = [Infinity, Infinity, Infinity];
    const high = low.map((x) => -x);
    const each = (act) => room.forEach((p) => {
      const n = p.length / 3;
      for (let i = 0; i < n; i++) act(axes.map((axis) => axis[0] * p[i] + axis[1] * p[n + i] + axis[2] * p[2 * n + i]));
    });
    each((q) => q.forEach((x, d) => {
      low[d] = Math.min(low[d], x);
      high[d] = Math.max(high[d], x);
    }));
    const middle = low.map((x, d) => (x + high[d]) / 2);
    const latitude = Math.asin(Math.min(Math.max(dot(unit(eye), axes[2]), -1), 1));
    let [wide, tall, far] = [1e-9, 1e-9, 1e-9];
    each((q) => {
      const [x, y, z] = q.map((value, d) => value - middle[d]);
      wide = Math.max(wide, Math.hypot(x, y));
      far = Math.max(far, Math.hypot(x, y, z));
      tall = Math.max(tall, Math.abs(z * Math.cos(latitude) + y * Math.sin(latitude)));
    });
    const center = [0, 1, 2].map((d) => axes.reduce((sum, axis, k) => sum + axis[d] * middle[k], 0));
    return { axes, latitude, center, far, wide, tall: Math.max(tall, TURNED * far) };
  }

  /** Normals of vertices, weighted by area, vertex after vertex. */
  function normalsOf(p, faces) {
    const n = p.length / 3;
    const normals = new Float32Array(3 * n);
    for (let t = 0; t < faces.length; t += 3) {
      const [a, b, c] = [faces[t], faces[t + 1], faces[t + 2]];
      const [ux, uy, uz] = [p[b] - p[a], p[n + b] - p[n + a], p[2 * n + b] - p[2 * n + a]];
      const [vx, vy, vz] = [p[c] - p[a], p[n + c] - p[n + a], p[2 * n + c] - p[2 * n + a]];
      const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      for (const i of [a, b, c]) {
        normals[3 * i] += x;
        normals[3 * i + 1] += y;
        normals[3 * i + 2] += z;
      }
    }
    return normals;
  }

  /** Coordinates vertex after vertex. */
  function interleaved(p) {
    const n = p.length / 3;
    const points = new Float32Array(p.length);
    for (let i = 0; i < n; i++) for (let d = 0; d < 3; d++) points[3 * i + d] = p[d * n + i];
    return points;
  }

  /** Ends of the segments of curves, six numbers each. */
  function segmentsOf(curves) {
    return curves.flatMap((curve) => {
      const [points, ends] = [interleaved(curve), []];
      for (let i = 0; i + 5 < points.length; i += 3) ends.push(...points.subarray(i, i + 6));
      return ends;
    });
  }

  /** Arrows: shafts as segments, heads as pyramids of the last quarter. */
  function arrowsOf(feet, vectors) {
    const [shafts, heads] = [[], []];
    const [starts, ways] = [interleaved(feet), interleaved(vectors)];
    for (let i = 0; i < starts.length; i += 3) {
      const [foot, way] = [[...starts.subarray(i, i + 3)], [...ways.subarray(i, i + 3)]];
      const long = Math.hypot(...way);
      if (!long) continue;
      const along = (share) => foot.map((x, d) => x + share * way[d]);
      const least = way.reduce((best, x, d) => (Math.abs(x) < Math.abs(way[best]) ? d : best), 0);
      const across = unit(cross(way, [0, 1, 2].map((d) => +(d === least)))).map((x) => 0.14 * long * x);
      const beside = cross(way, across).map((x) => x / long);
      const [tip, neck] = [along(1), along(0.72)];
      const rim = [1, 0, -1, 0].map((s, k) => neck.map((x, d) => x + s * across[d] + [0, 1, 0, -1][k] * beside[d]));
      shafts.push(...foot, ...along(0.75));
      for (let k = 0; k < 4; k++) heads.push(...tip, ...rim[k], ...rim[(k + 1) % 4], ...neck, ...rim[(k + 1) % 4], ...rim[k]);
    }
    return { shafts, heads };
  }

  // --- the viewer --------------------------------------------------------------------------------------------------

  class Viewer {
    constructor(box, label) {
      this.box = box;
      this.canvas = document.createElement("canvas");
      this.canvas.className = "viewer-canvas";
      box.classList.add("viewer");
      for (const [name, value] of [["tabindex", "0"], ["role", "application"], ["aria-roledescription", "scene to turn"], ["aria-label", label]]) {
        box.setAttribute(name, value);
      }
      box.append(this.canvas);
      this.gl = this.canvas.getContext("webgl2", { alpha: true, antialias: true });
      if (!this.gl) throw new Error("This browser draws no scenes: WebGL 2 is missing or switched off.");
      this.programs = [SURFACE, LINES, POINTS].map((sources) => this.program(sources));
      this.pictures = [];
      this.home();
      this.listen();
    }

    program(sources) {
      const { gl } = this;
      const made = gl.createProgram();
      sources.forEach((source, k) => {
        const shader = gl.createShader(k ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        gl.attachShader(made, shader);
      });
      gl.linkProgram(made);
      if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error(gl.getProgramInfoLog(made));
      return made;
    }

    /** Show pictures in place of those before. */
    show(pictures) {
      for (const { title } of this.pictures) title.remove();
      this.pictures = pictures.map((given) => {
        const picture = { ...given, frame: frameOf({ ...given, room: given.room ?? [given.vertices] }), buffers: new Map() };
        picture.title = document.createElement("span");
        picture.title.className = "viewer-title";
        picture.title.textContent = given.name ?? "";
        this.box.append(picture.title);
        this.fill(picture);
        return picture;
      });
      this.draw();
    }

    /** Change some of what a picture shows. */
    change(k, changes) {
      Object.assign(this.pictures[k], changes);
      if (changes.name !== undefined) this.pictures[k].title.textContent = changes.name;
      this.fill(this.pictures[k], changes);
      this.draw();
    }

    /** Bring to the graphics card what changed of a picture; everything where `changes` is not given. */
    fill(picture, changes = picture) {
      const has = (...names) => names.some((name) => changes[name] !== undefined);
      const { vertices, faces, values } = picture;
      const apart = faces && (picture.onFaces || picture.edges); // every face with corners of its own
      const each = (source, width) => {
        if (!apart) return source;
        const spread = new Float32Array(faces.length * width);
        for (let i = 0; i < faces.length; i++) for (let d = 0; d < width; d++) spread[width * i + d] = source[width * faces[i] + d];
        return spread;
      };
      if (has("vertices")) {
        this.store(picture, "position", each(interleaved(vertices), 3));
        if (faces) this.store(picture, "normal", each(normalsOf(vertices, faces), 3));
        if (apart) this.store(picture, "corner", Float32Array.from({ length: 3 * faces.length }, (_, i) => +(Math.floor(i / 3) % 3 === i % 3)));
        if (faces && !apart) this.store(picture, "faces", faces, this.gl.ELEMENT_ARRAY_BUFFER);
      }
      if (has("values") && values) {
        const spread = picture.onFaces ? Float32Array.from(faces, (_, i) => values[Math.floor(i / 3)]) : each(values, 1);
        this.store(picture, "value", Float32Array.from(spread));
      }
      if (has("colors") && picture.colors) picture.texture = this.texture(picture.colors, picture.texture);
      if (has("curves") && picture.curves) this.store(picture, "curves", new Float32Array(segmentsOf(picture.curves)));
      if (has("points") && picture.points) this.store(picture, "points", interleaved(picture.points));
      if (has("feet") && picture.feet) {
        const { shafts, heads } = arrowsOf(picture.feet, picture.vectors);
        this.store(picture, "shafts", new Float32Array(shafts));
        this.store(picture, "heads", new Float32Array(heads));
      }
    }

    store(picture, name, data, target = this.gl.ARRAY_BUFFER) {
      const { gl } = this;
      const buffer = picture.buffers.get(name)?.buffer ?? gl.createBuffer();
      gl.bindBuffer(target, buffer);
      gl.bufferData(target, data, gl.DYNAMIC_DRAW);
      picture.buffers.set(name, { buffer, length: data.length, wide: data instanceof Uint32Array });
    }

    /** The colours between the stops; steps where two stops stand at one place. */
    texture(stops, before) {
      const { gl } = this;
      const [size, bytes] = [1020, []]; // a multiple of the number of labels
      for (let i = 0, k = 0; i < size; i++) {
        const at = (i + 0.5) / size;
        while (k < stops.length - 2 && at > stops[k + 1][0]) k++;
        const [[low, first], [high, second]] = [stops[k], stops[k + 1]];
        const part = high > low ? Math.min(Math.max((at - low) / (high - low), 0), 1) : 0;
        const [from, to] = [rgb(first), rgb(second)];
        bytes.push(...from.map((x, d) => Math.round(255 * (x + part * (to[d] - x)))), 255);
      }
      const texture = before ?? gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, size, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(bytes));
      for (const name of ["TEXTURE_MIN_FILTER", "TEXTURE_MAG_FILTER"]) gl.texParameteri(gl.TEXTURE_2D, gl[name], gl.NEAREST);
      for (const name of ["TEXTURE_WRAP_S", "TEXTURE_WRAP_T"]) gl.texParameteri(gl.TEXTURE_2D, gl[name], gl.CLAMP_TO_EDGE);
      return texture;
    }

    // --- drawing -----------------------------------------------------------------------------------------------------

    draw() {
      this.wanted ??= requestAnimationFrame(() => {
        this.wanted = null;
        this.paint();
      });
    }

    /** Where each picture stands: as many columns as make them largest. */
    layOut(width, height) {
      const n = this.pictures.length;
      const head = this.pictures.some(({ name }) => name) ? TITLE : 0;
      const wide = Math.max(...this.pictures.map(({ frame }) => frame.wide / frame.far));
      const tall = Math.max(...this.pictures.map(({ frame }) => frame.tall / frame.far));
      let best = { scale: -1 };
      for (let columns = 1; columns <= n; columns++) {
        const cell = { width: width / columns, height: height / Math.ceil(n / columns) };
        const scale = Math.min(cell.width / wide, Math.max(cell.height - head, 1) / tall);
        if (scale > best.scale + 1e-9) best = { scale, columns, ...cell };
      }
      return this.pictures.map((_, k) => ({
        left: (k % best.columns) * best.width, top: Math.floor(k / best.columns) * best.height + head,
        width: best.width, height: Math.max(best.height - head, 1),
      }));
    }

    paint() {
      const { gl, canvas } = this;
      if (!this.pictures.length || gl.isContextLost()) return;
      const start = performance.now();
      const ratio = Math.min(globalThis.devicePixelRatio || 1, 2);
      const [width, height] = [this.box.clientWidth, this.box.clientHeight];
      if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
        [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
      }
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.disable(gl.SCISSOR_TEST);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.enable(gl.SCISSOR_TEST);
      this.cells = this.layOut(width, height);
      this.pictures.forEach((picture, k) => {
        const cell = this.cells[k];
        Object.assign(picture.title.style, { left: `${cell.left}px`, top: `${cell.top - TITLE}px`, width: `${cell.width}px` });
        const box = [cell.left, height - cell.top - cell.height, cell.width, cell.height].map((x) => Math.round(x * ratio));
        gl.viewport(...box);
        gl.scissor(...box);
        this.paintOne(picture, this.seen(picture, cell), cell, ratio);
      });
      this.box.dataset.milliseconds = (performance.now() - start).toFixed(2); // of our own code, for the tests
    }

    /** The turn of a picture's camera, and the scale that fits it into a cell. */
    seen({ frame }, cell) {
      const latitude = Math.min(Math.max(frame.latitude + this.upward, -STEEPEST), STEEPEST);
      const [c, s, C, S] = [Math.cos(this.around), Math.sin(this.around), Math.cos(latitude), Math.sin(latitude)];
      const mix = (x, y, z) => [0, 1, 2].map((d) => x * frame.axes[0][d] + y * frame.axes[1][d] + z * frame.axes[2][d]);
      const turn = [mix(c, s, 0), mix(-s * S, c * S, C), mix(s * C, -c * C, S)];
      const fit = (this.zoomed * Math.min(cell.width / frame.wide, cell.height / frame.tall)) / 2.12; // pixels a unit
      return { turn, scale: [(2 * fit) / cell.width, (2 * fit) / cell.height, 0.45 / frame.far], fit };
    }

    paintOne(picture, { turn, scale }, cell, ratio) {
      const { gl, programs: [surface, lines, points] } = this;
      const use = (program) => {
        gl.useProgram(program);
        const at = (name) => gl.getUniformLocation(program, name);
        gl.uniformMatrix3fv(at("turn"), false, [0, 1, 2].flatMap((d) => turn.map((row) => row[d])));
        gl.uniform3fv(at("center"), picture.frame.center);
        gl.uniform3fv(at("scale"), scale);
        return at;
      };
      const attribute = (program, name, key, size, instanced = 0, stride = 0, offset = 0) => {
        const at = gl.getAttribLocation(program, name);
        if (at < 0) return;
        const stored = picture.buffers.get(key);
        if (!stored) {
          gl.disableVertexAttribArray(at);
          gl.vertexAttrib3f(at, 1, 1, 1);
        } else {
          gl.bindBuffer(gl.ARRAY_BUFFER, stored.buffer);
          gl.enableVertexAttribArray(at);
          gl.vertexAttribPointer(at, size, gl.FLOAT, false, stride, offset);
        }
        gl.vertexAttribDivisor(at, instanced);
      };
      const colored = Boolean(picture.values && picture.colors);
      const colors = (at) => {
        gl.uniform1i(at("colored"), +colored);
        gl.uniform3fv(at("plain"), rgb(picture.color ?? "#d9dde3"));
        gl.uniform2fv(at("limits"), picture.limits ?? [0, 1]);
        if (picture.texture) gl.bindTexture(gl.TEXTURE_2D, picture.texture);
      };

      if (picture.faces) {
        const at = use(surface);
        colors(at);
        gl.uniform1f(at("pixel"), ratio * Math.min(Math.max(cell.width / 500, 0.55), 1)); // lines a little finer on small pictures
        gl.uniform1i(at("nodal"), +Boolean(picture.nodal && !picture.onFaces));
        gl.uniform1i(at("edges"), +Boolean(picture.edges));
        for (const [name, size] of [["position", 3], ["normal", 3], ["corner", 3], ["value", 1]]) attribute(surface, name, name, size);
        const faces = picture.buffers.get("faces");
        if (faces) {
          gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, faces.buffer);
          gl.drawElements(gl.TRIANGLES, faces.length, faces.wide ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT, 0);
        } else {
          gl.drawArrays(gl.TRIANGLES, 0, picture.buffers.get("position").length / 3);
        }
      }
      const dots = (key, width, nearer, withColors) => {
        const at = use(points);
        colors(at);
        if (!withColors) {
          gl.uniform1i(at("colored"), 0);
          gl.uniform3fv(at("plain"), rgb(picture.ink ?? INK));
        }
        gl.uniform1f(at("width"), width * ratio);
        gl.uniform1f(at("nearer"), nearer);
        attribute(points, "position", key, 3);
        attribute(points, "value", withColors ? "value" : "none", 1);
        gl.drawArrays(gl.POINTS, 0, picture.buffers.get(key).length / 3);
      };
      if (!picture.faces) dots("position", Math.min(Math.max(cell.width / 60, 3), 8) * Math.sqrt(this.zoomed), 0, true);
      if (picture.buffers.get("points")?.length) dots("points", 9, 0.02, false);

      for (const [key, width] of [["curves", 2.6], ["shafts", 2]]) {
        const stored = picture.buffers.get(key);
        if (!stored?.length) continue;
        const at = use(lines);
        gl.uniform3fv(at("plain"), rgb(picture.ink ?? INK));
        gl.uniform2f(at("size"), cell.width * ratio, cell.height * ratio);
        gl.uniform1f(at("width"), 2 * width * ratio);
        attribute(lines, "from", key, 3, 1, 24, 0);
        attribute(lines, "to", key, 3, 1, 24, 12);
        if (!picture.buffers.has("where")) this.store(picture, "where", new Float32Array([0, -0.5, 0, 0.5, 1, -0.5, 1, 0.5]));
        attribute(lines, "where", "where", 2);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, stored.length / 6);
      }
      if (picture.buffers.get("heads")?.length) {
        const at = use(surface);
        for (const name of ["colored", "nodal", "edges"]) gl.uniform1i(at(name), 0);
        gl.uniform3fv(at("plain"), rgb(picture.ink ?? INK));
        for (const name of ["normal", "corner", "value"]) attribute(surface, name, "none", 3);
        attribute(surface, "position", "heads", 3);
        gl.drawArrays(gl.TRIANGLES, 0, picture.buffers.get("heads").length / 3);
      }
      for (const program of [surface, lines, points]) {
        for (const name of ["position", "normal", "corner", "value", "from", "to", "where"]) {
          const at = gl.getAttribLocation(program, name);
          if (at >= 0) gl.vertexAttribDivisor(at, 0);
          if (at >= 0) gl.disableVertexAttribArray(at);
        }
      }
    }

    // --- turning -----------------------------------------------------------------------------------------------------

    home() {
      [this.around, this.upward, this.zoomed] = [0, 0, 1];
      this.draw();
    }

    turn(around, upward) {
      const latitudes = this.pictures.map(({ frame }) => frame.latitude);
      this.around += around;
      this.upward = Math.min(Math.max(this.upward + upward, -STEEPEST - Math.max(...latitudes)), STEEPEST - Math.min(...latitudes));
      this.draw();
    }

    zoom(factor) {
      this.zoomed = Math.min(Math.max(this.zoomed * factor, 1 / 3), 12);
      this.draw();
    }

    key(event) {
      const actions = {
        ArrowLeft: () => this.turn(STEP, 0), ArrowRight: () => this.turn(-STEP, 0),
        ArrowUp: () => this.turn(0, -STEP), ArrowDown: () => this.turn(0, STEP),
        "+": () => this.zoom(1.25), "-": () => this.zoom(0.8), Home: () => this.home(),
      };
      if (!actions[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      actions[event.key]();
    }

    /** Drag to turn, pinch or Ctrl-wheel to zoom. The wheel alone and a vertical swipe belong to the page (touch-action). */
    listen() {
      const { box, canvas } = this;
      const held = new Map();
      const spread = () => {
        const [a, b] = [...held.values()];
        return Math.hypot(a.x - b.x, a.y - b.y);
      };
      box.addEventListener("keydown", (event) => this.key(event));
      canvas.addEventListener("wheel", (event) => {
        if (!event.ctrlKey) return;
        event.preventDefault();
        this.zoom(Math.exp(-0.01 * event.deltaY));
      }, { passive: false });
      canvas.addEventListener("pointerdown", (event) => {
        if (event.button) return;
        canvas.setPointerCapture(event.pointerId);
        held.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
        this.moved = held.size > 1 ? Infinity : 0;
      });
      canvas.addEventListener("pointermove", (event) => {
        const before = held.get(event.pointerId);
        if (!before) return;
        const [dx, dy, apart] = [event.offsetX - before.x, event.offsetY - before.y, held.size === 2 ? spread() : 0];
        held.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
        this.moved += Math.hypot(dx, dy);
        if (held.size === 2 && apart) this.zoom(spread() / apart);
        const pace = 4.5 / Math.max(Math.min(this.box.clientWidth, this.box.clientHeight), 1) / held.size;
        this.turn(-pace * dx, pace * dy);
      });
      const release = (event) => {
        if (held.delete(event.pointerId) && event.type === "pointerup" && this.moved < 5) this.pick(event);
      };
      for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, release);
      this.watcher = new ResizeObserver(() => this.draw());
      this.watcher.observe(box);
    }

    /** Call with (picture, vertex) when a vertex of a surface is clicked. */
    onPick(picked) {
      this.picked = picked;
    }

    pick({ offsetX, offsetY }) {
      const k = this.cells?.findIndex(({ left, top, width, height }) =>
        left <= offsetX && offsetX <= left + width && top <= offsetY && offsetY <= top + height) ?? -1;
      if (k < 0 || !this.picked || !this.pictures[k].faces) return;
      const [{ vertices, faces, frame }, cell] = [this.pictures[k], this.cells[k]];
      const { turn, fit } = this.seen(this.pictures[k], cell);
      const at = [(offsetX - cell.left - cell.width / 2) / fit, (cell.top + cell.height / 2 - offsetY) / fit];
      const n = vertices.length / 3;
      const seen = turn.map((row) => Float32Array.from({ length: n }, (_, i) =>
        row[0] * (vertices[i] - frame.center[0]) + row[1] * (vertices[n + i] - frame.center[1]) + row[2] * (vertices[2 * n + i] - frame.center[2])));
      let [nearest, found] = [-Infinity, -1];
      for (let t = 0; t < faces.length; t += 3) {
        const corners = [faces[t], faces[t + 1], faces[t + 2]];
        const [a, b, c] = corners.map((i) => [seen[0][i] - at[0], seen[1][i] - at[1]]);
        const weights = [b[0] * c[1] - b[1] * c[0], c[0] * a[1] - c[1] * a[0], a[0] * b[1] - a[1] * b[0]];
        if (!(weights.every((w) => w >= 0) || weights.every((w) => w <= 0))) continue;
        const total = weights[0] + weights[1] + weights[2];
        if (!total) continue;
        const depth = weights.reduce((sum, w, i) => sum + (w / total) * seen[2][corners[i]], 0);
        if (depth > nearest) [nearest, found] = [depth, corners[weights.map((w) => w / total).reduce((best, w, i, all) => (w > all[best] ? i : best), 0)]];
      }
      if (found >= 0) this.picked(k, found);
    }

    /** Call when the graphics card gives the scene up; what free() gives back is not lost. */
    onLost(lost) {
      this.canvas.addEventListener("webglcontextlost", () => this.canvas.isConnected && lost());
    }

    free() {
      this.watcher.disconnect();
      cancelAnimationFrame(this.wanted);
      this.gl.getExtension("WEBGL_lose_context")?.loseContext();
      this.box.replaceChildren();
    }
  }

  notes.Viewer = Viewer;
})();
