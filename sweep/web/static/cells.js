// A heatmap, drawn on a board: a cell each, hatched where its interval is wider than
// any step to a cell beside it.

import { Axis, bounds } from "./axes.js";
import { contextOf, make, short, unitText } from "./dom.js";
import { Board, known, stroke } from "./board.js";
import { ramp } from "./ramp.js";

/** @import { Dot, Figure, Panel } from "./explorer.d.ts" */
/** @import { Choose, Place } from "./picking.js" */

const LIGHT = 0.6; // of the range; above it hatches are dark

// The least and the largest value of all panels.
/** @param {Panel[]} panels */
function rangeOf(panels) {
  const values = panels.flatMap(({ marks: { columns, data } }) => {
    const at = columns.indexOf("y");
    return known(data.map((row) => (typeof row[at] === "number" ? row[at] : null)));
  });
  return bounds(values);
}

// The scale of the colours of all panels. Equal values have the colour in the middle.
/** @param {Figure} figure */
export function shadesOf({ panels, linear }) {
  return new Axis(rangeOf(panels), { linear }, 0).span(0, 1);
}

export class Cells extends Board {
  /**
   * @param {Axis} shades the place of a value among the colours, from 0 to 1
   * @param {Panel} panel
   * @param {(dot: Dot | null, at: Place) => void} over
   * @param {Choose} choose
   */
  constructor(shades, panel, over, choose) {
    super(panel, over, choose);
    this.shades = shades;
  }

  /** @override @returns {[Axis, Axis]} */
  scales() {
    const { x, y, span: [left, right, bottom, top] } = this.panel;
    return [new Axis([left, right], x, 0), new Axis([bottom, top], y, 0)];
  }

  /**
   * @param {Dot} dot
   * @returns {[number, number, number, number]} left, top, right, bottom
   */
  box(dot) {
    return [
      this.pixel("x", dot.left),
      this.pixel("y", dot.top),
      this.pixel("x", dot.right),
      this.pixel("y", dot.bottom),
    ];
  }

  /** @override @param {CanvasRenderingContext2D} context */
  paint(context) {
    for (const dot of this.dots) {
      const [left, top, right, bottom] = this.box(dot);
      context.fillStyle = this.colour(dot.y);
      context.fillRect(left, top, right - left + 0.5, bottom - top + 0.5);
      const light = dot.y !== null && this.shades.pixel(dot.y) > LIGHT;
      if (!dot.resolved) hatch(context, [left, top, right, bottom], light);
    }
    for (const dot of this.dots.filter((one) => this.isChosen(one))) {
      const [left, top, right, bottom] = this.box(dot);
      // Both, as a cell may have the colour of either.
      for (const [strokeStyle, lineWidth] of [["#fff", 5], ["#000", 2]]) {
        Object.assign(context, { strokeStyle, lineWidth });
        context.strokeRect(left + 2.5, top + 2.5, right - left - 5, bottom - top - 5);
      }
    }
  }

  // At its values, which need not be the middle of the cell; those of a bin are.
  /** @override @param {Dot} dot @returns {Place} */
  placeOf(dot) {
    const [left, top, right, bottom] = this.box(dot);
    return {
      x: dot.across === null ? (left + right) / 2 : this.pixel("x", dot.across),
      y: dot.up === null ? (top + bottom) / 2 : this.pixel("y", dot.up),
    };
  }

  /** @override @param {Dot} dot @param {number} value @param {string} ink */
  lookOfPublished(dot, value, ink) {
    return { ...super.lookOfPublished(dot, value, ink), filling: this.colour(value) };
  }

  // In its cell, of which it has no place but a colour.
  /** @override @param {Dot} dot @param {number} _value */
  placeOfPublished(dot, _value) {
    return this.placeOf(dot);
  }

  /** @param {number | null} value */
  colour(value) {
    return ramp(value === null ? 0 : this.shades.pixel(value));
  }

  /** @override @param {Place} place @returns {Dot | null} */
  find({ x: left, y: top }) {
    return this.dots.findLast((dot) => {
      const [first, upper, last, lower] = this.box(dot);
      return left >= first && left < last && top >= upper && top < lower;
    }) ?? null;
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {[number, number, number, number]} box
 * @param {boolean} light
 */
function hatch(context, [left, top, right, bottom], light) {
  context.save();
  context.beginPath();
  context.rect(left, top, right - left, bottom - top);
  context.clip();
  Object.assign(context, { strokeStyle: light ? "#0005" : "#fff6", lineWidth: 1 });
  for (let start = left - (bottom - top); start < right; start += 7) {
    stroke(context, [[start, bottom], [start + bottom - top, top]]);
  }
  context.restore();
}

// What the colours mean, in one line.
/** @param {Figure} figure */
export function rampLegend(figure) {
  const [low, high] = rangeOf(figure.panels);
  const { constant } = shadesOf(figure);
  const bar = make("canvas", {
    className: "ramp",
    width: 160,
    height: 12,
    role: "img",
    "aria-label": "scale of colours",
  });
  const context = contextOf(bar);
  for (let x = 0; x < 160; x++) {
    context.fillStyle = ramp(constant ? 0.5 : x / 159);
    context.fillRect(x, 0, 1, 12);
  }
  return make(
    "p",
    { className: "legend" },
    make("span", { textContent: unitText(figure.by) }),
    ...(constant ? [] : [make("span", { textContent: short(low) })]),
    bar,
    make("span", { textContent: short(high) }),
    make("span", {
      textContent:
        "hatched: the confidence interval is wider than all steps to adjacent cells",
    }),
  );
}
