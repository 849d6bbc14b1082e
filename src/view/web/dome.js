// The half-sphere of lights as a disc: its middle is the normal, its rim the horizon; the light is a handle on it.

/** @typedef {[number, number]} Angles theta from the normal and phi counter-clockwise from the right, degrees */

/** Where a direction lies on the disc of radius 1; up is up. @param {Angles} angles @returns {[number, number]} */
export function onDisc([theta, phi]) {
  const p = phi * Math.PI / 180;
  return [theta / 90 * Math.cos(p), theta / 90 * Math.sin(p)];
}

/** The direction at a place of the disc; from beyond its rim, that on the rim. @param {number} x @param {number} y @param {number} [most] theta @returns {Angles} */
export function fromDisc(x, y, most = 88) {
  const theta = Math.min(90 * Math.hypot(x, y), most);
  return [theta, (Math.atan2(y, x) * 180 / Math.PI + 360) % 360];
}

/** Directions as words, counter-clockwise from the right. */
const SIDES = ["right", "top right", "top", "top left", "left", "bottom left", "bottom", "bottom right"];

/** @param {Angles} angles */
export function told([theta, phi]) {
  if (theta < 3) return "from straight above";
  return `${Math.round(90 - theta)}° above the surface, from the ${SIDES[Math.round(phi / 45) % 8]}`;
}

/** The angles as the options of `btf image` and `btf render` take them. @param {Angles} angles */
export const inDegrees = ([theta, phi]) => `(theta ${Math.round(theta)}°, phi ${(Math.round(phi) % 360 + 360) % 360}°)`;

/** The widget. */
export class Dome {
  /** @param {SVGSVGElement} svg @param {(light: Angles) => void} move @param {() => void} rest when it is let go */
  constructor(svg, move, rest) {
    this.svg = svg;
    this.handle = /** @type {SVGGElement} */ (svg.querySelector("[data-handle]"));
    /** @type {Angles} */
    this.light = [0, 0];
    const follow = (/** @type {PointerEvent} */ event) => {
      const { left, top, width, height } = svg.getBoundingClientRect(), radius = width / 2.3;
      move(fromDisc((event.clientX - left - width / 2) / radius, (top + height / 2 - event.clientY) / radius));
    };
    svg.addEventListener("pointerdown", event => {
      svg.setPointerCapture(event.pointerId);
      follow(event);
    });
    svg.addEventListener("pointermove", event => {
      if (svg.hasPointerCapture(event.pointerId)) follow(event);
    });
    svg.addEventListener("lostpointercapture", rest);
    svg.addEventListener("keydown", event => {
      const step = /** @type {Record<string, [number, number]>} */ ({ ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] })[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      const [x, y] = onDisc(this.light), size = event.shiftKey ? 0.15 : 0.04;
      move(fromDisc(x + size * step[0], y + size * step[1]));
    });
  }

  /** Dots where lights were measured. @param {[number, number, number][]} vectors */
  mark(vectors) {
    const group = /** @type {SVGGElement} */ (this.svg.querySelector("[data-measured]"));
    if (vectors.length > 400) return;
    for (const [x, y, z] of vectors) {
      const theta = Math.acos(Math.min(z, 1)) * 180 / Math.PI, [u, v] = onDisc([theta, Math.atan2(y, x) * 180 / Math.PI]);
      const dot = /** @type {SVGCircleElement} */ (this.handle.querySelector("circle")?.cloneNode());
      for (const [name, value] of [["cx", u], ["cy", -v], ["r", 0.014]]) dot.setAttribute(String(name), String(value));
      group.append(dot);
    }
  }

  /** @param {Angles} light */
  show(light) {
    this.light = light;
    const [x, y] = onDisc(light);
    this.handle.setAttribute("transform", `translate(${x} ${-y})`);
    this.svg.setAttribute("aria-valuenow", String(Math.round(90 - light[0])));
    this.svg.setAttribute("aria-valuetext", told(light));
  }
}
