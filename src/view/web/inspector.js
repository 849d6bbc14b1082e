// The cluster under the pointer: its number, how much of the tile it covers, and its measured values as pictures.

import { clamp, vectorOf } from "./directions.js";
import { srgbCode } from "./palette.js";

/** Side of the picture of the light's half-sphere. */
const DISC = 72;

/** @typedef {import("./renderer.js").Renderer} Renderer @typedef {import("./state.js").State} State */

/** Tells about clusters. */
export class Inspector {
  /** @param {Renderer} renderer @param {HTMLElement} element */
  constructor(renderer, element) {
    this.renderer = renderer;
    this.text = /** @type {HTMLElement} */ (element.querySelector("[data-told]"));
    const [matrix, disc] = element.querySelectorAll("canvas");
    this.matrix = matrix;
    this.disc = disc;
    const { count } = renderer.clusters;
    /** Texels of each cluster. */
    this.texels = new Uint32Array(count);
    const index = renderer.material.array("index");
    for (const cluster of index) this.texels[cluster]++;
    this.all = index.length;
    this.told = "";
  }

  /** Tells of the texel at a pixel; whether there is one. @param {State} state @param {number} x @param {number} y */
  tell(state, x, y) {
    const texel = this.renderer.pick(state, x, y);
    if (!texel) return false;
    const [column, row] = texel, atlas = this.renderer.atlasOf(state);
    const name = atlas === this.renderer.tile ? "index" : "enlarged_index";
    const cluster = this.renderer.material.array(name)[row * atlas.width + column];
    const share = 100 * this.texels[cluster] / this.all;
    this.text.textContent = `Cluster ${cluster + 1} of ${this.renderer.clusters.count}, ${share.toFixed(share < 1 ? 2 : 1)} % of the tile. Texel ${column}, ${row}.`;
    const key = `${cluster} ${state.view} ${state.exposure}`;
    if (key !== this.told) {
      this.told = key;
      this.drawMatrix(cluster, state);
      this.drawDisc(cluster, state);
    }
    return true;
  }

  /** All values: a row for each view, a column for each light. @param {number} cluster @param {State} state */
  drawMatrix(cluster, { exposure }) {
    const { clusters } = this.renderer, { views, lights } = clusters, sum = new Float64Array(3), scale = 2 ** exposure;
    const picture = new ImageData(lights, views);
    for (let view = 0, at = 0; view < views; view++)
      for (let light = 0; light < lights; light++, at += 4) {
        sum.fill(0);
        clusters.add(cluster, view, light, scale, sum, 0);
        picture.data.set([srgbCode(sum[0]), srgbCode(sum[1]), srgbCode(sum[2]), 255], at);
      }
    [this.matrix.width, this.matrix.height] = [lights, views];
    this.matrix.getContext("2d")?.putImageData(picture, 0, 0);
  }

  /** The values under every light of the half-sphere, from the view of the state. @param {number} cluster @param {State} state */
  drawDisc(cluster, { view, exposure }) {
    const { clusters, views, lights } = this.renderer, seen = views.mix(vectorOf(...view)), scale = 2 ** exposure;
    const values = new Float64Array(3 * clusters.lights);
    for (let light = 0; light < clusters.lights; light++)
      for (const [number, weight] of seen.terms) clusters.add(cluster, number, light, weight * scale, values, 3 * light);
    const picture = new ImageData(DISC, DISC);
    for (let row = 0, at = 0; row < DISC; row++)
      for (let column = 0; column < DISC; column++, at += 4) {
        const [x, y] = [(column + 0.5) / DISC * 2 - 1, 1 - (row + 0.5) / DISC * 2], r = Math.hypot(x, y);
        if (r >= 1) continue;
        const { terms, cosineRatio } = lights.mix(vectorOf(Math.min(90 * r, 89.99), Math.atan2(y, x) * 180 / Math.PI));
        const sum = [0, 0, 0];
        for (const [number, weight] of terms) for (let c = 0; c < 3; c++) sum[c] += weight * cosineRatio * values[3 * number + c];
        picture.data.set([srgbCode(sum[0]), srgbCode(sum[1]), srgbCode(sum[2]), 255 * clamp((1 - r) * DISC / 2, 0, 1)], at);
      }
    [this.disc.width, this.disc.height] = [DISC, DISC];
    this.disc.getContext("2d")?.putImageData(picture, 0, 0);
  }
}

