"use strict";
// The numbers of the labs, against definitions and closed forms. Run: node --test tests/labs
const test = require("node:test");
const assert = require("node:assert/strict");

require("../../spectral_notes/plotting/static/arrays.js");
require("../../spectral_notes/labs/static/numerics.js");
const { numerics, halfToFloat, decodeArray } = globalThis.spectralNotes;

const close = (found, wanted, tolerance) => assert.ok(Math.abs(found - wanted) <= tolerance, `${found} is not ${wanted} to ${tolerance}`);
const allClose = (found, wanted, tolerance) => {
  assert.equal(found.length, wanted.length);
  found.forEach((value, i) => close(value, wanted[i], tolerance));
};

/** A ring of n samples of length 1: mass 1/n, modes 1, cos, sin, cos, ..., and their eigenvalues. */
function ring(n, pairs) {
  const modes = [Float32Array.from({ length: n }, () => 1)];
  const evals = [0];
  for (let k = 1; k <= pairs; k++) {
    for (const wave of [Math.cos, Math.sin]) {
      modes.push(Float32Array.from({ length: n }, (_, i) => Math.SQRT2 * wave((2 * Math.PI * k * i) / n)));
      evals.push((2 * Math.PI * k) ** 2);
    }
  }
  const evecs = new Float32Array(n * modes.length);
  modes.forEach((mode, k) => evecs.set(mode, k * n));
  return { n, evecs, modes, evals, mass: new Float32Array(n).fill(1 / n) };
}

/** An octahedron: coordinates and faces, outward. */
const OCTAHEDRON = {
  coordinates: [[1, -1, 0, 0, 0, 0], [0, 0, 1, -1, 0, 0], [0, 0, 0, 0, 1, -1]],
  faces: [0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5],
};

test("half precision: one, a third, the largest, the smallest, signed zero, infinity, not a number", () => {
  const known = [[0x3c00, 1], [0xc000, -2], [0x3555, 0.333251953125], [0x7bff, 65504], [0x0001, 2 ** -24], [0x03ff, 1023 * 2 ** -24], [0x7c00, Infinity]];
  for (const [bits, value] of known) assert.equal(halfToFloat(bits), value);
  assert.ok(Object.is(halfToFloat(0x8000), -0));
  assert.ok(Number.isNaN(halfToFloat(0x7e00)));
});

test("an array that is cut short is refused", async () => {
  const whole = { type: "int8", shape: [3], data: "eJxjZGIGAAANAAc=" }; // 1, 2, 3
  assert.deepEqual([...(await decodeArray(whole))], [1, 2, 3]);
  await assert.rejects(decodeArray({ ...whole, shape: [4] }), /int8 array of 4: 3 bytes/);
});

test("a basis in bytes is its steps times its bytes, behind the part in half precision", () => {
  const parts = { evecs: Float32Array.of(1, 2), evecs_in_bytes: Int8Array.of(127, -127, 1, 2), steps: Float32Array.of(0.5, 0.25), n: 2 };
  const joined = numerics.joinBasis(parts);
  assert.deepEqual([...joined], [1, 2, 63.5, -63.5, 0.25, 0.5]);
});

test("synthesize is the plain sum of modes, for every number of them and every band", () => {
  const { n, evecs, modes } = ring(24, 5);
  const c = Float32Array.from(modes, (_, k) => 1 / (k + 1));
  for (const [from, to] of [[0, 11], [0, 4], [0, 7], [3, 9], [5, 5]]) {
    const wanted = Array.from({ length: n }, (_, i) => modes.slice(from, to).reduce((sum, mode, k) => sum + c[from + k] * mode[i], 0));
    allClose(numerics.synthesize(evecs, c, n, from, to), wanted, 1e-5);
  }
});

test("heat conserves its integral and evens out; it keeps to the closed form on a ring", () => {
  const { n, evecs, evals, mass, modes } = ring(48, 12);
  const drop = numerics.row(evecs, n, modes.length, 7);
  for (const t of [0, 1e-3, 1e-2, 1]) {
    const f = numerics.synthesize(evecs, numerics.heatAt(evals, drop, t), n);
    close(numerics.integral(mass, f), 1, 1e-5);
  }
  allClose(numerics.synthesize(evecs, numerics.heatAt(evals, drop, 10), n), new Array(n).fill(1), 1e-6);
  const c = Float32Array.from(modes, (_, k) => +(k === 1));
  const decayed = numerics.heatAt(evals, c, 0.01);
  close(decayed[1], Math.exp(-((2 * Math.PI) ** 2) * 0.01), 1e-6);
});

test("a wave keeps its energy, starts at rest, and comes back after one turn of the ring", () => {
  const { evals } = ring(48, 12);
  const c = Float32Array.from(evals, (_, k) => 1 / (1 + k * k));
  const energy = (t) => numerics.waveEnergy(evals, numerics.waveAt(evals, c, t), numerics.waveSpeedAt(evals, c, t));
  for (const t of [0.1, 0.37, 5]) close(energy(t) / energy(0), 1, 1e-5);
  allClose(numerics.waveSpeedAt(evals, c, 0), new Array(c.length).fill(0), 1e-12);
  allClose(numerics.waveAt(evals, c, 1), [...c], 1e-5);
});

test("the error with k modes is the root of what was dropped, by the definition and by Parseval", () => {
  const { n, evecs, mass, modes } = ring(40, 6);
  const coefficients = [0, 1, 2].map((d) => Float32Array.from(modes, (_, k) => Math.sin(k + d) / (k + 1)));
  const whole = coefficients.map((c) => numerics.synthesize(evecs, c, n));
  const errors = numerics.truncationErrors(coefficients, 0, 1);
  for (const k of [0, 1, 5, 13]) {
    const part = coefficients.map((c) => numerics.synthesize(evecs, c, n, 0, k));
    close(errors[k], numerics.rmsDistance(mass, whole, part), 1e-5);
  }
});

test("Fourier coefficients: by definition, a known recipe, and back again", () => {
  const N = 32;
  const f = Float64Array.from({ length: N }, (_, n) => 3 * Math.cos((2 * Math.PI * 5 * n) / N) + 2 * Math.sin((2 * Math.PI * 7 * n) / N) - 1);
  const found = numerics.fourier(f);
  close(found.a[5], 3, 1e-12);
  close(found.b[7], 2, 1e-12);
  close(found.a[0], -1, 1e-12);
  close(numerics.amplitudes(found).reduce((sum, size) => sum + size, 0), 6, 1e-10);
  for (const length of [32, 33]) {
    const noise = Float64Array.from({ length }, (_, n) => Math.sin(n * n));
    allClose(numerics.inverseFourier(numerics.fourier(noise), length), [...noise], 1e-12);
  }
});

test("the largest K entries; of equals the earlier one", () => {
  assert.deepEqual(numerics.largest([1, 5, 3, 5], 2), [false, true, false, true]);
  assert.deepEqual(numerics.largest([2, 2, 2], 1), [true, false, false]);
});

test("the nearest row of a basis", () => {
  const { n, evecs, modes } = ring(24, 3);
  for (const vertex of [0, 5, 23]) {
    assert.equal(numerics.nearestRow(evecs, n, numerics.row(evecs, n, modes.length, vertex)), vertex);
  }
});

test("a map's coefficients: only the leading block of C counts", () => {
  const C = Float32Array.of(1, 2, 9, 3, 4, 9, 9, 9, 9);
  assert.deepEqual([...numerics.mapCoefficients(C, 3, [1, 10, 100], 2)], [21, 43]);
});

test("the adjusted Rand index: one for renamed parts, zero for one part, a value by hand", () => {
  assert.equal(numerics.adjustedRand([0, 0, 1, 1], [1, 1, 0, 0]), 1);
  assert.equal(numerics.adjustedRand([0, 0, 1, 1], [0, 0, 0, 0]), 0);
  close(numerics.adjustedRand([0, 0, 1, 1], [0, 0, 1, 2]), 4 / 7, 1e-12); // (1 - 1/3) / (3/2 - 1/3)
  assert.equal(numerics.adjustedRand([0, 0], [0, 0]), 1);
});

test("a string: closed forms of free, fixed and mixed ends; holding an end raises every frequency, below the next", () => {
  const units = (a, b) => numerics.stringFrequencies(a, b, 5).map((k) => k / Math.PI);
  const half = Math.PI / 2;
  allClose(units(half, half), [1, 2, 3, 4, 5], 1e-9);
  allClose(units(0, 0), [0, 1, 2, 3, 4], 1e-6);
  allClose(units(half, 0), [0.5, 1.5, 2.5, 3.5, 4.5], 1e-9);
  allClose(units(0, half), [0.5, 1.5, 2.5, 3.5, 4.5], 1e-9);
  let before = units(0, 0.3);
  for (let a = 0.1; a < half; a += 0.1) {
    const now = units(a, 0.3);
    now.forEach((k, n) => assert.ok(k > before[n] && k < n + 1, `${a}: ${k} after ${before[n]}`));
    before = now;
  }
  const xs = [0, 0.25, 0.5, 1];
  allClose(numerics.stringMode(2 * Math.PI, half, xs), [0, 1, 0, 0], 1e-9);
  allClose(numerics.stringMode(Math.PI, 0, xs), [1, Math.SQRT1_2, 0, -1], 1e-9);
});

test("triangles: lengths of sides; the quotient of the octahedron's coordinates, and none of a constant", () => {
  const { coordinates, faces } = OCTAHEDRON;
  allClose([...numerics.edgeLengths(coordinates, faces)], Array(24).fill(Math.SQRT2), 1e-12);
  // Each edge has the weight cot 60° = 1/sqrt 3, each vertex a third of four triangles of area sqrt(3)/2: 8 / sqrt 3 over 4 / sqrt 3.
  close(numerics.rayleighQuotient(coordinates, faces, coordinates[0]), 2, 1e-12);
  close(numerics.rayleighQuotient(coordinates.map((x) => x.map((value) => 3 * value)), faces, coordinates[0]), 2 / 9, 1e-12);
  close(numerics.rayleighQuotient(coordinates, faces, Float32Array.from(faces, () => 1)), 0, 1e-12);
});

test("linear equations: by elimination with a zero on the diagonal, and by conjugate gradients", () => {
  allClose(numerics.solve([[0, 2, 1], [1, 1, 0], [2, 0, 1]], [7, 3, 5]), [1, 2, 3], 1e-12);
  const A = [[4, 1, 0], [1, 3, -1], [0, -1, 2]];
  const apply = (x) => Float64Array.from(A, (row) => row.reduce((sum, a, j) => sum + a * x[j], 0));
  allClose(numerics.conjugateGradients(apply, Float64Array.of(6, 4, 4), Float64Array.of(9, -9, 0)), [1, 2, 3], 1e-7);
});

test("a heat step of fields: symmetric, and a field that is carried along a path of edges has no energy", () => {
  const path = { n: 3, edges: Uint16Array.of(0, 1, 1, 2), edge_turns: [0.3, -1.1], weights: [2, 5], mass: [1, 2, 4] };
  for (const nFold of [1, 4]) {
    const step = numerics.heatStep(path, nFold, 0.7);
    const angles = [0.4, 0.4 + 0.3 * nFold, 0.4 - 0.8 * nFold];
    const carried = Float64Array.from([...angles.map(Math.cos), ...angles.map(Math.sin)]);
    allClose(step(carried), [...carried].map((value, i) => path.mass[i % 3] * value), 1e-12);
    const [u, v] = [Float64Array.of(1, 2, -1, 0, 3, 1), Float64Array.of(0, 1, 1, -2, 1, 5)];
    close(numerics.dot(u, step(v)), numerics.dot(step(u), v), 1e-12);
    assert.ok(numerics.dot(u, step(u)) > numerics.dot(u, numerics.heatStep(path, nFold, 0)(u)));
  }
});

test("a Chebyshev sum is its polynomial: exact from its degree on, for numbers and for a path of nodes", () => {
  const g = (x) => 1 - 2 * x + 0.5 * x * x;
  const a = numerics.chebyshev(g, 4, 5);
  allClose(a.slice(3), [0, 0], 1e-12);
  const xs = [0, 1, 2.5, 5];
  allClose(numerics.chebyshevSum(a, 5, (u) => u.map((value, i) => xs[i] * value), [1, 1, 1, 1]), xs.map(g), 1e-12);
  allClose(numerics.chebyshevSum(numerics.chebyshev(() => 3, 0, 5), 5, (u) => u, [1, 2]), [3, 6], 1e-12);
  const L = (f) => numerics.graphLaplacian([0, 1, 1, 2], [1, 2], f);
  const f = Float64Array.of(1, 0, 0);
  allClose(L(f), [1, -1, 0], 1e-12);
  const twice = L(L(f)); // [2, -4, 2]
  allClose(numerics.chebyshevSum(a, 5, L, f), [1 - 2 + 1, 2 - 2, 1], 1e-12);
  assert.deepEqual([...twice], [2, -4, 2]);
});

test("a response through its knobs: at them, between them, beyond the last", () => {
  const g = numerics.polyline([1, 0, 0.5], 4);
  allClose([0, 1, 2, 3, 4, 9].map(g), [1, 0.5, 0, 0.25, 0.5, 0.5], 1e-12);
});

test("colours: the ends, the middle, and in between", () => {
  assert.deepEqual(numerics.colorAt(numerics.SIGNED, 0.5), [0xf7, 0xf7, 0xf7]);
  assert.deepEqual(numerics.colorAt(numerics.SIGNED, -1), [0x05, 0x30, 0x61]);
  assert.deepEqual(numerics.colorAt(numerics.POSITIVE, 2), [0xfd, 0xe7, 0x25]);
  assert.deepEqual(numerics.colorAt(["#000000", "#ff0000"], 0.2), [51, 0, 0]);
  assert.deepEqual(numerics.colorScale(["#000000", "#ffffff"]), [[0, "#000000"], [1, "#ffffff"]]);
  assert.equal(numerics.labelScale().length, 24);
});

test("the farthest vertex along each axis", () => {
  const found = numerics.PLACES.map((_, place) => numerics.farthest(OCTAHEDRON.coordinates, place));
  assert.deepEqual(found, [0, 1, 2, 3, 4, 5]);
});
