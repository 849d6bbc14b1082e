// The coherent rule as fragment shaders: the same whole numbers as coherent.js, on the GPU.
//
// Positions of a level lie in four textures, one for each parity of row and column, so that a sub-pass draws one of them
// and reads the others. Each level is made for a region whose origin is even.

import { PARITIES, keyOf, modulo } from "./coherent.js";
import { Program, drawInto, fill, texture } from "./gl.js";

/** @typedef {import("./gl.js").GL} GL @typedef {import("./coherent.js").Region} Region */

/** Rows and columns of what is made at once. */
export const TILE = 256;

const HASH = `
uint mixWord(uint v) {
  v ^= v >> 16; v *= 0x21f0aaadu; v ^= v >> 15; v *= 0xd35a2d97u;
  return v ^ (v >> 15);
}
uniform ivec2 sides;                 // width and height of the exemplar
ivec2 wrapped(ivec2 p) {
  p += ivec2(lessThan(p, ivec2(0))) * sides;
  return p - ivec2(greaterThanEqual(p, sides)) * sides;
}`;

/** First positions of a level from those of the next coarser one: all four parities at once, since they share a parent. */
const FINER = `${HASH}
uniform isampler2D parent0, parent1, parent2, parent3;   // by parity: 2 * (row & 1) + (column & 1)
uniform ivec2 origin;                // place of the first texel, even
uniform ivec2 offset;                // half of it, in the coarser region
uniform int key, level, jitter;
uniform bool reflects;
layout(location = 0) out ivec4 out0;
layout(location = 1) out ivec4 out1;
layout(location = 2) out ivec4 out2;
layout(location = 3) out ivec4 out3;
ivec2 child(ivec2 parent, ivec2 at, ivec2 parity) {
  ivec2 place = origin + 2 * at + parity;
  uint word = mixWord(mixWord(uint(key) ^ uint(place.x)) ^ uint(place.y) * 0x9e3779b1u);
  ivec2 shaken = (ivec2(int(word & 0xffffu), int(word >> 16)) - 32768) * jitter + (1 << (22 - level)) >> (23 - level);
  ivec2 p = wrapped(parent + (parity << level) + shaken);
  if (reflects) {
    ivec2 last = sides - 2;
    p = ivec2(p.x < 1 ? 2 - p.x : p.x > last.x ? 2 * last.x - p.x : p.x, p.y < 1 ? 2 - p.y : p.y > last.y ? 2 * last.y - p.y : p.y);
  }
  return p;
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), from = offset + at, half_ = from >> 1;
  ivec2 odd = from & 1;
  ivec2 parent = (odd.y == 0
    ? (odd.x == 0 ? texelFetch(parent0, half_, 0) : texelFetch(parent1, half_, 0))
    : (odd.x == 0 ? texelFetch(parent2, half_, 0) : texelFetch(parent3, half_, 0))).xy;
  out0 = ivec4(child(parent, at, ivec2(0, 0)), 0, 0);
  out1 = ivec4(child(parent, at, ivec2(1, 0)), 0, 0);
  out2 = ivec4(child(parent, at, ivec2(0, 1)), 0, 0);
  out3 = ivec4(child(parent, at, ivec2(1, 1)), 0, 0);
}`;

/** One sub-pass. The textures are named as they lie from the corrected parity: in its row, its column, and neither. */
const CORRECT = `${HASH}
uniform isampler2D own, inRow, inColumn, across;
uniform isampler2D wasInRow, wasInColumn, wasAcross;     // as they were when the pass began
uniform isampler2D looks, looksToo;  // appearance of the exemplar, four numbers each
uniform ivec2 parity;                // of column and row
uniform int spacing, repetition;
uniform ivec2 period;                // sides of the exemplar in texels of the level
uniform ivec2 beyond;                // and how far beyond the exemplar's own sides they reach
uniform bool bordered, coarse;
out ivec4 position;

ivec2 halved(ivec2 at, ivec2 step) { return at + ((parity + step) >> 1); }
ivec2 row(ivec2 at, ivec2 step) { return texelFetch(inRow, halved(at, step), 0).xy; }
ivec2 column(ivec2 at, ivec2 step) { return texelFetch(inColumn, halved(at, step), 0).xy; }
ivec2 diagonal(ivec2 at, ivec2 step) { return texelFetch(across, halved(at, step), 0).xy; }
ivec2 neighbour(ivec2 at, ivec2 step) {
  if (step.y == 0) return step.x == 0 ? texelFetch(own, at, 0).xy : row(at, step);
  return step.x == 0 ? column(at, step) : diagonal(at, step);
}
ivec2 site(ivec2 at, ivec2 step) {
  ivec2 from = halved(at, step);
  if ((step.y & 1) == 0) return ((step.x & 1) == 0 ? texelFetch(own, from, 0) : texelFetch(wasInRow, from, 0)).xy;
  return ((step.x & 1) == 0 ? texelFetch(wasInColumn, from, 0) : texelFetch(wasAcross, from, 0)).xy;
}
int near(ivec2 q, ivec2 c) {
  ivec2 apart = abs(q - c);
  ivec2 least = min(apart, sides - apart) * 2;
  return int(least.x <= spacing) + int(least.y <= spacing);
}
ivec2 sites[12];
void lookAtSites(ivec2 at) {
  for (int n = 0; n < 6; n++) {
    int t = n / 2 - 1, side = (n & 1) * 2 - 1;
    sites[n] = wrapped(site(at, ivec2(t, side * period.y)) - ivec2(t * spacing, side * beyond.y));
    sites[n + 6] = wrapped(site(at, ivec2(side * period.x, t)) - ivec2(side * beyond.x, t * spacing));
  }
}
int square(ivec4 v) { v *= v; return v.x + v.y + v.z + v.w; }

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  ivec2 here = texelFetch(own, at, 0).xy;
  ivec2 proposals[9], steps[9];
  int n = 0;
  steps[0] = ivec2(0, 0); steps[1] = ivec2(-1, 0); steps[2] = ivec2(1, 0); steps[3] = ivec2(0, -1); steps[4] = ivec2(-1, -1);
  steps[5] = ivec2(1, -1); steps[6] = ivec2(0, 1); steps[7] = ivec2(-1, 1); steps[8] = ivec2(1, 1);
  ivec2 broken = ivec2(0);
  for (n = 0; n < 9; n++) {
    proposals[n] = neighbour(at, steps[n]);
    broken |= proposals[n] ^ wrapped(here + steps[n] * spacing);
  }
  position = ivec4(here, 0, 0);
  // Most texels continue all their neighbours already.
  if (broken == ivec2(0)) return;
  ivec4 around[4], aroundToo[4];
  for (n = 0; n < 4; n++) {
    ivec2 e = ivec2((n & 1) * 2 - 1, (n >> 1) * 2 - 1);
    ivec2 a = diagonal(at, e);
    ivec2 b = wrapped(row(at, ivec2(e.x, 2 * e.y)) - ivec2(0, spacing * e.y));
    ivec2 c = wrapped(column(at, ivec2(2 * e.x, e.y)) - ivec2(spacing * e.x, 0));
    around[n] = texelFetch(looks, a, 0) + texelFetch(looks, b, 0) + texelFetch(looks, c, 0);
    if (coarse) aroundToo[n] = texelFetch(looksToo, a, 0) + texelFetch(looksToo, b, 0) + texelFetch(looksToo, c, 0);
  }
  if (repetition > 0) lookAtSites(at);
  int least = 0x7fffffff;
  for (int k = 0; k < 9; k++) {
    ivec2 continued = proposals[k] - spacing * steps[k];
    bool outside = any(lessThan(continued, ivec2(1))) || any(greaterThanEqual(continued, sides - 1));
    if (k > 0 && bordered && outside) continue;
    ivec2 candidate = wrapped(continued);
    int cost = 0;
    for (n = 0; n < 4; n++) {
      ivec2 there = wrapped(candidate + spacing * ivec2((n & 1) * 2 - 1, (n >> 1) * 2 - 1));
      cost += square(around[n] - 3 * texelFetch(looks, there, 0));
      if (coarse) cost += square(aroundToo[n] - 3 * texelFetch(looksToo, there, 0));
    }
    if (repetition > 0) for (n = 0; n < 12; n++) cost += repetition * near(sites[n], candidate);
    if (cost < least) { least = cost; position = ivec4(candidate, 0, 0); }
  }
}`;

/** The four parities as one plane of positions in the tile. */
const GATHER = `
uniform isampler2D parity0, parity1, parity2, parity3;
uniform ivec2 offset, exemplar;
out ivec4 position;
void main() {
  ivec2 from = offset + ivec2(gl_FragCoord.xy), at = from >> 1, odd = from & 1;
  position = ivec4((odd.y == 0
    ? (odd.x == 0 ? texelFetch(parity0, at, 0) : texelFetch(parity1, at, 0))
    : (odd.x == 0 ? texelFetch(parity2, at, 0) : texelFetch(parity3, at, 0))).xy + exemplar, 0, 0);
}`;

/** Makes windows of an endless plane on the GPU. */
export class Synthesis {
  /** @param {GL} gl @param {import("./coherent.js").Plane} plane with all its levels */
  constructor(gl, plane) {
    this.gl = gl;
    this.plane = plane;
    this.finer = new Program(gl, FINER);
    this.correct = new Program(gl, CORRECT);
    this.gather = new Program(gl, GATHER);
    this.frame = gl.createFramebuffer();
    this.looks = plane.levels.map(({ dims, values }) => {
      const texels = plane.height * plane.width, parts = [];
      for (let part = 0; part < dims; part += 4) {
        const four = dims === 4 ? values : new Int8Array(4 * texels);
        if (dims !== 4) for (let n = 0; n < texels; n++) four.set(values.subarray(n * dims + part, n * dims + part + 4), 4 * n);
        const made = texture(gl, gl.RGBA8I, plane.width, plane.height);
        fill(gl, made, plane.width, plane.height, gl.RGBA_INTEGER, gl.BYTE, four);
        parts.push(made);
      }
      return parts;
    });
    /** Eight textures a region's size: the positions, and their successors. @type {Map<string, WebGLTexture[]>} */
    this.pool = new Map();
  }

  /** @param {string} name @param {number} width @param {number} height of a parity */
  textures(name, width, height) {
    const key = `${name} ${width} ${height}`;
    let found = this.pool.get(key);
    if (!found) {
      found = Array.from({ length: 8 }, () => texture(this.gl, this.gl.RG16I, width, height));
      this.pool.set(key, found);
    }
    return found;
  }

  /**
   * Positions of a window, drawn into what `target` binds.
   * @param {number} seed @param {Region} window in places of the level @param {number} finest the level
   * @param {() => void} target
   */
  window(seed, window, finest, target) {
    const { gl, plane } = this, sides = [plane.width, plane.height], last = plane.facts.levels.length - 1;
    const regions = plane.regions(window, finest).map(evened);
    // Regions that are evened need a little more of those above them.
    for (let n = 1; n < regions.length; n++) {
      const { y, x, height, width } = regions[n - 1], [rows, columns] = plane.halo(finest + n);
      const top = Math.min(regions[n].y, (y >> 1) - rows), left = Math.min(regions[n].x, (x >> 1) - columns);
      const bottom = Math.max(regions[n].y + regions[n].height, (y + height >> 1) + rows);
      const right = Math.max(regions[n].x + regions[n].width, (x + width >> 1) + columns);
      regions[n] = evened({ y: top, x: left, height: bottom - top, width: right - left });
    }
    gl.disable(gl.BLEND);
    /** @type {WebGLTexture[]} */
    let now = [];
    for (let level = last; level >= finest; level--) {
      const region = regions[level - finest], width = region.width / 2, height = region.height / 2;
      const pool = this.textures(`level ${level}`, width, height);
      const parents = now;
      now = pool.slice(0, 4);
      if (level === last) this.begin(seed, region, now);
      else {
        const coarser = regions[level - finest + 1];
        drawInto(gl, this.frame, now);
        this.finer.use(
          { parent0: parents[0], parent1: parents[1], parent2: parents[2], parent3: parents[3] }, {},
          {
            sides, origin: [region.x, region.y], offset: [region.x / 2 - coarser.x, region.y / 2 - coarser.y],
            key: keyOf(seed, level) | 0, level, jitter: plane.facts.jitter, reflects: level === 0 && !plane.wraps,
          },
        );
        this.finer.draw(width, height);
      }
      now = this.corrected(level, now, pool.slice(4), width, height);
    }
    const region = regions[0];
    target();
    this.gather.use(
      { parity0: now[0], parity1: now[1], parity2: now[2], parity3: now[3] }, {},
      { offset: [window.x - region.x, window.y - region.y], exemplar: [plane.left, plane.top] },
    );
    this.gather.draw(window.width, window.height);
  }

  /** Positions of the coarsest level: so few that they are made here. @param {number} seed @param {Region} region @param {WebGLTexture[]} into */
  begin(seed, region, into) {
    const { gl } = this, width = region.width / 2, height = region.height / 2;
    const positions = this.plane.begin(seed, region);
    into.forEach((made, parity) => {
      const part = new Int16Array(2 * width * height);
      for (let y = 0, at = 0; y < height; y++)
        for (let x = 0; x < width; x++) {
          const position = positions[(2 * y + (parity >> 1)) * region.width + 2 * x + (parity & 1)];
          part[at++] = position & 0xffff;
          part[at++] = position >>> 16;
        }
      fill(gl, made, width, height, gl.RG_INTEGER, gl.SHORT, part);
    });
  }

  /**
   * @param {number} level @param {WebGLTexture[]} now @param {WebGLTexture[]} spare @param {number} width @param {number} height
   */
  corrected(level, now, spare, width, height) {
    const { gl, plane } = this, { dims, passes, repetition, spacing } = plane.levels[level];
    const [rows, columns] = plane.sidesAt(level), reach = repetition ? [rows + 6, columns + 6] : [4, 6];
    for (let pass = 0; pass < passes; pass++) {
      const was = now.slice();
      // What later passes do not reach, and what cannot look around itself, is left as it is.
      const [top, left] = [rows, columns].map((side, axis) => Math.max(2, pass * reach[axis] + (repetition ? side : 0)) >> 1);
      for (const [a, b] of PARITIES) {
        const own = 2 * a + b;
        drawInto(gl, this.frame, [spare[own]]);
        this.correct.use(
          {
            own: now[own], inRow: now[own ^ 1], inColumn: now[own ^ 2], across: now[own ^ 3], wasInRow: was[own ^ 1],
            wasInColumn: was[own ^ 2], wasAcross: was[own ^ 3], looks: this.looks[level][0], looksToo: this.looks[level][dims / 4 - 1],
          }, {},
          {
            sides: [plane.width, plane.height], parity: [b, a], spacing, repetition, period: [columns, rows],
            beyond: [modulo(columns * spacing, plane.width), modulo(rows * spacing, plane.height)], bordered: level === 0 && !plane.wraps, coarse: dims > 4,
          },
        );
        this.correct.draw(width - 2 * left, height - 2 * top, left, top);
        now = now.map((made, n) => n === own ? spare[own] : made);
        spare = spare.map((made, n) => n === own ? was[own] : made);
      }
    }
    return now;
  }
}

/** The region with an even origin and even sides around it. @param {Region} region @returns {Region} */
function evened({ y, x, height, width }) {
  const top = y & ~1, left = x & ~1;
  return { y: top, x: left, height: y + height - top + 1 & ~1, width: x + width - left + 1 & ~1 };
}
