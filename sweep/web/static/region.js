// A region of a figure, chosen by a drag across it: between two values of each axis
// that is a setting, or where none is, the points within it.

import { make } from "./dom.js";

/** @import { Choice, Dot, FigureAxis, Panel } from "./explorer.d.ts" */

const LEAST = 5; // pixels of a drag
const DIGITS = 4;

/**
 * What a board of a figure has: its element, its marks, and its scales.
 *
 * @typedef {{
 *   element: HTMLElement,
 *   dots: Dot[],
 *   pixel(axis: "x" | "y", value: number): number,
 *   value(axis: "x" | "y", pixel: number): number,
 * }} Measured
 */
/** @typedef {{ x: number, y: number }} Place */

const AXES = /** @type {const} */ (["x", "y"]);

// The region that an address has, by settings: "n 10 50, speed 1 2".
/** @param {string} text @returns {Record<string, [number, number]>} */
export function regionOf(text) {
  const parts = text.split(",").map((one) => one.trim().split(/\s+/));
  return Object.fromEntries(
    parts.filter((one) => one.length === 3).map(([name, low, high]) => [
      name,
      [Number(low), Number(high)],
    ]),
  );
}

export class Region {
  /** @type {Place | null} */
  from = null;
  dragged = false;
  shown = "";

  /**
   * @param {Measured} board
   * @param {Panel} panel
   * @param {string[]} settings
   * @param {(change: Partial<Choice>) => void} go
   */
  constructor(board, panel, settings, go) {
    this.board = board;
    this.panel = panel;
    this.go = go;
    this.axes = AXES.filter((axis) => isNumber(panel[axis], settings));
    this.box = make("div", { className: "region", hidden: true });
    const { element } = board;
    element.append(this.box);
    element.addEventListener("pointerdown", (event) => this.press(event));
    element.addEventListener("pointermove", (event) => this.follow(event));
    element.addEventListener("pointerup", (event) => this.release(event));
    element.addEventListener("pointercancel", () => this.leave());
    element.addEventListener("click", (event) => {
      if (this.dragged) event.stopPropagation();
      this.dragged = false;
    }, { capture: true });
    this.watch = new ResizeObserver(() => this.show(this.shown));
    this.watch.observe(element);
  }

  remove() {
    this.watch.disconnect();
  }

  /** @param {PointerEvent} event @returns {Place} */
  place(event) {
    const box = this.board.element.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** @param {PointerEvent} event */
  press(event) {
    this.dragged = false;
    if (event.button === 0) this.from = this.place(event);
  }

  /** @param {PointerEvent} event */
  follow(event) {
    if (!this.from) return;
    if (!event.buttons) return this.leave();
    const to = this.place(event);
    const far = Math.max(Math.abs(to.x - this.from.x), Math.abs(to.y - this.from.y));
    this.dragged ||= far >= LEAST;
    if (this.dragged) this.draw(this.from, to);
  }

  /** @param {PointerEvent} event */
  release(event) {
    const { from, dragged } = this;
    this.from = null;
    if (!from || !dragged) return;
    const to = this.place(event);
    if (this.axes.length) return this.go({ region: this.said(from, to), point: "" });
    const within = this.board.dots.filter((dot) => this.isWithin(dot, from, to));
    this.go({ point: within.map((dot) => dot.point).join(" "), trial: "", region: "" });
  }

  leave() {
    this.from = null;
    this.show(this.shown);
  }

  // The region between two places, as an address has it.
  /** @param {Place} from @param {Place} to */
  said(from, to) {
    return this.axes.map((axis) => {
      const ends = [from, to].map((one) => this.board.value(axis, one[axis]));
      const [low, high] = ends.toSorted((a, b) => a - b).map((end) =>
        Number(end.toPrecision(DIGITS))
      );
      return `${this.panel[axis].name} ${low} ${high}`;
    }).join(", ");
  }

  /** @param {Dot} dot @param {Place} from @param {Place} to */
  isWithin(dot, from, to) {
    return AXES.every((axis) => {
      const value = dot[axis];
      if (value === null) return false;
      const at = this.board.pixel(axis, value);
      return (at - from[axis]) * (at - to[axis]) <= 0;
    });
  }

  /** @param {string} text that of the address */
  show(text) {
    this.shown = text;
    const region = regionOf(text);
    const ends = this.axes.map((axis) => region[this.panel[axis].name]);
    const whole = this.axes.length > 0 && ends.every(Boolean);
    this.box.hidden = !whole;
    if (!whole) return;
    const from = { x: 0, y: 0 };
    const to = { x: 0, y: 0 };
    this.axes.forEach((axis, i) => {
      [from[axis], to[axis]] = ends[i].map((value) => this.board.pixel(axis, value));
    });
    this.draw(from, to);
  }

  // An axis that is no setting is covered whole.
  /** @param {Place} from @param {Place} to */
  draw(from, to) {
    const { clientWidth: width, clientHeight: height } = this.board.element;
    const free = this.axes.length > 0;
    const across = !free || this.axes.includes("x") ? [from.x, to.x] : [0, width];
    const down = !free || this.axes.includes("y") ? [from.y, to.y] : [0, height];
    const [left, right] = across.toSorted((a, b) => a - b);
    const [top, bottom] = down.toSorted((a, b) => a - b);
    this.box.hidden = false;
    Object.assign(this.box.style, {
      left: `${left}px`,
      top: `${top}px`,
      width: `${right - left}px`,
      height: `${bottom - top}px`,
    });
  }
}

/** @param {FigureAxis} axis @param {string[]} settings */
const isNumber = ({ name, names }, settings) =>
  names.length === 0 && settings.includes(name);
