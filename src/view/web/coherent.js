// The coherent rule in plain whole numbers: any window of the endless plane, the same to the bit as the program makes.
// docs/method/coherent.md of btfkit is the specification. It stands in where the GPU cannot, and is its judge.

/**
 * @typedef {{ y: number, x: number, height: number, width: number }} Region a part of a level, in its places
 * @typedef {{ dims: number, spacing: number, passes: number, repetition: number, values: Int8Array }} Level appearance
 *   [y, x, dim] of the exemplar, as it looks at this level
 */

/** A bijection of 32-bit words. @param {number} word */
export function mixWord(word) {
  word ^= word >>> 16;
  word = Math.imul(word, 0x21f0aaad);
  word ^= word >>> 15;
  word = Math.imul(word, 0xd35a2d97);
  return (word ^ word >>> 15) >>> 0;
}

/** The key of a level. @param {number} seed @param {number} level */
export const keyOf = (seed, level) => mixWord(mixWord(seed) + level | 0);

/** The hash of a place. @param {number} key @param {number} y @param {number} x */
export const hashOf = (key, y, x) => mixWord(mixWord(key ^ x) ^ Math.imul(y, 0x9e3779b1));

/** The remainder that is never negative. @param {number} a @param {number} n */
export const modulo = (a, n) => (a % n + n) % n;

/** `a / b` to the nearest, halves up; neither negative. @param {number} a @param {number} b */
const rounded = (a, b) => Math.floor((2 * a + b) / (2 * b));

/** @param {number} c @param {number} s @param {number} otherC @param {number} otherS @param {number} other @param {number} u */
function solve(c, s, otherC, otherS, other, u) {
  const whole = Math.abs(c) * otherS;
  const cycle = Math.floor(u * Math.abs(c) / 65536);
  return modulo(rounded(modulo(cycle * otherS - Math.sign(c) * otherC * other, whole) * s, whole), s);
}

/**
 * A shift that maps the material to itself.
 * @param {number[][]} lattice @param {number} height @param {number} width @param {number} word
 */
function shiftOf(lattice, height, width, word) {
  const [u, v] = [word >>> 16, word & 0xffff];
  const part = (/** @type {number} */ n, /** @type {number} */ side) => Math.floor(n * side / 65536);
  if (lattice.length === 0) return [part(u, height), part(v, width)];
  const [[a, b], second] = lattice;
  if (!second) {
    if (Math.abs(b) * height >= Math.abs(a) * width) {
      const dy = part(u, height);
      return [dy, solve(b, width, a, height, dy, v)];
    }
    const dx = part(v, width);
    return [solve(a, height, b, width, dx, u), dx];
  }
  const [c, d] = second;
  const determinant = a * d - b * c, cells = Math.abs(determinant), sign = Math.sign(determinant);
  const [i, j] = [part(u, cells), part(v, cells)];
  return [
    modulo(rounded(modulo(sign * (d * i - b * j), cells) * height, cells), height),
    modulo(rounded(modulo(sign * (a * j - c * i), cells) * width, cells), width),
  ];
}

const FEATURES = 8;
/** Parities of the sub-passes, rows before columns. */
export const PARITIES = [[0, 0], [1, 1], [0, 1], [1, 0]];
/** Candidates, the texel's own first. */
const NEIGHBOURS = [[0, 0], [0, -1], [0, 1], [-1, 0], [-1, -1], [-1, 1], [1, 0], [1, -1], [1, 1]];
const DIAGONALS = [[-1, -1], [-1, 1], [1, -1], [1, 1]];
/** Sites that tell of repetition. */
const SITES = 12;

/** The endless plane of a material. */
export class Plane {
  /** @param {import("./data.js").Material} material */
  constructor(material) {
    const facts = material.header.appearance;
    if (!facts) throw new Error("The model has no endless surface.");
    this.material = material;
    this.facts = facts;
    const [top, left, height, width] = facts.exemplar;
    this.top = top;
    this.left = left;
    this.height = height;
    this.width = width;
    this.wraps = facts.wraps || Math.min(this.height, this.width) < 8;
    /** @type {Level[]} */
    this.levels = [];
    this.blurred = this.features();
    /** What lies around the texel that is being corrected. */
    this.around = new Int32Array(4 * FEATURES);
    this.sites = new Int32Array(2 * SITES);
  }

  /** Sixteen times the features of every texel of the exemplar. */
  features() {
    const index = this.material.array("index"), features = this.material.array("features");
    const stride = this.material.header.tile.width;
    const values = new Int16Array(this.height * this.width * FEATURES);
    for (let y = 0, at = 0; y < this.height; y++)
      for (let x = 0; x < this.width; x++) {
        const cluster = index[(this.top + y) * stride + this.left + x];
        for (let n = 0; n < FEATURES; n++) values[at++] = 16 * features[cluster * FEATURES + n];
      }
    return values;
  }

  /** Whether all levels have been made. */
  get isReady() {
    return this.levels.length === this.facts.levels.length;
  }

  /** Makes the next coarser level. */
  makeLevel() {
    const number = this.levels.length, spacing = 1 << number;
    const { dims, shift, passes, repetition } = this.facts.levels[number];
    this.levels.push({ dims, spacing, passes, repetition, values: this.appearance(number, dims, shift) });
    if (!this.isReady) this.blur(spacing);
  }

  /** @param {number} number @param {number} dims @param {number} shift */
  appearance(number, dims, shift) {
    const { height, width, blurred } = this, spacing = 1 << number;
    const basis = this.material.array(`basis_${number}`), offset = this.material.array(`offset_${number}`);
    const values = new Int8Array(height * width * dims), sums = new Int32Array(dims), half = 1 << shift - 1;
    for (let y = 0, at = 0; y < height; y++) {
      const rows = [y - spacing, y, y + spacing].map(row => modulo(row, height) * width);
      for (let x = 0; x < width; x++, at += dims) {
        sums.fill(0);
        for (let place = 0, input = 0; place < 9; place++) {
          const column = x + (place % 3 - 1) * spacing;
          const from = (rows[place / 3 | 0] + (column < 0 || column >= width ? modulo(column, width) : column)) * FEATURES;
          for (let n = 0; n < FEATURES; n++, input++) {
            const value = blurred[from + n];
            for (let d = 0; d < dims; d++) sums[d] += Math.imul(value, basis[input * dims + d]);
          }
        }
        for (let d = 0; d < dims; d++)
          values[at + d] = Math.max(-120, Math.min(120, (sums[d] - offset[d] + half | 0) >> shift));
      }
    }
    return values;
  }

  /** @param {number} spacing */
  blur(spacing) {
    const { height, width, blurred } = this, down = new Int16Array(blurred.length);
    /** @param {Int16Array} from @param {Int16Array} to @param {number} stepY @param {number} stepX */
    const along = (from, to, stepY, stepX) => {
      for (let y = 0, at = 0; y < height; y++)
        for (let x = 0; x < width; x++) {
          const before = (modulo(y - stepY, height) * width + modulo(x - stepX, width)) * FEATURES;
          const after = (modulo(y + stepY, height) * width + modulo(x + stepX, width)) * FEATURES;
          for (let n = 0; n < FEATURES; n++, at++) to[at] = from[before + n] + 2 * from[at] + from[after + n] + 2 >> 2;
        }
    };
    along(blurred, down, spacing, 0);
    along(down, blurred, 0, spacing);
  }

  /** Rows and columns around a region that the correction of a level depends on. @param {number} level */
  halo(level) {
    const { passes, repetition } = this.facts.levels[level];
    if (repetition === 0) return [4 * passes + 2, 6 * passes];
    return this.sidesAt(level).map(side => passes * (side + 6));
  }

  /** Sides of the exemplar in texels of a level. @param {number} level */
  sidesAt(level) {
    return [this.height, this.width].map(side => side + ((1 << level) >> 1) >> level);
  }

  /**
   * What is needed of each level for a window of level `finest`, that level first.
   * @param {Region} window @param {number} finest @returns {Region[]}
   */
  regions(window, finest) {
    const regions = [];
    for (let level = finest, wanted = window; level < this.facts.levels.length; level++) {
      const [rows, columns] = this.halo(level);
      const region = grown(wanted, rows, columns);
      regions.push(region);
      const [y, x] = [region.y >> 1, region.x >> 1];
      wanted = { y, x, height: (region.y + region.height - 1 >> 1) + 1 - y, width: (region.x + region.width - 1 >> 1) + 1 - x };
    }
    return regions;
  }

  /**
   * Positions of the coarsest level, before correction: row in the high half of a word, column in the low one.
   * @param {number} seed @param {Region} region
   */
  begin(seed, { y: top, x: left, height, width }) {
    const level = this.facts.levels.length - 1, key = keyOf(seed, level), positions = new Int32Array(height * width);
    for (let y = top, at = 0; y < top + height; y++)
      for (let x = left; x < left + width; x++, at++) {
        const [dy, dx] = shiftOf(this.facts.lattice, this.height, this.width, hashOf(key, y, x));
        positions[at] = modulo(y * 2 ** level + dy, this.height) << 16 | modulo(x * 2 ** level + dx, this.width);
      }
    return positions;
  }

  /**
   * Positions continued from the next coarser level.
   * @param {number} seed @param {number} level @param {Region} region @param {Int32Array} parents @param {Region} coarser
   */
  finer(seed, level, { y: top, x: left, height, width }, parents, coarser) {
    const key = keyOf(seed, level), jitter = this.facts.jitter, half = 1 << 22 - level, shift = 23 - level;
    const positions = new Int32Array(height * width);
    const columns = Array.from({ length: width }, (_, x) => mixWord(key ^ left + x));
    for (let y = top, at = 0; y < top + height; y++) {
      const row = Math.imul(y, 0x9e3779b1), from = ((y >> 1) - coarser.y) * coarser.width - coarser.x;
      for (let x = left; x < left + width; x++, at++) {
        const parent = parents[from + (x >> 1)], word = mixWord(columns[x - left] ^ row);
        const py = (parent >>> 16) + ((y & 1) << level) + (Math.imul((word >>> 16) - 32768, jitter) + half >> shift);
        const px = (parent & 0xffff) + ((x & 1) << level) + (Math.imul((word & 0xffff) - 32768, jitter) + half >> shift);
        positions[at] = wrapped(py, this.height) << 16 | wrapped(px, this.width);
      }
    }
    if (level === 0 && !this.wraps)
      for (let at = 0; at < positions.length; at++)
        positions[at] = reflected(positions[at] >>> 16, this.height) << 16 | reflected(positions[at] & 0xffff, this.width);
    return positions;
  }

  /** Corrects the positions of a level, in place. @param {number} level @param {Region} region @param {Int32Array} positions */
  correct(level, region, positions) {
    const { passes, repetition } = this.levels[level], sides = this.sidesAt(level);
    for (let pass = 0; pass < passes; pass++) {
      // A pass leaves out what later ones do not reach, and what it cannot look around.
      const reach = repetition ? sides.map(side => side + 6) : [4, 6];
      const margin = [0, 1].map(axis => Math.max(2, pass * reach[axis] + (repetition ? sides[axis] : 0)));
      const before = repetition ? positions.slice() : null;
      for (const [a, b] of PARITIES) {
        const y0 = margin[0] + (a - region.y - margin[0] & 1), x0 = margin[1] + (b - region.x - margin[1] & 1);
        for (let y = y0; y < region.height - margin[0]; y += 2)
          for (let x = x0; x < region.width - margin[1]; x += 2) {
            const at = y * region.width + x;
            if (this.isBroken(level, region.width, positions, at))
              positions[at] = this.best(level, region.width, positions, at, before, sides);
          }
      }
    }
  }

  /** Whether a neighbour does not continue a texel. @param {number} level @param {number} width @param {Int32Array} positions @param {number} at */
  isBroken(level, width, positions, at) {
    const spacing = 1 << level, here = positions[at], y = here >>> 16, x = here & 0xffff;
    for (const [dy, dx] of NEIGHBOURS) {
      const continued = wrapped(y + dy * spacing, this.height) << 16 | wrapped(x + dx * spacing, this.width);
      if (positions[at + dy * width + dx] !== continued) return true;
    }
    return false;
  }

  /**
   * The best of the positions that a texel and its neighbours propose.
   * @param {number} level @param {number} width @param {Int32Array} positions @param {number} at
   * @param {Int32Array | null} before @param {number[]} sides
   */
  best(level, width, positions, at, before, sides) {
    const { dims, values, repetition } = this.levels[level], spacing = 1 << level, around = this.around;
    for (let e = 0; e < 4; e++) {
      const [i, j] = DIAGONALS[e];
      const near = this.place(positions[at + i * width + j], 0, 0) * dims;
      const below = this.place(positions[at + 2 * i * width + j], -i * spacing, 0) * dims;
      const beside = this.place(positions[at + i * width + 2 * j], 0, -j * spacing) * dims;
      for (let d = 0; d < dims; d++) around[e * dims + d] = values[near + d] + values[below + d] + values[beside + d];
    }
    if (before) this.lookAtSites(level, width, before, at, sides);
    let best = positions[at], least = Infinity;
    for (let n = 0; n < NEIGHBOURS.length; n++) {
      const [i, j] = NEIGHBOURS[n], proposal = positions[at + i * width + j];
      const y = (proposal >>> 16) - i * spacing, x = (proposal & 0xffff) - j * spacing;
      if (n > 0 && level === 0 && !this.wraps && !(y >= 1 && y < this.height - 1 && x >= 1 && x < this.width - 1)) continue;
      const candidate = wrapped(y, this.height) << 16 | wrapped(x, this.width);
      if (n > 0 && candidate === best) continue;
      let cost = before ? repetition * this.repeated(spacing, candidate) : 0;
      for (let e = 0; e < 4; e++) {
        const there = this.place(candidate, DIAGONALS[e][0] * spacing, DIAGONALS[e][1] * spacing) * dims;
        for (let d = 0; d < dims; d++) {
          const unlike = around[e * dims + d] - 3 * values[there + d];
          cost += unlike * unlike;
        }
      }
      if (cost < least) [best, least] = [candidate, cost];
    }
    return best;
  }

  /** Where the exemplar's texel lies that is so many rows and columns from a position. @param {number} position @param {number} dy @param {number} dx */
  place(position, dy, dx) {
    return wrapped((position >>> 16) + dy, this.height) * this.width + wrapped((position & 0xffff) + dx, this.width);
  }

  /**
   * What the sites one side of the exemplar away continue to.
   * @param {number} level @param {number} width @param {Int32Array} before @param {number} at @param {number[]} sides
   */
  lookAtSites(level, width, before, at, [rows, columns]) {
    for (let n = 0; n < SITES; n++) {
      const t = (n >> 1) % 3 - 1, sign = (n & 1) * 2 - 1;
      const [i, j] = n < SITES / 2 ? [sign * rows, t] : [t, sign * columns], site = before[at + i * width + j];
      this.sites[2 * n] = modulo((site >>> 16) - (i << level), this.height);
      this.sites[2 * n + 1] = modulo((site & 0xffff) - (j << level), this.width);
    }
  }

  /** How many of the sites come from a candidate's row, and how many from its column. @param {number} spacing @param {number} candidate */
  repeated(spacing, candidate) {
    let count = 0;
    for (let n = 0; n < SITES; n++) {
      const y = Math.abs(this.sites[2 * n] - (candidate >>> 16)), x = Math.abs(this.sites[2 * n + 1] - (candidate & 0xffff));
      count += Number(2 * Math.min(y, this.height - y) <= spacing) + Number(2 * Math.min(x, this.width - x) <= spacing);
    }
    return count;
  }

  /**
   * Positions of a window of a level, row by row: row of the tile in the high half of a word, column in the low one.
   * @param {number} seed @param {Region} window in places of the level @param {number} finest the level
   */
  window(seed, window, finest = 0) {
    const regions = this.regions(window, finest), last = this.facts.levels.length - 1;
    let positions = this.begin(seed, regions[last - finest]);
    for (let level = last; level >= finest; level--) {
      const region = regions[level - finest];
      if (level < last) positions = this.finer(seed, level, region, positions, regions[level - finest + 1]);
      this.correct(level, region, positions);
    }
    const out = new Int32Array(window.height * window.width), region = regions[0];
    for (let y = 0; y < window.height; y++) {
      const from = (window.y - region.y + y) * region.width + window.x - region.x;
      for (let x = 0; x < window.width; x++) {
        const position = positions[from + x];
        out[y * window.width + x] = (position >>> 16) + this.top << 16 | (position & 0xffff) + this.left;
      }
    }
    return out;
  }
}

/** @param {Region} region @param {number} rows @param {number} columns @returns {Region} */
const grown = ({ y, x, height, width }, rows, columns) =>
  ({ y: y - rows, x: x - columns, height: height + 2 * rows, width: width + 2 * columns });

/** A place less than one side beyond a range, brought back. @param {number} place @param {number} side */
const wrapped = (place, side) => place < 0 ? place + side : place >= side ? place - side : place;

/** @param {number} place @param {number} side */
const reflected = (place, side) => place < 1 ? 2 - place : place > side - 2 ? 2 * (side - 2) - place : place;
