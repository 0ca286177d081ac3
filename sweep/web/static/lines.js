// Lines with bands, drawn on a board.

import { known } from "./board.js";
import { Dots, shade } from "./dots.js";
import { ring } from "./picking.js";

/** @import { Dot, Figure, Panel } from "./explorer.d.ts" */
/** @import { Choose, Place } from "./picking.js" */

const REACH = 24; // pixels from a mark
const MOST_MARKED = 60; // places of a line that are drawn as marks
const RADIUS = 3.5;

export class Lines extends Dots {
  /**
   * @param {Figure} figure
   * @param {Panel} panel
   * @param {(dot: Dot | null, at: Place) => void} over
   * @param {Choose} choose
   */
  constructor(figure, panel, over, choose) {
    super(figure, panel, over, choose);
    this.reach = REACH;
    this.lines = Map.groupBy(this.dots, ({ colour }) => colour).values().toArray()
      .map((line) => line.toSorted((a, b) => (a.x ?? 0) - (b.x ?? 0)));
    this.marked = new Set(known(this.dots.map(({ x }) => x))).size <= MOST_MARKED;
  }

  // Bands lie below all lines.
  /** @override @param {CanvasRenderingContext2D} context @param {string} ink */
  paint(context, ink) {
    for (const line of this.lines) this.fill(context, line, ink);
    this.paintTrials(context, ink);
    for (const line of this.lines) this.trace(context, line, ink);
    for (const dot of this.dots) {
      const at = this.placeOf(dot);
      if (!at) continue;
      if (this.marked) {
        context.fillStyle = shade(this.colours[dot.colour], ink);
        context.beginPath();
        context.arc(at.x, at.y, RADIUS, 0, 2 * Math.PI);
        context.fill();
      }
      if (this.isChosen(dot)) ring(context, at, 8, ink);
    }
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Dot[]} line
   * @param {string} ink
   */
  fill(context, line, ink) {
    context.fillStyle = shade(this.colours[line[0].colour], ink);
    context.globalAlpha = 0.18;
    for (const run of runs(line, ({ low, high }) => low !== null && high !== null)) {
      const lower = run.map((dot) => ({ ...dot, y: dot.low }));
      const upper = run.toReversed().map((dot) => ({ ...dot, y: dot.high }));
      this.path(context, [...lower, ...upper]);
      context.fill();
    }
    context.globalAlpha = 1;
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Dot[]} line
   * @param {string} ink
   */
  trace(context, line, ink) {
    context.strokeStyle = shade(this.colours[line[0].colour], ink);
    context.lineWidth = line.some((dot) => this.isChosen(dot)) ? 3 : 1.6;
    for (const run of runs(line, ({ y }) => y !== null)) {
      this.path(context, run);
      context.stroke();
    }
    context.lineWidth = 1;
  }

  // Begins a path through marks.
  /** @param {CanvasRenderingContext2D} context @param {Dot[]} dots */
  path(context, dots) {
    context.beginPath();
    for (const dot of dots) {
      const at = this.placeOf(dot);
      if (at) context.lineTo(at.x, at.y);
    }
  }
}

// The parts of a line between marks that lack a value.
/** @param {Dot[]} line @param {(dot: Dot) => boolean} there @returns {Dot[][]} */
function runs(line, there) {
  /** @type {Dot[][]} */
  const parts = [[]];
  for (const dot of line) {
    if (there(dot)) parts[parts.length - 1].push(dot);
    else parts.push([]);
  }
  return parts.filter((part) => part.length > 0);
}
