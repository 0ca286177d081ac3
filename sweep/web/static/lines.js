// Lines with bands, by uPlot.

import { make, named, short, unitText } from "./dom.js";
import { dotsOf, HEIGHT, known } from "./board.js";
import { shade } from "./dots.js";

/** @import { Dot, Figure, Panel, Plotted } from "./explorer.d.ts" */

const REACH = 24; // pixels from a mark

export class Lines {
  /** @type {Plotted | null} */
  plot = null;
  /** @type {Set<string>} */
  chosen = new Set();

  /**
   * @param {Figure} figure
   * @param {Panel} panel
   * @param {(dot: Dot | null, at: { x: number, y: number }) => void} over
   * @param {(dot: Dot) => void} choose
   */
  constructor(figure, panel, over, choose) {
    this.figure = figure;
    this.panel = panel;
    this.over = over;
    this.choose = choose;
    this.dots = dotsOf(panel);
    this.element = make("div", { className: "board" });
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.element);
  }

  remove() {
    this.watch.disconnect();
    this.plot?.destroy();
    this.element.remove();
  }

  /** @param {Set<string>} points */
  mark(points) {
    this.chosen = points;
    this.draw();
  }

  /** @returns {(number | null)[][]} x, and for each colour its means, lows and highs */
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
        dots.map((dot) => dot?.y ?? null),
        dots.map((dot) => dot?.low ?? null),
        dots.map((dot) => dot?.high ?? null),
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
    this.plot?.destroy();
    const style = getComputedStyle(this.element);
    const data = this.data;
    this.plot = new uPlot(
      this.options(width, style, data[0].length),
      data,
      this.element,
    );
    const { over } = this.plot;
    over.addEventListener("pointermove", (event) => {
      const dot = this.find(event.offsetX, event.offsetY);
      this.over(dot, { x: event.clientX, y: event.clientY });
    });
    over.addEventListener("pointerleave", () => this.over(null, { x: 0, y: 0 }));
    over.addEventListener("click", (event) => {
      const dot = this.find(event.offsetX, event.offsetY);
      if (dot) this.choose(dot);
    });
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
    return {
      width,
      height: HEIGHT,
      legend: { show: false },
      cursor: { y: false, points: { show: false }, drag: { x: false, y: false } },
      scales: { x: { time: false, distr: x.logarithmic ? 3 : 1 }, y: {} },
      axes: [
        { ...look, label: unitText(x.label), values, labelSize: 22, size: 34 },
        { ...look, label: unitText(y.label), values, labelSize: 22, size: 52 },
      ],
      series: [{}, ...lines.flatMap((line) => [line, bounds, bounds])],
      bands: lines.map((line, i) => ({
        series: [3 * i + 3, 3 * i + 2],
        fill: `color-mix(in srgb, ${line.stroke} 18%, transparent)`,
      })),
    };
  }

  // Where a value lies in the element, and which one lies there.
  /** @param {"x" | "y"} axis @param {number} value */
  pixel(axis, value) {
    return (this.plot?.valToPos(value, axis) ?? 0) + this.margin(axis);
  }

  /** @param {"x" | "y"} axis @param {number} pixel */
  value(axis, pixel) {
    return this.plot?.posToVal(pixel - this.margin(axis), axis) ?? 0;
  }

  /** @param {"x" | "y"} axis */
  margin(axis) {
    const over = this.plot?.over.getBoundingClientRect();
    const box = this.element.getBoundingClientRect();
    return over ? (axis === "x" ? over.left - box.left : over.top - box.top) : 0;
  }

  /** @param {number} left @param {number} top @returns {Dot | null} */
  find(left, top) {
    const { plot } = this;
    if (!plot) return null;
    let best = null;
    let nearest = REACH;
    for (const dot of this.dots) {
      if (dot.x === null || dot.y === null) continue;
      const far = Math.hypot(
        plot.valToPos(dot.x, "x") - left,
        plot.valToPos(dot.y, "y") - top,
      );
      if (far < nearest) [best, nearest] = [dot, far];
    }
    return best;
  }
}
