// What the pointer and the keyboard do with the marks of a figure: point at one, choose
// it, or drag a rectangle about several.

import { make } from "./dom.js";

/** @import { Dot } from "./explorer.d.ts" */
/** @typedef {{ x: number, y: number }} Place in CSS pixels, from the left and top */

const DRAG = 5; // pixels; what moves less is a click
const ASIDE = 3; // a mark so many times as far aside counts as far as one straight on
export const MOST_POINTS = 100; // that the server is asked for at once

/**
 * A figure with marks. `placeOf` is where a mark lies in `element`, and `find` the mark
 * there. `over` is told which one is pointed at, and `choose` the ids of the points
 * behind those that are chosen.
 *
 * @typedef {{
 *   element: HTMLElement,
 *   dots: Dot[],
 *   chosen: Set<string>,
 *   placeOf(dot: Dot): Place | null,
 *   find(place: Place): Dot | null,
 *   over(dot: Dot | null, at: Place): void,
 *   choose(points: string[]): void,
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

  /** @param {Marked} board @param {string} label */
  constructor(board, label) {
    this.board = board;
    const { element } = board;
    element.tabIndex = 0;
    element.setAttribute("role", "application");
    element.setAttribute(
      "aria-label",
      `${label}; arrow keys go from mark to mark, Enter chooses one, Space one more`,
    );
    this.rectangle = make("div", { className: "brush", hidden: true });
    element.append(this.rectangle);
    element.addEventListener("pointerdown", (event) => this.press(event));
    element.addEventListener("pointermove", (event) => this.move(event));
    element.addEventListener("pointerup", (event) => this.lift(event));
    element.addEventListener("pointercancel", () => this.stop());
    element.addEventListener("pointerleave", () => board.over(null, { x: 0, y: 0 }));
    element.addEventListener("keydown", (event) => this.key(event));
    element.addEventListener("blur", () => this.goTo(null));
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
      this.rectangle.hidden = false;
    }
    const [left, top] = [Math.min(from.x, at.x), Math.min(from.y, at.y)];
    Object.assign(this.rectangle.style, {
      left: `${left}px`,
      top: `${top}px`,
      width: `${Math.abs(at.x - from.x)}px`,
      height: `${Math.abs(at.y - from.y)}px`,
    });
  }

  /** @param {PointerEvent} event */
  lift(event) {
    const { board, from } = this;
    if (!from) return;
    const at = this.placeIn(event);
    const brushed = !this.rectangle.hidden;
    this.stop();
    if (brushed) board.choose(pointsOf(this.within(from, at)));
    else {
      const dot = board.find(at);
      if (dot) board.choose(pointsOf([dot]));
    }
  }

  stop() {
    this.from = null;
    this.rectangle.hidden = true;
  }

  /** @param {Place} one @param {Place} other two corners */
  within(one, other) {
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
    const { board, here } = this;
    if (event.key === "Escape" && this.from) this.stop();
    else if (event.key === "Escape") this.goTo(null);
    else if (event.key === "Enter" && here) board.choose(pointsOf([here]));
    else if (event.key === " " && here) this.add(here);
    else {
      const next = this.next(event.key);
      if (!next) return;
      this.goTo(next);
    }
    event.preventDefault();
    event.stopPropagation();
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
    this.board.choose([...chosen]);
  }

  /** @param {string} key @returns {Dot | null} */
  next(key) {
    const { board, here } = this;
    const marks = board.dots.map((dot) => ({ dot, place: board.placeOf(dot) }))
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
