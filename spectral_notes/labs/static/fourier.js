"use strict";
// Draw a signal; see its coefficients; change, mute or keep the largest of them; hear the sum.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics, svg } = notes;
  const N = 128;
  const LIMIT = 1.2; // of a drawn value
  const PITCH = 110; // hertz, when the signal is heard as one period
  const at = (rule) => Float64Array.from({ length: N }, (_, n) => rule(n / N));
  const SIGNALS = {
    "Two waves": at((t) => 0.6 * Math.cos(2 * Math.PI * 3 * t) + 0.4 * Math.sin(2 * Math.PI * 8 * t)),
    "Square wave": at((t) => (t < 0.5 ? 0.8 : -0.8)),
    "Triangle wave": at((t) => 0.8 * (4 * Math.abs(t - 0.5) - 1)),
    "Saw": at((t) => 0.8 * (1 - 2 * t)),
    "One pulse": at((t) => Math.exp(-((40 * (t - 0.5)) ** 2))),
    "Flat, to draw on": at(() => 0),
  };

  async function start(lab) {
    const names = Object.keys(SIGNALS);
    let f, coefficients, muted, sound;
    let chosen = 3;
    let pen = N / 2;

    const signal = lab.choice("Signal", names, (i) => take(SIGNALS[names[i]]));
    const keep = lab.slider("Keep the largest", { min: 1, max: N / 2 + 1, value: N / 2 + 1, text: (K) => `${K} of ${N / 2 + 1} waves` }, () => update());
    const frequency = lab.slider("Wave k", { max: N / 2, value: chosen }, (k) => choose(k));
    const strength = lab.slider("Its amplitude", { max: 1, step: 0.01, value: 0, text: (value) => value.toFixed(2) }, (value) => scale(value));
    lab.button("Mute or unmute it", () => mute());
    const hear = lab.button("Hear it", () => (sound ? silence() : play()));
    const energy = lab.number("Energy kept, %");
    const error = lab.number("RMS error");
    const count = lab.number("Waves heard");

    const time = new notes.Chart(lab, "The signal. Draw with the pointer; or arrow keys: left and right move the pen, up and down change the value.", {
      x: { name: "sample n", range: [0, N - 1] },
      y: { name: "f", range: [-LIMIT, LIMIT] },
    });
    const spectrum = new notes.Chart(lab, "Amplitudes. Drag a bar; or arrow keys: left and right choose a wave, up and down change it, M mutes it.", {
      x: { name: "frequency k", range: [0, N / 2] },
      y: { name: "amplitude", range: [0, 1] },
    });
    const samples = Array.from({ length: N }, (_, n) => n);
    lab.hint("Draw on the signal with the pointer, or press the arrow keys on it. Drag a bar up or down; M mutes it.");
    const bars = Array.from({ length: N / 2 + 1 }, () => spectrum.root.appendChild(svg("rect", { width: 3.6 })));

    function take(values) {
      f = Float64Array.from(values);
      coefficients = numerics.fourier(f);
      muted = new Set();
      choose(chosen);
    }

    const update = lab.steps(
      () => {
        const sizes = numerics.amplitudes(coefficients);
        const kept = numerics.largest(sizes.map((size, k) => (muted.has(k) ? 0 : size)), +keep.value);
        const only = (values) => values.map((value, k) => (kept[k] && !muted.has(k) ? value : 0));
        const part = { a: only(coefficients.a), b: only(coefficients.b) };
        const sum = numerics.inverseFourier(part, N);
        return { sizes, part, sum, left: f.map((value, n) => value - sum[n]) };
      },
      ({ sizes, part, sum, left }) => {
        const square = (values) => values.reduce((total, value) => total + value ** 2, 0);
        const heard = numerics.amplitudes(part);
        energy(square(f) ? ((100 * square(sum)) / square(f)).toFixed(1) : "100.0");
        error(Math.sqrt(square(left) / N).toFixed(4));
        count(heard.filter((size) => size > 1e-9).length);
        time.curve("given", samples, f);
        time.curve("values", samples, sum);
        time.dot(pen, f[pen]);
        bars.forEach((bar, k) => {
          const top = spectrum.place(1, Math.min(sizes[k], 1));
          bar.setAttribute("x", spectrum.place(0, k) - 1.8);
          bar.setAttribute("y", Math.min(top, spectrum.place(1, 0) - 1));
          bar.setAttribute("height", Math.max(spectrum.place(1, 0) - top, 1));
          bar.setAttribute("class", `${heard[k] > 1e-9 ? "kept" : "dropped"} ${k === chosen ? "chosen" : ""}`);
        });
        if (sound) sound.wave.setPeriodicWave(period(part));
      },
    );

    // --- the spectrum ------------------------------------------------------------------------------------------------

    function choose(k) {
      chosen = Math.min(Math.max(k, 0), N / 2);
      frequency.set(chosen);
      strength.set(numerics.amplitudes(coefficients)[chosen]);
      update();
    }

    /** Give the chosen wave another amplitude and leave its phase; one that was silent becomes a cosine. */
    function scale(value) {
      const { a, b } = coefficients;
      const size = Math.hypot(a[chosen], b[chosen]);
      [a[chosen], b[chosen]] = size > 1e-9 ? [(a[chosen] * value) / size, (b[chosen] * value) / size] : [value, 0];
      f = numerics.inverseFourier(coefficients, N); // the signal is what its waves say
      strength.set(value);
      update();
    }

    function mute() {
      if (!muted.delete(chosen)) muted.add(chosen);
      update();
    }

    // --- pointer and keys --------------------------------------------------------------------------------------------

    function draw(to, value) {
      const from = pen;
      const start = f[from];
      pen = Math.min(Math.max(to, 0), N - 1);
      const steps = Math.abs(pen - from);
      for (let i = 0; i <= steps; i++) f[from + i * Math.sign(pen - from)] = start + (steps ? i / steps : 1) * (value - start);
      take(f);
    }

    const step = (by) => {
      pen = (pen + by + N) % N;
      update();
    };
    const lift = (by) => draw(pen, Math.min(Math.max(f[pen] + by, -LIMIT), LIMIT));
    time.answer((x, y) => {
      pen = Math.min(Math.round(x), N - 1);
      draw(pen, y);
    }, (x, y) => draw(Math.round(x), y), {
      ArrowLeft: () => step(-1), ArrowRight: () => step(1), ArrowUp: () => lift(0.1), ArrowDown: () => lift(-0.1),
    });
    const louder = (by) => scale(Math.min(Math.max(+strength.value + by, 0), 1));
    spectrum.answer((x) => choose(Math.round(x)), (_, y) => scale(y), {
      ArrowLeft: () => choose(chosen - 1), ArrowRight: () => choose(chosen + 1),
      ArrowUp: () => louder(0.05), ArrowDown: () => louder(-0.05), m: mute, M: mute,
    });

    // --- sound -------------------------------------------------------------------------------------------------------

    const period = ({ a, b }) => sound.context.createPeriodicWave(a.map((value, k) => (k ? value : 0)), b);

    function play() {
      const context = new AudioContext();
      const wave = context.createOscillator();
      const volume = context.createGain();
      wave.frequency.value = PITCH;
      volume.gain.value = 0.15;
      wave.connect(volume).connect(context.destination);
      sound = { context, wave };
      wave.start();
      hear.textContent = "Silence";
      update();
    }

    function silence() {
      sound?.context.close();
      sound = null;
      hear.textContent = "Hear it";
    }

    lab.stopping.push(silence);
    take(SIGNALS[names[signal.selectedIndex]]);
  }

  notes.defineLab("fourier", {
    title: "Fourier playground",
    prompts: [
      [
        "Take the square wave and keep fewer and fewer of its waves.",
        "The flanks lean, and beside each jump the sum overshoots, by about a tenth of the jump from few waves. The place moves to the jump; the height hardly falls until nearly all of the 32 waves of this square are kept.",
      ],
      [
        "Draw a signal of your own. Then change one bar and see what moves.",
        "Everything moves: each wave reaches round the whole circle. A small stroke, the other way round, changes every bar.",
      ],
      [
        "Listen to two waves, mute one, then compare the square wave with the triangle at the same amplitude.",
        "The pitch is the greatest common divisor of the frequencies; the colour of the tone is in the bars. The square's bars fall more slowly, so it sounds sharper.",
      ],
    ],
    start,
  });
})();
