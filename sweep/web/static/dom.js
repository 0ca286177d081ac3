// Elements, icons and numbers, of which all parts of the page are made. Text is set as
// text, never as HTML.

/** @import { Value } from "./protocol.d.ts" */

const PICTURES = {
  play: "M7 4.5v15l12.5-7.5z",
  pause: "M6.5 5h4v14h-4zM13.5 5h4v14h-4z",
  step: "M5 4.5v15l10-7.5zM17 5h2.5v14H17z",
  reset: "M4.5 13a7.5 7.5 0 1 0 2-6L4 9.5M4 4.5v5h5",
  forward: "M4 5v14l8-7zM12.5 5v14l8-7z",
  select: "M6 3.5l12.5 8.2-6 1.3-3 6z",
  disc: "M12 4.5a7.5 7.5 0 1 0 .01 0z",
  rectangle: "M4 6.5h16v11H4z",
  goal: "M6 21V4h11.5l-3 4 3 4H6",
  world: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  flock: "M12 3v4M12 17v4M3 12h4M17 12h4M12 8.5a3.5 3.5 0 1 0 .01 0z",
  undo: "M9 5L4 10l5 5M4 10h10a5.5 5.5 0 0 1 0 11h-3",
  redo: "M15 5l5 5-5 5M20 10H10a5.5 5.5 0 0 0 0 11h3",
  beside: "M4 5h6.5v14H4zM13.5 5H20v14h-6.5z",
  remove: "M6 6l12 12M18 6L6 18",
  range: "M4 7v10M20 7v10M4 12h16",
  plus: "M12 5v14M5 12h14",
  copy: "M8.5 8.5h11v12h-11zM15.5 8.5v-5h-11v12h4",
  save: "M12 4v11M7 10.5l5 5 5-5M4.5 20h15",
  keys: "M3 6.5h18v11H3zM7 10h.01M12 10h.01M17 10h.01M8 14h8",
  chart: "M4 4v16h16M7.5 15l4-5 3.5 3 4.5-7",
  before: "M15 5l-7 7 7 7",
  after: "M9 5l7 7-7 7",
  settings: "M4 5h16v14H4zM15 5v14",
  watch: "M4 5h16v14H4zM9 5v14",
  present: "M3 4h18M5 4v11h14V4M12 15v5M8 20h8",
};
/** @typedef {keyof typeof PICTURES} Picture */
const FILLED = ["play", "pause", "step", "forward"];

/**
 * What an element is made with: its own properties, attributes, and its listeners.
 *
 * @template E
 * @typedef {{ [K in keyof E]?: E[K] }
 *   & { [attribute: `aria-${string}`]: string }
 *   & { on?: Record<string, () => void> }} Properties
 */

/**
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {Properties<HTMLElementTagNameMap[T]>} properties
 * @param {(Node | string)[]} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  dress(element, properties);
  element.append(...children);
  return element;
}

/**
 * @template {HTMLElement} E
 * @param {E} element
 * @param {Properties<E>} properties
 */
function dress(element, { on = {}, ...others }) {
  for (const [event, act] of Object.entries(on)) element.addEventListener(event, act);
  for (const [name, value] of Object.entries(others)) {
    if (name in element) Object.assign(element, { [name]: value });
    else element.setAttribute(name, String(value));
  }
}

/** @param {Picture} name */
export function icon(name) {
  const space = "http://www.w3.org/2000/svg";
  const picture = document.createElementNS(space, "svg");
  const line = document.createElementNS(space, "path");
  picture.setAttribute("viewBox", "0 0 24 24");
  picture.setAttribute("aria-hidden", "true");
  picture.setAttribute("focusable", "false");
  picture.classList.toggle("filled", FILLED.includes(name));
  line.setAttribute("d", PICTURES[name]);
  picture.append(line);
  return picture;
}

// A button with an icon; `label` is its name for everyone, `words` those that stand
// beside the icon.
/**
 * @param {Picture} picture
 * @param {string} label
 * @param {() => void} act
 * @param {string} words
 * @param {Properties<HTMLButtonElement>} properties
 */
export function button(picture, label, act, words = "", properties = {}) {
  const one = make("button", { type: "button", title: label, on: { click: act } });
  one.append(icon(picture));
  if (words) one.append(make("span", { textContent: words }));
  if (words !== label) one.setAttribute("aria-label", label);
  dress(one, properties);
  return one;
}

/** @param {HTMLElement} element @param {Picture} name @param {string} label */
export function setIcon(element, name, label) {
  element.firstChild?.replaceWith(icon(name));
  element.title = label;
  element.setAttribute("aria-label", label);
}

// A page has randomUUID only if it comes from this machine or by https. A notebook may
// come by http.
export const randomName = () =>
  Array.from(crypto.getRandomValues(new Uint32Array(4)), (part) => part.toString(36))
    .join("-");

/** @param {string} name */
export const spaced = (name) => name.replaceAll("_", " ");

/** @type {Record<string, string>} */
const RAISED = { 2: "²", 3: "³", 4: "⁴" };
/** @param {string} [unit] */
export const unitText = (unit = "") =>
  unit.replace(/\^([234])/g, (_, power) => RAISED[power]);

// A number as people read it: at most `digits` significant ones.
/** @param {Value | null | undefined} value @param {number} digits */
export function short(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (typeof value !== "number") return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) {
    return value.toExponential(digits - 2).replace("e+", "e");
  }
  return String(Number(value.toPrecision(digits)));
}

/** @param {Value} value */
export const asNumber = (value) =>
  Number(typeof value === "string" ? value.replace("inf", "Infinity") : value);

// Calls `act` at once and then at most every `wait` ms, the last call always.
/**
 * @template {unknown[]} A
 * @param {(...given: A) => void} act
 * @param {number} wait
 */
export function paced(act, wait) {
  let timer = 0;
  /** @type {A | null} */
  let latest = null;
  const fire = () => {
    timer = 0;
    if (latest) {
      const given = latest;
      latest = null;
      timer = setTimeout(fire, wait);
      act(...given);
    }
  };
  /** @param {A} given */
  return (...given) => {
    latest = given;
    if (!timer) fire();
  };
}

// Red, green and blue of a colour as a browser gives it: rgb(0, 0, 0).
/** @param {string} colour */
export const partsOf = (colour) =>
  Array.from(colour.matchAll(/[\d.]+/g), ([part]) => Number(part));

// A colour of the style sheet as a canvas takes it, which knows no light-dark().
/** @param {HTMLElement} near @param {string} name as --line */
export function named(near, name) {
  const probe = make("i", { hidden: true });
  probe.style.color = `var(${name})`;
  near.parentElement?.append(probe);
  const found = getComputedStyle(probe).color;
  probe.remove();
  return found;
}

// The context with which a script draws in a canvas.
/**
 * @param {HTMLCanvasElement} canvas
 * @param {CanvasRenderingContext2DSettings} [settings]
 */
export function contextOf(canvas, settings) {
  const context = canvas.getContext("2d", settings);
  if (!context) throw new Error("this browser draws in no canvas");
  return context;
}

// Sets the text of an element only if it changes: most messages change little.
/** @param {Element} element @param {string} text */
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
