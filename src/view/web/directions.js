// Measured directions, the triangles between them, and mixes of three of them that stand for any other.

/**
 * @typedef {[number, number, number]} Vector
 * @typedef {{ terms: [number, number][], cosineRatio: number }} Mix numbers of directions and weights; the ratio is that
 *   of the light's cosine to the mix's, beyond the outermost directions
 */

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @param {ArrayLike<number>} a @param {ArrayLike<number>} b @returns {Vector} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** The unit vector of two angles in degrees. @param {number} theta @param {number} phi @returns {Vector} */
export function vectorOf(theta, phi) {
  const [t, p] = [theta * Math.PI / 180, phi * Math.PI / 180];
  return [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
}

/** @param {number} number @param {number} low @param {number} high */
export const clamp = (number, low, high) => Math.min(Math.max(number, low), high);

const NEGLIGIBLE_WEIGHT = 1e-9;
const SAME_DIRECTION = 1e-7;

/** Finds the mix of any direction, by the rules of the program. */
export class Interpolator {
  /** @param {Float64Array} vectors [direction, xyz] @param {Uint16Array} triangles [triangle, corner] */
  constructor(vectors, triangles) {
    /** @type {Vector[]} */
    this.vectors = [];
    for (let n = 0; n < vectors.length; n += 3) this.vectors.push([vectors[n], vectors[n + 1], vectors[n + 2]]);
    /** @type {[number, number, number][]} */
    this.triangles = [];
    for (let n = 0; n < triangles.length; n += 3) this.triangles.push([triangles[n], triangles[n + 1], triangles[n + 2]]);
    this.border = borderEdges(this.triangles);
  }

  /** @param {Vector} target @returns {Mix} */
  mix(target) {
    let nearest = 0;
    for (let n = 1; n < this.vectors.length; n++)
      if (dot(this.vectors[n], target) > dot(this.vectors[nearest], target)) nearest = n;
    const found = this.vectors[nearest];
    if (Math.hypot(found[0] - target[0], found[1] - target[1], found[2] - target[2]) < SAME_DIRECTION)
      return { terms: [[nearest, 1]], cosineRatio: 1 };
    let best = null, least = -NEGLIGIBLE_WEIGHT;
    for (const corners of this.triangles) {
      const [a, b, c] = corners.map(corner => this.vectors[corner]);
      const volume = dot(a, cross(b, c));
      if (Math.abs(volume) <= 1e-12) continue;
      const weights = [dot(target, cross(b, c)) / volume, dot(target, cross(c, a)) / volume, dot(target, cross(a, b)) / volume];
      const smallest = Math.min(...weights);
      if (smallest > least) [best, least] = [{ corners, weights }, smallest];
    }
    if (best) {
      const { corners, weights } = best;
      return { terms: shares(corners.map((corner, n) => [corner, weights[n]])), cosineRatio: 1 };
    }
    return this.atBorder(target) ??
      { terms: [[nearest, 1]], cosineRatio: clamp(target[2] / Math.max(found[2], 1e-9), 0, 1) };
  }

  /**
   * Where the target's meridian crosses the border: its elevation is clamped.
   * @param {Vector} target @returns {Mix | null}
   */
  atBorder(target) {
    let best = null, nearest = -Infinity;
    for (const [i, j] of this.border) {
      const [vi, vj] = [this.vectors[i], this.vectors[j]];
      const [ai, aj] = [target[0] * vi[1] - target[1] * vi[0], target[0] * vj[1] - target[1] * vj[0]];
      if (ai * aj > 0 || ai === aj) continue;
      const all = Math.abs(ai) + Math.abs(aj), wi = Math.abs(aj) / all, wj = Math.abs(ai) / all;
      const point = /** @type {Vector} */ ([0, 1, 2].map(axis => wi * vi[axis] + wj * vj[axis]));
      if (point[0] * target[0] + point[1] * target[1] <= 0) continue;
      const near = dot(point, target) / Math.hypot(...point);
      if (near > nearest) {
        nearest = near;
        const cosine = point[2] / Math.hypot(...point);
        best = { terms: shares([[i, wi], [j, wj]]), cosineRatio: clamp(target[2] / cosine, 0, 1) };
      }
    }
    return best;
  }
}

/** Weights that sum to 1, without those that are rounding. @param {[number, number][]} weights @returns {[number, number][]} */
function shares(weights) {
  const kept = weights.filter(([, weight]) => weight > NEGLIGIBLE_WEIGHT);
  const sum = kept.reduce((all, [, weight]) => all + weight, 0);
  return kept.map(([number, weight]) => [number, weight / sum]);
}

/** Edges of one triangle only. @param {[number, number, number][]} triangles @returns {[number, number][]} */
function borderEdges(triangles) {
  const count = new Map();
  for (const [a, b, c] of triangles)
    for (const [i, j] of [[a, b], [b, c], [c, a]]) {
      const key = Math.min(i, j) * 65536 + Math.max(i, j);
      count.set(key, (count.get(key) ?? 0) + 1);
    }
  return [...count].filter(([, times]) => times === 1).map(([key]) => [Math.floor(key / 65536), key % 65536]);
}

/** Side of the picture that says in which cell to begin. */
export const START_SIDE = 64;

/**
 * Cells for a shader: the triangles, and beyond each edge of the border the wedge whose elevations are clamped to it.
 * In each, three linear functions of a direction are all positive within, and name the neighbour where one is not; in a
 * triangle they are the weights, in a wedge the first two are.
 *
 * @typedef {{ table: Float32Array, start: Uint16Array, count: number }} Cells [cell, 4, 4]: three rows of a function and
 *   its corner, then the three neighbours and 1 for a wedge; and the cell to begin with, over the disc
 * @param {Interpolator} interpolator
 * @returns {Cells | null} none where no triangles lie all around the normal, which curved shapes need
 */
export function cellsOf({ vectors, triangles, border }) {
  const up = /** @type {Vector} */ ([0, 0, 1]);
  if (vectors.length === 1) {
    // One direction stands for all.
    const table = new Float32Array([0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2]);
    return { table, start: new Uint16Array(START_SIDE * START_SIDE), count: 1 };
  }
  /** @type {{ rows: Vector[], corners: number[], wedge: boolean, near: number[] }[]} */
  const cells = [];
  /** @type {Map<number, [number, number][]>} */
  const sides = new Map();
  const side = (/** @type {number} */ i, /** @type {number} */ j) => Math.min(i, j) * 65536 + Math.max(i, j);
  const join = (/** @type {number} */ key, /** @type {number} */ cell, /** @type {number} */ slot) =>
    sides.set(key, [...(sides.get(key) ?? []), [cell, slot]]);
  for (const corners of triangles) {
    const [a, b, c] = corners.map(corner => vectors[corner]);
    const volume = dot(a, cross(b, c));
    if (Math.abs(volume) <= 1e-12) continue;
    const rows = [cross(b, c), cross(c, a), cross(a, b)].map(row => /** @type {Vector} */ (row.map(value => value / volume)));
    const cell = cells.push({ rows, corners: [...corners], wedge: false, near: [-1, -1, -1] }) - 1;
    for (let n = 0; n < 3; n++) join(side(corners[(n + 1) % 3], corners[(n + 2) % 3]), cell, n);
  }
  if (!cells.some(({ rows }) => rows.every(row => dot(row, up) >= -NEGLIGIBLE_WEIGHT))) return null;
  for (const edge of border) {
    let [i, j] = edge;
    // Counter-clockwise as seen from above.
    if (vectors[i][0] * vectors[j][1] - vectors[i][1] * vectors[j][0] < 0) [i, j] = [j, i];
    const [vi, vj] = [vectors[i], vectors[j]];
    if (vi[0] * vj[1] - vi[1] * vj[0] <= 1e-9) return null;
    const beyond = cross(vj, vi);
    const rows = /** @type {Vector[]} */ ([[vj[1], -vj[0], 0], [-vi[1], vi[0], 0], beyond]);
    const cell = cells.push({ rows, corners: [i, j, i], wedge: true, near: [-1, -1, -1] }) - 1;
    join(side(i, j), cell, 2);
    join(-1 - j, cell, 0);
    join(-1 - i, cell, 1);
  }
  for (const pair of sides.values()) {
    if (pair.length !== 2) return null;
    const [[first, slot], [second, other]] = pair;
    cells[first].near[slot] = second;
    cells[second].near[other] = first;
  }
  const table = new Float32Array(cells.length * 16);
  cells.forEach(({ rows, corners, wedge, near }, cell) => {
    for (let n = 0; n < 3; n++) {
      table.set([...rows[n], corners[n]], cell * 16 + 4 * n);
      table[cell * 16 + 12 + n] = near[n];
    }
    table[cell * 16 + 15] = wedge ? 1 : 0;
  });
  return { table, start: startOf(cells), count: cells.length };
}

/** The cell in the middle of each part of the stereographic disc. @param {{ rows: Vector[], near: number[] }[]} cells */
function startOf(cells) {
  const start = new Uint16Array(START_SIDE * START_SIDE);
  let cell = 0;
  for (let row = 0; row < START_SIDE; row++)
    for (let column = 0; column < START_SIDE; column++) {
      const [x, y] = [column, row].map(n => (n + 0.5) / START_SIDE * 2 - 1);
      const square = x * x + y * y;
      const direction = /** @type {Vector} */ ([2 * x / (1 + square), 2 * y / (1 + square), (1 - square) / (1 + square)]);
      for (let steps = 0; steps < cells.length; steps++) {
        const values = cells[cell].rows.map(value => dot(value, direction));
        const worst = values.indexOf(Math.min(...values));
        if (values[worst] >= -1e-7) break;
        cell = cells[cell].near[worst];
      }
      start[row * START_SIDE + column] = cell;
    }
  return start;
}
