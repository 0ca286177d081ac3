// The hand: with pointer or keyboard it places, moves and resizes obstacles, sets
// goals, and selects boids. A click selects what a drag may change then: a drag over
// something else moves the view.

import { paced } from "./dom.js";
import { goalsOf } from "./ground.js";
import { isSolid, shifted } from "./obstacles.js";

/** @import { Kind, Message, Obstacle, Scene, Shape } from "./protocol.d.ts" */
/** @import { Place, Stage } from "./stage.js" */

/** @typedef {"select" | "goal" | Kind} Tool */

/**
 * What the pointer has taken hold of; a click selects the `boid`, the `shape` or the
 * `goal` with that index.
 *
 * @typedef {{ kind: Kind, boid: null }} Drawing
 * @typedef {{
 *   kind: "shape",
 *   boid: number | null,
 *   index: number,
 *   row: Obstacle,
 * }} Moving
 * @typedef {{
 *   kind: "handle",
 *   boid: null,
 *   index: number,
 *   row: Obstacle,
 *   signs: number[],
 * }} Sizing
 * @typedef {{ kind: "goal", boid: number | null, index: number }} Aiming
 * @typedef {{
 *   kind: "pan",
 *   boid: number | null,
 *   shape?: number,
 *   goal?: number,
 * }} Panning
 */

/** @typedef {{ place: Place, at: Place, moved: boolean, base?: Obstacle[] }} Way */
/** @typedef {Drawing | Moving | Sizing | Aiming | Panning} Grip */
/** @typedef {(Drawing | Moving | Sizing) & Way} Stretch */
/** @typedef {Grip & Way} Drag */

/** @type {Record<string, number>} */
const NEAR = { mouse: 9, pen: 14, touch: 22 }; // CSS pixels
const STILL = 4;
const DRAG_SEND_EVERY = 150; // ms while dragging
const PATIENCE = 3000; // ms to wait for the world that was asked for
/** @type {Record<string, [across: number, along: number]>} */
const ARROWS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

// Obstacles are rows [x, y, half width, half height, 1 for a disc, polygon], as in a
// scene; shapes are what a spec has.
/** @param {Obstacle} obstacle @returns {Shape} */
export function shapeOf([x, y, halfWidth, halfHeight, round, polygon]) {
  if (polygon) return { polygon };
  return round
    ? { disc: { x, y, radius: halfWidth } }
    : { rectangle: { x, y, width: 2 * halfWidth, height: 2 * halfHeight } };
}

/** @param {Obstacle[]} first @param {Obstacle[]} second */
const same = (first, second) =>
  first.length === second.length &&
  first.every((row, i) =>
    numbersOf(row).every((value, k) => Math.abs(value - numbersOf(second[i])[k]) < 1e-9)
  );

/** @param {Obstacle} obstacle @returns {number[]} */
const numbersOf = ([x, y, halfWidth, halfHeight, round, polygon]) =>
  polygon?.vertices.flat() ?? [x, y, halfWidth, halfHeight, round];

/** @param {Place} one @param {Place} other */
const apart = (one, other) => Math.hypot(one.x - other.x, one.y - other.y);

/** @param {Place} one @param {Place} other */
const between = (one, other) => ({
  x: (one.x + other.x) / 2,
  y: (one.y + other.y) / 2,
});

export class Hand {
  /**
   * @param {Stage} stage
   * @param {(message: Message) => void} send
   * @param {() => void} changed
   */
  constructor(stage, send, changed) {
    this.stage = stage;
    this.send = send;
    this.changed = changed;
    /** @type {Tool} */
    this.tool = "select";
    this.frozen = false;
    /** @type {Drag | { kind: "pinch" } | null} */
    this.drag = null;
    /** @type {Map<number, Place>} */
    this.fingers = new Map();
    this.waiting = 0;
    this.sendPaced = paced(() => this.drag && this.sendShapes(true), DRAG_SEND_EVERY);
    this.goalPaced = paced((/** @type {Message} */ message) => {
      if (this.drag?.kind === "goal" && this.drag.moved) this.send(message);
    }, DRAG_SEND_EVERY);
    const { canvas } = stage;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.up(event));
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
  }

  // Whether obstacles stay as they are: those that move are set in the spec.
  get fixed() {
    return this.frozen || Boolean(this.stage.scene?.paths);
  }

  // The tool for goals sets the one that is selected: the first of several, and where
  // it is in the hand already, the next one.
  /** @param {Tool} tool */
  use(tool) {
    const before = this.tool;
    this.tool = (tool === "goal" ? this.frozen : this.fixed) ? "select" : tool;
    if (this.tool === "goal" && this.goals.length > 0) {
      const { goalMarked } = this.stage;
      const next = before === "goal" && goalMarked !== null ? goalMarked + 1 : 0;
      this.mark(null, next % this.goals.length);
    }
    this.stage.canvas.dataset.tool = this.tool;
    this.changed();
  }

  get goals() {
    return this.stage.scene ? goalsOf(this.stage.scene) : [];
  }

  // A scene has come. Once the world is as it was edited here, the edit is forgotten.
  /** @param {Scene} scene */
  settle(scene) {
    const { stage } = this;
    const late = performance.now() - this.waiting > PATIENCE;
    if (stage.edited && !this.drag && (late || same(stage.edited, scene.obstacles))) {
      stage.edited = null;
    }
    if (stage.marked !== null && stage.marked >= stage.obstacles.length) {
      stage.marked = null;
    }
    if (stage.goalMarked !== null && stage.goalMarked >= goalsOf(scene).length) {
      stage.goalMarked = null;
    }
  }

  refuse() {
    if (this.drag) return;
    this.stage.edited = null;
    this.stage.redraw();
  }

  // Selects an obstacle, a goal, or nothing.
  /** @param {number | null} index @param {number | null} goal */
  mark(index, goal = null) {
    this.stage.marked = index;
    this.stage.goalMarked = goal;
    this.stage.redraw();
    this.changed();
  }

  // Sends the whole list of obstacles.
  /** @param {Obstacle[]} obstacles */
  replace(obstacles) {
    const { stage } = this;
    stage.edited = obstacles;
    if (stage.marked !== null && stage.marked >= obstacles.length) stage.marked = null;
    this.sendShapes(false);
    stage.redraw();
    this.changed();
  }

  // The paced call may come when the next drag has begun and has changed nothing yet.
  /** @param {boolean} part of a drag that goes on */
  sendShapes(part) {
    const { edited } = this.stage;
    if (!edited) return;
    this.waiting = performance.now();
    this.send({ type: "shapes", shapes: edited.map(shapeOf), part });
  }

  // What was edited here is not to come back: the world of before is asked for.
  forget() {
    this.drag = null;
    this.stage.edited = null;
    this.stage.redraw();
  }

  /** @param {Kind} kind @param {number} x @param {number} y */
  add(kind, x, y) {
    const { width, height } = this.stage.world;
    const half = this.tidy(Math.min(width, height) / 16);
    const round = kind === "disc" ? 1 : 0;
    this.stage.marked = this.stage.obstacles.length;
    this.replace([
      ...this.stage.obstacles,
      [this.tidy(x), this.tidy(y), half, half, round],
    ]);
  }

  remove(index = this.stage.marked) {
    if (index === null || this.fixed) return;
    this.stage.marked = null;
    this.replace(this.stage.obstacles.filter((_, i) => i !== index));
  }

  /** @param {number} index @param {Obstacle} row */
  change(index, row) {
    this.replace(this.stage.obstacles.map((one, i) => (i === index ? row : one)));
  }

  // Rounds lengths to what the screen can show, so that a spec is readable.
  /** @param {number} length */
  tidy(length) {
    const grain = 10 ** Math.floor(Math.log10(1 / this.stage.camera.scale));
    return Number((Math.round(length / grain) * grain).toPrecision(9));
  }

  /** @param {Place} place @returns {Place} */
  within({ x, y }) {
    const { width, height } = this.stage.world;
    return { x: Math.min(Math.max(x, 0), width), y: Math.min(Math.max(y, 0), height) };
  }

  /** @param {MouseEvent} event @returns {Place} */
  where(event) {
    const box = this.stage.canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** @param {PointerEvent} event */
  down(event) {
    if (event.button !== 0 || !this.stage.scene) return;
    this.stage.canvas.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, this.where(event));
    if (this.fingers.size === 2) this.drag = { kind: "pinch" };
    if (this.fingers.size > 1) return;
    const place = this.where(event);
    const grip = this.grip(place, NEAR[event.pointerType] ?? 9);
    this.drag = { place, at: this.stage.toWorld(place), moved: false, ...grip };
  }

  // The thing under the pointer, which a drag moves. A click selects a boid there.
  /** @param {Place} place @param {number} near @returns {Grip} */
  grip(place, near) {
    const { stage, tool } = this;
    if (tool === "goal") {
      return { kind: tool, boid: null, index: stage.goalMarked ?? 0 };
    }
    if (tool !== "select") return { kind: tool, boid: null };
    const { chosen: row, marked: index } = stage;
    if (!this.fixed && row && index !== null) {
      const handle = stage.handles(row).find((one) => apart(one, place) <= near);
      if (handle) {
        return { kind: "handle", boid: null, index, row, signs: handle.signs };
      }
    }
    const boid = stage.boidAt(place, near);
    if (this.frozen) return { kind: "pan", boid };
    const goal = this.goalAt(place, near + 3);
    if (goal < 0) return this.gripWorld(place, boid);
    if (goal === stage.goalMarked) return { kind: "goal", boid, index: goal };
    return { kind: "pan", boid, goal };
  }

  /** @param {Place} place @param {number | null} boid @returns {Grip} */
  gripWorld(place, boid) {
    const { stage } = this;
    const index = this.shapeAt(stage.toWorld(place));
    if (index < 0) return { kind: "pan", boid };
    if (this.fixed || index !== stage.marked) {
      return { kind: "pan", boid, shape: index };
    }
    return { kind: "shape", boid, index, row: stage.obstacles[index] };
  }

  // The goal whose flag is nearest, of those within reach; -1 for none.
  /** @param {Place} place @param {number} near */
  goalAt(place, near) {
    const far = this.goals.map(([x, y]) => apart(this.stage.toScreen({ x, y }), place));
    const least = Math.min(...far);
    return least <= near ? far.indexOf(least) : -1;
  }

  /** @param {Place} place */
  shapeAt({ x, y }) {
    /** @param {Obstacle} obstacle */
    const inside = ([middleX, middleY, a, b, round, polygon]) => {
      if (polygon) return isSolid(polygon, { x, y });
      const [dx, dy] = [Math.abs(x - middleX), Math.abs(y - middleY)];
      return round ? Math.hypot(dx, dy) <= a : dx <= a && dy <= b;
    };
    return this.stage.obstacles.findLastIndex(inside);
  }

  /** @param {PointerEvent} event */
  move(event) {
    const { drag, stage } = this;
    const place = this.where(event);
    if (!drag) return this.hover(place);
    if (drag.kind === "pinch") return this.pinch(event.pointerId, place);
    drag.moved ||= apart(place, drag.place) > STILL;
    if (!drag.moved) return;
    const at = stage.toWorld(place);
    if (drag.kind === "pan") stage.pan(drag.at.x - at.x, drag.at.y - at.y);
    else if (drag.kind === "goal") this.setGoal(drag.index, at, true);
    else this.stretch(drag, at);
  }

  /** @param {Place} place */
  hover(place) {
    const { canvas } = this.stage;
    if (!this.stage.scene || !this.stage.frame) return;
    const { boid, kind, ...grip } = this.grip(place, NEAR.mouse);
    const clicked = boid !== null || "shape" in grip || "goal" in grip;
    canvas.dataset.over = clicked ? "boid" : kind;
  }

  /** @param {number} id @param {Place} place */
  pinch(id, place) {
    if (this.fingers.size < 2) return; // one of them is gone
    const [first, second] = [...this.fingers.values()];
    this.fingers.set(id, place);
    const [third, fourth] = [...this.fingers.values()];
    const [before, after] = [apart(first, second), apart(third, fourth)];
    const { stage } = this;
    const middle = between(first, second);
    const from = stage.toWorld(middle);
    const to = stage.toWorld(between(third, fourth));
    stage.pan(from.x - to.x, from.y - to.y);
    if (before > 0) stage.zoom(after / before, middle);
  }

  // A shape under the hand: drawn, moved or resized.
  /** @param {Stretch} drag @param {Place} at */
  stretch(drag, at) {
    const { stage } = this;
    const index = "index" in drag ? drag.index : (drag.base ?? stage.obstacles).length;
    if (!drag.base) {
      drag.base = stage.obstacles;
      stage.marked = index;
    }
    stage.edited = [...drag.base];
    stage.edited[index] = this.stretched(drag, at);
    stage.redraw();
    this.sendPaced();
  }

  /** @param {Stretch} drag @param {Place} at */
  stretched(drag, at) {
    if (drag.kind === "shape") return this.movedRow(drag, at);
    return drag.kind === "handle" ? this.sizedRow(drag, at) : this.drawnRow(drag, at);
  }

  /** @param {Drawing & Way} drag @param {Place} to @returns {Obstacle} */
  drawnRow({ kind, at: from }, to) {
    if (kind === "disc") {
      const { x, y } = this.within(from);
      const radius = this.least(Math.hypot(to.x - x, to.y - y));
      return [this.tidy(x), this.tidy(y), radius, radius, 1];
    }
    return this.rectangle(this.within(from), this.within(to));
  }

  // By two opposite corners.
  /** @param {Place} first @param {Place} second @returns {Obstacle} */
  rectangle(first, second) {
    const { x, y } = between(first, second);
    return [
      this.tidy(x),
      this.tidy(y),
      this.least(Math.abs(first.x - second.x) / 2),
      this.least(Math.abs(first.y - second.y) / 2),
      0,
    ];
  }

  /** @param {number} length */
  least(length) {
    return Math.max(this.tidy(length), this.tidy(2 / this.stage.camera.scale));
  }

  /** @param {Moving & Way} drag @param {Place} to @returns {Obstacle} */
  movedRow({ row, at: from }, to) {
    const { x, y } = this.within({
      x: row[0] + to.x - from.x,
      y: row[1] + to.y - from.y,
    });
    if (!row[5]) return [this.tidy(x), this.tidy(y), row[2], row[3], row[4]];
    const [across, along] = [this.tidy(x) - row[0], this.tidy(y) - row[1]];
    const polygon = shifted(row[5], across, along);
    return [row[0] + across, row[1] + along, row[2], row[3], 0, polygon];
  }

  /** @param {Sizing & Way} drag @param {Place} to @returns {Obstacle} */
  sizedRow({ row, signs: [a, b] }, to) {
    const [x, y, halfWidth, halfHeight, round] = row;
    if (round) {
      const radius = this.least(Math.hypot(to.x - x, to.y - y));
      return [x, y, radius, radius, 1];
    }
    return this.rectangle({ x: x - a * halfWidth, y: y - b * halfHeight }, to);
  }

  /** @param {number} index @param {Place} place @param {boolean} part of a drag */
  setGoal(index, place, part) {
    const { scene } = this.stage;
    if (!scene?.goal || index > scene.next_goals.length) return;
    const [x, y] = [this.tidy(place.x), this.tidy(place.y)];
    if (index === 0) scene.goal = [x, y, scene.goal[2]];
    else scene.next_goals[index - 1] = [x, y];
    this.stage.redraw();
    /** @type {Message} */
    const message = { type: "goal", x, y, index, part };
    if (part) this.goalPaced(message);
    else this.send(message);
  }

  /** @param {PointerEvent} event */
  up(event) {
    const { drag, stage } = this;
    this.fingers.delete(event.pointerId);
    if (!drag || (drag.kind === "pinch" && this.fingers.size > 0)) return;
    this.drag = null;
    if (drag.kind === "pinch") return;
    if (event.type === "pointercancel") return this.refuse();
    if (drag.base) this.sendShapes(false);
    else if (drag.kind === "goal" && drag.moved) {
      this.setGoal(drag.index, stage.toWorld(this.where(event)), false);
    } else if (!drag.moved) this.click(drag);
    if (this.tool !== "select") this.use("select");
    this.changed();
    stage.redraw();
  }

  /** @param {Drag} drag */
  click(drag) {
    const { x, y } = this.within(drag.at);
    if (drag.kind === "disc" || drag.kind === "rectangle") this.add(drag.kind, x, y);
    else if (drag.kind === "goal" && this.tool === "goal") {
      this.setGoal(drag.index, drag.at, false);
      this.mark(null, drag.index);
    } else if (drag.boid !== null) this.send({ type: "select", boid: drag.boid });
    else if (drag.kind === "pan") this.clickThing(drag);
  }

  /** @param {Panning} drag */
  clickThing({ shape, goal }) {
    if (shape === undefined && goal === undefined) this.release();
    else this.mark(shape ?? null, goal);
  }

  release() {
    this.mark(null);
    if (this.stage.selection) this.send({ type: "select", boid: null });
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    this.stage.zoom(
      Math.exp(-event.deltaY / (event.ctrlKey ? 100 : 500)),
      this.where(event),
    );
    this.changed();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { stage } = this;
    const arrow = ARROWS[event.key];
    if (arrow && !event.ctrlKey && !event.metaKey) this.arrow(arrow, event.shiftKey);
    else if (event.key === "Delete" || event.key === "Backspace") this.remove();
    else if (event.key === "PageUp" || event.key === "PageDown") {
      stage.zoom(event.key === "PageUp" ? 1.25 : 0.8, stage.middle);
    } else if (event.key === "Escape") {
      this.use("select");
      this.release();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {[across: number, along: number]} direction @param {boolean} sizing */
  arrow([across, along], sizing) {
    const { stage } = this;
    const step = Math.max(stage.world.width, stage.world.height) / 100;
    const { chosen, goalMarked, marked } = stage;
    const goal = this.goals[goalMarked ?? -1];
    if (goal && goalMarked !== null && !this.frozen) {
      const [x, y] = goal;
      const aim = { x: x + step * across, y: y + step * along * stage.upright };
      return this.setGoal(goalMarked, aim, false);
    }
    if (!chosen || marked === null || this.fixed) {
      return stage.pan(5 * step * across, 5 * step * along * stage.upright);
    }
    const [x, y, halfWidth, halfHeight, round] = chosen;
    const place = this.within({
      x: x + step * across,
      y: y + step * along * stage.upright,
    });
    const [wider, higher] = [
      halfWidth + step * across,
      halfHeight + step * (round ? across : -along),
    ];
    if (sizing) {
      this.change(marked, [x, y, this.least(wider), this.least(higher), round]);
    } else {
      const [left, top] = [this.tidy(place.x), this.tidy(place.y)];
      this.change(marked, [left, top, halfWidth, halfHeight, round]);
    }
  }
}
