// The picture: a camera over the world, and its layers from the ground up to the
// handles of what is selected.

import { decode, FlockColours, placeX, placeY } from "./frames.js";
import { contextOf, make } from "./dom.js";
import { obstaclesAt } from "./obstacles.js";
import { SvgPen } from "./pen.js";
import { Stamps } from "./stamps.js";
import { drawWheel } from "./headings.js";
import {
  drawGoals,
  drawGround,
  drawHandles,
  drawObstacles,
  drawScale,
  MARGIN,
  paintHeat,
} from "./ground.js";
import {
  drawAccelerations,
  drawBoids,
  drawFailed,
  drawPerception,
  drawTrails,
  HUES,
} from "./swarm.js";

/** @import { Coverage, Frame } from "./frames.js" */
/** @import { Bytes, Obstacle, Scene, Seen } from "./protocol.d.ts" */

/** @typedef {{ x: number, y: number }} Place */
/** @typedef {CanvasRenderingContext2D | SvgPen} Pen */
/** @typedef {{ scale: number, x: number, y: number }} Camera */
/** @typedef {"world" | "boids" | "free"} Fit */
/** @typedef {Omit<Seen, "range"> & { range: number }} Selected */
/** @typedef {Record<typeof COLOURS[number], string>} Colours */

const COLOURS = /** @type {const} */ ([
  "stage",
  "ground",
  "border",
  "boid",
  "obstacle",
  "edge",
  "goal",
  "ink",
  "muted",
  "chosen",
  "published",
  "heat",
]);
const TRAIL_FRAMES = 60;
const TRAIL_SEGMENTS = 12000;

// The colours of the style sheet by name, those of the rules, whose arrows are drawn,
// and the hues of boids.
/**
 * @param {HTMLElement} element
 * @returns {[Colours, string[], string[]]}
 */
function coloursBeside(element) {
  const probe = make("span");
  element.after(probe);
  /** @param {string} name */
  const resolve = (name) => {
    probe.style.color = `var(--${name})`;
    return getComputedStyle(probe).color;
  };
  const named = COLOURS.map((name) => [name, resolve(name)]);
  /** @param {string} kind */
  const palette = (kind) =>
    Array.from({ length: HUES }, (_, i) => resolve(`${kind}-${i}`));
  const [rules, hues] = [palette("rule"), palette("hue")];
  probe.remove();
  return [/** @type {Colours} */ (Object.fromEntries(named)), rules, hues];
}

/** @param {Scene} scene */
function coloursOfKinds({ kinds }) {
  if (!kinds.length) return null;
  return Int16Array.from(
    kinds.flatMap(([, boids], kind) => Array(boids).fill(kind % HUES)),
  );
}

// The box about all boids: left, top, right and bottom.
/** @param {Frame} frame @param {Scene} scene */
function around(frame, scene) {
  const least = Math.max(scene.width, scene.height) / 20;
  let [left, top, right, bottom] = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = 0; i < frame.n; i++) {
    const [x, y] = [placeX(frame, i), placeY(frame, i)];
    [left, right] = [Math.min(left, x), Math.max(right, x)];
    [top, bottom] = [Math.min(top, y), Math.max(bottom, y)];
  }
  return [left - least, top - least, right + least, bottom + least];
}

// `taken` is called with each frame that is drawn, `renewed` when colours or size have
// changed. `room` is left around the world.
export class Stage {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {(frame: Frame) => void} taken
   * @param {() => void} renewed
   * @param {typeof MARGIN} room
   */
  constructor(canvas, taken, renewed, room = MARGIN) {
    this.canvas = canvas;
    this.room = room;
    /** @type {Pen} */
    this.context = contextOf(canvas, { alpha: false });
    this.taken = taken;
    this.renewed = renewed;
    this.width = 0;
    this.height = 0;
    this.ratio = 1;
    /** @type {Scene | null} */
    this.scene = null;
    /** @type {Frame | null} */
    this.frame = null;
    /** @type {{ data: Bytes | Frame, run: number } | null} */
    this.pending = null;
    this.run = 0; // of the frames that come
    this.shown = 0; // of the frame on the screen
    /** @type {Selected | null} */
    this.selection = null;
    /** @type {Set<string>} */
    this.overlays = new Set();
    /** @type {Obstacle[] | null} */
    this.edited = null;
    /** @type {number | null} */
    this.marked = null;
    /** @type {number | null} */
    this.goalMarked = null;
    this.arrowScale = 0;
    /** @type {Fit} */
    this.fit = "world";
    /** @type {Camera} */
    this.camera = { scale: 1, x: 0, y: 0 };
    /** @type {{ x: Float32Array, y: Float32Array, step: number }[]} */
    this.trail = [];
    this.screenX = new Float32Array(0);
    this.screenY = new Float32Array(0);
    this.flocks = new FlockColours(HUES);
    /** @type {Int16Array | null} */
    this.kinds = null; // the colour of each boid, where there are kinds
    this.stamps = new Stamps();
    this.heat = document.createElement("canvas");
    /** @type {Coverage | null} */
    this.coverage = null; // the latest that came: not every frame has one
    this.request = 0;
    this.watcher = new ResizeObserver(() => this.resize());
    this.watcher.observe(canvas);
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.recolour = () => this.readColours();
    this.scheme.addEventListener("change", this.recolour);
    const [colours, rules, hues] = coloursBeside(canvas);
    this.colours = colours;
    this.rules = rules;
    this.hues = hues;
  }

  stop() {
    cancelAnimationFrame(this.request);
    this.watcher.disconnect();
    this.scheme.removeEventListener("change", this.recolour);
  }

  readColours() {
    [this.colours, this.rules, this.hues] = coloursBeside(this.canvas);
    paintHeat(this);
    this.redraw();
    // JupyterLab hides everything while it changes its theme.
    requestAnimationFrame(() => this.renewed());
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = devicePixelRatio || 1;
    [this.width, this.height, this.ratio] = [width, height, ratio];
    this.canvas.width = Math.max(1, Math.round(width * ratio));
    this.canvas.height = Math.max(1, Math.round(height * ratio));
    this.look();
    this.draw();
    this.renewed();
  }

  /** @param {Scene} scene */
  setScene(scene) {
    const size = this.scene &&
      `${this.scene.width} ${this.scene.height} ${this.scene.downwards}`;
    this.scene = scene;
    this.kinds = coloursOfKinds(scene);
    if (size !== `${scene.width} ${scene.height} ${scene.downwards}`) {
      this.fit = "world";
    }
    this.look();
    this.redraw();
  }

  /** @param {Bytes | Frame} data */
  take(data) {
    this.pending = { data, run: this.run };
    this.redraw();
  }

  redraw() {
    this.request ||= requestAnimationFrame(() => {
      this.request = 0;
      this.draw();
    });
  }

  forget() {
    this.trail = [];
    this.redraw();
  }

  // Without a frame: another run comes.
  clear() {
    this.frame =
      this.pending =
      this.coverage =
      this.selection =
        null;
    this.forget();
  }

  // The camera: the world, all boids, or where the user has put it.
  look() {
    if (!this.scene || !this.width) return;
    let box = [0, 0, this.scene.width, this.scene.height];
    if (this.fit === "boids" && this.frame?.n) box = around(this.frame, this.scene);
    if (this.fit === "free") return;
    const [left, top, right, bottom] = box;
    const across = (this.width - 2 * this.room.side) / Math.max(right - left, 1e-9);
    const along = (this.height - this.room.top - this.room.bottom) /
      Math.max(bottom - top, 1e-9);
    this.camera = {
      scale: Math.min(across, along),
      x: (left + right) / 2,
      y: (top + bottom) / 2,
    };
  }

  /** @param {Fit} fit */
  setFit(fit) {
    this.fit = fit;
    this.look();
    this.redraw();
  }

  /** @param {number} factor @param {Place} at */
  zoom(factor, at) {
    const before = this.toWorld(at);
    this.fit = "free";
    this.camera.scale = Math.min(Math.max(this.camera.scale * factor, 1e-6), 1e6);
    const after = this.toWorld(at);
    this.pan(before.x - after.x, before.y - after.y);
  }

  /** @param {number} dx @param {number} dy */
  pan(dx, dy) {
    this.fit = "free";
    this.camera = { ...this.camera, x: this.camera.x + dx, y: this.camera.y + dy };
    this.redraw();
  }

  get upright() {
    return this.scene?.downwards === false ? -1 : 1;
  }

  get middle() {
    return {
      x: this.width / 2,
      y: (this.height + this.room.top - this.room.bottom) / 2,
    };
  }

  /** @param {Place} place @returns {Place} */
  toScreen({ x, y }) {
    const { camera, middle } = this;
    return {
      x: middle.x + (x - camera.x) * camera.scale,
      y: middle.y + (y - camera.y) * camera.scale * this.upright,
    };
  }

  /** @param {Place} place @returns {Place} */
  toWorld({ x, y }) {
    const { camera, middle } = this;
    return {
      x: camera.x + (x - middle.x) / camera.scale,
      y: camera.y + ((y - middle.y) / camera.scale) * this.upright,
    };
  }

  // The boid nearest to a place on the screen, if it is within `reach` pixels, or null.
  /** @param {Place} place @param {number} reach @returns {number | null} */
  boidAt(place, reach) {
    /** @type {number | null} */
    let nearest = null;
    let least = reach * reach;
    for (let i = 0; i < (this.frame?.n ?? 0); i++) {
      const [dx, dy] = [this.screenX[i] - place.x, this.screenY[i] - place.y];
      if (dx * dx + dy * dy < least) [nearest, least] = [i, dx * dx + dy * dy];
    }
    return nearest;
  }

  draw() {
    if (!this.scene || !this.width) return this.wait();
    if (this.pending) {
      const { data, run } = this.pending;
      const fresh = "step" in data ? data : decode(data);
      this.accept(fresh, run);
      this.pending = null;
      this.taken(fresh); // the next one is made and sent while this one is drawn
    }
    this.paint(this.scene);
  }

  // Before there is a scene, the picture says so on its ground.
  wait() {
    const { context, ratio, width, height } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = this.colours.stage;
    context.fillRect(0, 0, width, height);
    context.fillStyle = this.colours.muted;
    context.font = "13px system-ui, sans-serif";
    context.fillText("Loading…", width / 2 - 30, height / 2);
  }

  // Draws all layers, from the ground up.
  /** @param {Scene} scene */
  paint(scene) {
    const { context, frame, overlays, ratio } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = this.colours.stage;
    context.fillRect(0, 0, this.width, this.height);
    drawGround(this, scene);
    drawObstacles(this, scene);
    drawGoals(this, scene);
    if (frame) {
      this.project(frame);
      if (overlays.has("trails")) drawTrails(this, scene);
      drawPerception(this, scene, frame);
      drawFailed(this, scene, frame);
      drawBoids(this, scene, frame);
      if (overlays.has("accelerations")) drawAccelerations(this, frame);
    }
    drawHandles(this);
    if (this.room !== MARGIN) return; // a small picture has no legends
    drawScale(this, scene);
    if (frame && overlays.has("headings")) drawWheel(this, frame);
  }

  // Draws the picture as it is with another pen, so many times as fine as the screen.
  /** @param {Pen} pen @param {number} finer */
  paintWith(pen, finer) {
    const { context, ratio } = this;
    [this.context, this.ratio] = [pen, finer];
    if (this.scene) this.paint(this.scene);
    [this.context, this.ratio] = [context, ratio];
  }

  // The picture as it is in a canvas of its own.
  /** @param {number} finer */
  pixels(finer) {
    const canvas = make("canvas", {
      width: Math.round(this.width * finer),
      height: Math.round(this.height * finer),
    });
    this.paintWith(contextOf(canvas, { alpha: false }), finer);
    return canvas;
  }

  // The picture as it is, as lines.
  lines() {
    const pen = new SvgPen(this.width, this.height);
    this.paintWith(pen, 1);
    return pen;
  }

  // Of another run, or of an earlier step, nothing before goes on.
  /** @param {Frame} frame @param {number} run */
  accept(frame, run) {
    if (run !== this.shown || (this.frame && frame.step < this.frame.step)) {
      this.trail = [];
      this.coverage = null;
    }
    this.shown = run;
    this.frame = frame;
    if (frame.coverage) this.coverage = frame.coverage;
    if (frame.coverage) paintHeat(this);
    if (frame.flocks) this.flocks.assign(frame.flocks);
    const [x, y] = [new Float32Array(frame.n), new Float32Array(frame.n)];
    for (let i = 0; i < frame.n; i++) {
      [x[i], y[i]] = [placeX(frame, i), placeY(frame, i)];
    }
    const most = Math.min(
      TRAIL_FRAMES,
      Math.max(4, Math.floor(TRAIL_SEGMENTS / Math.max(1, frame.n))),
    );
    if (this.trail.at(-1)?.step !== frame.step) {
      this.trail.push({ x, y, step: frame.step });
    }
    this.trail.splice(0, this.trail.length - most);
    if (this.fit === "boids") this.look();
  }

  /** @param {Frame} frame */
  project(frame) {
    const { n } = frame;
    const origin = this.toScreen({ x: 0, y: 0 });
    const [across, along] = [this.camera.scale, this.camera.scale * this.upright];
    if (this.screenX.length !== n) {
      [this.screenX, this.screenY] = [new Float32Array(n), new Float32Array(n)];
    }
    for (let i = 0; i < n; i++) {
      this.screenX[i] = origin.x + across * placeX(frame, i);
      this.screenY[i] = origin.y + along * placeY(frame, i);
    }
  }

  /**
   * @param {number} x
   * @param {number} y
   * @param {number} width
   * @param {number} height
   * @returns {[number, number, number, number]}
   */
  box(x, y, width, height) {
    const corner = this.toScreen({ x, y: this.upright > 0 ? y : y + height });
    return [corner.x, corner.y, width * this.camera.scale, height * this.camera.scale];
  }

  get world() {
    return { width: this.scene?.width ?? 0, height: this.scene?.height ?? 0 };
  }

  // The boids that have failed in the frame that is shown.
  get failed() {
    const step = this.frame?.step ?? 0;
    const boids = this.scene?.failing?.boids ?? [];
    return boids.filter(([, from]) => from <= step).map(([boid]) => boid);
  }

  // The obstacle that is selected.
  get chosen() {
    return this.marked === null ? undefined : this.obstacles[this.marked];
  }

  get obstacles() {
    if (this.edited || !this.scene) return this.edited ?? [];
    return obstaclesAt(this.scene, this.frame?.step ?? 0);
  }

  // Where the handles of an obstacle are, by what a drag of them changes: [sign of x,
  // sign of y].
  /** @param {Obstacle} obstacle */
  handles([x, y, halfWidth, halfHeight, round, polygon]) {
    if (polygon) return [];
    const signs = round
      ? [[1, 0], [0, 1], [-1, 0], [0, -1]]
      : [[1, 1], [-1, 1], [-1, -1], [1, -1]];
    return signs.map(([a, b]) => ({
      signs: [a, b],
      ...this.toScreen({ x: x + a * halfWidth, y: y + b * halfHeight }),
    }));
  }
}
