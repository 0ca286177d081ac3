// The hand: obstacles are placed, moved and resized, the goal set and boids chosen, by
// pointer or keyboard.

import { paced } from "./dom.js";

const NEAR = { mouse: 9, pen: 14, touch: 22 }; // CSS pixels
const STILL = 4;
const DRAG_SEND_EVERY = 150; // ms while dragging
const PATIENCE = 3000; // ms to wait for the world that was asked for
const ARROWS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

// Obstacles are rows [x, y, half width, half height, 1 for a disc], as in a scene;
// shapes are what a spec has.
export function shapeOf([x, y, halfWidth, halfHeight, round]) {
  return round
    ? { disc: { x, y, radius: halfWidth } }
    : { rectangle: { x, y, width: 2 * halfWidth, height: 2 * halfHeight } };
}

const same = (first, second) =>
  first.length === second.length &&
  first.every((row, i) =>
    row.every((value, k) => Math.abs(Number(value) - Number(second[i][k])) < 1e-9)
  );

export class Hand {
  constructor(stage, send, changed) {
    this.stage = stage;
    this.send = send;
    this.changed = changed;
    this.tool = "select";
    this.frozen = false;
    this.drag = null;
    this.fingers = new Map();
    this.past = [];
    this.waiting = 0;
    // It may be due when the next drag has begun and has changed nothing yet.
    this.sendPaced = paced(
      () => this.drag && stage.edited && this.sendShapes(),
      DRAG_SEND_EVERY,
    );
    const { canvas } = stage;
    const listen = {
      pointerdown: "down",
      pointermove: "move",
      pointerup: "up",
      pointercancel: "up",
      keydown: "key",
    };
    for (const [event, method] of Object.entries(listen)) {
      canvas.addEventListener(event, (given) => this[method](given));
    }
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
  }

  use(tool) {
    this.tool = this.frozen ? "select" : tool;
    this.stage.canvas.dataset.tool = this.tool;
    this.changed();
  }

  // The scene has come: what was edited here is forgotten once the world is like it.
  settle(scene) {
    const { stage } = this;
    const late = performance.now() - this.waiting > PATIENCE;
    if (stage.edited && !this.drag && (late || same(stage.edited, scene.obstacles))) {
      stage.edited = null;
    }
    if (stage.marked !== null && stage.marked >= stage.obstacles.length) {
      stage.marked = null;
    }
  }

  refuse() {
    if (this.drag) return;
    this.stage.edited = null;
    this.stage.redraw();
  }

  mark(index) {
    this.stage.marked = index;
    this.stage.redraw();
    this.changed();
  }

  // The whole list of obstacles anew; `lasting` says that undo comes back to what was
  // before.
  replace(obstacles, lasting = true) {
    const { stage } = this;
    if (lasting) this.past.push(stage.obstacles);
    stage.edited = obstacles;
    if (stage.marked !== null && stage.marked >= obstacles.length) stage.marked = null;
    this.sendShapes();
    stage.redraw();
    this.changed();
  }

  sendShapes() {
    this.waiting = performance.now();
    this.send({ type: "shapes", shapes: this.stage.edited.map(shapeOf) });
  }

  undo() {
    if (this.past.length) this.replace(this.past.pop(), false);
  }

  add(kind, x, y, halfWidth = this.usual, halfHeight = halfWidth) {
    const row = [
      this.tidy(x),
      this.tidy(y),
      this.tidy(halfWidth),
      this.tidy(halfHeight),
      kind === "disc" ? 1 : 0,
    ];
    this.stage.marked = this.stage.obstacles.length;
    this.replace([...this.stage.obstacles, row]);
  }

  remove(index = this.stage.marked) {
    if (index === null || this.frozen) return;
    this.stage.marked = null;
    this.replace(this.stage.obstacles.filter((_, i) => i !== index));
  }

  change(index, row) {
    this.replace(this.stage.obstacles.map((one, i) => (i === index ? row : one)));
  }

  get usual() {
    return Math.min(this.stage.scene.width, this.stage.scene.height) / 16;
  }

  // Lengths as fine as the screen shows them, so that a spec is readable.
  tidy(length) {
    const grain = 10 ** Math.floor(Math.log10(1 / this.stage.camera.scale));
    return Number((Math.round(length / grain) * grain).toPrecision(9));
  }

  within({ x, y }) {
    const { width, height } = this.stage.scene;
    return { x: Math.min(Math.max(x, 0), width), y: Math.min(Math.max(y, 0), height) };
  }

  where(event) {
    const box = this.stage.canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  down(event) {
    if (event.button !== 0 || !this.stage.scene) return;
    this.stage.canvas.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, this.where(event));
    if (this.fingers.size === 2) this.drag = { kind: "pinch" };
    if (this.fingers.size > 1) return;
    const place = this.where(event);
    this.drag = {
      place,
      at: this.stage.toWorld(place),
      moved: false,
      ...this.grip(place, NEAR[event.pointerType] ?? 9),
    };
    if (this.drag.kind === "shape" && this.drag.boid === null) {
      this.mark(this.drag.index);
    }
  }

  // What the pointer has taken hold of: it is dragged. A boid there is what a click
  // means.
  grip(place, near) {
    const { stage } = this;
    if (this.tool !== "select") return { kind: this.tool };
    const reach = ({ x, y }, most) => Math.hypot(x - place.x, y - place.y) <= most;
    if (!this.frozen && stage.marked !== null) {
      const handle = stage.handles(stage.obstacles[stage.marked]).find((one) =>
        reach(one, near)
      );
      if (handle) {
        return {
          kind: "handle",
          index: stage.marked,
          signs: handle.signs,
          row: stage.obstacles[stage.marked],
        };
      }
    }
    const boid = stage.boidAt(place, near);
    if (this.frozen) return { kind: "pan", boid };
    const [goalX, goalY] = stage.scene.goal ?? [0, 0];
    const goal = (goalX || goalY) && stage.toScreen({ x: goalX, y: goalY });
    if (goal && reach(goal, near + 3)) return { kind: "goal", boid };
    const index = this.shapeAt(stage.toWorld(place));
    return index < 0
      ? { kind: "pan", boid }
      : { kind: "shape", boid, index, row: stage.obstacles[index] };
  }

  shapeAt({ x, y }) {
    const inside = ([middleX, middleY, a, b, round]) => {
      const [dx, dy] = [Math.abs(x - middleX), Math.abs(y - middleY)];
      return round ? Math.hypot(dx, dy) <= a : dx <= a && dy <= b;
    };
    return this.stage.obstacles.findLastIndex(inside);
  }

  move(event) {
    const { drag, stage } = this;
    const place = this.where(event);
    if (!drag) return this.hover(place);
    if (drag.kind === "pinch") return this.pinch(event.pointerId, place);
    drag.moved ||= Math.hypot(place.x - drag.place.x, place.y - drag.place.y) > STILL;
    if (!drag.moved) return;
    const at = stage.toWorld(place);
    if (drag.kind === "pan") stage.pan(drag.at.x - at.x, drag.at.y - at.y);
    else if (drag.kind === "goal") this.setGoal(at);
    else this.stretch(drag, at);
  }

  hover(place) {
    const { canvas } = this.stage;
    if (!this.stage.scene || !this.stage.frame) return;
    const { kind, boid = null } = this.grip(place, NEAR.mouse);
    canvas.dataset.over = boid === null ? kind : "boid";
  }

  pinch(id, place) {
    const [first, second] = [...this.fingers.values()];
    const before = Math.hypot(first.x - second.x, first.y - second.y);
    const middle = { x: (first.x + second.x) / 2, y: (first.y + second.y) / 2 };
    this.fingers.set(id, place);
    const [third, fourth] = [...this.fingers.values()];
    const after = Math.hypot(third.x - fourth.x, third.y - fourth.y);
    const { stage } = this;
    const from = stage.toWorld(middle);
    const to = stage.toWorld({
      x: (third.x + fourth.x) / 2,
      y: (third.y + fourth.y) / 2,
    });
    stage.pan(from.x - to.x, from.y - to.y);
    if (before > 0) stage.zoom(after / before, middle);
  }

  // A shape under the hand: drawn, moved or resized.
  stretch(drag, at) {
    const { stage } = this;
    if (!drag.base) {
      drag.base = stage.obstacles;
      if (drag.index === undefined) [drag.index, drag.drawn] = [drag.base.length, true];
      stage.marked = drag.index;
    }
    const row = drag.drawn
      ? this.drawnRow(drag, at)
      : drag.kind === "shape"
      ? this.movedRow(drag, at)
      : this.sizedRow(drag, at);
    stage.edited = [...drag.base];
    stage.edited[drag.index] = row;
    stage.redraw();
    this.sendPaced();
  }

  drawnRow({ kind, at: from }, to) {
    if (kind === "disc") {
      const { x, y } = this.within(from);
      const radius = this.least(Math.hypot(to.x - x, to.y - y));
      return [this.tidy(x), this.tidy(y), radius, radius, 1];
    }
    return this.between(this.within(from), this.within(to));
  }

  between(first, second) {
    const [x, y] = [
      this.tidy((first.x + second.x) / 2),
      this.tidy((first.y + second.y) / 2),
    ];
    return [
      x,
      y,
      this.least(Math.abs(first.x - second.x) / 2),
      this.least(Math.abs(first.y - second.y) / 2),
      0,
    ];
  }

  least(length) {
    return Math.max(this.tidy(length), this.tidy(2 / this.stage.camera.scale));
  }

  movedRow({ row, at: from }, to) {
    const { x, y } = this.within({
      x: row[0] + to.x - from.x,
      y: row[1] + to.y - from.y,
    });
    return [this.tidy(x), this.tidy(y), ...row.slice(2)];
  }

  sizedRow({ row, signs: [a, b] }, to) {
    const [x, y, halfWidth, halfHeight, round] = row;
    if (round) {
      const radius = this.least(Math.hypot(to.x - x, to.y - y));
      return [x, y, radius, radius, 1];
    }
    return this.between({ x: x - a * halfWidth, y: y - b * halfHeight }, to);
  }

  setGoal(place) {
    const [x, y] = [this.tidy(place.x), this.tidy(place.y)];
    this.stage.scene.goal = [x, y, this.stage.scene.goal[2]];
    this.stage.redraw();
    this.goalPaced ??= paced((message) => this.send(message), DRAG_SEND_EVERY);
    this.goalPaced({ type: "goal", x, y });
  }

  up(event) {
    const { drag, stage } = this;
    this.fingers.delete(event.pointerId);
    if (!drag || (drag.kind === "pinch" && this.fingers.size > 0)) return;
    this.drag = null;
    if (event.type === "pointercancel") return this.refuse();
    if (drag.base) {
      this.past.push(drag.base);
      this.sendShapes();
    } else if (!drag.moved) this.click(drag);
    if (this.tool !== "select") this.use("select");
    this.changed();
    stage.redraw();
  }

  click(drag) {
    const { x, y } = this.within(drag.at);
    if (drag.kind === "disc" || drag.kind === "rectangle") this.add(drag.kind, x, y);
    else if (drag.kind === "goal" && this.tool === "goal") this.setGoal(drag.at);
    else if (drag.boid !== null && drag.boid !== undefined) {
      this.send({ type: "select", boid: drag.boid });
    } else if (drag.kind === "pan") this.release();
  }

  release() {
    this.mark(null);
    if (this.stage.selection) this.send({ type: "select", boid: null });
  }

  wheel(event) {
    event.preventDefault();
    this.stage.zoom(
      Math.exp(-event.deltaY / (event.ctrlKey ? 100 : 500)),
      this.where(event),
    );
    this.changed();
  }

  key(event) {
    const { stage } = this;
    if (event.key in ARROWS && !event.ctrlKey && !event.metaKey) {
      this.arrow(ARROWS[event.key], event.shiftKey);
    } else if (event.key === "Delete" || event.key === "Backspace") this.remove();
    else if (event.key === "PageUp" || event.key === "PageDown") {
      stage.zoom(event.key === "PageUp" ? 1.25 : 0.8, stage.middle);
    } else if (event.key === "Escape") {
      this.use("select");
      this.release();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  arrow([across, along], sizing) {
    const { stage } = this;
    const step = Math.max(stage.scene.width, stage.scene.height) / 100;
    const chosen = stage.obstacles[stage.marked];
    if (!chosen || this.frozen) {
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
    const sized = [x, y, this.least(wider), this.least(higher), round];
    this.change(
      stage.marked,
      sizing
        ? sized
        : [this.tidy(place.x), this.tidy(place.y), halfWidth, halfHeight, round],
    );
  }
}
