// Points with their intervals, drawn on a board.

import { Board, stroke } from "./board.js";
import { ring } from "./picking.js";

/** @import { Dot, Figure, Panel } from "./explorer.d.ts" */
/** @import { Choose, Place } from "./picking.js" */

const PALE = 0.45; // of the values of trials
const MANY = 60; // so many have their intervals drawn, as in a printed figure

/** @param {string} colour @param {string} ink black is invisible on a dark page */
export const shade = (colour, ink) => (colour === "#000000" ? ink : colour);

export class Dots extends Board {
  /**
   * @param {Figure} figure
   * @param {Panel} panel
   * @param {(dot: Dot | null, at: Place) => void} over
   * @param {Choose} choose
   */
  constructor(figure, panel, over, choose) {
    super(panel, over, choose);
    this.colours = figure.colours;
    this.paths = figure.form === "paths"
      ? Map.groupBy(this.dots, (dot) => dot.point).values().toArray()
      : [];
  }

  /** @override @param {Dot} dot @param {number} value @param {string} ink */
  lookOfPublished(dot, value, ink) {
    const colour = shade(this.colours[dot.colour], ink);
    return { ...super.lookOfPublished(dot, value, ink), colour };
  }

  /** @override @param {CanvasRenderingContext2D} context @param {string} ink */
  paint(context, ink) {
    const { x, y, dots } = this;
    if (!x || !y) return;
    const few = dots.length <= MANY;
    const { line } = this.panel;
    Object.assign(context, { strokeStyle: ink, lineWidth: 1 });
    stroke(context, line.x.map((value, i) => [x.pixel(value), y.pixel(line.y[i])]));
    this.paintTrials(context, ink);
    Object.assign(context, { lineWidth: few ? 1.2 : 0.6 });
    for (const path of this.paths) this.join(context, path, ink);
    for (const dot of dots) {
      if (dot.x === null || dot.y === null) continue;
      const at = { x: x.pixel(dot.x), y: y.pixel(dot.y) };
      const colour = shade(this.colours[dot.colour], ink);
      Object.assign(context, {
        strokeStyle: colour,
        fillStyle: colour,
        lineWidth: 1.2,
      });
      if (few || dot.best || this.isChosen(dot)) {
        if (dot.low !== null && dot.high !== null) {
          stroke(context, [[at.x, y.pixel(dot.low)], [at.x, y.pixel(dot.high)]]);
        }
        if (typeof dot.x_low === "number" && typeof dot.x_high === "number") {
          stroke(context, [[x.pixel(dot.x_low), at.y], [x.pixel(dot.x_high), at.y]]);
        }
      }
      const size = few ? 4 : 2.5;
      const way = y.beyond(dot.y);
      context.beginPath();
      if (way) arrow(context, at, size, way);
      else context.arc(at.x, at.y, size, 0, 2 * Math.PI);
      context.fill();
      if (dot.best) ring(context, at, 6, colour);
      if (this.isChosen(dot)) ring(context, at, 9, ink);
    }
  }

  // The values of single trials lie behind the means.
  /** @param {CanvasRenderingContext2D} context @param {string} ink */
  paintTrials(context, ink) {
    for (const dot of this.trials) {
      const at = this.placeOf(dot);
      if (!at) continue;
      context.globalAlpha = PALE;
      context.fillStyle = shade(this.colours[dot.colour], ink);
      context.beginPath();
      context.arc(at.x, at.y, 3, 0, 2 * Math.PI);
      context.fill();
      context.globalAlpha = 1;
      if (dot.trial === this.playing) ring(context, at, 6, ink);
    }
  }

  // Draws a line through the marks of one point.
  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Dot[]} path
   * @param {string} ink
   */
  join(context, path, ink) {
    context.strokeStyle = shade(this.colours[path[0].colour], ink);
    const places = path.map((dot) => this.placeOf(dot)).filter((at) => at !== null);
    stroke(context, places.map(({ x, y }) => [x, y]));
  }
}

// A triangle that points up for a `way` of 1, and down for -1.
/**
 * @param {CanvasRenderingContext2D} context
 * @param {{ x: number, y: number }} at
 * @param {number} size
 * @param {number} way
 */
function arrow(context, { x, y }, size, way) {
  context.moveTo(x - size, y + way * size);
  context.lineTo(x + size, y + way * size);
  context.lineTo(x, y - way * size);
}
