// Pieces of the endless plane that have been visited, on the GPU, each level in squares of 256 places.

import { layered } from "./gl.js";
import { TILE } from "./synthesis.js";

/** @typedef {import("./gl.js").GL} GL @typedef {{ level: number, row: number, column: number }} Tile */

/** Pieces that are kept. */
const LAYERS = 144;

/** Rows and columns of a table of pieces: what is seen at once is smaller. */
export const TABLE_SIDE = 32;

/** Pieces by their places, the least recently seen first. */
export class Tiles {
  /**
   * @param {GL} gl @param {import("./coherent.js").Plane} plane
   * @param {import("./synthesis.js").Synthesis | null} synthesis none where the GPU cannot
   */
  constructor(gl, plane, synthesis) {
    this.gl = gl;
    this.plane = plane;
    this.synthesis = synthesis;
    this.seed = 1;
    this.positions = layered(gl, gl.RG16I, TILE, TILE, LAYERS);
    this.tables = layered(gl, gl.R16I, TABLE_SIDE, TABLE_SIDE, plane.facts.levels.length);
    this.frame = gl.createFramebuffer();
    /** Layers by the keys of their pieces. @type {Map<string, number>} */
    this.cache = new Map();
    /** @type {Tile[]} */
    this.missing = [];
    this.last = "";
  }

  /** Another plane of the same material. @param {number} seed */
  plant(seed) {
    if (seed === this.seed) return;
    this.seed = seed;
    this.cache.clear();
    this.last = "";
  }

  /**
   * Says what is seen: the pieces of these places, and one or two coarser ones that stand in for those that are missing.
   * @param {number} level @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 in places of the level
   */
  see(level, x0, y0, x1, y1) {
    const coarsest = this.plane.facts.levels.length - 1;
    /** @type {Tile[]} */
    const seen = [];
    for (const k of new Set([Math.min(level + 2, coarsest), level])) {
      const scale = TILE * 2 ** (k - level);
      const [c0, c1, r0, r1] = [x0, x1, y0, y1].map(place => Math.floor(place / scale));
      const far = (/** @type {Tile} */ { row, column }) => Math.hypot(row - (r0 + r1) / 2, column - (c0 + c1) / 2);
      const tiles = [];
      for (let row = r0; row <= r1; row++)
        for (let column = c0; column <= c1; column++) tiles.push({ level: k, row, column });
      seen.push(...tiles.sort((a, b) => far(a) - far(b)));
    }
    const shown = seen.slice(0, LAYERS);
    for (const tile of shown) {
      const key = placeOf(tile), layer = this.cache.get(key);
      if (layer === undefined) continue;
      this.cache.delete(key);
      this.cache.set(key, layer);
    }
    this.missing = shown.filter(tile => !this.cache.has(placeOf(tile)));
    this.tell(shown);
  }

  /** Writes the tables. @param {Tile[]} shown */
  tell(shown) {
    const there = shown.filter(tile => this.cache.has(placeOf(tile)));
    const told = there.map(placeOf).join(" ");
    if (told === this.last) return;
    this.last = told;
    const { gl } = this, side = TABLE_SIDE, table = new Int16Array(side * side * this.plane.facts.levels.length);
    for (const tile of there)
      table[(tile.level * side + (tile.row & side - 1)) * side + (tile.column & side - 1)] = 1 + (this.cache.get(placeOf(tile)) ?? 0);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.tables);
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, side, side, this.plane.facts.levels.length, gl.RED_INTEGER, gl.SHORT, table);
  }

  /** Makes the next missing piece; whether there was one. */
  make() {
    const tile = this.missing.shift();
    if (!tile) return false;
    let layer = this.cache.size;
    if (layer >= LAYERS) {
      const [oldest, freed] = /** @type {[string, number]} */ (this.cache.entries().next().value);
      this.cache.delete(oldest);
      layer = freed;
    }
    const { gl } = this;
    const window = { y: tile.row * TILE, x: tile.column * TILE, height: TILE, width: TILE };
    if (this.synthesis) {
      this.synthesis.window(this.seed, window, tile.level, () => this.bind(layer));
    } else {
      const positions = this.plane.window(this.seed, window, tile.level), values = new Int16Array(2 * positions.length);
      for (let n = 0; n < positions.length; n++) {
        values[2 * n] = positions[n] & 0xffff;
        values[2 * n + 1] = positions[n] >>> 16;
      }
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.positions);
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, TILE, TILE, 1, gl.RG_INTEGER, gl.SHORT, values);
    }
    this.cache.set(placeOf(tile), layer);
    return true;
  }

  /** @param {number} layer */
  bind(layer) {
    const { gl } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, this.positions, 0, layer);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0]);
  }

  /**
   * A piece's positions [y, x, (column, row)], read back; for tests.
   * @param {Tile} tile
   */
  read(tile) {
    const { gl } = this, layer = this.cache.get(placeOf(tile));
    if (layer === undefined) return null;
    this.bind(layer);
    const values = new Int32Array(4 * TILE * TILE);
    gl.readPixels(0, 0, TILE, TILE, gl.RGBA_INTEGER, gl.INT, values);
    return Int32Array.from({ length: TILE * TILE }, (_, n) => values[4 * n + 1] << 16 | values[4 * n]);
  }
}

/** @param {Tile} tile */
const placeOf = ({ level, row, column }) => `${level}/${row}/${column}`;
