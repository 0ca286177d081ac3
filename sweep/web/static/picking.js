// What the pointer and the keyboard do with the marks of a figure: point at one, choose
// it, or draw a rectangle about several.

import { make } from "./dom.js";

/** @import { Dot } from "./explorer.d.ts" */
/** @typedef {{ x: number, y: number }} Place in CSS pixels, from the left and top */
/** @typedef {[Place, Place]} Corners two opposite ones of a rectangle */
/**
 * @callback Choose
 * @param {string[]} points
 * @param {Corners | null} about
 * @param {string} [trial] the id of a single trial
 * @returns {void}
 */

const DRAG = 5; // pixels; what moves less is a click
const ASIDE = 3; // a mark so many times as far aside counts as far as one straight on
export const MOST_POINTS = 100; // that the server is asked for at once

/**
 * A figure with marks. `placeOf` is where a mark lies in `element`, and `find` the mark
 * there. `trials` are values of single trials. `over` is told which mark is pointed at,
 * and `choose` the ids of the points behind those that are chosen, with the rectangle
 * that was drawn about them, or null.
 *
 * @typedef {{
 *   element: HTMLElement,
 *   dots: Dot[],
 *   trials?: Dot[],
 *   chosen: Set<string>,
 *   placeOf(dot: Dot): Place | null,
 *   find(place: Place): Dot | null,
 *   over(dot: Dot | null, at: Place): void,
 *   choose: Choose,
 *   draw(): void,
 * }} Marked
 */

/** @param {Dot[]} dots */
export const pointsOf = (dots) => [
  ...new Set(dots.flatMap(({ point }) => point.split(" "))),
];

// How far a mark lies in the direction of an arrow key; Infinity for one that does not.
/** @param {string} key @param {Place} from @param {Place} to */
function away(key, from, to) {
  const [right, down] = [to.x - from.x, to.y - from.y];
  const along =
    { ArrowRight: right, ArrowLeft: -right, ArrowDown: down, ArrowUp: -down }[
      key
    ];
  if (along === undefined || along < 1) return Infinity;
  const aside = key === "ArrowRight" || key === "ArrowLeft" ? down : right;
  return along + ASIDE * Math.abs(aside);
}

export class MarkPicker {
  /** @type {Dot | null} */
  here = null; // the mark at which the keyboard is
  /** @type {Place | null} */
  from = null; // where the pointer went down
  /** @type {Dot | null} */
  anchor = null; // the mark where the keyboard began a rectangle

  /** @param {Marked} board @param {string} label */
  constructor(board, label) {
    this.board = board;
    const { element } = board;
    element.tabIndex = 0;
    element.setAttribute("role", "application");
    element.setAttribute(
      "aria-label",
      `${label}; arrow keys go from mark to mark, with Shift they draw a rectangle;` +
        " Enter chooses a mark, Space adds a mark",
    );
    this.rectangle = make("div", { className: "brush", hidden: true });
    element.append(this.rectangle);
    element.addEventListener("pointerdown", (event) => this.press(event));
    element.addEventListener("pointermove", (event) => this.move(event));
    element.addEventListener("pointerup", (event) => this.lift(event));
    element.addEventListener("pointercancel", () => this.stop());
    element.addEventListener("pointerleave", () => board.over(null, { x: 0, y: 0 }));
    element.addEventListener("keydown", (event) => this.key(event));
    element.addEventListener("blur", () => this.leave());
  }

  /** @param {MouseEvent} event @returns {Place} */
  placeIn({ clientX, clientY }) {
    const { left, top } = this.board.element.getBoundingClientRect();
    return { x: clientX - left, y: clientY - top };
  }

  // A finger scrolls the page, and chooses by a tap.
  /** @param {PointerEvent} event */
  press(event) {
    if (event.button !== 0) return;
    this.from = this.placeIn(event);
    this.brushes = event.pointerType !== "touch";
  }

  /** @param {PointerEvent} event */
  move(event) {
    const { board, from } = this;
    const at = this.placeIn(event);
    const dot = board.find(at);
    board.element.classList.toggle("over", Boolean(dot));
    board.over(dot, { x: event.clientX, y: event.clientY });
    if (!from || !this.brushes) return;
    if (this.rectangle.hidden) {
      if (Math.hypot(at.x - from.x, at.y - from.y) < DRAG) return;
      board.element.setPointerCapture(event.pointerId);
    }
    surround(this.rectangle, [from, at]);
  }

  /** @param {PointerEvent} event */
  lift(event) {
    const { board, from } = this;
    if (!from) return;
    const at = this.placeIn(event);
    const brushed = !this.rectangle.hidden;
    this.stop();
    if (brushed) return this.brush([from, at]);
    const dot = board.find(at);
    board.choose(dot ? pointsOf([dot]) : [], null, dot?.trial);
  }

  stop() {
    this.from = this.anchor = null;
    this.rectangle.hidden = true;
  }

  // Chooses all marks in a rectangle.
  /** @param {Corners} corners */
  brush(corners) {
    this.board.choose(pointsOf(this.within(corners)), corners);
  }

  /** @param {Corners} corners */
  within([one, other]) {
    const [left, right] = [one.x, other.x].toSorted((a, b) => a - b);
    const [top, bottom] = [one.y, other.y].toSorted((a, b) => a - b);
    return this.board.dots.filter((dot) => {
      const place = this.board.placeOf(dot);
      return place && place.x >= left && place.x <= right && place.y >= top &&
        place.y <= bottom;
    });
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const { here } = this;
    if (event.key === "Escape" && !this.rectangle.hidden) this.stop();
    else if (event.key === "Escape") this.goTo(null);
    else if (event.key === "Enter" && here) this.enter(here);
    else if (event.key === " " && here) this.add(here);
    else {
      const next = this.next(event.key);
      if (!next) return;
      if (event.shiftKey) this.stretch(here ?? next, next);
      else this.stop();
      this.goTo(next);
    }
    event.preventDefault();
    event.stopPropagation();
  }

  // Chooses what the rectangle of the keyboard has, or one mark where there is none.
  /** @param {Dot} here */
  enter(here) {
    const corners = this.corners(this.anchor, here);
    this.stop();
    if (corners) this.brush(corners);
    else this.board.choose(pointsOf([here]), null, here.trial);
  }

  // Draws the rectangle from the mark where Shift was first held to the next one.
  /** @param {Dot} here @param {Dot} next */
  stretch(here, next) {
    this.anchor ??= here;
    const corners = this.corners(this.anchor, next);
    if (corners) surround(this.rectangle, corners);
  }

  /** @param {Dot | null} one @param {Dot} other @returns {Corners | null} */
  corners(one, other) {
    const [first, last] = [one && this.board.placeOf(one), this.board.placeOf(other)];
    return first && last ? [first, last] : null;
  }

  // Adds a mark to the chosen ones, or takes it away again.
  /** @param {Dot} dot */
  add(dot) {
    const [own, chosen] = [pointsOf([dot]), new Set(this.board.chosen)];
    const there = own.every((point) => chosen.has(point));
    for (const point of own) {
      if (there) chosen.delete(point);
      else chosen.add(point);
    }
    this.board.choose([...chosen], null);
  }

  /** @param {string} key @returns {Dot | null} */
  next(key) {
    const { board, here } = this;
    // Upwards and downwards lie the trials of a mark too.
    const trials = /Up$|Down$/.test(key) ? board.trials ?? [] : [];
    const marks = [...board.dots, ...trials].map((dot) => ({
      dot,
      place: board.placeOf(dot),
    }))
      .filter(({ place }) => place !== null);
    const from = here && board.placeOf(here);
    /** @param {Place | null} place */
    const far = (place) => {
      if (!place) return Infinity;
      if (key === "Home") return place.x;
      if (key === "End") return -place.x;
      return from ? away(key, from, place) : place.x;
    };
    if (!/^(Arrow|Home$|End$)/.test(key)) return null;
    let [best, least] = [here, Infinity];
    for (const { dot, place } of marks) {
      if (far(place) < least) [best, least] = [dot, far(place)];
    }
    return best;
  }

  leave() {
    this.stop();
    this.goTo(null);
  }

  /** @param {Dot | null} dot */
  goTo(dot) {
    if (dot === this.here) return;
    this.here = dot;
    const { board } = this;
    const place = dot && board.placeOf(dot);
    const { left, top } = board.element.getBoundingClientRect();
    board.over(dot, place ? { x: left + place.x, y: top + place.y } : { x: 0, y: 0 });
    board.draw();
  }
}

// Shows a box between two corners.
/** @param {HTMLElement} box @param {Corners} corners */
export function surround(box, [one, other]) {
  box.hidden = false;
  Object.assign(box.style, {
    left: `${Math.min(one.x, other.x)}px`,
    top: `${Math.min(one.y, other.y)}px`,
    width: `${Math.abs(one.x - other.x)}px`,
    height: `${Math.abs(one.y - other.y)}px`,
  });
}

// What is drawn about a mark that is chosen, and for a published number: a diamond that
// can be seen on any colour.
/**
 * @param {CanvasRenderingContext2D} context
 * @param {Place} at
 * @param {number} radius
 * @param {string} colour
 */
export function ring(context, at, radius, colour) {
  Object.assign(context, { strokeStyle: colour, lineWidth: 2 });
  context.beginPath();
  context.arc(at.x, at.y, radius, 0, 2 * Math.PI);
  context.stroke();
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Place} at
 * @param {{ colour: string, around: string, filling: string }} look
 */
export function diamond(context, { x, y }, { colour, around, filling }) {
  context.beginPath();
  for (const [right, down] of [[0, -6], [6, 0], [0, 6], [-6, 0]]) {
    context.lineTo(x + right, y + down);
  }
  context.closePath();
  for (const [strokeStyle, lineWidth] of [[around, 5], [colour, 2]]) {
    Object.assign(context, { strokeStyle, lineWidth });
    context.stroke();
  }
  context.fillStyle = filling;
  context.fill();
}
