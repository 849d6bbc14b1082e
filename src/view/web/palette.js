// Colours of clusters: under lights and a view, and false ones.

/** Weights of linear red, green and blue in the luminance. */
const LUMINANCE = [0.2126, 0.7152, 0.0722];

/** @param {number} code 0 to 255 */
const linearOf = code => code <= 0.04045 * 255 ? code / 255 / 12.92 : ((code / 255 + 0.055) / 1.055) ** 2.4;

/** Linear values of sRGB codes. */
export const LINEAR = Float64Array.from({ length: 256 }, (_, code) => linearOf(code));

/** The code of a linear value. @param {number} value */
export function srgbCode(value) {
  const linear = Math.min(Math.max(value, 0), 1);
  return Math.round(255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055));
}

/** Measured values of the clusters. */
export class Clusters {
  /** @param {import("./data.js").Material} material */
  constructor(material) {
    const [count, views, lights] = material.shape("representatives");
    this.count = count;
    this.views = views;
    this.lights = lights;
    this.isCoded = material.header.values === "srgb8";
    this.samples = material.array("representatives");
  }

  /**
   * Adds linear red, green and blue of a cluster, times a weight.
   * @param {number} cluster @param {number} view @param {number} light @param {number} weight
   * @param {Float64Array | Float32Array} sum @param {number} at
   */
  add(cluster, view, light, weight, sum, at) {
    const place = (cluster * this.views + view) * this.lights + light;
    if (this.isCoded) {
      for (let c = 0; c < 3; c++) sum[at + c] += weight * LINEAR[this.samples[3 * place + c]];
    } else {
      const code = this.samples[place], scale = weight * 2 ** ((code >>> 27) - 24);
      for (let c = 0; c < 3; c++) sum[at + c] += scale * (code >>> 9 * c & 511);
    }
  }

  /**
   * Linear colours of all clusters [cluster, rgba] under lights of these mixes and intensities, seen from a view.
   * @param {import("./directions.js").Mix} view
   * @param {{ mix: import("./directions.js").Mix, intensity: number }[]} lights
   */
  colors(view, lights) {
    const colors = new Float32Array(4 * this.count);
    const sum = new Float64Array(3);
    for (let cluster = 0; cluster < this.count; cluster++) {
      sum.fill(0);
      for (const { mix, intensity } of lights)
        for (const [v, viewWeight] of view.terms)
          for (const [l, lightWeight] of mix.terms)
            this.add(cluster, v, l, viewWeight * lightWeight * mix.cosineRatio * intensity, sum, 0);
      colors.set([sum[0], sum[1], sum[2], 1], 4 * cluster);
    }
    return colors;
  }

  /** How light each cluster is, over all pairs of directions that few samples stand for. */
  lightness() {
    const sum = new Float64Array(3);
    return Float64Array.from({ length: this.count }, (_, cluster) => {
      sum.fill(0);
      for (let view = 0; view < this.views; view += Math.max(1, this.views >> 3))
        for (let light = 0; light < this.lights; light += Math.max(1, this.lights >> 4)) this.add(cluster, view, light, 1, sum, 0);
      return sum.reduce((all, value, c) => all + LUMINANCE[c] * value, 0);
    });
  }
}

/** Linear colour of hue, saturation and value. @param {number} hue @param {number} saturation @param {number} value */
function linearOfHsv(hue, saturation, value) {
  return [5, 3, 1].map(n => {
    const k = (n + hue * 6) % 6;
    return linearOf(255 * (value - value * saturation * Math.max(0, Math.min(k, 4 - k, 1))));
  });
}

/**
 * False colours [cluster, rgba] that say how light a cluster is among all: from dark blue over green to light yellow, as
 * the program's own pictures.
 * @param {Float64Array} lightness
 */
export function falseColors(lightness) {
  const order = [...lightness.keys()].sort((a, b) => lightness[a] - lightness[b]);
  const colors = new Float32Array(4 * lightness.length);
  order.forEach((cluster, rank) => {
    const at = rank / Math.max(1, lightness.length - 1);
    colors.set([...linearOfHsv(0.68 - 0.53 * at, 0.85 - 0.35 * at, 0.35 + 0.65 * at), 1], 4 * cluster);
  });
  return colors;
}
