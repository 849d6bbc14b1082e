// The controls beside the picture: ordinary form elements, which the state and they keep equal.

import { CHOICES } from "./state.js";
import { inDegrees, told } from "./dome.js";

/** @typedef {import("./state.js").State} State */

/** Words for what a choice is. @type {Record<string, Record<string, string>>} */
const WORDS = {
  shape: { plane: "Plane", sphere: "Sphere", box: "Box", cylinder: "Cylinder" },
  surface: { endless: "Endless", repeated: "Repeated", tile: "Tile", enlarged: "Enlarged" },
  show: { material: "Material", clusters: "Clusters", source: "Source", normals: "Normals" },
  drag: { light: "Light", turn: "Turn", move: "Move" },
  lights: { 1: "One", 2: "Two", 3: "Three" },
};

/** What they say when the pointer rests on them. @type {Record<string, string>} */
const HINTS = {
  endless: "A surface that never repeats and never ends, made as you move", repeated: "The tile side by side, as most programs do",
  tile: "The tile as it was cut from the measurement", enlarged: "The enlargement that was opened",
  clusters: "Which of the measured reflectances a texel has, coloured from dark to light",
  source: "Where in the tile each texel comes from", normals: "The normals, as estimated from the measurement",
};

/** Makes the controls of the page. */
export class Panel {
  /**
   * @param {HTMLElement} element @param {State} state
   * @param {Record<string, string[]>} offered words of each choice that this material has
   * @param {(name: string, value: string) => void} choose
   */
  constructor(element, state, offered, choose) {
    this.element = element;
    for (const name of Object.keys(WORDS)) {
      const group = /** @type {HTMLElement} */ (element.querySelector(`[data-choice=${name}]`));
      const words = offered[name] ?? Object.keys(WORDS[name]);
      group.hidden = words.length < 2;
      for (const word of words) {
        const label = document.createElement("label"), input = document.createElement("input");
        Object.assign(input, { type: "radio", name, value: word });
        if (HINTS[word]) label.title = HINTS[word];
        label.append(input, Object.assign(document.createElement("span"), { textContent: WORDS[name][word] }));
        group.querySelector("div")?.append(label);
      }
    }
    element.addEventListener("input", event => {
      const input = /** @type {HTMLInputElement} */ (event.target);
      if (input.name) choose(input.name, input.value);
    });
    this.show(state, "light");
  }

  /** Shows a state. @param {State} state @param {string} drag */
  show(state, drag) {
    const values = /** @type {Record<string, string>} */ ({
      shape: state.shape, surface: state.surface, show: state.show, lights: String(state.lights), drag,
    });
    for (const [name, value] of Object.entries(values)) {
      const input = /** @type {HTMLInputElement | null} */ (this.element.querySelector(`input[name=${name}][value="${value}"]`));
      if (input) input.checked = true;
    }
    this.range("exposure", state.exposure, `${state.exposure > 0 ? "+" : ""}${state.exposure.toFixed(1)} stops`);
    this.range("scale", Math.log2(state.scale), `${Math.round(state.scale)} texels`);
    /** @type {HTMLElement} */ (this.element.querySelector("[data-of=scale]")).hidden = state.shape === "plane";
    /** @type {HTMLButtonElement} */ (this.element.querySelector("[data-act=another]")).hidden = state.surface !== "endless";
    /** @type {HTMLElement} */ (this.element.querySelector("[data-light]")).textContent = `Light ${told(state.light)} ${inDegrees(state.light)}`;
  }

  /** @param {string} name @param {number} value @param {string} text */
  range(name, value, text) {
    const input = /** @type {HTMLInputElement} */ (this.element.querySelector(`input[name=${name}]`));
    input.value = String(value);
    input.setAttribute("aria-valuetext", text);
    /** @type {HTMLElement} */ (this.element.querySelector(`output[for=${name}]`)).textContent = text;
  }
}

/** The words of a choice. @param {"shape" | "surface" | "show"} name */
export const wordsOf = name => CHOICES[name];
