// Lines with bands, by uPlot.

import { make, named, short, unitText } from "./dom.js";
import { dotsOf, HEIGHT, known, labelOf, nearestTo } from "./board.js";
import { shade } from "./dots.js";
import { diamond, MarkPicker, ring } from "./picking.js";

/** @import { Dot, Figure, Panel, Plotted, Published } from "./explorer.d.ts" */
/** @import { Choose, Place } from "./picking.js" */

const REACH = 24; // pixels from a mark
const TICK = 60; // pixels of a tick with its number
const ROOM = 0.1; // of the values, above and below them

/** @type {Promise<void> | undefined} */
let loading;

// uPlot is a script that makes a global. It is loaded when the first curve is drawn.
/** @returns {Promise<void>} */
const loaded = () =>
  loading ??= new Promise((done, fail) => {
    const on = { load: () => done(), error: fail };
    document.head.append(make("script", { src: "uplot.js", on }));
  });

export class Lines {
  /** @type {Plotted | null} */
  plot = null;
  /** @type {Set<string>} */
  chosen = new Set();

  /**
   * @param {Figure} figure
   * @param {Panel} panel
   * @param {(dot: Dot | null, at: Place) => void} over
   * @param {Choose} choose
   */
  constructor(figure, panel, over, choose) {
    this.figure = figure;
    this.panel = panel;
    this.over = over;
    this.choose = choose;
    this.dots = dotsOf(panel);
    /** @type {Published[]} */
    this.published = [];
    this.element = make("div", { className: "board" });
    this.picker = new MarkPicker(this, labelOf(panel));
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.element);
  }

  remove() {
    this.watch.disconnect();
    this.plot?.destroy();
    this.element.remove();
  }

  /** @param {Published[]} published */
  mention(published) {
    this.published = published;
    this.draw();
  }

  /** @param {Set<string>} points */
  mark(points) {
    this.chosen = points;
    this.draw();
  }

  // x, and for each colour its means, lows and highs. A line has a gap at null, and
  // goes on over the places of other lines, which are undefined.
  /** @returns {(number | null | undefined)[][]} */
  get data() {
    const places = [...new Set(known(this.dots.map((dot) => dot.x)))].toSorted((a, b) =>
      a - b
    );
    const columns = this.colours.flatMap((colour) => {
      const there = new Map(
        this.dots.filter((dot) => dot.colour === colour).map((dot) => [dot.x, dot]),
      );
      const dots = places.map((place) => there.get(place));
      return [
        dots.map((dot) => dot && (dot.y ?? null)),
        dots.map((dot) => dot && (dot.low ?? null)),
        dots.map((dot) => dot && (dot.high ?? null)),
      ];
    });
    return [places, ...columns];
  }

  get colours() {
    return [...new Set(this.dots.map((dot) => dot.colour))].toSorted((a, b) => a - b);
  }

  draw() {
    const width = this.element.clientWidth;
    if (!width || !this.element.isConnected) return;
    if (typeof uPlot === "undefined") {
      loaded().then(() => this.draw());
      return;
    }
    this.plot?.destroy();
    const style = getComputedStyle(this.element);
    const data = this.data;
    this.plot = new uPlot(
      this.options(width, style, data[0].length),
      data,
      this.element,
    );
  }

  /** @param {number} width @param {CSSStyleDeclaration} style @param {number} places */
  options(width, style, places) {
    const ink = style.color;
    const { x, y } = this.panel;
    const chosen = this.dots.some((dot) => this.chosen.has(dot.point));
    const lines = this.colours.map((colour) => {
      const stroke = shade(this.figure.colours[colour], ink);
      const own = this.dots.some((dot) =>
        dot.colour === colour && this.chosen.has(dot.point)
      );
      const weight = chosen && own ? 3 : 1.6;
      return {
        stroke,
        width: weight,
        points: { show: places <= 60, size: 7, fill: stroke },
        scale: "y",
      };
    });
    const bounds = { width: 0, points: { show: false }, scale: "y" };
    const grid = { stroke: named(this.element, "--line"), width: 1 };
    const look = {
      stroke: ink,
      grid,
      ticks: grid,
      font: "12px system-ui, sans-serif",
      labelFont: "12px system-ui, sans-serif",
    };
    const values = (/** @type {unknown} */ _, /** @type {(number | null)[]} */ ticks) =>
      ticks.map((tick) => (tick === null ? "" : short(tick)));
    const few = x.listed.length > 0 && x.listed.length * TICK <= width;
    const at = few ? { splits: () => x.listed } : {};
    return {
      width,
      height: HEIGHT,
      legend: { show: false },
      cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
      scales: {
        x: { time: false, distr: x.logarithmic ? 3 : 1 },
        y: {
          distr: y.logarithmic ? 3 : 1,
          range: (
            /** @type {unknown} */ _,
            /** @type {number} */ low,
            /** @type {number} */ high,
          ) => this.reach(low, high),
        },
      },
      hooks: {
        draw: [(/** @type {Plotted} */ plot) => this.mentioned(plot, ink)],
      },
      axes: [
        { ...look, label: unitText(x.label), values, ...at, labelSize: 22, size: 34 },
        { ...look, label: unitText(y.label), values, labelSize: 22, size: 52 },
      ],
      series: [{}, ...lines.flatMap((line) => [line, bounds, bounds])],
      bands: lines.map((line, i) => ({
        series: [3 * i + 3, 3 * i + 2],
        fill: `color-mix(in srgb, ${line.stroke} 18%, transparent)`,
      })),
    };
  }

  // The range of an axis that has all values, published ones too.
  /** @param {number} low @param {number} high */
  reach(low, high) {
    const values = this.published.map(({ value }) => value);
    const least = Math.min(low, ...values);
    const most = Math.max(high, ...values);
    return this.panel.y.logarithmic
      ? uPlot.rangeLog(least, most, 10, false)
      : uPlot.rangeNum(least, most, ROOM, true);
  }

  // Where the plotting area begins in the element, in CSS pixels. uPlot lays itself out
  // after it was made: before that its area is empty.
  /** @param {"x" | "y"} axis */
  margin(axis) {
    const { left = 0, top = 0 } = this.plot?.bbox ?? {};
    return (axis === "x" ? left : top) / (devicePixelRatio || 1);
  }

  // Where a value lies in the element, and which one lies there.
  /** @param {"x" | "y"} axis @param {number} value */
  pixel(axis, value) {
    return this.margin(axis) + (this.plot?.valToPos(value, axis) ?? 0);
  }

  /** @param {"x" | "y"} axis @param {number} pixel */
  value(axis, pixel) {
    return this.plot?.posToVal(pixel - this.margin(axis), axis) ?? 0;
  }

  /** @param {Dot} dot @returns {Place | null} */
  placeOf({ x, y }) {
    if (x === null || y === null || !this.plot?.bbox.width) return null;
    return { x: this.pixel("x", x), y: this.pixel("y", y) };
  }

  /** @param {Place} place @returns {Dot | null} */
  find(place) {
    return nearestTo(place, this, REACH);
  }

  // The chosen marks, published numbers, and the mark at which the keyboard is.
  /** @param {Plotted} plot @param {string} ink */
  mentioned(plot, ink) {
    const { ctx: context } = plot;
    const ratio = devicePixelRatio || 1;
    context.save();
    context.scale(ratio, ratio);
    const chosen = this.dots.filter(({ point }) => this.chosen.has(point));
    for (const place of chosen.map((dot) => this.placeOf(dot))) {
      if (place) ring(context, place, 8, ink);
    }
    const around = named(this.element, "--panel");
    for (const { point, value } of this.published) {
      const dot = this.dots.find((one) => one.point === point);
      const place = dot && this.placeOf({ ...dot, y: value });
      const colour = shade(this.figure.colours[dot?.colour ?? 0], ink);
      if (place) diamond(context, place, { colour, around, filling: around });
    }
    const { here } = this.picker;
    const place = here && this.placeOf(here);
    if (place) ring(context, place, 12, named(this.element, "--accent"));
    context.restore();
  }
}
