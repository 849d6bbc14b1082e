// Pointers, wheel and keys on the picture.

import { fromDisc, onDisc } from "./dome.js";
import { LIMITS, viewOf, within } from "./state.js";
import { screenOf } from "./renderer.js";

/** @typedef {import("./state.js").State} State @typedef {"light" | "turn" | "move"} Drag */

/** Steepest view of the plane. */
const STEEPEST = 78;

/** Moves the light by so many pixels. @param {State} state @param {number} dx @param {number} dy @param {number} side */
export function moveLight(state, dx, dy, side) {
  const [x, y] = onDisc(state.light);
  state.light = fromDisc(x + dx / (0.45 * side), y - dy / (0.45 * side));
}

/** Turns the surface, or the shape. @param {State} state @param {number} dx @param {number} dy @param {number} side */
export function turn(state, dx, dy, side) {
  // The direction that is seen moves against the pointer, in the frame of the screen.
  const [right, up, towards] = screenOf(state), size = 2.4 / side;
  const view = towards.map((value, axis) => value - dx * size * right[axis] + dy * size * up[axis]);
  const length = Math.hypot(...view), most = state.shape === "plane" ? STEEPEST : LIMITS.theta[1];
  const theta = Math.acos(Math.min(1, Math.max(-1, view[2] / length))) * 180 / Math.PI;
  state.view = [within(theta, [0, most]), (Math.atan2(view[1], view[0]) * 180 / Math.PI + 360) % 360];
}

/** Moves along the surface by so many pixels. @param {State} state @param {number} dx @param {number} dy */
export function move(state, dx, dy) {
  let [x, y] = [dx, dy];
  if (state.shape === "plane") {
    const [[a, b], [c, d]] = screenOf(state), determinant = a * d - b * c;
    [x, y] = [(d * dx + b * dy) / determinant, (c * dx + a * dy) / determinant];
  }
  state.at = [within(state.at[0] - x / state.zoom, LIMITS.at), within(state.at[1] - y / state.zoom, LIMITS.at)];
}

/** Zooms about a point, pixels from the middle. @param {State} state @param {number} factor @param {number} x @param {number} y @param {number} least */
export function zoomAbout(state, factor, x, y, least) {
  const zoom = within(state.zoom * factor, [least, LIMITS.zoom[1]]);
  if (state.shape === "plane") {
    move(state, -x, -y);
    state.zoom = zoom;
    move(state, x, y);
  } else state.zoom = zoom;
}

/** Listens to a canvas, and says what changed. */
export class Gestures {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {{ state: () => State, drag: () => Drag, least: () => number, changed: () => void, rested: () => void,
   *   pointed: (x: number, y: number) => void, command: (key: string) => boolean }} to
   */
  constructor(canvas, to) {
    this.canvas = canvas;
    this.to = to;
    /** @type {Map<number, { x: number, y: number }>} */
    this.pointers = new Map();
    /** @type {Drag} */
    this.drag = "light";
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("pointerdown", event => this.down(event));
    canvas.addEventListener("pointermove", event => this.moved(event));
    for (const name of /** @type {const} */ (["pointerup", "pointercancel"])) canvas.addEventListener(name, event => this.up(event));
    canvas.addEventListener("wheel", event => this.wheel(event), { passive: false });
    canvas.addEventListener("keydown", event => this.key(event));
  }

  /** The shorter side of the picture. */
  get side() {
    return Math.min(this.canvas.clientWidth, this.canvas.clientHeight);
  }

  /** @param {PointerEvent} event */
  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true });
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (event.button === 2 || event.shiftKey) this.drag = "turn";
    else if (event.button === 1 || event.ctrlKey || event.altKey) this.drag = "move";
    else this.drag = this.to.drag();
    if (event.button === 1) event.preventDefault();
    this.canvas.dataset.drag = this.drag;
  }

  /** @param {PointerEvent} event */
  moved(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) {
      const { left, top } = this.canvas.getBoundingClientRect();
      this.to.pointed(event.clientX - left, event.clientY - top);
      return;
    }
    const now = { x: event.clientX, y: event.clientY }, state = this.to.state();
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const { left, top, width, height } = this.canvas.getBoundingClientRect();
      const spread = (/** @type {{ x: number, y: number }} */ place) => Math.hypot(place.x - other.x, place.y - other.y);
      move(state, (now.x - before.x) / 2, (now.y - before.y) / 2);
      zoomAbout(state, spread(now) / Math.max(1, spread(before)), (now.x + other.x) / 2 - left - width / 2, (now.y + other.y) / 2 - top - height / 2, this.to.least());
    } else if (this.pointers.size === 1) {
      const [dx, dy] = [now.x - before.x, now.y - before.y];
      if (this.drag === "light") moveLight(state, dx, dy, this.side);
      else if (this.drag === "turn") turn(state, dx, dy, this.side);
      else move(state, dx, dy);
    }
    this.pointers.set(event.pointerId, now);
    this.to.changed();
  }

  /** @param {PointerEvent} event */
  up(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    if (this.pointers.size === 0) {
      delete this.canvas.dataset.drag;
      this.to.rested();
      if (event.pointerType === "touch") {
        const { left, top } = this.canvas.getBoundingClientRect();
        this.to.pointed(event.clientX - left, event.clientY - top);
      }
    }
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const pixels = event.deltaMode === 1 ? 30 * event.deltaY : event.deltaY;
    const factor = Math.exp(-Math.max(-240, Math.min(240, pixels)) / (event.ctrlKey ? 120 : 400));
    zoomAbout(this.to.state(), factor, event.clientX - left - width / 2, event.clientY - top - height / 2, this.to.least());
    this.to.changed();
    this.to.rested();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey) return;
    const state = this.to.state(), side = this.side;
    const arrow = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] })[event.key];
    if (arrow) {
      const [dx, dy] = arrow;
      if (event.altKey) move(state, -48 * dx, -48 * dy);
      else if (event.shiftKey) turn(state, side / 40 * dx, side / 40 * dy, side);
      else moveLight(state, side / 50 * dx, side / 50 * dy, side);
    } else if (event.key === "+" || event.key === "=") zoomAbout(state, 1.25, 0, 0, this.to.least());
    else if (event.key === "-") zoomAbout(state, 0.8, 0, 0, this.to.least());
    else if (event.key === "0") state.view = viewOf(state.shape);
    else if (!this.to.command(event.key)) return;
    event.preventDefault();
    this.to.changed();
    this.to.rested();
  }
}
