"use strict";
// A string whose ends slide from free to fixed: the modes morph, the frequencies climb, and the chord is heard.
(() => {
  const notes = globalThis.spectralNotes;
  const { numerics } = notes;
  const SHOWN = 5;
  const XS = Array.from({ length: 201 }, (_, i) => i / 200);
  const PITCH = 110; // hertz of a string with both ends fixed

  async function start(lab) {
    let sound;
    const kind = (share) => (share === 0 ? "free" : share === 1 ? "fixed" : `held, ${Math.round(100 * share)} %`);
    const ends = ["Left end", "Right end"].map((name) => lab.slider(name, { max: 1, step: 0.02, value: 1, text: kind }, () => update()));
    const mode = lab.slider("Mode", { max: SHOWN - 1, value: 1 }, () => update());
    lab.choice("Both ends", ["as they are", "fixed (sines)", "free (cosines)", "left fixed, right free"], (i) => {
      if (i) ends.forEach((end, k) => end.set([1, 0, k ? 0 : 1][i - 1]));
      update();
    });
    const hear = lab.button("Hear it", () => (sound ? silence() : play()));
    const frequency = lab.number("Frequency k, in units of \u03c0");
    const eigenvalue = lab.number("Eigenvalue k\u00b2");
    const all = lab.number("All five, in units of \u03c0");
    const chart = new notes.Chart(lab, "The chosen mode of the string", {
      x: { name: "place along the string", range: [0, 1] }, y: { name: "mode", range: [-1.1, 1.1] },
    });
    lab.hint("Slide the ends from free to fixed: a spring grows stiff at each. The height of the whole mode is set to one.");

    const update = lab.steps(
      () => {
        const [a, b] = ends.map((end) => (+end.value * Math.PI) / 2);
        const frequencies = numerics.stringFrequencies(a, b, SHOWN);
        return { frequencies, u: numerics.stringMode(frequencies[+mode.value], a, XS) };
      },
      ({ frequencies, u }) => {
        const k = frequencies[+mode.value];
        frequency((k / Math.PI).toFixed(3));
        eigenvalue((k * k).toFixed(2));
        all(frequencies.map((one) => (one / Math.PI).toFixed(2)).join(", "));
        chart.curve("given", [0, 1], [0, 0]);
        chart.curve("values", XS, u);
        sound?.waves.forEach((wave, n) => (wave.frequency.value = (PITCH * frequencies[n]) / Math.PI));
      },
    );

    function play() {
      const context = new AudioContext();
      const waves = Array.from({ length: SHOWN }, (_, n) => {
        const [wave, volume] = [context.createOscillator(), context.createGain()];
        volume.gain.value = 0.12 / (n + 1);
        wave.connect(volume).connect(context.destination);
        wave.start();
        return wave;
      });
      sound = { context, waves };
      hear.textContent = "Silence";
      update();
    }

    function silence() {
      sound?.context.close();
      sound = null;
      hear.textContent = "Hear it";
    }

    lab.stopping.push(silence);
    update();
  }

  notes.defineLab("ends", {
    title: "The ends choose the waves",
    prompts: [
      [
        "With both ends fixed, step through the modes. Then free both ends.",
        "Fixed ends give sines with frequencies 1, 2, 3, \u2026 times \u03c0, free ends cosines with 0, 1, 2, \u2026: the same tones, and one of frequency zero, the string that only moves as a whole.",
      ],
      [
        "Free one end and leave the other fixed. What became of the frequencies?",
        "They are 0.5, 1.5, 2.5, \u2026 times \u03c0: the ground tone falls by an octave, and only its odd multiples sound. A closed organ pipe does this.",
      ],
      [
        "Slide one end slowly from free to fixed, with the sound on. Does any frequency ever fall?",
        "None: holding a string more tightly raises every tone, and each stays below the next one of the free string.",
      ],
    ],
    start,
  });
})();
