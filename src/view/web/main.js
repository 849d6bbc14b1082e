// The page: reads the material, and draws it whenever something changes.

import { readMaterial } from "./data.js";
import { Dome } from "./dome.js";
import { Gestures } from "./gestures.js";
import { Inspector } from "./inspector.js";
import { Panel, wordsOf } from "./panel.js";
import { Renderer, Unable } from "./renderer.js";
import { LIMITS, read, viewOf, within, written } from "./state.js";

/** @typedef {import("./state.js").State} State @typedef {import("./state.js").Shape} Shape */

/** How long after the last change something counts as moving, milliseconds. */
const MOVING = 160;

/** Frames slower than this are drawn with fewer pixels while something moves, milliseconds. */
const SLOW = 70;

/** @param {string} id */
const element = id => /** @type {HTMLElement} */ (document.getElementById(id));

/** Everything that is on the page. */
class Viewer {
  /** @param {import("./data.js").Material} material */
  constructor(material) {
    this.material = material;
    this.canvas = /** @type {HTMLCanvasElement} */ (element("picture"));
    this.renderer = new Renderer(this.canvas, material, { plain: new URLSearchParams(location.search).has("plain") });
    const { tile, enlarged, appearance } = material.header;
    const surfaces = wordsOf("surface").filter(word => word === "endless" ? appearance : word === "enlarged" ? enlarged : true);
    /** @type {Record<string, string[]>} */
    this.offered = {
      shape: this.renderer.curves ? wordsOf("shape") : ["plane"], surface: surfaces,
      show: wordsOf("show").filter(word => word !== "normals" || material.has("normals")),
    };
    const middle = enlarged ?? tile;
    /** @type {State} */
    this.first = {
      shape: "plane", surface: enlarged ? "enlarged" : appearance ? "endless" : tile.wraps ? "repeated" : "tile", show: "material",
      light: [42, 125], view: [0, 0], zoom: 2, at: [Math.floor(middle.width / 2), Math.floor(middle.height / 2)], scale: 200, exposure: 0, lights: 1, seed: 1,
    };
    /** @type {State} */
    this.state = this.allowed(read(location.hash, this.first));
    /** @type {import("./gestures.js").Drag} */
    this.drag = "light";
    this.changedAt = -Infinity;
    this.asked = false;
    this.isMore = true;
    this.lastFrame = 0;
    this.panel = new Panel(element("panel"), this.state, this.offered, (name, value) => this.choose(name, value));
    this.dome = new Dome(/** @type {SVGSVGElement} */ (document.querySelector("#dome")), light => {
      this.state.light = light;
      this.changed();
    }, () => this.rested());
    this.dome.mark(this.renderer.lights.vectors);
    this.inspector = new Inspector(this.renderer, element("inspector"));
    /** @type {[number, number] | null} */
    this.pointed = null;
    this.gestures = new Gestures(this.canvas, {
      state: () => this.state, drag: () => this.drag, least: () => this.leastZoom(), changed: () => this.changed(),
      rested: () => this.rested(), command: key => this.command(key),
      pointed: (x, y) => {
        this.pointed = [x, y];
        this.ask();
      },
    });
    this.describe();
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    this.resize();
    for (const button of document.querySelectorAll("button[data-act]"))
      button.addEventListener("click", () => this.act(/** @type {HTMLElement} */ (button).dataset.act ?? ""));
    addEventListener("hashchange", () => {
      this.state = this.allowed(read(location.hash, this.state));
      this.changed();
    });
    this.canvas.addEventListener("webglcontextlost", event => {
      event.preventDefault();
      notice("The graphics was taken away from this page.", true);
    });
    this.changed();
  }

  /** Says what is shown, on the page and to those who do not see it. */
  describe() {
    const { name, tile } = this.material.header, { count, views, lights } = this.renderer.clusters;
    element("name").textContent = name;
    element("facts").textContent = `${count} measured reflectances, ${views} views × ${lights} lights, tile of ${tile.width} × ${tile.height} texels`;
    this.canvas.setAttribute("aria-label", `${name}: a picture of the material that you can light, turn and walk over. Arrow keys move the light.`);
  }

  /** A state of what this material has. @param {State} state @returns {State} */
  allowed(state) {
    for (const name of /** @type {const} */ (["shape", "surface", "show"]))
      if (!this.offered[name].includes(state[name])) Object.assign(state, { [name]: this.first[name] });
    if (state.shape === "plane") state.view = [Math.min(state.view[0], 78), state.view[1]];
    return state;
  }

  /** The smallest zoom that still has levels, or that shows all there is. */
  leastZoom() {
    const levels = this.material.header.appearance?.levels.length ?? 0;
    if (this.state.shape !== "plane") return 0.02;
    return this.state.surface === "endless" ? Math.max(LIMITS.zoom[0], 2 ** -(levels - 2)) : LIMITS.zoom[0];
  }

  /** A zoom at which a shape fills the picture well. @param {Shape} shape */
  fitting(shape) {
    const [x, y] = this.renderer.aside;
    const side = Math.min(this.canvas.clientWidth - 2 * Math.abs(x), this.canvas.clientHeight - 2 * Math.abs(y));
    return shape === "plane" ? this.first.zoom : (shape === "sphere" ? 0.41 : 0.34) * side / this.state.scale;
  }

  /** @param {string} name @param {string} value */
  choose(name, value) {
    const { state } = this;
    if (name === "drag") this.drag = /** @type {import("./gestures.js").Drag} */ (value);
    else if (name === "lights") state.lights = Number(value);
    else if (name === "exposure") state.exposure = within(Number(value), LIMITS.exposure);
    else if (name === "scale") {
      const scale = within(2 ** Number(value), LIMITS.scale);
      state.zoom *= state.scale / scale;
      state.scale = scale;
    } else if (name === "shape") {
      // The unlit side of a curved shape is black: a second light shows it.
      if ((state.shape === "plane") !== (value === "plane")) state.lights = value === "plane" ? 1 : 2;
      state.shape = /** @type {Shape} */ (value);
      state.view = viewOf(state.shape);
      state.zoom = this.fitting(state.shape);
    } else Object.assign(state, { [name]: value });
    this.changed();
    this.rested();
  }

  /** What a key of its own does; whether there is such a one. @param {string} key */
  command(key) {
    const number = Number(key) - 1, next = (/** @type {string} */ name) => {
      const words = this.offered[name], at = words.indexOf(/** @type {any} */ (this.state)[name]);
      this.choose(name, words[(at + 1) % words.length]);
    };
    if (this.offered.shape[number]) this.choose("shape", this.offered.shape[number]);
    else if (key === "l") this.drag = "light";
    else if (key === "t") this.drag = "turn";
    else if (key === "m") this.drag = "move";
    else if (key === "f") next("show");
    else if (key === "u") next("surface");
    else if (key === "n") this.act("another");
    else if (key === "p") this.act("save");
    else return false;
    return true;
  }

  /** @param {string} name */
  act(name) {
    if (name === "another" && this.state.surface === "endless") this.state.seed = (this.state.seed + 1) % 2 ** 32;
    else if (name === "reset") {
      const { shape, surface } = this.state;
      this.state = { ...this.first, shape, surface, view: viewOf(shape), at: [...this.first.at], light: [...this.first.light] };
      this.state.zoom = this.fitting(shape);
    } else if (name === "save") this.save();
    else if (name === "panel") {
      const isOpen = document.body.classList.toggle("open");
      const toggle = element("toggle");
      toggle.setAttribute("aria-expanded", String(isOpen));
      toggle.textContent = isOpen ? "Close" : "Controls";
      this.stand();
      if (this.state.shape !== "plane") this.state.zoom = this.fitting(this.state.shape);
    }
    this.changed();
    this.rested();
  }

  /** The picture as a file. */
  save() {
    this.renderer.present(this.state, 1);
    this.canvas.toBlob(blob => {
      if (!blob) return;
      const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: `${this.material.header.name}.png` });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }

  /** Stands a curved shape in the middle of what the controls leave free. */
  stand() {
    const panel = element("panel"), isWide = innerWidth > 640;
    const isOpen = document.body.classList.contains("open");
    this.renderer.aside = isWide ? [-panel.offsetWidth / 2, 0] : [0, isOpen ? panel.offsetHeight / 2 : 0];
  }

  resize() {
    this.stand();
    const ratio = Math.min(devicePixelRatio, 2), { clientWidth, clientHeight } = this.canvas;
    const [width, height] = [clientWidth, clientHeight].map(side => Math.max(1, Math.round(side * ratio)));
    if (width === this.canvas.width && height === this.canvas.height) return;
    Object.assign(this.canvas, { width, height });
    if (!/zoom=/.test(location.hash) && this.state.shape !== "plane") this.state.zoom = this.fitting(this.state.shape);
    this.ask();
  }

  /** Something of the state is another. */
  changed() {
    this.changedAt = performance.now();
    this.panel.show(this.state, this.drag);
    this.dome.show(this.state.light);
    this.ask();
  }

  /** A movement is over: the address tells where. */
  rested() {
    history.replaceState(null, "", `#${written(this.state)}`);
  }

  ask() {
    this.isMore = true;
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => this.frame());
  }

  frame() {
    this.asked = false;
    const now = performance.now(), isMoving = now - this.changedAt < MOVING, { renderer } = this;
    if (isMoving && now - this.lastFrame < 1000) {
      if (now - this.lastFrame > SLOW) renderer.draft = 0.5;
      else if (now - this.lastFrame < SLOW / 4) renderer.draft = 1;
    }
    this.lastFrame = now;
    try {
      this.isMore = renderer.draw(this.state, isMoving) || isMoving;
      if (!isMoving && this.pointed) {
        const ratio = this.canvas.width / this.canvas.clientWidth, [x, y] = this.pointed;
        this.pointed = null;
        element("inspector").hidden = !this.inspector.tell(this.state, x * ratio, y * ratio);
      }
    } catch (error) {
      if (!renderer.gl.isContextLost()) notice(String(error instanceof Error ? error.message : error), true);
      this.isMore = false;
      document.body.dataset.state = "failed";
      return;
    }
    document.body.dataset.state = this.isMore ? "working" : "ready";
    const isBare = renderer.isBare(this.state);
    if (isBare !== document.body.classList.contains("bare")) {
      document.body.classList.toggle("bare", isBare);
      notice(isBare ? "Computing the surface…" : "", false);
    }
    if (this.isMore) this.ask();
  }
}

/** @param {string} text @param {boolean} isWrong */
function notice(text, isWrong) {
  const place = element("notice");
  place.textContent = text;
  place.hidden = !text;
  if (isWrong) document.body.dataset.state = "failed";
}

try {
  if (!("DecompressionStream" in window)) throw new Unable("This browser is too old: a current one draws the material.");
  const viewer = new Viewer(await readMaterial(element("material")));
  // For tests, and for pages that hold this one.
  Object.assign(window, { viewer });
  notice("", false);
} catch (error) {
  notice(error instanceof Error ? error.message : String(error), true);
}
