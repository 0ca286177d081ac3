// The figure of a supplement: a mark for each row of its table, with its interval. A
// mark is chosen by a click, by the arrow keys, or by a drag across the figure.

import { make, short, spaced, unitText } from "./dom.js";
import { Axis, bounds } from "./axes.js";
import { ramp } from "./ramp.js";

/**
 * @import {
 *   SupplementAxis,
 *   SupplementData,
 *   SupplementPoint,
 *   SupplementRow,
 * } from "./supplement.d.ts"
 */

const SPACE = "http://www.w3.org/2000/svg";
const MARGIN = { left: 62, right: 16, top: 14, bottom: 46 };
const LEGEND = { width: 74, height: 14 }; // of a heatmap: its scale, its label above
const ROW = 24; // CSS pixels
const MOST_NAME = 0.42; // of the width
const DIGIT = 7; // the width of a digit at a tick
const LABEL = 26; // of the axis on the left
const RADIUS = 5;
const REACH = 14; // a mark is hit so far from its middle
// Paths about (0, 0), one a colour in turn: marks differ not by their colour alone.
const SHAPES = [
  "M-5 0a5 5 0 1 0 10 0a5 5 0 1 0-10 0z",
  "M-4.5-4.5h9v9h-9z",
  "M0-5.8L5.4 4.2H-5.4z",
  "M0-6.2L6.2 0 0 6.2-6.2 0z",
];
/** @typedef {{ x: number, y: number }} Place */
/**
 * A mark: its point and row, its numbers, its place, and its column and row among the
 * marks, for the arrow keys.
 *
 * @typedef {object} Mark
 * @property {SupplementPoint} point
 * @property {SupplementRow} row
 * @property {number | null} mean
 * @property {number | null} low
 * @property {number | null} high
 * @property {number} column
 * @property {number} line
 * @property {Place} at
 * @property {SVGGElement} element
 * @property {Record<string, number>} [box] of a cell
 */

/**
 * @template {keyof SVGElementTagNameMap} T
 * @param {T} tag
 * @param {Record<string, string | number>} attributes
 * @param {(Node | string)[]} children
 * @returns {SVGElementTagNameMap[T]}
 */
function drawn(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SPACE, tag);
  for (const [name, value] of Object.entries(attributes)) {
    element.setAttribute(name, String(value));
  }
  element.append(...children);
  return element;
}

/** @param {unknown} value */
const number = (value) => (typeof value === "number" ? value : null);

/** @param {number[]} values @param {unknown} value */
function nearest(values, value) {
  const away = values.map((one) => Math.abs(one - Number(value)));
  return away.indexOf(Math.min(...away));
}

// The mean of a row with its interval, in words.
/** @param {SupplementRow} row @param {SupplementData["figure"]} figure */
export function estimated(row, { column, metric, says }) {
  const [mean, low, high] = [row[column], row[`${column}_low`], row[`${column}_high`]];
  const what = `${spaced(metric.name)} ${says}`;
  if (number(mean) === null) return `${what}: no value`;
  const unit = metric.unit && ` ${unitText(metric.unit)}`;
  const interval = number(low) === null || number(high) === null
    ? "no confidence interval"
    : `95 % confidence interval ${short(low)} to ${short(high)}`;
  return `${what} ${short(mean)}${unit}, ${interval}`;
}

export class Plotted {
  chosen = 0; // the place of the chosen mark
  width = 0;
  height = 0;
  tall = 0; // the height that is wanted, 0 for the usual one
  redrawn = () => {}; // is called after each drawing
  /** @type {Mark[]} */
  marks = [];
  ring = drawn("rect", { class: "ring box" }); // about the chosen cell

  // `choose` is told the place of a mark, and whether it was clicked.
  /**
   * @param {SupplementData} data
   * @param {(place: number, clicked: boolean) => void} choose
   */
  constructor(data, choose) {
    this.data = data;
    this.choose = choose;
    this.svg = drawn("svg", { role: "listbox", "aria-label": this.words() });
    this.element = make("div", { className: "plotted" }, this.svg);
    this.svg.addEventListener("keydown", (event) => this.key(event));
    this.svg.addEventListener("pointerdown", (event) => this.press(event));
    this.svg.addEventListener("pointermove", (event) => this.follow(event));
    this.svg.addEventListener("pointerup", (event) => this.release(event));
    this.svg.addEventListener("pointercancel", () => (this.pressed = null));
    new ResizeObserver(() => this.draw()).observe(this.element);
  }

  /** @type {{ place: number, moved: boolean } | null} */
  pressed = null;

  words() {
    const { figure } = this.data;
    const against = [figure.x, figure.y, figure.by].filter((one) => one !== null)
      .map(({ label }) => label);
    const over = against.length ? ` against ${against.join(" and ")}` : "";
    return `${figure.label}${over}: points, each with a run to play`;
  }

  // Draws everything anew, as wide as there is room.
  draw() {
    const width = Math.floor(this.element.clientWidth);
    const { form } = this.data.figure;
    const usual = form === "rows"
      ? this.data.rows.length * ROW + MARGIN.top + MARGIN.bottom
      : Math.round(Math.min(Math.max(0.62 * width, 260), 480));
    const height = this.tall || usual;
    if (!width || (width === this.width && height === this.height)) return;
    [this.width, this.height] = [width, height];
    const focused = this.svg.contains(document.activeElement);
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    this.svg.setAttribute("height", String(height));
    this.svg.replaceChildren();
    this.marks = this.data.points.map((point, place) => this.mark(point, place));
    this.area = {
      left: MARGIN.left,
      right: width - MARGIN.right,
      top: MARGIN.top,
      bottom: height - MARGIN.bottom,
    };
    if (form === "cells") this.drawHeatmap();
    else if (form === "rows") this.drawRows();
    else this.drawCurves();
    this.show(this.chosen);
    if (focused) this.marks[this.chosen].element.focus();
    this.redrawn();
  }

  /** @type {{ left: number, right: number, top: number, bottom: number }} */
  area = { left: 0, right: 1, top: 0, bottom: 1 };

  /** @param {SupplementPoint} point @param {number} place @returns {Mark} */
  mark(point, place) {
    const { figure, rows } = this.data;
    const row = rows[place];
    const { x, y } = figure;
    const plays = point.runs.length ? "" : ". No run to play";
    const element = drawn("g", {
      class: `mark colour-${point.colour % 7}${point.runs.length ? "" : " empty"}`,
      role: "option",
      tabindex: -1,
      "aria-selected": "false",
      "aria-label": `${point.words}: ${estimated(row, figure)}${plays}`,
    });
    const column = x ? nearest(x.values, row[x.name]) : 0;
    const line = y ? nearest(y.values, row[y.name]) : x ? point.colour : -place;
    return {
      point,
      row,
      mean: number(row[figure.column]),
      low: number(row[`${figure.column}_low`]),
      high: number(row[`${figure.column}_high`]),
      column,
      line,
      at: { x: 0, y: 0 },
      element,
    };
  }

  // The marks in the order in which their cells lie over each other.
  get layered() {
    return this.marks.toSorted((a, b) =>
      (a.point.cell?.order ?? -1) - (b.point.cell?.order ?? -1)
    );
  }

  /** @param {Mark} mark */
  ends({ mean, low, high }) {
    return [mean, low, high].filter((value) => value !== null);
  }

  // The metric against a setting, a curve with its band for each colour.
  drawCurves() {
    const { form, x, label, linear } = this.data.figure;
    if (!x) return;
    const { right, top, bottom } = this.area;
    const values = this.marks.flatMap((mark) => this.ends(mark));
    const along = new Axis(values, { label, linear }).span(bottom, top);
    const left = this.leftOf(along);
    const across = axisOf(x, x.values, 0).span(left + 12, right - 12);
    this.frame(across);
    this.levels(along);
    for (const mark of this.marks) {
      mark.at = {
        x: across.pixel(Number(mark.row[x.name])),
        y: along.pixel(mark.mean ?? NaN),
      };
    }
    const curves = new Map(this.marks.map((mark) => [mark.point.colour, [mark]]));
    for (const [colour] of curves) {
      const own = this.marks.filter((mark) => mark.point.colour === colour)
        .toSorted((a, b) => a.at.x - b.at.x);
      if (form === "lines") this.drawCurve(own, along, colour);
    }
    for (const mark of this.marks) this.drawMark(mark, along);
  }

  // The left edge of the plot: ticks of the axis beside it have room.
  /** @param {Axis} axis */
  leftOf({ ticks }) {
    const digits = Math.max(0, ...ticks.map(({ text }) => text.length));
    this.area.left = Math.max(MARGIN.left, LABEL + DIGIT * digits);
    return this.area.left;
  }

  /** @param {Mark[]} marks @param {Axis} along @param {number} colour */
  drawCurve(marks, along, colour) {
    const known = marks.filter(({ mean }) => mean !== null);
    const banded = known.filter(({ low, high }) => low !== null && high !== null);
    /** @param {Place[]} places */
    const path = (places) => places.map(({ x, y }) => `${x} ${y}`).join("L");
    const upper = banded.map(({ at, high }) => ({
      x: at.x,
      y: along.pixel(high ?? 0),
    }));
    const lower = banded.map(({ at, low }) => ({ x: at.x, y: along.pixel(low ?? 0) }));
    const name = `colour-${colour % 7}`;
    if (banded.length > 1) {
      const band = `M${path([...upper, ...lower.toReversed()])}z`;
      this.svg.append(drawn("path", { class: `band ${name}`, d: band }));
    }
    if (known.length > 1) {
      const curve = `M${path(known.map(({ at }) => at))}`;
      this.svg.append(drawn("path", { class: `curve ${name}`, d: curve }));
    }
  }

  // A mark with the whisker of its interval. Without a mean it lies on the axis.
  /** @param {Mark} mark @param {Axis} along */
  drawMark(mark, along) {
    const { element, at, low, high, point } = mark;
    if (Number.isNaN(at.y)) at.y = this.area.bottom;
    if (low !== null && high !== null) {
      const whisker = `M${at.x} ${along.pixel(low)}V${along.pixel(high)}`;
      element.append(drawn("path", { class: "whisker", d: whisker }));
    }
    this.finish(mark, SHAPES[point.colour % SHAPES.length]);
  }

  /** @param {Mark} mark @param {string} shape */
  finish({ element, at, point }, shape) {
    const move = `translate(${at.x} ${at.y})`;
    element.append(
      drawn("circle", { class: "reach", r: REACH, transform: move }),
      drawn("circle", { class: "ring", r: RADIUS + 5, transform: move }),
      drawn("path", { class: "shape", d: shape, transform: move }),
      drawn("title", {}, point.words),
    );
    this.svg.append(element);
  }

  // The metric along x, and a row a point.
  drawRows() {
    const { label, linear } = this.data.figure;
    const values = this.marks.flatMap((mark) => this.ends(mark));
    const longest = Math.max(...this.marks.map(({ point }) => point.words.length));
    const names = Math.min(7 * longest + 12, MOST_NAME * this.width);
    const { right, top, bottom } = this.area;
    this.area.left = names;
    const across = new Axis(values, { label, linear }).span(names + 8, right - 8);
    this.frame(across);
    for (const [place, mark] of this.marks.entries()) {
      mark.at = {
        x: mark.mean === null ? names : across.pixel(mark.mean),
        y: top + (place + 0.5) * ((bottom - top) / this.marks.length),
      };
      const { element, at, low, high, point } = mark;
      const letters = Math.floor(names / 7);
      const words = point.words.length > letters
        ? `${point.words.slice(0, letters - 1)}…`
        : point.words;
      const name = { class: "name", x: names - 8, y: at.y + 4, "text-anchor": "end" };
      element.append(drawn("text", name, words));
      if (low !== null && high !== null) {
        const whisker = `M${across.pixel(low)} ${at.y}H${across.pixel(high)}`;
        element.append(drawn("path", { class: "whisker", d: whisker }));
      }
      this.finish(mark, SHAPES[0]);
    }
  }

  // The metric as a colour over two settings. A cell is hatched as in the explorer.
  drawHeatmap() {
    const { x, y, label, linear } = this.data.figure;
    if (!x || !y) return;
    this.area.right -= LEGEND.width;
    this.area.top += LEGEND.height;
    const { right, top, bottom } = this.area;
    const boxes = this.marks.flatMap(({ point }) => point.cell ? [point.cell.box] : []);
    const along = axisOf(y, boxes.flatMap(([, , low, high]) => [low, high]), 0)
      .span(bottom, top);
    const across = axisOf(x, boxes.flatMap(([low, high]) => [low, high]), 0)
      .span(this.leftOf(along), right);
    const means = this.marks.flatMap(({ mean }) => (mean === null ? [] : [mean]));
    const [low, high] = bounds(means);
    const shades = new Axis([low, high], { linear }, 0).span(0, 1);
    this.frame(across);
    this.levels(along);
    this.svg.append(hatching());
    for (const mark of this.layered) {
      this.cell(mark, across, along, shades.pixel(mark.mean ?? low));
    }
    this.legend(right + 18, shades.constant ? [high] : [high, low], label);
    this.svg.append(this.ring);
  }

  /**
   * @param {Mark} mark
   * @param {Axis} across
   * @param {Axis} along
   * @param {number} shade from 0 to 1
   */
  cell(mark, across, along, shade) {
    const { x, y } = this.data.figure;
    if (!x || !y) return;
    const { element, point, row } = mark;
    const { area } = this;
    const [column, line] = [Number(row[x.name]), Number(row[y.name])];
    mark.at = {
      x: Math.min(Math.max(across.pixel(column), area.left), area.right),
      y: Math.min(Math.max(along.pixel(line), area.top), area.bottom),
    };
    const { cell } = point;
    if (cell) {
      const [low, high, lower, upper] = cell.box;
      const [left, top] = [across.pixel(low), along.pixel(upper)];
      const box = {
        x: left,
        y: top,
        width: across.pixel(high) - left,
        height: along.pixel(lower) - top,
      };
      mark.box = box;
      element.append(
        drawn("rect", { ...box, class: "cell", fill: ramp(shade) }),
      );
      if (!cell.resolved) {
        element.append(drawn("rect", { ...box, fill: "url(#hatching)" }));
      }
    }
    element.append(drawn("title", {}, point.words));
    this.svg.append(element);
  }

  // What the colours of a heatmap stand for.
  /**
   * @param {number} x
   * @param {number[]} ends the value above and the value below, or one for all marks
   * @param {string} label
   */
  legend(x, ends, label) {
    const { top, bottom } = this.area;
    const parts = 32;
    const tall = (bottom - top) / parts;
    for (let k = 0; k < parts; k++) {
      const y = bottom - (k + 1) * tall;
      const box = { x, y, width: 12, height: tall + 0.5 };
      this.svg.append(
        drawn("rect", {
          ...box,
          fill: ramp(ends.length > 1 ? (k + 0.5) / parts : 0.5),
        }),
      );
    }
    const text = { class: "tick", x: x + 16 };
    this.svg.append(
      ...ends.map((end, i) =>
        drawn("text", { ...text, y: i ? bottom : top + 9 }, short(end))
      ),
      drawn(
        "text",
        { class: "label", x: this.width - 4, y: top - 10, "text-anchor": "end" },
        label,
      ),
    );
  }

  // The axis below, and lines at its ticks.
  /** @param {Axis} axis */
  frame(axis) {
    const { left, right, top, bottom } = this.area;
    for (const { at, text } of axis.ticks) {
      const x = axis.pixel(at);
      const middle = { class: "tick", x, y: bottom + 16, "text-anchor": "middle" };
      this.svg.append(
        drawn("path", { class: "grid", d: `M${x} ${top}V${bottom}` }),
        drawn("text", middle, text),
      );
    }
    const base = { class: "base", d: `M${left} ${bottom}H${right}` };
    const name = { class: "label", x: (left + right) / 2, y: bottom + 36 };
    this.svg.append(
      drawn("path", base),
      drawn("text", { ...name, "text-anchor": "middle" }, axis.label),
    );
  }

  // The axis on the left.
  /** @param {Axis} axis */
  levels(axis) {
    const { left, right, top, bottom } = this.area;
    for (const { at, text } of axis.ticks) {
      const y = axis.pixel(at);
      const end = { class: "tick", x: left - 6, y: y + 4, "text-anchor": "end" };
      this.svg.append(
        drawn("path", { class: "grid", d: `M${left} ${y}H${right}` }),
        drawn("text", end, text),
      );
    }
    const middle = (top + bottom) / 2;
    const name = { class: "label", transform: `translate(14 ${middle}) rotate(-90)` };
    this.svg.append(drawn("text", { ...name, "text-anchor": "middle" }, axis.label));
  }

  // Shows which mark is chosen. One mark can be reached by Tab.
  /** @param {number} place */
  show(place) {
    this.marks[this.chosen]?.element.setAttribute("aria-selected", "false");
    this.marks[this.chosen]?.element.setAttribute("tabindex", "-1");
    this.chosen = place;
    this.marks[place]?.element.setAttribute("aria-selected", "true");
    this.marks[place]?.element.setAttribute("tabindex", "0");
    for (const [name, value] of Object.entries(this.marks[place]?.box ?? {})) {
      this.ring.setAttribute(name, String(value));
    }
  }

  /** @param {number} place */
  take(place, clicked = false) {
    if (place !== this.chosen) this.show(place);
    else if (!clicked) return;
    this.choose(place, clicked);
  }

  // The place of the mark that is meant by a place on the screen.
  /** @param {PointerEvent} event */
  meant({ clientX, clientY }) {
    const box = this.svg.getBoundingClientRect();
    const scale = this.width / (box.width || 1);
    const [x, y] = [(clientX - box.left) * scale, (clientY - box.top) * scale];
    const { form } = this.data.figure;
    const cell = this.layered.findLast((mark) => mark.box && isWithin(mark.box, x, y));
    if (cell) return this.marks.indexOf(cell);
    // Across a figure of curves the setting counts more than the value.
    const [wide, tall] = form === "lines" ? [4, 1] : form === "rows" ? [0, 1] : [1, 1];
    const away = this.marks.map(({ at }) =>
      Math.hypot(wide * (at.x - x), tall * (at.y - y))
    );
    return away.indexOf(Math.min(...away));
  }

  /** @param {PointerEvent} event */
  press(event) {
    if (event.button !== 0) return;
    const place = this.meant(event);
    this.pressed = { place, moved: false };
    this.svg.setPointerCapture(event.pointerId);
    this.take(place);
    this.marks[place].element.focus({ preventScroll: true });
    event.preventDefault();
  }

  /** @param {PointerEvent} event */
  follow(event) {
    if (!this.pressed) return;
    const place = this.meant(event);
    if (place !== this.pressed.place) this.pressed.moved = true;
    this.take(place);
  }

  /** @param {PointerEvent} event */
  release(event) {
    if (!this.pressed) return;
    const { moved } = this.pressed;
    this.pressed = null;
    const place = this.meant(event);
    this.marks[place].element.focus({ preventScroll: true });
    this.take(place, !moved);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Enter") this.take(this.chosen, true);
    else {
      const to = this.beside(event.key);
      if (to === null) return;
      this.take(to);
      this.marks[to].element.focus();
    }
    event.preventDefault();
    event.stopPropagation();
  }

  // The place of the next mark in the direction of a key, or null for another key.
  /** @param {string} key */
  beside(key) {
    const here = this.marks[this.chosen];
    /** @type {Record<string, (mark: Mark) => number>} */
    const steps = {
      ArrowRight: ({ column, line }) => (line === here.line ? column - here.column : 0),
      ArrowLeft: ({ column, line }) => (line === here.line ? here.column - column : 0),
      ArrowUp: ({ column, line }) => (column === here.column ? line - here.line : 0),
      ArrowDown: ({ column, line }) => (column === here.column ? here.line - line : 0),
    };
    if (key === "Home" || key === "End") {
      const order = this.marks.keys().toArray().toSorted((a, b) =>
        this.marks[a].column - this.marks[b].column ||
        this.marks[b].line - this.marks[a].line
      );
      return order[key === "Home" ? 0 : order.length - 1];
    }
    const far = steps[key];
    if (!far) return null;
    let [best, least] = [this.chosen, Infinity];
    for (const [place, mark] of this.marks.entries()) {
      const away = far(mark);
      if (away > 0 && away < least) [best, least] = [place, away];
    }
    return best;
  }
}

// The axis of a parameter, with its values as ticks.
/** @param {SupplementAxis} about @param {number[]} values @param {number} room */
const axisOf = (about, values, room) =>
  new Axis(values, { ...about, listed: about.values }, room);

/** @param {Record<string, number>} box @param {number} x @param {number} y */
const isWithin = (box, x, y) =>
  x >= box.x && x < box.x + box.width && y >= box.y && y < box.y + box.height;

function hatching() {
  const lines = drawn("path", { class: "hatch", d: "M-2 2l4-4M0 8l8-8M6 10l4-4" });
  const about = { id: "hatching", width: 8, height: 8, patternUnits: "userSpaceOnUse" };
  return drawn("defs", {}, drawn("pattern", about, lines));
}
