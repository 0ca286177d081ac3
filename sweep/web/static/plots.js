// Metrics against the step, each in a small canvas, with what was published as dashed
// lines. A cursor reads values, and a click goes to its step.

import { Axis, bounds } from "./axes.js";
import { button, contextOf, make, short, spaced, unitText, write } from "./dom.js";

/** @import { Metric, Published, State } from "./protocol.d.ts" */
/** @import { Colours } from "./stage.js" */

/** @typedef {{ left: number, right: number, top: number, bottom: number }} Area */

const MOST = 3000; // values of a drawn line
const MOST_STEPS = 12_000; // of one metric
const MOST_WORDS = 3;
const MOST_NAMES = 3;
const FONT = "11px system-ui, sans-serif";
const EDGE = { left: 40, right: 10, top: 15, bottom: 16 };

// The values of one metric at the steps that were measured, in order.
export class Series {
  // Steps at which the metric restarts from 0.
  /** @type {number[]} */
  restarts = [];

  constructor() {
    /** @type {number[]} */
    this.steps = [];
    /** @type {(number | null)[]} */
    this.values = [];
  }

  clear() {
    this.steps = [];
    this.values = [];
    this.restarts = [];
  }

  /** @param {number[]} steps @param {(number | null)[]} values */
  add(steps, values) {
    for (let i = 0; i < steps.length; i++) {
      const place = this.place(steps[i]);
      const known = this.steps[place] === steps[i] ? 1 : 0;
      this.steps.splice(place, known, steps[i]);
      this.values.splice(place, known, values[i]);
    }
    if (this.steps.length <= MOST_STEPS) return;
    /** @param {unknown} _ @param {number} i */
    const stays = (_, i) => i % 2 === 0 || i === this.steps.length - 1;
    [this.steps, this.values] = [this.steps.filter(stays), this.values.filter(stays)];
  }

  // The number of values before `step`.
  /** @param {number} step */
  place(step) {
    let [low, high] = [0, this.steps.length];
    if (high && this.steps[high - 1] < step) return high;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.steps[middle] < step) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  // The value of `step`, or null where it was not measured.
  /** @param {number} step */
  at(step) {
    const place = this.place(step);
    return this.steps[place] === step ? this.values[place] : null;
  }

  // The step with a value that is nearest to a place on the axis, or null.
  /** @param {number} place */
  nearest(place) {
    /** @param {number | null} best @param {number} step */
    const nearer = (best, step) =>
      best === null || Math.abs(step - place) < Math.abs(best - place) ? step : best;
    return this.steps.reduce(nearer, /** @type {number | null} */ (null));
  }
}

/** @typedef {Pick<State, "settings" | "exact">} Shown */
/**
 * What a plot asks for: that a step is read in it and those beside it, that the run
 * goes to a step, that it is removed, or is shown larger. `clock` has the time of a
 * step in words.
 *
 * @typedef {object} Acts
 * @property {(step: number | null) => void} read
 * @property {(step: number) => void} seek
 * @property {(step: number) => string} clock
 * @property {() => void} [remove]
 * @property {(plot: Plot) => void} [enlarge]
 */

/** @param {Published} one */
const numberOf = ({ value, frame }) =>
  short(value) + (frame === null ? "" : ` at step ${frame}`);

// What is said of a number that is not about this run.
/** @param {Published} one @param {string[]} others */
function elsewhere(one, others) {
  const number = `${numberOf(one)} is published for`;
  if (!others.length) return `${number} a run without changes of parameters`;
  const names = others.slice(0, MOST_NAMES).map(spaced).join(", ");
  const more = others.length - MOST_NAMES;
  return `${number} other parameters: ${names}${more > 0 ? ` and ${more} more` : ""}`;
}

export class Plot {
  // That of the same metric in a run beside, which is drawn on the same axes.
  /** @type {Plot | null} */
  peer = null;
  // The same plot in a larger canvas.
  /** @type {Plot | null} */
  larger = null;
  // Whether values are drawn by their logarithms: those above 0, if there are any.
  logarithmic = false;
  // The step whose value is read.
  /** @type {number | null} */
  cursor = null;

  /**
   * @param {Metric} metric
   * @param {Series} series
   * @param {Shown} shown
   * @param {Acts} acts
   */
  constructor(metric, series, shown, acts) {
    this.metric = metric;
    this.acts = acts;
    this.series = series;
    /** @type {Published[]} */
    this.published = [];
    this.canvas = make("canvas", { role: "img", tabIndex: -1 });
    this.value = make("output", { className: "reading" });
    this.line = make("p", { className: "published" });
    const unit = make("span", {
      className: "unit",
      textContent: unitText(metric.unit),
    });
    this.element = make(
      "figure",
      { className: "plot" },
      make("header", {}, this.title(), this.value, unit, ...this.close()),
    );
    this.element.append(this.canvas, this.line);
    this.publish(shown);
    this.canvas.addEventListener(
      "pointermove",
      (event) => acts.read(this.under(event)),
    );
    this.canvas.addEventListener("pointerleave", () => acts.read(null));
    this.canvas.addEventListener("click", (event) => {
      const step = this.under(event);
      if (step !== null) acts.seek(step);
    });
  }

  title() {
    const { metric: { name, text }, acts: { enlarge } } = this;
    if (!enlarge) return make("h3", { textContent: spaced(name) });
    const open = make("button", {
      type: "button",
      className: "quiet",
      textContent: spaced(name),
      title: `${text}. Click to enlarge, with source and values`,
      on: { click: () => enlarge(this) },
    });
    return make("h3", {}, open);
  }

  close() {
    const { metric: { name }, acts: { remove } } = this;
    if (!remove) return [];
    const label = `Remove the plot of ${spaced(name)}`;
    return [button("remove", label, remove, "", { className: "quiet" })];
  }

  // The step below the mouse.
  /** @param {MouseEvent} event */
  under({ offsetX }) {
    const { first, last } = this.span();
    const width = this.canvas.clientWidth - EDGE.left - EDGE.right;
    const part = (offsetX - EDGE.left) / Math.max(1, width);
    return this.series.nearest(first + part * (last - first));
  }

  // The published numbers are shown where no setting differs and none was changed on
  // the way. Else the line names what differs from the number that is nearest.
  /** @param {Shown} shown */
  publish({ settings, exact }) {
    /** @param {Published} one */
    const others = (one) =>
      Object.keys(one.settings).filter((name) => settings[name] !== one.settings[name]);
    const rows = this.metric.published.map((one) => ({ one, others: others(one) }))
      .sort((first, second) => first.others.length - second.others.length);
    const same = rows.filter((row) => exact && !row.others.length);
    const known = new Map(same.map(({ one }) => [`${one.value} ${one.frame}`, one]));
    this.published = [...known.values()];
    const [nearest] = rows;
    const told = this.published.length ? this.published : nearest ? [nearest.one] : [];
    write(
      this.line,
      this.published.length || !nearest
        ? this.words()
        : elsewhere(nearest.one, nearest.others),
    );
    this.line.classList.toggle("elsewhere", !this.published.length);
    this.line.title = told.map(({ where, says }) => `${where}: ${says}`).join("\n");
  }

  words() {
    const words = this.published.slice(0, MOST_WORDS).map(numberOf).join(", ");
    const more = this.published.length > MOST_WORDS ? " ..." : "";
    return words && `published: ${words}${more}`;
  }

  /** @param {number} step @param {Colours} colours */
  draw(step, colours) {
    const { canvas } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    const ratio = devicePixelRatio || 1;
    if (canvas.width !== Math.round(width * ratio)) {
      canvas.width = Math.round(width * ratio);
    }
    if (canvas.height !== Math.round(height * ratio)) {
      canvas.height = Math.round(height * ratio);
    }
    const context = contextOf(canvas);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    const area = {
      left: EDGE.left,
      right: width - EDGE.right,
      top: EDGE.top,
      bottom: height - EDGE.bottom,
    };
    this.drawIn(context, area, step, colours);
    this.tell(step);
    this.enlarge(step, colours);
  }

  /** @param {number} step @param {Colours} colours */
  enlarge(step, colours) {
    const { larger } = this;
    if (!larger) return;
    const { series, peer, published, cursor, logarithmic } = this;
    Object.assign(larger, { series, peer, published, cursor, logarithmic });
    larger.draw(step, colours);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Area} area
   * @param {number} step
   * @param {Colours} colours
   */
  drawIn(context, area, step, colours) {
    const { first, last } = this.span();
    const { low, high, logarithmic } = this.bounds();
    const across = new Axis([first, last], {}, 0).span(area.left, area.right);
    const along = new Axis([low, high], { logarithmic }, 0).span(area.bottom, area.top);
    context.lineWidth = 1;
    context.strokeStyle = colours.border;
    context.fillStyle = colours.muted;
    context.font = FONT;
    this.axes(context, area, across, along);
    context.strokeStyle = colours.published;
    context.lineWidth = 1.5;
    context.setLineDash([5, 3]);
    for (const { value } of this.lasting) this.level(context, area, along.pixel(value));
    context.setLineDash([]);
    context.strokeStyle = colours.boid;
    this.trace(context, across, along);
    context.strokeStyle = colours.published;
    for (const { value, frame } of this.passing) {
      if (frame !== null) this.ring(context, across.pixel(frame), along.pixel(value));
    }
    if (step < last - 0.01 * (last - first)) {
      context.fillStyle = colours.chosen;
      context.fillRect(
        across.pixel(step) - 0.75,
        area.top,
        1.5,
        area.bottom - area.top,
      );
    }
    const { cursor } = this;
    if (cursor !== null) {
      const value = this.series.at(cursor);
      context.fillStyle = colours.ink;
      context.fillRect(across.pixel(cursor) - 0.5, area.top, 1, area.bottom - area.top);
      context.strokeStyle = colours.ink;
      if (value !== null) this.ring(context, across.pixel(cursor), along.pixel(value));
    }
    context.fillStyle = cursor === null ? colours.muted : colours.ink;
    context.textAlign = "right";
    const words = cursor === null ? `step ${last}` : this.acts.clock(cursor);
    context.fillText(words, area.right, area.top - 4);
    context.textAlign = "left";
  }

  get lasting() {
    return this.published.filter(({ frame }) => frame === null);
  }

  get passing() {
    const { steps } = this.series;
    const last = steps.at(-1) ?? -1;
    return this.published.filter(({ frame }) =>
      frame !== null && frame >= steps[0] && frame <= last
    );
  }

  /** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y */
  ring(context, x, y) {
    context.beginPath();
    context.arc(x, y, 3.5, 0, 2 * Math.PI);
    context.stroke();
  }

  /** @param {CanvasRenderingContext2D} context @param {Area} area @param {number} y */
  level(context, area, y) {
    context.beginPath();
    context.moveTo(area.left, y);
    context.lineTo(area.right, y);
    context.stroke();
  }

  // Lines at the ticks of values, and numbers at those of both axes.
  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Area} area
   * @param {Axis} across
   * @param {Axis} along
   */
  axes(context, area, across, along) {
    for (const y of [area.top, area.bottom]) this.level(context, area, y);
    context.textAlign = "right";
    for (const { at, text } of along.ticks) {
      this.level(context, area, along.pixel(at));
      context.fillText(text, area.left - 4, along.pixel(at) + 4);
    }
    context.textAlign = "center";
    for (const { at, text } of across.ticks) {
      context.fillText(text, across.pixel(at), area.bottom + 12);
    }
    context.textAlign = "left";
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Axis} across
   * @param {Axis} along
   */
  trace(context, across, along) {
    const { steps, values, restarts } = this.series;
    const apart = Math.ceil(steps.length / MOST);
    context.beginPath();
    let joined = false; // a value that is missing, or has no place, leaves a gap
    for (let i = 0; i < steps.length; i++) {
      const value = values[i];
      /** @param {number} at */
      const between = (at) => i > 0 && at > steps[i - 1] && at <= steps[i];
      const begins = restarts.some(between);
      if (begins) joined = false;
      else if (i % apart && i < steps.length - 1) continue;
      if (value === null || (along.logarithmic && value <= 0)) joined = false;
      else if (joined) context.lineTo(across.pixel(steps[i]), along.pixel(value));
      else {
        context.moveTo(across.pixel(steps[i]), along.pixel(value));
        joined = true;
      }
    }
    context.stroke();
  }

  // The first and the last step of both axes.
  span() {
    const all = this.peer ? [this, this.peer] : [this];
    const firsts = all.map(({ series }) => series.steps[0] ?? Infinity);
    const first = Math.min(...firsts);
    const from = Number.isFinite(first) ? first : 0;
    const last = Math.max(
      from + 1,
      ...all.map(({ series }) => series.steps.at(-1) ?? 1),
    );
    return { first: from, last };
  }

  known() {
    return [
      ...this.series.values.filter((value) => value !== null),
      ...[...this.lasting, ...this.passing].map(({ value }) => value),
    ];
  }

  // The least and the largest value of both runs, with some room.
  bounds() {
    const all = [...this.known(), ...(this.peer?.known() ?? [])];
    const positive = all.filter((value) => value > 0);
    const logarithmic = this.logarithmic && positive.length > 0;
    const [least, most] = bounds(logarithmic ? positive : all);
    if (logarithmic) {
      const factor = (most / least) ** 0.08 * (most > least ? 1 : 1.1);
      return { low: least / factor, high: most * factor, logarithmic };
    }
    const room = all.length && ((most - least) * 0.08 || Math.abs(most) * 0.1 || 0.5);
    return {
      low: least >= 0 ? Math.max(0, least - room) : least - room,
      high: most + room,
      logarithmic,
    };
  }

  /** @param {number} step */
  tell(step) {
    const { metric } = this;
    const read = this.cursor ?? step;
    write(this.value, short(this.series.at(read), this.cursor === null ? 4 : 6));
    const known = this.line.textContent && `; ${this.line.textContent}`;
    const label = `${
      spaced(metric.name)
    }: ${this.value.textContent} ${metric.unit} at step ${read}${known}`;
    if (this.canvas.getAttribute("aria-label") !== label) {
      this.canvas.setAttribute("aria-label", label);
    }
  }
}
