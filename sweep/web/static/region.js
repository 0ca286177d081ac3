// A region of a figure: between two values of each axis that is a setting. It follows
// from the rectangle that was drawn about marks.

import { make } from "./dom.js";
import { surround } from "./picking.js";

/** @import { FigureAxis, Panel } from "./explorer.d.ts" */
/** @import { Corners } from "./picking.js" */

const DIGITS = 6; // more than a pixel tells, and a value of a spec stays what it is
const AXES = /** @type {const} */ (["x", "y"]);

/**
 * What a board of a figure has: its element, and its scales.
 *
 * @typedef {{
 *   element: HTMLElement,
 *   pixel(axis: "x" | "y", value: number): number,
 *   value(axis: "x" | "y", pixel: number): number,
 * }} Measured
 */

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
  shown = "";

  /** @param {Measured} board @param {Panel} panel @param {string[]} settings */
  constructor(board, panel, settings) {
    this.board = board;
    this.panel = panel;
    this.axes = AXES.filter((axis) => isNumber(panel[axis], settings));
    this.box = make("div", { className: "region", hidden: true });
    board.element.append(this.box);
    this.watch = new ResizeObserver(() => this.show(this.shown));
    this.watch.observe(board.element);
  }

  remove() {
    this.watch.disconnect();
  }

  // What a rectangle is as a region, as an address has it; "" where no axis is a
  // setting.
  /** @param {Corners} corners */
  of(corners) {
    return this.axes.map((axis) => {
      const ends = corners.map((one) => this.board.value(axis, one[axis]));
      const [low, high] = ends.toSorted((a, b) => a - b).map((end) =>
        Number(end.toPrecision(DIGITS))
      );
      return `${this.panel[axis].name} ${low} ${high}`;
    }).join(", ");
  }

  // Shows the region of an address. An axis that is no setting is covered whole.
  /** @param {string} text */
  show(text) {
    this.shown = text;
    const region = regionOf(text);
    const { clientWidth, clientHeight } = this.board.element;
    /** @type {Corners} */
    const corners = [{ x: 0, y: 0 }, { x: clientWidth, y: clientHeight }];
    const whole = this.axes.length > 0 &&
      this.axes.every((axis) => region[this.panel[axis].name]);
    this.box.hidden = !whole;
    if (!whole) return;
    for (const axis of this.axes) {
      region[this.panel[axis].name].forEach((value, i) => {
        corners[i][axis] = this.board.pixel(axis, value);
      });
    }
    surround(this.box, corners);
  }
}

/** @param {FigureAxis} axis @param {string[]} settings */
const isNumber = ({ name, names }, settings) =>
  names.length === 0 && settings.includes(name);
