"use strict";
// What the labs compute, on plain arrays: no page, no drawing. The browser and Node load this same file.
// A function on a surface is one Float32Array, one number a vertex. A basis is a Float32Array, mode after mode.
(() => {
  const notes = (globalThis.spectralNotes ??= {});

  // --- data written by spectral_notes.labs --------------------------------------------------------------------------

  // A basis of many modes: the first in half precision, the rest in bytes, each mode with a step of its own.
  function joinBasis({ evecs: head, evecs_in_bytes: tail, steps, n }) {
    if (!tail) return head;
    const evecs = new Float32Array(head.length + tail.length);
    evecs.set(head);
    for (let i = 0; i < tail.length; i++) evecs[head.length + i] = tail[i] * steps[Math.floor(i / n)];
    return evecs;
  }

  // --- analyze, change the coefficients, synthesize ----------------------------------------------------------------

  // The sum over from <= k < to of coefficients[k] times mode k; four modes in one pass, for speed.
  function synthesize(evecs, coefficients, n, from = 0, to = coefficients.length) {
    const sum = new Float32Array(n);
    let k = from;
    for (; k + 4 <= to; k += 4) {
      const [a, b, c, d] = [0, 1, 2, 3].map((step) => coefficients[k + step]);
      const start = k * n;
      for (let i = 0, at = start; i < n; i++, at++) {
        sum[i] += a * evecs[at] + b * evecs[at + n] + c * evecs[at + 2 * n] + d * evecs[at + 3 * n];
      }
    }
    for (; k < to; k++) {
      for (let i = 0, at = k * n; i < n; i++, at++) sum[i] += coefficients[k] * evecs[at];
    }
    return sum;
  }

  const row = (evecs, n, k, vertex) => Float32Array.from({ length: k }, (_, mode) => evecs[mode * n + vertex]);

  function integral(mass, f) {
    let sum = 0;
    for (let i = 0; i < f.length; i++) sum += mass[i] * f[i];
    return sum;
  }

  // sqrt(sum of mass |p - q|^2 / sum of mass): p and q hold one array for each coordinate.
  function rmsDistance(mass, p, q) {
    let sum = 0;
    let total = 0;
    for (let i = 0; i < mass.length; i++) {
      total += mass[i];
      for (let d = 0; d < p.length; d++) sum += mass[i] * (p[d][i] - q[d][i]) ** 2;
    }
    return Math.sqrt(sum / total);
  }

  // Errors with 0, 1, 2, ... modes, from the error with all of them: Parseval, summed from the small end.
  function truncationErrors(coefficients, errorOfAll, area) {
    const squares = [errorOfAll ** 2 * area];
    for (let k = coefficients[0].length - 1; k >= 0; k--) {
      squares.push(squares.at(-1) + coefficients.reduce((sum, c) => sum + c[k] ** 2, 0));
    }
    return squares.reverse().map((square) => Math.sqrt(square / area));
  }

  // --- heat, waves, a quantum particle -----------------------------------------------------------------------------

  const heatAt = (evals, c, t) => Float32Array.from(c, (value, k) => value * Math.exp(-evals[k] * t));
  const waveAt = (evals, c, t) => Float32Array.from(c, (value, k) => value * Math.cos(Math.sqrt(evals[k]) * t));
  const waveSpeedAt = (evals, c, t) =>
    Float32Array.from(c, (value, k) => -value * Math.sqrt(evals[k]) * Math.sin(Math.sqrt(evals[k]) * t));

  // Half the squared speed plus half the squared slope, both by their coefficients.
  function waveEnergy(evals, position, speed) {
    return position.reduce((sum, c, k) => sum + (speed[k] ** 2 + evals[k] * c ** 2) / 2, 0);
  }

  // --- signals -----------------------------------------------------------------------------------------------------

  // a[k] = <f, cos>/N and b[k] = <f, sin>/N, by definition, for k = 0 .. N/2; each wave between counts twice.
  function fourier(f) {
    const N = f.length;
    const half = Math.floor(N / 2);
    const a = new Float64Array(half + 1);
    const b = new Float64Array(half + 1);
    for (let k = 0; k <= half; k++) {
      const times = k === 0 || 2 * k === N ? 1 : 2;
      for (let n = 0; n < N; n++) {
        const angle = (2 * Math.PI * ((k * n) % N)) / N;
        a[k] += (times * f[n] * Math.cos(angle)) / N;
        b[k] += (times * f[n] * Math.sin(angle)) / N;
      }
    }
    return { a, b };
  }

  function inverseFourier({ a, b }, N) {
    return Float64Array.from({ length: N }, (_, n) => {
      let sum = 0;
      for (let k = 0; k < a.length; k++) {
        const angle = (2 * Math.PI * ((k * n) % N)) / N;
        sum += a[k] * Math.cos(angle) + b[k] * Math.sin(angle);
      }
      return sum;
    });
  }

  const amplitudes = ({ a, b }) => Float64Array.from(a, (value, k) => Math.hypot(value, b[k]));

  // Which K entries are largest, as booleans; of equals the earlier one.
  function largest(values, K) {
    const order = Array.from(values, (_, k) => k).sort((j, k) => values[k] - values[j] || j - k);
    const kept = new Set(order.slice(0, K));
    return Array.from(values, (_, k) => kept.has(k));
  }

  // --- maps and labels ---------------------------------------------------------------------------------------------

  // Half the squared length of every row of the first k modes.
  function halfSquares(evecs, n, k) {
    const sums = new Float32Array(n);
    for (let at = 0; at < k * n; at++) sums[at % n] += evecs[at] ** 2 / 2;
    return sums;
  }

  // The vertex whose row is nearest to the given one: |x - y|^2 / 2 = |x|^2 / 2 - <x, y> + |y|^2 / 2.
  function nearestRow(evecs, n, target, halves = halfSquares(evecs, n, target.length)) {
    const products = synthesize(evecs, target, n);
    let best = 0;
    for (let i = 1; i < n; i++) if (halves[i] - products[i] < halves[best] - products[best]) best = i;
    return best;
  }

  // C (k, k) row after row, of which the first `size` rows and columns count: the coefficients on 2 of a function on 1.
  function mapCoefficients(C, k, c, size) {
    return Float32Array.from({ length: size }, (_, r) => {
      let sum = 0;
      for (let j = 0; j < size; j++) sum += C[r * k + j] * c[j];
      return sum;
    });
  }

  // Adjusted Rand index (Hubert and Arabie 1985): 1 for the same parts whatever their names, 0 for chance.
  function adjustedRand(p, q) {
    const pairs = (counts) => Object.values(counts).reduce((sum, count) => sum + (count * (count - 1)) / 2, 0);
    const [inP, inQ, inBoth] = [{}, {}, {}];
    for (let i = 0; i < p.length; i++) {
      inP[p[i]] = (inP[p[i]] ?? 0) + 1;
      inQ[q[i]] = (inQ[q[i]] ?? 0) + 1;
      const both = `${p[i]} ${q[i]}`;
      inBoth[both] = (inBoth[both] ?? 0) + 1;
    }
    const chance = (pairs(inP) * pairs(inQ)) / pairs({ all: p.length });
    const most = (pairs(inP) + pairs(inQ)) / 2;
    return most === chance ? 1 : (pairs(inBoth) - chance) / (most - chance);
  }

  // --- places ------------------------------------------------------------------------------------------------------

  const PLACES = ["its +x end", "its −x end", "its +y end", "its −y end", "its +z end", "its −z end"];

  // The vertex farthest along the direction of a place, by its number.
  function farthest(coordinates, place) {
    const [axis, sign] = [Math.floor(place / 2), place % 2 ? -1 : 1];
    return coordinates[axis].reduce((best, value, i, x) => (sign * value > sign * x[best] ? i : best), 0);
  }

  // --- tangent fields: one complex number a vertex ------------------------------------------------------------------

  // x with A x = b, by elimination with row exchanges; A holds its rows.
  function solve(A, b) {
    const rows = A.map((row, i) => [...row, b[i]]);
    for (let k = 0; k < rows.length; k++) {
      const best = rows.reduce((found, row, i) => (i > k && Math.abs(row[k]) > Math.abs(rows[found][k]) ? i : found), k);
      [rows[k], rows[best]] = [rows[best], rows[k]];
      for (let i = 0; i < rows.length; i++) {
        const times = i === k ? 0 : rows[i][k] / rows[k][k];
        if (times) for (let j = k; j <= rows.length; j++) rows[i][j] -= times * rows[k][j];
      }
    }
    return rows.map((row, k) => row[rows.length] / row[k]);
  }

  // z -> (M + t L) z for n-fold fields, x of all vertices and then y: along an edge (i, j) a vector is turned.
  function heatStep({ n, edges, edge_turns, weights, mass }, nFold, t) {
    const [cos, sin] = [Math.cos, Math.sin].map((wave) => Float64Array.from(edge_turns, (turn) => wave(nFold * turn)));
    const scaled = Float64Array.from(weights, (weight) => t * weight);
    const [tails, heads] = [0, 1].map((end) => edges.filter((_, at) => at % 2 === end));
    return (z) => {
      const out = new Float64Array(2 * n);
      for (let i = 0; i < n; i++) {
        out[i] = mass[i] * z[i];
        out[n + i] = mass[i] * z[n + i];
      }
      for (let e = 0; e < scaled.length; e++) {
        const i = tails[e];
        const j = heads[e];
        const x = scaled[e] * (z[j] - cos[e] * z[i] + sin[e] * z[n + i]);
        const y = scaled[e] * (z[n + j] - sin[e] * z[i] - cos[e] * z[n + i]);
        out[j] += x;
        out[n + j] += y;
        out[i] -= cos[e] * x + sin[e] * y;
        out[n + i] -= cos[e] * y - sin[e] * x;
      }
      return out;
    };
  }

  function dot(x, y) {
    let sum = 0;
    for (let i = 0; i < x.length; i++) sum += x[i] * y[i];
    return sum;
  }

  // x with A x = b by conjugate gradients, where apply(x) is A x and A is symmetric and positive; from a start.
  function conjugateGradients(apply, b, start, tolerance = 1e-8) {
    const x = Float64Array.from(start);
    const product = apply(x);
    const residual = Float64Array.from(b, (value, i) => value - product[i]);
    const way = Float64Array.from(residual);
    let size = dot(residual, residual);
    const enough = tolerance ** 2 * dot(b, b);
    for (let step = 0; size > enough && step < 5000; step++) {
      const image = apply(way);
      const share = size / dot(way, image);
      for (let i = 0; i < x.length; i++) {
        x[i] += share * way[i];
        residual[i] -= share * image[i];
      }
      const before = size;
      size = dot(residual, residual);
      for (let i = 0; i < x.length; i++) way[i] = residual[i] + (size / before) * way[i];
    }
    return x;
  }

  // The sum of columns g_j, each the answer to a unit load at vertices[j], that is values[j] = [x, y] at vertices[j].
  function fieldThrough(columns, n, vertices, values) {
    const [X, Y] = [0, n].map((part) => vertices.map((i) => columns.map((g) => g[part + i])));
    const A = [...X.map((row, i) => [...row, ...Y[i].map((y) => -y)]), ...Y.map((row, i) => [...row, ...X[i]])];
    const load = solve(A, [...values.map(([x]) => x), ...values.map(([, y]) => y)]);
    const sum = new Float64Array(2 * n);
    columns.forEach((g, j) => {
      const [x, y] = [load[j], load[columns.length + j]];
      for (let i = 0; i < n; i++) {
        sum[i] += x * g[i] - y * g[n + i];
        sum[n + i] += x * g[n + i] + y * g[i];
      }
    });
    return sum;
  }

  // How many turns, in units of one n-th, an n-fold field makes round each face beyond its transport.
  function fieldIndices({ n, faces, turns, holonomy }, nFold, z) {
    const angles = Float64Array.from({ length: n }, (_, i) => Math.atan2(z[n + i], z[i]));
    return Float32Array.from(holonomy, (whole, t) => {
      let sum = nFold * whole;
      for (let c = 0; c < 3; c++) {
        const [i, j] = [faces[3 * t + c], faces[3 * t + ((c + 1) % 3)]];
        const step = angles[j] - angles[i] - nFold * turns[3 * t + c];
        sum += step - 2 * Math.PI * Math.round(step / (2 * Math.PI));
      }
      return Math.round(sum / (2 * Math.PI));
    });
  }

  // --- filters on a graph -------------------------------------------------------------------------------------------

  // A piecewise linear function through equally spaced values on [0, end].
  function polyline(values, end) {
    return (at) => {
      const place = (Math.min(Math.max(at / end, 0), 1)) * (values.length - 1);
      const i = Math.min(Math.floor(place), values.length - 2);
      return values[i] + (place - i) * (values[i + 1] - values[i]);
    };
  }

  // Coefficients of the Chebyshev polynomial of a degree that agrees with g at its nodes on [0, b].
  function chebyshev(g, degree, b) {
    const N = degree + 1;
    const angles = Array.from({ length: N }, (_, j) => (Math.PI * (j + 0.5)) / N);
    const at = angles.map((angle) => g((b / 2) * (Math.cos(angle) + 1)));
    return angles.map((_, k) => ((k ? 2 : 1) / N) * angles.reduce((sum, angle, j) => sum + at[j] * Math.cos(k * angle), 0));
  }

  // The sum of a[k] T_k(2 L / b - 1) f, where apply(f) is L f: one product with L a degree. A number is a matrix, too.
  function chebyshevSum(a, b, apply, f) {
    const X = (u) => apply(u).map((value, i) => (2 / b) * value - u[i]);
    let [before, now] = [f, X(f)];
    let sum = f.map((value, i) => a[0] * value + (a[1] ?? 0) * now[i]);
    for (let k = 2; k < a.length; k++) {
      [before, now] = [now, X(now).map((value, i) => 2 * value - before[i])];
      sum = sum.map((value, i) => value + a[k] * now[i]);
    }
    return sum;
  }

  // L f of a graph with edges [tail, head, tail, head, ...] and their weights.
  function graphLaplacian(edges, weights, f) {
    const sum = new Float64Array(f.length);
    weights.forEach((weight, e) => {
      const [i, j] = [edges[2 * e], edges[2 * e + 1]];
      sum[i] += weight * (f[i] - f[j]);
      sum[j] += weight * (f[j] - f[i]);
    });
    return sum;
  }

  // --- a string whose ends are held by springs ----------------------------------------------------------------------

  // Frequencies of -u'' = k^2 u on [0, 1] with cos(a) u' = sin(a) u at 0 and -cos(b) u' = sin(b) u at 1: a = 0 is a free end,
  // a = pi/2 a fixed one. Between n pi and (n + 1) pi lies one of them, found by halving.
  function stringFrequencies(a, b, count) {
    const miss = (k) => {
      const [c, s] = [Math.cos(k), k ? Math.sin(k) / k : 1];
      return -k * k * s * Math.cos(a) * Math.cos(b) + Math.sin(a + b) * c + Math.sin(a) * Math.sin(b) * s;
    };
    return Array.from({ length: count }, (_, n) => {
      let [low, high] = [n * Math.PI, (n + 1) * Math.PI];
      const side = n % 2 ? -1 : 1; // of the value just above the lower end
      for (let step = 0; step < 60; step++) {
        const middle = (low + high) / 2;
        if (side * miss(middle) > 1e-14) low = middle;
        else high = middle;
      }
      return (low + high) / 2;
    });
  }

  // The mode of frequency k with its left end held at angle a, largest value 1.
  function stringMode(k, a, xs) {
    const u = xs.map((x) => Math.cos(a) * Math.cos(k * x) + Math.sin(a) * (k ? Math.sin(k * x) / k : x));
    const top = Math.max(...u.map(Math.abs));
    return u.map((value) => value / top);
  }

  // --- colours -----------------------------------------------------------------------------------------------------

  // Stops of matplotlib's RdBu_r and viridis, and the label colours of the book's stills.
  const SIGNED = ["#053061", "#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7", "#fddbc7", "#f4a582", "#d6604d", "#b2182b", "#67001f"];
  const POSITIVE = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
  const LABELS = ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#bbbbbb", "#6a423e", "#8ff0b0", "#2391f5", "#2d32b3", "#8844ee"];

  const colorScale = (stops) => stops.map((color, i) => [i / (stops.length - 1), color]);
  const labelScale = () => LABELS.flatMap((color, i) => [[i / LABELS.length, color], [(i + 1) / LABELS.length, color]]);

  // The colour at x, from 0 to 1, between the stops: [red, green, blue] from 0 to 255.
  function colorAt(stops, x) {
    const place = Math.min(Math.max(x, 0), 1) * (stops.length - 1);
    const i = Math.min(Math.floor(place), stops.length - 2);
    const part = (color, at) => parseInt(color.slice(at, at + 2), 16);
    return [1, 3, 5].map((at) => Math.round(part(stops[i], at) + (place - i) * (part(stops[i + 1], at) - part(stops[i], at))));
  }

  /** The lengths of the sides of triangles, side by side; an edge inside comes twice. */
  function edgeLengths([x, y, z], faces) {
    return Float64Array.from(faces, (a, k) => {
      const b = faces[k % 3 === 2 ? k - 2 : k + 1];
      return Math.hypot(x[b] - x[a], y[b] - y[a], z[b] - z[a]);
    });
  }

  /** f'Lf / f'Mf with the cotangent weights and the lumped masses of triangles, from the lengths of their sides alone. */
  function rayleighQuotient(coordinates, faces, f) {
    const lengths = edgeLengths(coordinates, faces);
    let [energy, size] = [0, 0];
    for (let t = 0; t < faces.length; t += 3) {
      const squares = [0, 1, 2].map((k) => lengths[t + k] ** 2);
      const [a, b, c] = [0, 1, 2].map((k) => lengths[t + k]);
      const area = Math.sqrt(Math.max((a + b + c) * (b + c - a) * (c + a - b) * (a + b - c), 0)) / 4;
      const sum = squares[0] + squares[1] + squares[2];
      for (let k = 0; k < 3; k++) {
        const [here, next] = [f[faces[t + k]], f[faces[t + ((k + 1) % 3)]]];
        energy += ((sum - 2 * squares[k]) / (8 * area)) * (next - here) ** 2; // half the cotangent across side k
        size += (area / 3) * here ** 2;
      }
    }
    return energy / size;
  }

  notes.numerics = {
    joinBasis, synthesize, row, integral, rmsDistance, truncationErrors,
    heatAt, waveAt, waveSpeedAt, waveEnergy, fourier, inverseFourier, amplitudes, largest,
    halfSquares, nearestRow, mapCoefficients, adjustedRand, stringFrequencies, stringMode, colorScale, labelScale, colorAt,
    farthest, edgeLengths, rayleighQuotient, solve, heatStep, dot, conjugateGradients, fieldThrough,
    fieldIndices, polyline, chebyshev, chebyshevSum, graphLaplacian, PLACES, SIGNED, POSITIVE,
  };
})();
