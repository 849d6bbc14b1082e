// Draws a state: colours of the tile, then the surface on its shape, then the mean of ever more samples on the screen.

import { Interpolator, START_SIDE, cellsOf, clamp, vectorOf } from "./directions.js";
import { Clusters, falseColors } from "./palette.js";
import { Plane, modulo } from "./coherent.js";
import { Program, drawInto, fill, layered, texture } from "./gl.js";
import { Synthesis } from "./synthesis.js";
import { Tiles } from "./tiles.js";
import { AVERAGE, COLOR, CURVED, FLAT, PRESENT } from "./shaders.js";

/**
 * @typedef {import("./state.js").State} State @typedef {import("./gl.js").GL} GL @typedef {import("./data.js").Material} Material
 * @typedef {{ index: WebGLTexture, width: number, height: number, wraps: boolean, key: string, colors: WebGLTexture[],
 *   made: number }} Atlas colours of a tile, from one texel a time to the means of squares of 2^k texels
 */

/** Samples a pixel when nothing moves. */
const SAMPLES = { plane: 8, sphere: 16, box: 16, cylinder: 16 };

/** Lights beside the one that is moved: turned about the normal, their elevation, and how bright. */
const MORE_LIGHTS = [[125, 58, 0.4], [-115, 66, 0.3]];

/** Clusters in a row of values. */
const MOST_COLUMNS = 2048;

/** The radical inverse of a number. @param {number} number @param {number} base */
function halton(number, base) {
  let [sum, share] = [0, 1];
  for (; number > 0; number = Math.floor(number / base)) sum += number % base * (share /= base);
  return sum;
}

/** The shortest turn of a direction to the z axis, row by row. @param {[number, number, number]} direction */
export function turnOf([x, y, z]) {
  const k = 1 / Math.max(1 + z, 1e-6);
  return [[1 - x * x * k, -x * y * k, -x], [-x * y * k, 1 - y * y * k, -y], [x, y, z]];
}

/**
 * The screen's right, up and towards the eye, as directions of the surface: the plane is tilted the shortest way, curved
 * shapes stand upright.
 * @param {State} state
 */
export function screenOf({ shape, view }) {
  const towards = vectorOf(...view), across = Math.hypot(towards[0], towards[2]);
  if (shape === "plane" || across < 1e-4) return turnOf(towards);
  const right = [towards[2] / across, 0, -towards[0] / across];
  const [x, y, z] = towards;
  return [right, [y * right[2], z * right[0] - x * right[2], -y * right[0]], towards];
}

/** Why there can be no picture. */
export class Unable extends Error {}

/** Draws into a canvas. */
export class Renderer {
  /** @param {HTMLCanvasElement} canvas @param {Material} material @param {{ plain?: boolean }} [options] plain: without the GPU's synthesis */
  constructor(canvas, material, options = {}) {
    const gl = canvas.getContext("webgl2", { alpha: true, antialias: false, depth: false, powerPreference: "high-performance" });
    if (!gl) throw new Unable("This browser has no WebGL 2, which draws the material. Any current browser has it; it may be switched off in its settings.");
    if (!gl.getExtension("EXT_color_buffer_float") && !gl.getExtension("EXT_color_buffer_half_float"))
      throw new Unable("The graphics driver draws no floating-point pictures, which the light needs.");
    this.gl = gl;
    this.canvas = canvas;
    this.material = material;
    this.options = options;
    this.clusters = new Clusters(material);
    this.views = new Interpolator(/** @type {Float64Array} */ (material.array("views")), /** @type {Uint16Array} */ (material.array("view_triangles")));
    this.lights = new Interpolator(/** @type {Float64Array} */ (material.array("lights")), /** @type {Uint16Array} */ (material.array("light_triangles")));
    this.viewCells = cellsOf(this.views);
    this.lightCells = cellsOf(this.lights);
    const { tile, enlarged } = material.header;
    this.fits(Math.max(tile.width, tile.height, this.clusters.lights * Math.ceil(this.clusters.count / MOST_COLUMNS)), gl.MAX_TEXTURE_SIZE);
    this.frame = gl.createFramebuffer();
    this.programs = {
      color: new Program(gl, COLOR), average: new Program(gl, AVERAGE), flat: new Program(gl, FLAT), present: new Program(gl, PRESENT),
    };
    /** @type {Program | null} */
    this.curved = null;
    this.tile = this.atlas("index", tile.width, tile.height, tile.wraps);
    this.enlarged = enlarged ? this.atlas("enlarged_index", enlarged.width, enlarged.height, false) : null;
    this.palette = texture(gl, gl.RGBA32F, 256, Math.ceil(this.clusters.count / 256));
    this.normal = texture(gl, gl.RGB8, tile.width, tile.height);
    if (material.has("normals")) fill(gl, this.normal, tile.width, tile.height, gl.RGB, gl.UNSIGNED_BYTE, /** @type {Uint8Array} */ (material.array("normals")));
    this.plane = material.header.appearance ? new Plane(material) : null;
    /** @type {Tiles | null} */
    this.tiles = null;
    /** The seed of the endless surface of which a whole picture has been made. @type {number | null} */
    this.ripe = null;
    this.empty = layered(gl, gl.RG16I, 1, 1, 1);
    this.pickTarget = texture(gl, gl.RGBA16F, 1, 1);
    /** @type {WebGLTexture | null} */
    this.mean = null;
    this.meanSize = "";
    this.seen = "";
    this.samples = 0;
    /** @type {Float32Array | null} */
    this.ramp = null;
    /** @type {{ textures: Record<string, WebGLTexture>, columns: number } | null} */
    this.curvedMade = null;
    /** Part of the pixels that are drawn while something moves and the graphics is slow. */
    this.draft = 1;
    this.drawn = 0;
    /** How far right and up of the middle a curved shape stands, pixels of the page. */
    this.aside = [0, 0];
  }

  /** @param {number} side @param {number} limit */
  fits(side, limit) {
    const most = Number(this.gl.getParameter(limit));
    if (side > most) throw new Unable(`This material needs pictures of ${side} pixels; the graphics of this device has ${most} at most.`);
  }

  /** Whether the directions allow curved shapes. */
  get curves() {
    return this.viewCells !== null && this.lightCells !== null;
  }

  /** @param {string} name @param {number} width @param {number} height @param {boolean} wraps @returns {Atlas} */
  atlas(name, width, height, wraps) {
    const { gl } = this, values = this.material.array(name), isWide = values.BYTES_PER_ELEMENT === 2;
    const index = texture(gl, isWide ? gl.R16UI : gl.R8UI, width, height);
    fill(gl, index, width, height, gl.RED_INTEGER, isWide ? gl.UNSIGNED_SHORT : gl.UNSIGNED_BYTE, values);
    return { index, width, height, wraps, key: "", colors: [], made: 0 };
  }

  /** @param {State} state @returns {Atlas} */
  atlasOf(state) {
    return state.surface === "enlarged" && this.enlarged ? this.enlarged : this.tile;
  }

  /** Directions and intensities of a state's lights. @param {State} state @returns {{ direction: [number, number, number], intensity: number }[]} */
  lightsOf({ light: [theta, phi], lights }) {
    const more = MORE_LIGHTS.slice(0, lights - 1).map(([turn, height, intensity]) => ({ direction: vectorOf(height, phi + turn), intensity }));
    return [{ direction: vectorOf(theta, phi), intensity: 1 }, ...more];
  }

  /** Linear colours of the clusters [cluster, rgba]. @param {State} state */
  colorsOf(state) {
    if (state.show === "clusters") return this.ramp ??= falseColors(this.clusters.lightness());
    const lights = this.lightsOf(state).map(({ direction, intensity }) => ({ mix: this.lights.mix(direction), intensity }));
    return this.clusters.colors(this.views.mix(vectorOf(...state.view)), lights);
  }

  /** Colours of the tile's texels, up to the means of squares of 2^level. @param {Atlas} atlas @param {State} state @param {number} level */
  color(atlas, state, level) {
    const { gl, programs } = this, { width, height } = atlas;
    const isLit = state.show === "material";
    const key = isLit ? `${state.light} ${state.view} ${state.lights}` : state.show;
    if (key !== atlas.key) {
      atlas.key = key;
      atlas.made = 0;
      if (isLit || state.show === "clusters") {
        const colors = this.colorsOf(state), rows = Math.ceil(this.clusters.count / 256), padded = new Float32Array(1024 * rows);
        padded.set(colors);
        fill(gl, this.palette, 256, rows, gl.RGBA, gl.FLOAT, padded);
      }
    }
    gl.disable(gl.BLEND);
    for (; atlas.made <= level; atlas.made++) {
      const to = atlas.colors[atlas.made] ??= texture(gl, gl.RGBA16F, width, height);
      drawInto(gl, this.frame, [to]);
      if (atlas.made === 0) {
        const show = state.show === "source" ? 1 : state.show === "normals" ? 2 : 0;
        programs.color.use({ cluster: atlas.index, palette: this.palette, normal: this.normal }, {}, { show, size: [width, height] });
        programs.color.draw(width, height);
      } else {
        const step = 1 << atlas.made - 1;
        programs.average.use({ finer: atlas.colors[atlas.made - 1] }, {}, { size: [width, height], step_: step, wraps: atlas.wraps });
        programs.average.draw(width, height);
      }
    }
    return atlas.colors[level];
  }

  /** Whether the tile still stands in for the endless surface. @param {State} state */
  isBare(state) {
    return state.surface === "endless" && !!this.plane && this.ripe !== state.seed;
  }

  /** Makes a part of what the endless plane needs; whether there was something to make. */
  prepare() {
    if (!this.plane || this.tiles) return false;
    if (!this.plane.isReady) {
      this.plane.makeLevel();
      return true;
    }
    const synthesis = this.options.plain ? null : new Synthesis(this.gl, this.plane);
    this.tiles = new Tiles(this.gl, this.plane, synthesis);
    return true;
  }

  /**
   * How pixels lie on the surface.
   * @param {State} state @param {number} draft
   */
  geometry(state, draft) {
    const { canvas } = this, atlas = this.atlasOf(state);
    const width = Math.max(1, Math.round(canvas.width * draft)), height = Math.max(1, Math.round(canvas.height * draft));
    const ratio = canvas.width / Math.max(1, canvas.clientWidth) * draft, pixels = state.zoom * ratio;
    const turn = screenOf(state);
    const isFlat = state.shape === "plane", isEndless = state.surface === "endless" && !!this.plane;
    const [[a, b], [c, d]] = turn, determinant = a * d - b * c;
    // A texel's place for a pixel's: rows of the tile run downwards.
    const inverse = [[d / determinant, -b / determinant], [c / determinant, -a / determinant]];
    const footprint = isFlat ? Math.sqrt(1 / Math.abs(determinant)) / pixels : 1;
    const levels = isEndless && this.plane ? this.plane.facts.levels.length : 1 + Math.floor(Math.log2(Math.min(atlas.width, atlas.height)));
    const level = clamp(Math.floor(Math.log2(footprint)), 0, levels - 1), step = 2 ** level;
    const whole = state.at.map(place => Math.floor(place / step));
    const fraction = state.at.map((place, axis) => place / step - whole[axis]);
    const matrix = inverse.map(row => row.map(value => value / (pixels * step)));
    let reach;
    if (isFlat) reach = matrix.map(([x, y]) => (Math.abs(x) * width + Math.abs(y) * height) / 2 + 2);
    else {
      const far = { sphere: state.view[0] > 50 ? [2, 2] : [1.75, 1.75], box: [3.1, 0.85], cylinder: [2.1, 0.95] };
      reach = far[/** @type {"sphere"} */ (state.shape)].map(extent => extent * state.scale + 2);
    }
    const exemplar = isEndless && this.plane ? [this.plane.left, this.plane.top, this.plane.width, this.plane.height] : [0, 0, atlas.width, atlas.height];
    return { atlas, width, height, ratio, pixels, turn, isFlat, isEndless, levels, level, step, whole, fraction, matrix, reach, exemplar };
  }

  /**
   * Draws one more sample of a state, and shows their mean. Whether there is more to do for this state.
   * @param {State} state @param {boolean} isMoving
   */
  draw(state, isMoving) {
    const { gl, canvas } = this;
    let isMore = this.options.plain && isMoving ? true : this.work(state, isMoving);
    const draft = isMoving ? this.draft : 1;
    const seen = JSON.stringify([state, canvas.width, canvas.height, draft, this.aside, this.tiles?.last, !this.tiles]);
    if (seen !== this.seen) {
      this.seen = seen;
      this.samples = 0;
    }
    const wanted = isMoving ? 1 : SAMPLES[state.shape];
    if (this.samples < wanted) this.sample(state, draft, isMoving);
    this.present(state, draft);
    this.drawn++;
    return isMore || this.samples < wanted;
  }

  /** Makes what is missing of what is seen, a piece at a time. @param {State} state @param {boolean} isMoving */
  work(state, isMoving) {
    if (state.surface !== "endless" || !this.plane) return false;
    if (this.prepare()) return true;
    const { tiles } = this;
    if (!tiles) return false;
    tiles.plant(state.seed);
    const see = () => {
      const { level, whole, reach } = this.geometry(state, 1);
      tiles.see(level, Math.floor(whole[0] - reach[0]), Math.floor(whole[1] - reach[1]), Math.ceil(whole[0] + reach[0]), Math.ceil(whole[1] + reach[1]));
    };
    see();
    // While something moves, every other frame is kept free for it.
    if (isMoving && this.drawn % 2) return tiles.missing.length > 0;
    if (tiles.make()) see();
    if (!tiles.missing.length) this.ripe = state.seed;
    return tiles.missing.length > 0;
  }

  /** @param {State} state @param {number} draft @param {boolean} isMoving */
  sample(state, draft, isMoving) {
    const { gl, canvas } = this, size = `${canvas.width}x${canvas.height}`;
    if (size !== this.meanSize || !this.mean) {
      if (this.mean) gl.deleteTexture(this.mean);
      this.mean = texture(gl, gl.RGBA16F, canvas.width, canvas.height);
      this.meanSize = size;
    }
    // The first sample is that of the pixels' middles.
    const number = this.samples, jitter = number ? [halton(number, 2) - 0.5, halton(number, 3) - 0.5] : [0, 0];
    const program = this.surface(state, draft, jitter, !isMoving || state.shape === "plane", null);
    const { width, height } = this.geometry(state, draft);
    drawInto(gl, this.frame, [this.mean]);
    if (number) {
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA);
      gl.blendColor(0, 0, 0, 1 / (number + 1));
    } else gl.disable(gl.BLEND);
    program.draw(width, height);
    gl.disable(gl.BLEND);
    this.samples++;
  }

  /**
   * Sets up the program that draws the surface on its shape.
   * @param {State} state @param {number} draft @param {number[]} jitter @param {boolean} isSmooth
   * @param {[number, number] | null} pick the pixel whose texel is wanted instead of colours
   */
  surface(state, draft, jitter, isSmooth, pick) {
    const shown = this.geometry(state, draft), { atlas, isFlat, isEndless, level, step, whole, exemplar } = shown;
    const isLit = state.show === "material";
    const colors = isFlat || !isLit ? this.color(atlas, state, level) : this.tile.index;
    const middle = [shown.width, shown.height].map((side, axis) =>
      side / 2 + (isFlat ? 0 : this.aside[axis] * shown.ratio) - (pick ? pick[axis] : 0));
    const common = {
      surface: isEndless ? 0 : state.surface === "repeated" ? 1 : 2, level, levels: shown.levels, whole: whole.map(place => place | 0),
      period: whole.map((place, axis) => modulo(place * step - exemplar[axis], exemplar[2 + axis])), exemplar,
      smooth_: isSmooth, picks: !!pick,
    };
    const pieces = { pieces: this.tiles?.positions ?? this.empty, tables: this.tiles?.tables ?? this.empty };
    if (isFlat) {
      const [[a, b], [c, d]] = shown.matrix;
      this.programs.flat.use({ ...pieces, colors }, { fraction: shown.fraction, middle, jitter, matrix2: [a, c, b, d] }, common);
      return this.programs.flat;
    }
    const { textures, columns } = this.curvedTextures();
    const program = this.curved ??= new Program(this.gl, CURVED);
    const [x, y, z] = shown.turn, lights = this.lightsOf(state);
    /** @type {Record<string, number[] | number>} */
    const floats = {
      fraction: shown.fraction, middle, jitter, radius: shown.pixels * state.scale, texels: state.scale,
      // Columns of the inverse turn are its rows.
      matrix3: [x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]],
    };
    lights.forEach(({ direction, intensity }, n) => {
      floats[`light[${n}]`] = direction;
      floats[`intensity[${n}]`] = intensity;
    });
    program.use(
      { ...pieces, ...textures, cluster: atlas.index, colors: isLit ? this.normal : colors }, floats,
      { ...common, shape: ["plane", "sphere", "box", "cylinder"].indexOf(state.shape), lights: lights.length, columns, lightCount: this.clusters.lights, lit: isLit },
    );
    return program;
  }

  /** What curved shapes need beside the rest, made when the first is drawn. */
  curvedTextures() {
    if (this.curvedMade) return this.curvedMade;
    const { gl, clusters } = this, { count, views, lights } = clusters;
    const columns = Math.min(count, MOST_COLUMNS), rows = lights * Math.ceil(count / columns);
    this.fits(views, gl.MAX_ARRAY_TEXTURE_LAYERS);
    const values = layered(gl, clusters.isCoded ? gl.SRGB8 : gl.RGB9_E5, columns, rows, views);
    const samples = clusters.samples, part = clusters.isCoded ? new Uint8Array(3 * columns * rows) : new Uint32Array(columns * rows);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    for (let view = 0; view < views; view++) {
      for (let cluster = 0; cluster < count; cluster++)
        for (let light = 0; light < lights; light++) {
          const from = (cluster * views + view) * lights + light;
          const to = (Math.floor(cluster / columns) * lights + light) * columns + cluster % columns;
          if (clusters.isCoded) {
            part[3 * to] = samples[3 * from];
            part[3 * to + 1] = samples[3 * from + 1];
            part[3 * to + 2] = samples[3 * from + 2];
          } else part[to] = samples[from];
        }
      gl.bindTexture(gl.TEXTURE_2D_ARRAY, values);
      const type = clusters.isCoded ? gl.UNSIGNED_BYTE : gl.UNSIGNED_INT_5_9_9_9_REV;
      gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, view, columns, rows, 1, gl.RGB, type, part);
    }
    const cells = (/** @type {import("./directions.js").Cells | null} */ found) => {
      if (!found) throw new Unable("Curved shapes need directions all around the normal.");
      const table = texture(gl, gl.RGBA32F, 4, found.count), start = texture(gl, gl.R16UI, START_SIDE, START_SIDE);
      fill(gl, table, 4, found.count, gl.RGBA, gl.FLOAT, found.table);
      fill(gl, start, START_SIDE, START_SIDE, gl.RED_INTEGER, gl.UNSIGNED_SHORT, found.start);
      return [table, start];
    };
    const [viewCells, viewStart] = cells(this.viewCells), [lightCells, lightStart] = cells(this.lightCells);
    const lightVectors = texture(gl, gl.RGBA32F, lights, 1);
    fill(gl, lightVectors, lights, 1, gl.RGBA, gl.FLOAT, new Float32Array(this.lights.vectors.flatMap(vector => [...vector, 0])));
    return this.curvedMade = { textures: { values, viewCells, viewStart, lightCells, lightStart, lightVectors }, columns };
  }

  /** @param {State} state @param {number} draft */
  present(state, draft) {
    const { gl, canvas } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.BLEND);
    this.programs.present.use({ mean: this.mean }, { exposure: state.show === "material" ? 2 ** state.exposure : 1, scale: [draft, draft] });
    this.programs.present.draw(canvas.width, canvas.height);
  }

  /**
   * The texel of the tile that a pixel shows, column and row.
   * @param {State} state @param {number} x @param {number} y in pixels of the canvas from its top left corner
   */
  pick(state, x, y) {
    const { gl, canvas } = this;
    const program = this.surface(state, 1, [0, 0], false, [Math.floor(x), canvas.height - 1 - Math.floor(y)]);
    drawInto(gl, this.frame, [this.pickTarget]);
    gl.disable(gl.BLEND);
    program.draw(1, 1);
    const found = new Float32Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, found);
    const { width, height } = this.atlasOf(state);
    if (found[3] === 0 || found[0] < 0) return null;
    return [Math.min(found[0], width - 1), Math.min(found[1], height - 1)];
  }

  /** The canvas's pixels [y, x, rgba], the topmost row first. @param {State} state */
  pixels(state) {
    const { gl, canvas } = this, { width, height } = canvas, flipped = new Uint8Array(4 * width * height), rows = new Uint8Array(flipped.length);
    this.present(state, 1);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, flipped);
    for (let y = 0; y < height; y++) rows.set(flipped.subarray(4 * width * (height - 1 - y), 4 * width * (height - y)), 4 * width * y);
    return rows;
  }
}
