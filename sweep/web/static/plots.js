// Metrics against the step, each in a small canvas, with what was published as dashed
// lines.

import { button, contextOf, make, short, spaced, unitText, write } from "./dom.js";

/** @import { Metric, Published, Value } from "./protocol.d.ts" */
/** @import { Colours } from "./stage.js" */

/** @typedef {{ left: number, right: number, top: number, bottom: number }} Area */

const MOST = 3000;
const MOST_WORDS = 3;
const EDGE = { left: 2, right: 2, top: 15, bottom: 15 };

// The values of one metric by step, thinned where there are too many of them for a
// plot.
export class Series {
  constructor() {
    /** @type {number[]} */
    this.steps = [];
    /** @type {(number | null)[]} */
    this.values = [];
  }

  clear() {
    this.steps = [];
    this.values = [];
  }

  /** @param {number[]} steps @param {(number | null)[]} values */
  add(steps, values) {
    while ((this.steps.at(-1) ?? -1) >= steps[0]) {
      this.steps.pop();
      this.values.pop();
    }
    for (let i = 0; i < steps.length; i++) {
      this.steps.push(steps[i]);
      this.values.push(values[i]);
    }
    if (this.steps.length <= MOST) return;
    /** @param {unknown} _ @param {number} i */
    const kept = (_, i) => i % 2 === 0 || i === this.steps.length - 1;
    [this.steps, this.values] = [this.steps.filter(kept), this.values.filter(kept)];
  }

  // The value at `step`. In a replay there may be later ones.
  /** @param {number} step */
  at(step) {
    let i = this.steps.length - 1;
    while (i > 0 && this.steps[i] > step) i--;
    return this.values[i];
  }
}

export class Plot {
  /**
   * @param {Metric} metric
   * @param {Series} series
   * @param {Record<string, Value>} settings
   * @param {() => void} remove
   */
  constructor(metric, series, settings, remove) {
    this.metric = metric;
    this.series = series;
    /** @type {Published[]} */
    this.published = [];
    this.canvas = make("canvas", { role: "img", tabIndex: -1 });
    this.value = make("output", { className: "reading" });
    const close = button(
      "remove",
      `Remove the plot of ${spaced(metric.name)}`,
      remove,
      "",
      { className: "quiet" },
    );
    const title = make("h3", { textContent: spaced(metric.name), title: metric.text });
    this.line = make("p", { className: "published" });
    const unit = make("span", {
      className: "unit",
      textContent: unitText(metric.unit),
    });
    this.element = make(
      "figure",
      { className: "plot" },
      make("header", {}, title, this.value, unit, close),
    );
    this.element.append(this.canvas, this.line);
    this.publish(settings);
  }

  // The published numbers for exactly the settings on the screen. They are of a whole
  // run, or of one of its frames.
  /** @param {Record<string, Value>} settings */
  publish(settings) {
    /** @param {Published} one */
    const suits = (one) =>
      Object.entries(one.settings).every(([name, value]) => settings[name] === value);
    /** @type {Map<string, Published>} */
    const known = new Map();
    for (const one of this.metric.published) {
      if (suits(one)) known.set(`${one.value} ${one.frame}`, one);
    }
    this.published = [...known.values()];
    /** @param {number | null} frame */
    const at = (frame) => (frame === null ? "" : ` at step ${frame}`);
    const words = this.published.slice(0, MOST_WORDS).map(({ value, frame }) =>
      short(value) + at(frame)
    ).join(", ");
    const more = this.published.length > MOST_WORDS ? " ..." : "";
    write(this.line, words && `published: ${words}${more}`);
    this.line.title = this.published.map(({ where, says }) => `${where}: ${says}`).join(
      "\n",
    );
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
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Area} area
   * @param {number} step
   * @param {Colours} colours
   */
  drawIn(context, area, step, colours) {
    const { low, high } = this.bounds();
    const { steps } = this.series;
    const first = steps[0] ?? 0;
    const last = Math.max(steps.at(-1) ?? 1, first + 1);
    /** @param {number} one */
    const across = (one) =>
      area.left + ((one - first) / (last - first)) * (area.right - area.left);
    /** @param {number} value */
    const along = (value) =>
      area.bottom - ((value - low) / (high - low)) * (area.bottom - area.top);
    context.lineWidth = 1;
    context.strokeStyle = colours.border;
    for (const y of [area.top, area.bottom]) this.level(context, area, y);
    context.strokeStyle = colours.published;
    context.lineWidth = 1.5;
    context.setLineDash([5, 3]);
    for (const { value } of this.lasting) this.level(context, area, along(value));
    context.setLineDash([]);
    context.strokeStyle = colours.boid;
    this.trace(context, across, along);
    context.strokeStyle = colours.published;
    for (const { value, frame } of this.passing) {
      if (frame !== null) this.ring(context, across(frame), along(value));
    }
    if (step < last - 0.01 * (last - first)) {
      context.fillStyle = colours.chosen;
      context.fillRect(across(step) - 0.75, area.top, 1.5, area.bottom - area.top);
    }
    context.fillStyle = colours.muted;
    context.font = "11px system-ui, sans-serif";
    context.fillText(short(low, 3), area.left, area.bottom + 12);
    context.fillText(short(high, 3), area.left, area.top - 4);
    context.textAlign = "right";
    context.fillText(`step ${last}`, area.right, area.bottom + 12);
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

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {(step: number) => number} across
   * @param {(value: number) => number} along
   */
  trace(context, across, along) {
    const { steps, values } = this.series;
    context.beginPath();
    let joined = false; // a value that is missing leaves a gap
    for (let i = 0; i < steps.length; i++) {
      const value = values[i];
      if (value === null) joined = false;
      else if (joined) context.lineTo(across(steps[i]), along(value));
      else {
        context.moveTo(across(steps[i]), along(value));
        joined = true;
      }
    }
    context.stroke();
  }

  bounds() {
    const known = [
      ...this.series.values.filter((value) => value !== null),
      ...[...this.lasting, ...this.passing].map(({ value }) => value),
    ];
    if (!known.length) return { low: 0, high: 1 };
    const [least, most] = known.reduce(
      ([a, b], value) => [Math.min(a, value), Math.max(b, value)],
      [Infinity, -Infinity],
    );
    const room = (most - least) * 0.08 || Math.abs(most) * 0.1 || 0.5;
    return {
      low: least >= 0 ? Math.max(0, least - room) : least - room,
      high: most + room,
    };
  }

  /** @param {number} step */
  tell(step) {
    const { metric } = this;
    write(this.value, short(this.series.at(step) ?? null));
    const known = this.line.textContent && `; ${this.line.textContent}`;
    const label = `${
      spaced(metric.name)
    }: ${this.value.textContent} ${metric.unit} at step ${step}${known}`;
    if (this.canvas.getAttribute("aria-label") !== label) {
      this.canvas.setAttribute("aria-label", label);
    }
  }
}
