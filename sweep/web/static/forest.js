// A forest plot: a row a difference with its interval, about zero and the margin.

import { Axis } from "./axes.js";
import { contextOf, make, named, short, spaced, unitText } from "./dom.js";
import { stroke } from "./board.js";

/** @import { Difference } from "./explorer.d.ts" */

const ROW = 24; // CSS pixels
const TOP = 26;
const BOTTOM = 42;
const FAR = 4; // times the median: an interval that ends beyond it gets an arrow
const NARROW = 560; // below it the verdicts stand in the table alone

/**
 * One row: its label, what it shows, and what is behind it.
 *
 * @typedef {{
 *   label: string,
 *   about: Difference,
 *   chosen: boolean,
 *   choose: () => void,
 * }} Line
 */

// The ends of an interval: one without an end reaches beyond the picture.
/** @param {Difference} about @returns {[number, number] | null} */
const interval = ({ low, high }) =>
  low === null || high === null ? null : [bound(low), bound(high)];

/** @param {number | string} value */
const bound = (value) =>
  typeof value === "number" ? value : Number(value.replace("inf", "Infinity"));

export class Forest {
  /** @type {Line[]} */
  lines = [];
  /** @type {number | null} */
  margin = null;
  labels = "";

  /** @param {(line: Line | null, at: { x: number, y: number }) => void} over */
  constructor(over) {
    this.canvas = make("canvas", { role: "img" });
    this.element = make("div", { className: "forest" }, this.canvas);
    this.canvas.addEventListener("pointermove", (event) => {
      const line = this.find(event.offsetY);
      this.canvas.classList.toggle("over", Boolean(line));
      over(line, { x: event.clientX, y: event.clientY });
    });
    this.canvas.addEventListener("pointerleave", () => over(null, { x: 0, y: 0 }));
    this.canvas.addEventListener("click", (event) => {
      this.find(event.offsetY)?.choose();
    });
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.element);
  }

  remove() {
    this.watch.disconnect();
    this.element.remove();
  }

  /** @param {Line[]} lines @param {number | null} margin @param {string} labels */
  show(lines, margin, labels) {
    Object.assign(this, { lines, margin, labels });
    const what = `${lines.length} differences with confidence intervals`;
    this.canvas.setAttribute("aria-label", `${what}; the table has the numbers`);
    this.draw();
  }

  /** @param {number} top @returns {Line | null} */
  find(top) {
    return this.lines[Math.floor((top - TOP) / ROW)] ?? null;
  }

  // Zero, the margin and all differences lie within the scale, and the ends of all
  // intervals but those that are many times as far off as most.
  get scale() {
    const { lines, margin } = this;
    const ends = lines.flatMap(({ about }) => interval(about) ?? [])
      .filter((end) => Number.isFinite(end));
    const inner = [
      ...[0, margin ?? 0, -(margin ?? 0)],
      ...lines.map(({ about }) => about.difference ?? 0),
    ];
    const far = ends.map(Math.abs).toSorted((a, b) => a - b);
    const most = Math.max(FAR * (far[far.length >> 1] ?? 0), ...inner.map(Math.abs));
    const kept = ends.map((end) => Math.min(Math.max(end, -most), most));
    const { metric = "", unit = "" } = lines[0]?.about ?? {};
    const label = `${spaced(metric)}, B - A${unit ? ` (${unit})` : ""}`;
    return new Axis([...inner, ...kept], { label });
  }

  draw() {
    const width = this.element.clientWidth;
    if (!width || !this.element.isConnected) return;
    const { canvas, lines } = this;
    const height = TOP + lines.length * ROW + BOTTOM;
    const ratio = devicePixelRatio || 1;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    canvas.style.height = `${height}px`;
    const context = contextOf(canvas);
    context.scale(ratio, ratio);
    context.font = "12px system-ui, sans-serif";
    const inks = {
      ink: getComputedStyle(this.element).color,
      line: named(this.element, "--line"),
      well: named(this.element, "--well"),
      muted: named(this.element, "--muted"),
      higher: named(this.element, "--accent"),
      lower: named(this.element, "--bad"),
      equivalent: named(this.element, "--good"),
    };
    const wide = (/** @type {string[]} */ texts, /** @type {number} */ most) =>
      Math.min(
        Math.max(...texts.map((text) => context.measureText(text).width)) + 16,
        most * width,
      );
    const left = wide([this.labels, ...lines.map(({ label }) => label)], 0.4);
    const verdicts = lines.map(({ about }) => about.verdict);
    const right = width < NARROW ? 12 : wide(verdicts, 0.3);
    const scale = this.scale.span(left, width - right);
    this.ground(context, inks, scale, [left, width - right, height]);
    lines.forEach((line, i) => {
      const y = TOP + (i + 0.5) * ROW;
      if (line.chosen) {
        context.strokeStyle = inks.ink;
        context.strokeRect(1, y - ROW / 2 + 1, width - 2, ROW - 2);
      }
      context.fillStyle = inks.ink;
      context.textAlign = "right";
      context.fillText(line.label, left - 8, y + 4, left - 12);
      context.textAlign = "left";
      if (width >= NARROW) {
        context.fillText(line.about.verdict, width - right + 8, y + 4, right - 8);
      }
      this.mark(context, line.about, scale, y, colourOf(line.about, inks));
    });
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Record<string, string>} inks
   * @param {Axis} scale
   * @param {[left: number, right: number, height: number]} bounds
   */
  ground(context, inks, scale, [left, right, height]) {
    const [top, bottom] = [TOP - 4, height - BOTTOM + 4];
    if (this.margin !== null) {
      const from = scale.pixel(-this.margin);
      context.fillStyle = inks.well;
      context.fillRect(from, top, scale.pixel(this.margin) - from, bottom - top);
    }
    context.textAlign = "center";
    for (const { at, text } of scale.ticks) {
      const place = scale.pixel(at);
      context.strokeStyle = inks.line;
      stroke(context, [[place, top], [place, bottom]]);
      context.fillStyle = inks.ink;
      context.fillText(text, place, bottom + 14);
    }
    context.strokeStyle = inks.ink;
    stroke(context, [[scale.pixel(0), top], [scale.pixel(0), bottom]]);
    context.fillStyle = inks.muted;
    context.textAlign = "right";
    context.fillText(this.labels, left - 8, TOP - 10, left - 12);
    context.textAlign = "center";
    context.fillStyle = inks.ink;
    context.fillText(scale.label, (left + right) / 2, height - 8);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Difference} about
   * @param {Axis} scale
   * @param {number} y
   * @param {string} colour
   */
  mark(context, about, scale, y, colour) {
    Object.assign(context, { strokeStyle: colour, fillStyle: colour, lineWidth: 2 });
    for (const [i, end] of (interval(about) ?? []).entries()) {
      const edge = i ? scale.to : scale.from;
      const beyond = i ? scale.pixel(end) > edge : scale.pixel(end) < edge;
      const place = beyond ? edge : scale.pixel(end);
      stroke(context, [[scale.pixel(about.difference ?? 0), y], [place, y]]);
      const back = i ? -6 : 6;
      if (beyond) {
        stroke(context, [[edge + back, y - 4], [edge, y], [edge + back, y + 4]]);
      }
    }
    context.lineWidth = 1;
    if (about.difference === null) return;
    const size = about.paired ? 4 : 3;
    context.fillRect(
      scale.pixel(about.difference) - size,
      y - size,
      2 * size,
      2 * size,
    );
  }
}

// The words of a verdict are separated by commas; the first one decides.
/** @param {Difference} about @param {Record<string, string>} inks */
const colourOf = ({ verdict }, inks) => inks[verdict.split(",")[0]] ?? inks.muted;

// What a row shows, in words.
/** @param {Difference} about @returns {string} */
export function described(about) {
  const { a, b, difference, low, high, p, verdict, unit } = about;
  const ends = low === null ? "" : ` (${short(low)} to ${short(high)})`;
  const of = unit ? ` ${unitText(unit)}` : "";
  return [
    `A ${short(a)}, B ${short(b)}${of}`,
    `B - A ${short(difference)}${ends}`,
    `p ${short(p, 3)}: ${verdict}; click to list the trials`,
  ].join("\n");
}
