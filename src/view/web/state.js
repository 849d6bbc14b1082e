// What is seen, and how it is written in the address.

/**
 * @typedef {"plane" | "sphere" | "box" | "cylinder"} Shape
 * @typedef {"endless" | "repeated" | "tile" | "enlarged"} Surface
 * @typedef {"material" | "clusters" | "source" | "normals"} Show
 * @typedef {{ shape: Shape, surface: Surface, show: Show, light: [number, number], view: [number, number], zoom: number,
 *   at: [number, number], scale: number, exposure: number, lights: number, seed: number }} State
 *   light and view in degrees, theta from the normal and phi counter-clockwise; zoom in pixels a texel; at, the texel in
 *   the middle, column and row; scale, the texels that a curved shape's radius is long; exposure in stops
 */

/** Values that a word may have. */
export const CHOICES = {
  shape: ["plane", "sphere", "box", "cylinder"],
  surface: ["endless", "repeated", "tile", "enlarged"],
  show: ["material", "clusters", "source", "normals"],
};

/** Least and most of each number. */
export const LIMITS = {
  zoom: [1 / 64, 64], scale: [40, 800], exposure: [-4, 4], lights: [1, 3], seed: [0, 2 ** 32 - 1], theta: [0, 150], at: [-(2 ** 30), 2 ** 30],
};

/** How a shape is shown at first. @param {Shape} shape @returns {[number, number]} */
export function viewOf(shape) {
  return shape === "box" ? [42, 140] : shape === "cylinder" ? [24, 90] : [0, 0];
}

/** @param {number} number @param {number[]} limits */
export const within = (number, [low, high]) => Math.min(Math.max(number, low), high);

/** @param {State} state */
export function written(state) {
  const round = (/** @type {number} */ number) => String(Number(number.toPrecision(7)));
  const parts = Object.entries(state).map(([name, value]) =>
    `${name}=${Array.isArray(value) ? value.map(round).join(",") : typeof value === "number" ? round(value) : value}`);
  return parts.join("&");
}

/**
 * A state with what an address says of it; what it says wrongly is as it was.
 * @param {string} address @param {State} state @returns {State}
 */
export function read(address, state) {
  /** @type {Record<string, any>} */
  const found = { ...state };
  for (const part of address.replace(/^#/, "").split("&")) {
    const [name, text] = part.split("=");
    if (!text || !(name in found)) continue;
    if (name in CHOICES) {
      if (CHOICES[/** @type {keyof CHOICES} */ (name)].includes(text)) found[name] = text;
      continue;
    }
    const numbers = text.split(",").map(Number);
    if (!numbers.every(Number.isFinite) || numbers.length !== (Array.isArray(found[name]) ? 2 : 1)) continue;
    if (name === "at") found.at = numbers.map(number => within(number, LIMITS.at));
    else if (name === "light") found.light = [within(numbers[0], [0, 90]), numbers[1] % 360];
    else if (name === "view") found.view = [within(numbers[0], LIMITS.theta), numbers[1] % 360];
    else {
      const number = within(numbers[0], LIMITS[/** @type {"zoom"} */ (name)]);
      found[name] = name === "seed" || name === "lights" ? Math.round(number) : number;
    }
  }
  return /** @type {State} */ (found);
}
