"use strict";
// Arrays as Python packs them (spectral_notes/plotting/packing.py). The browser and Node load this same file.
(() => {
  const notes = (globalThis.spectralNotes ??= {});

  function halfToFloat(bits) {
    const sign = bits & 0x8000 ? -1 : 1;
    const exponent = (bits >> 10) & 31;
    const fraction = bits & 1023;
    if (exponent === 31) return fraction ? NaN : sign * Infinity;
    return exponent ? sign * (1 + fraction / 1024) * 2 ** (exponent - 15) : sign * fraction * 2 ** -24;
  }

  const READERS = {
    float16: [2, (view, at, table) => table[view.getUint16(at, true)], Float32Array],
    float32: [4, (view, at) => view.getFloat32(at, true), Float32Array],
    uint16: [2, (view, at) => view.getUint16(at, true), Uint16Array],
    uint32: [4, (view, at) => view.getUint32(at, true), Uint32Array],
    int8: [1, (view, at) => view.getInt8(at), Int8Array],
  };
  let halves = null;

  // An array is { type, shape, data }: data is base64 of the deflated bytes, all first bytes before all second ones.
  async function decodeArray({ type, shape, data }) {
    const [width, read, Kind] = READERS[type];
    const packed = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const planes = new Uint8Array(await new Response(stream).arrayBuffer());
    const size = shape.reduce((product, length) => product * length, 1);
    if (planes.length !== size * width) throw new Error(`${type} array of ${shape}: ${planes.length} bytes`);
    halves ??= Float32Array.from({ length: 65536 }, (_, bits) => halfToFloat(bits));
    const element = new DataView(new ArrayBuffer(width));
    const values = new Kind(size);
    for (let i = 0; i < size; i++) {
      for (let b = 0; b < width; b++) element.setUint8(b, planes[b * size + i]);
      values[i] = read(element, 0, halves);
    }
    return values;
  }

  async function decodeAll(arrays) {
    const names = Object.keys(arrays);
    const values = await Promise.all(names.map((name) => decodeArray(arrays[name])));
    return Object.fromEntries(names.map((name, i) => [name, values[i]]));
  }

  Object.assign(notes, { halfToFloat, decodeArray, decodeAll });
})();
