// The material: what the program packed into the page, or serves beside it.

/**
 * @typedef {Uint8Array | Int8Array | Uint16Array | Int16Array | Uint32Array | Int32Array | Float64Array} Values
 * @typedef {{ dims: number, shift: number, passes: number, repetition: number }} LevelFacts
 * @typedef {{ exemplar: number[], wraps: boolean, lattice: number[][], levels: LevelFacts[], jitter: number }} AppearanceFacts
 * @typedef {{ height: number, width: number, wraps: boolean }} TileFacts
 * @typedef {{ height: number, width: number, y: number, x: number }} EnlargedFacts
 * @typedef {{ name: string, version: string, values: string, tile: TileFacts, enlarged?: EnlargedFacts,
 *   appearance?: AppearanceFacts, arrays: Record<string, { type: string, shape: number[], offset: number }> }} Header
 */

const ARRAY_TYPES = {
  u8: Uint8Array, i8: Int8Array, u16: Uint16Array, i16: Int16Array, u32: Uint32Array, i32: Int32Array, f64: Float64Array,
};

/** Arrays by name, and what is said of them. */
export class Material {
  /** @param {ArrayBuffer} buffer as packed, no longer compressed */
  constructor(buffer) {
    const length = new DataView(buffer).getUint32(0, true);
    /** @type {Header} */
    this.header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
    this.buffer = buffer;
    this.begin = 4 + length;
  }

  /** @param {string} name */
  has(name) {
    return name in this.header.arrays;
  }

  /** @param {string} name @returns {number[]} */
  shape(name) {
    return this.header.arrays[name].shape;
  }

  /** @param {string} name @returns {Values} */
  array(name) {
    const { type, shape, offset } = this.header.arrays[name];
    const count = shape.reduce((product, side) => product * side, 1);
    return new ARRAY_TYPES[/** @type {keyof typeof ARRAY_TYPES} */ (type)](this.buffer, this.begin + offset, count);
  }
}

/**
 * Bytes of base64, four characters at a time in parts, so that no string of all of them is made.
 * @param {string} text
 */
function bytesOfBase64(text) {
  const part = 1 << 20;
  const trimmed = text.trim();
  const padding = trimmed.endsWith("==") ? 2 : trimmed.endsWith("=") ? 1 : 0;
  const bytes = new Uint8Array(trimmed.length / 4 * 3 - padding);
  for (let from = 0; from < trimmed.length; from += part) {
    const decoded = atob(trimmed.slice(from, from + part));
    const at = from / 4 * 3;
    for (let n = 0; n < decoded.length; n++) bytes[at + n] = decoded.charCodeAt(n);
  }
  return bytes;
}

/**
 * Reads the material out of the page, or asks the server for it.
 * @param {HTMLElement} element
 */
export async function readMaterial(element) {
  const address = element.dataset.address;
  let packed;
  if (address) {
    const response = await fetch(address);
    if (!response.ok) throw new Error(`The server of this page answered ${response.status}. Is btf view still running?`);
    packed = await response.arrayBuffer();
  } else {
    packed = bytesOfBase64(element.textContent ?? "");
    element.textContent = "";
  }
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Material(await new Response(stream).arrayBuffer());
}
