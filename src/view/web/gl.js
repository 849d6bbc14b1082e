// Small helpers for WebGL 2.

/** @typedef {WebGL2RenderingContext} GL */

/** A full-screen triangle. */
const COVER = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID % 2, gl_VertexID / 2) * 4.0 - 1.0, 0, 1); }`;

const PRECISION = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp isampler2D;
precision highp isampler2DArray;
precision highp usampler2D;
`;

/** A fragment program with its uniforms by name. */
export class Program {
  /** @param {GL} gl @param {string} source of the fragments, without its head */
  constructor(gl, source) {
    this.gl = gl;
    const program = this.program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, COVER], [gl.FRAGMENT_SHADER, PRECISION + source]]) {
      const shader = /** @type {WebGLShader} */ (gl.createShader(Number(type)));
      gl.shaderSource(shader, String(text));
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    this.linked = false;
    /** @type {Map<string, WebGLUniformLocation | null>} */
    this.places = new Map();
  }

  /**
   * Makes it the current one; only now is the compiler waited for.
   * @param {Record<string, WebGLTexture | null>} textures by the names of their samplers
   * @param {Record<string, number | boolean | number[] | Int32Array>} [numbers] floats by their names
   * @param {Record<string, number | boolean | number[] | Int32Array>} [integers] whole ones by theirs
   */
  use(textures, numbers = {}, integers = {}) {
    const { gl, program } = this;
    if (!this.linked) {
      if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
        const told = (gl.getAttachedShaders(program) ?? []).map(shader => gl.getShaderInfoLog(shader)).join("\n");
        throw new Error(`The graphics driver refuses a shader. ${gl.getProgramInfoLog(program)} ${told}`);
      }
      this.linked = true;
    }
    gl.useProgram(program);
    let unit = 0;
    for (const [name, texture] of Object.entries(textures)) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(kinds.get(/** @type {WebGLTexture} */ (texture)) ?? gl.TEXTURE_2D, texture);
      gl.uniform1i(this.place(name), unit++);
    }
    for (const [name, value] of Object.entries(numbers)) {
      const list = typeof value === "object" ? [...value] : [Number(value)];
      if (name.startsWith("matrix2")) gl.uniformMatrix2fv(this.place(name), false, list);
      else if (name.startsWith("matrix3")) gl.uniformMatrix3fv(this.place(name), false, list);
      else gl[/** @type {"uniform1fv"} */ (`uniform${list.length > 4 ? 4 : list.length}fv`)](this.place(name), list);
    }
    for (const [name, value] of Object.entries(integers)) {
      const list = typeof value === "object" ? [...value] : [Number(value)];
      gl[/** @type {"uniform1iv"} */ (`uniform${list.length}iv`)](this.place(name), list);
    }
  }

  /** @param {string} name */
  place(name) {
    if (!this.places.has(name)) this.places.set(name, this.gl.getUniformLocation(this.program, name));
    return this.places.get(name) ?? null;
  }

  /** Draws into what is bound. @param {number} width @param {number} height @param {number} [x] @param {number} [y] */
  draw(width, height, x = 0, y = 0) {
    this.gl.viewport(x, y, width, height);
    this.gl.drawArrays(this.gl.TRIANGLES, 0, 3);
  }
}

/** Which textures are arrays. @type {WeakMap<WebGLTexture, number>} */
const kinds = new WeakMap();

/**
 * A texture that is read texel by texel.
 * @param {GL} gl @param {number} format @param {number} width @param {number} height
 */
export function texture(gl, format, width, height) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  plain(gl, gl.TEXTURE_2D);
  return made;
}

/**
 * The same in layers.
 * @param {GL} gl @param {number} format @param {number} width @param {number} height @param {number} layers
 */
export function layered(gl, format, width, height, layers) {
  const made = gl.createTexture();
  kinds.set(made, gl.TEXTURE_2D_ARRAY);
  gl.bindTexture(gl.TEXTURE_2D_ARRAY, made);
  gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, format, width, height, layers);
  plain(gl, gl.TEXTURE_2D_ARRAY);
  return made;
}

/** @param {GL} gl @param {number} target */
function plain(gl, target) {
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, filter, gl.NEAREST);
  for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, wrap, gl.CLAMP_TO_EDGE);
}

/**
 * Values into a part of a texture.
 * @param {GL} gl @param {WebGLTexture} to @param {number} width @param {number} height @param {number} format
 * @param {number} type @param {ArrayBufferView} values
 */
export function fill(gl, to, width, height, format, type, values) {
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.bindTexture(gl.TEXTURE_2D, to);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, format, type, values);
}

/**
 * Makes textures the ones that are drawn into.
 * @param {GL} gl @param {WebGLFramebuffer} frame @param {WebGLTexture[]} textures
 */
export function drawInto(gl, frame, textures) {
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  for (let n = 0; n < 4; n++)
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + n, gl.TEXTURE_2D, textures[n] ?? null, 0);
  gl.drawBuffers(textures.map((_, n) => gl.COLOR_ATTACHMENT0 + n));
}
