// A canvas with two axes, on which marks are drawn and found again.

import { Axis } from "./axes.js";
import { contextOf, make, named } from "./dom.js";
import { diamond, MarkPicker, ring } from "./picking.js";

/** @import { Dot, Known, Marks, Panel, Published } from "./explorer.d.ts" */
/** @import { Choose, Place } from "./picking.js" */

export const HEIGHT = 300;
const LEFT = 66;
const MOST_LEFT = 0.25; // of the width, for names
const BOTTOM = 44;
const TOP = 8;
const RIGHT = 12;
const FONT = "12px system-ui, sans-serif";
const REACH = 14; // pixels from a mark
const ON = 6; // pixels from a mark, or from the value of a trial

/** @param {Marks} marks @returns {Dot[]} */
function dotsOf({ columns, data }) {
  return data.map((row) =>
    Object.assign(
      Object.fromEntries(columns.map((name, i) => [name, row[i]])),
    )
  );
}

/** @param {(Known | undefined)[]} values @returns {number[]} */
export const known = (values) =>
  values.filter((value) => typeof value === "number" && Number.isFinite(value))
    .map(Number);

/** @param {Panel} panel */
export const labelOf = ({ title, x, y }) =>
  [`${y.label} against ${x.label}`, title].filter(Boolean).join(", ");

export class Board {
  /**
   * @param {Panel} panel
   * @param {(dot: Dot | null, at: Place) => void} over
   * @param {Choose} choose
   */
  constructor(panel, over, choose) {
    this.panel = panel;
    /** @type {Published[]} */
    this.published = [];
    this.over = over;
    this.choose = choose;
    this.dots = dotsOf(panel.marks);
    this.trials = panel.trials ? dotsOf(panel.trials) : [];
    this.playing = ""; // the id of a trial
    this.reach = REACH;
    /** @type {Set<string>} */
    this.chosen = new Set();
    this.left = LEFT; // of the plotting area, in pixels
    this.canvas = make("canvas", { "aria-hidden": "true" });
    this.element = make("div", { className: "board" }, this.canvas);
    this.picker = new MarkPicker(this, labelOf(panel));
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.element);
  }

  remove() {
    this.watch.disconnect();
    this.element.remove();
  }

  /** @param {Published[]} published */
  mention(published) {
    this.published = published;
    this.draw();
  }

  /** @param {Set<string>} points @param {string} playing */
  mark(points, playing) {
    this.chosen = points;
    this.playing = playing;
    this.draw();
  }

  /** @param {Dot} dot */
  isChosen(dot) {
    return this.chosen.size > 0 &&
      dot.point.split(" ").some((one) => this.chosen.has(one));
  }

  get width() {
    return Math.max(this.element.clientWidth, 120);
  }

  /** @returns {[Axis, Axis]} */
  scales() {
    const { x, y } = this.panel;
    const shown = [...this.dots, ...this.trials];
    const across = known(shown.flatMap((dot) => [dot.x, dot.x_low, dot.x_high]));
    const values = this.published.map(({ value }) => value);
    const up = known([
      ...shown.flatMap((dot) => [dot.y, dot.low, dot.high]),
      ...values,
    ]);
    return [new Axis([...across, ...known([x.low])], x), new Axis(up, y)];
  }

  draw() {
    if (!this.element.isConnected) return;
    const { canvas, width } = this;
    const ratio = devicePixelRatio || 1;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(HEIGHT * ratio);
    const context = contextOf(canvas);
    context.scale(ratio, ratio);
    const style = getComputedStyle(this.element);
    const ink = style.color;
    const line = named(this.element, "--line");
    const [x, y] = this.scales();
    context.font = FONT;
    const names = y.names.map((text) => context.measureText(text).width + 30);
    this.left = Math.min(Math.max(LEFT, ...names), Math.max(LEFT, MOST_LEFT * width));
    this.x = x.span(this.left, width - RIGHT);
    this.y = y.span(HEIGHT - BOTTOM, TOP);
    this.axes(context, ink, line);
    context.save();
    context.beginPath();
    context.rect(this.left, TOP, width - RIGHT - this.left, HEIGHT - BOTTOM - TOP);
    context.clip();
    this.paint(context, ink);
    context.restore();
    this.mentioned(context, ink);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {string} ink
   * @param {string} line
   */
  axes(context, ink, line) {
    const { x, y, width, left } = this;
    if (!x || !y) return;
    const bottom = HEIGHT - BOTTOM;
    Object.assign(context, {
      font: FONT,
      fillStyle: ink,
      strokeStyle: line,
    });
    context.textAlign = "center";
    for (const { at, text } of x.ticks) {
      const place = x.pixel(at);
      stroke(context, [[place, TOP], [place, bottom]]);
      context.fillText(text, place, bottom + 16);
    }
    context.textAlign = "right";
    for (const { at, text } of y.ticks) {
      const place = y.pixel(at);
      stroke(context, [[left, place], [width - RIGHT, place]]);
      context.fillText(fitting(context, text, left - 24), left - 6, place + 4);
    }
    context.textAlign = "center";
    context.fillText(x.label, (left + width) / 2, HEIGHT - 8);
    context.save();
    context.translate(12, (TOP + bottom) / 2);
    context.rotate(-Math.PI / 2);
    context.fillText(fitting(context, y.label, bottom - TOP), 0, 0);
    context.restore();
  }

  // Where a value lies in the element, and which one lies there.
  /** @param {"x" | "y"} axis @param {number} value */
  pixel(axis, value) {
    return this[axis]?.pixel(value) ?? 0;
  }

  /** @param {"x" | "y"} axis @param {number} pixel */
  value(axis, pixel) {
    return this[axis]?.value(pixel) ?? 0;
  }

  /** @param {CanvasRenderingContext2D} _context @param {string} _ink */
  paint(_context, _ink) {}

  // Published numbers, and the mark at which the keyboard is.
  /** @param {CanvasRenderingContext2D} context @param {string} ink */
  mentioned(context, ink) {
    const around = named(this.element, "--panel");
    for (const { point, value } of this.published) {
      const dot = this.dots.find((one) => one.point === point);
      const at = dot && this.placeOfPublished(dot, value);
      if (at) {
        diamond(context, at, { around, ...this.lookOfPublished(dot, value, ink) });
      }
    }
    const { here } = this.picker;
    const at = here && this.placeOf(here);
    if (at) ring(context, at, 12, named(this.element, "--accent"));
  }

  /** @param {Dot} _dot @param {number} _value @param {string} ink */
  lookOfPublished(_dot, _value, ink) {
    return { colour: ink, filling: named(this.element, "--panel") };
  }

  /** @param {Dot} dot @param {number} value @returns {Place | null} */
  placeOfPublished(dot, value) {
    return this.placeOf({ ...dot, y: value });
  }

  /** @param {Dot} dot @returns {Place | null} */
  placeOf(dot) {
    if (dot.x === null || dot.y === null) return null;
    return { x: this.pixel("x", dot.x), y: this.pixel("y", dot.y) };
  }

  // The mark at a place, else the trial there, else the nearest mark.
  /** @param {Place} place @returns {Dot | null} */
  find(place) {
    const { dots, trials, reach } = this;
    /** @param {Dot[]} some @param {number} most */
    const nearest = (some, most) =>
      nearestTo(place, some, (dot) => this.placeOf(dot), most);
    return (trials.length && (nearest(dots, ON) ?? nearest(trials, ON))) ||
      nearest(dots, reach);
  }
}

// The mark that lies nearest to a place, at most so far away.
/**
 * @param {Place} place
 * @param {Dot[]} dots
 * @param {(dot: Dot) => Place | null} placeOf
 * @param {number} reach
 * @returns {Dot | null}
 */
export function nearestTo({ x, y }, dots, placeOf, reach) {
  let [best, nearest] = [/** @type {Dot | null} */ (null), reach];
  for (const dot of dots) {
    const at = placeOf(dot);
    const far = at ? Math.hypot(at.x - x, at.y - y) : Infinity;
    if (far < nearest) [best, nearest] = [dot, far];
  }
  return best;
}

/** @param {CanvasRenderingContext2D} context @param {[number, number][]} places */
export function stroke(context, places) {
  context.beginPath();
  for (const [x, y] of places) context.lineTo(x, y);
  context.stroke();
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {string} text
 * @param {number} room
 */
function fitting(context, text, room) {
  let shown = text;
  while (shown.length > 1 && context.measureText(shown).width > room) {
    shown = `${shown.slice(0, -2)}…`;
  }
  return shown;
}
