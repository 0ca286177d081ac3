// The picture: a camera over the world, and its layers from the ground up to the
// handles of what is selected.

import { decode, FlockColours, placeX, placeY } from "./frames.js";
import { make } from "./dom.js";
import { Stamps } from "./stamps.js";
import {
  drawGoal,
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
  drawPerception,
  drawTrails,
  RULES,
} from "./swarm.js";

const COLOURS = [
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
];
const TRAIL_FRAMES = 60;
const TRAIL_SEGMENTS = 12000;

// `taken` is called with each frame that is drawn, `renewed` when colours or size have
// changed.
export class Stage {
  constructor(canvas, taken, renewed) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.taken = taken;
    this.renewed = renewed;
    this.scene = null;
    this.frame = null;
    this.pending = null;
    this.selection = null;
    this.overlays = new Set();
    this.edited = null;
    this.marked = null;
    this.arrowScale = 0;
    this.fit = "world";
    this.camera = { scale: 1, x: 0, y: 0 };
    this.trail = [];
    this.flocks = new FlockColours(RULES);
    this.stamps = new Stamps();
    this.heat = document.createElement("canvas");
    this.coverage = null; // the latest that came: not every frame has one
    this.heatMost = 0;
    this.request = 0;
    this.watcher = new ResizeObserver(() => this.resize());
    this.watcher.observe(canvas);
    this.scheme = matchMedia("(prefers-color-scheme: dark)");
    this.recolour = () => this.readColours();
    this.scheme.addEventListener("change", this.recolour);
    this.readColours();
  }

  stop() {
    cancelAnimationFrame(this.request);
    this.watcher.disconnect();
    this.scheme.removeEventListener("change", this.recolour);
  }

  readColours() {
    const probe = make("span");
    this.canvas.parentElement.append(probe);
    const resolve = (name) => {
      probe.style.color = `var(--${name})`;
      return getComputedStyle(probe).color;
    };
    this.colours = Object.fromEntries(COLOURS.map((name) => [name, resolve(name)]));
    this.rules = Array.from({ length: RULES }, (_, i) => resolve(`rule-${i}`));
    probe.remove();
    paintHeat(this);
    this.redraw();
    // JupyterLab hides all while it changes its theme.
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

  setScene(scene) {
    const size = this.scene &&
      `${this.scene.width} ${this.scene.height} ${this.scene.downwards}`;
    this.scene = scene;
    if (size !== `${scene.width} ${scene.height} ${scene.downwards}`) {
      this.fit = "world";
    }
    this.look();
    this.redraw();
  }

  take(data) {
    this.pending = data;
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

  // The camera: the world, all boids, or where the user has put it.
  look() {
    if (!this.scene || !this.width) return;
    let box = [0, 0, this.scene.width, this.scene.height];
    if (this.fit === "boids" && this.frame?.n) box = this.bodies();
    if (this.fit === "free") return;
    const [left, top, right, bottom] = box;
    const across = (this.width - 2 * MARGIN.side) / Math.max(right - left, 1e-9);
    const along = (this.height - MARGIN.top - MARGIN.bottom) /
      Math.max(bottom - top, 1e-9);
    this.camera = {
      scale: Math.min(across, along),
      x: (left + right) / 2,
      y: (top + bottom) / 2,
    };
  }

  bodies() {
    const { frame } = this;
    const least = Math.max(this.scene.width, this.scene.height) / 20;
    let [left, top, right, bottom] = [Infinity, Infinity, -Infinity, -Infinity];
    for (let i = 0; i < frame.n; i++) {
      const [x, y] = [placeX(frame, i), placeY(frame, i)];
      [left, right, top, bottom] = [
        Math.min(left, x),
        Math.max(right, x),
        Math.min(top, y),
        Math.max(bottom, y),
      ];
    }
    return [left - least, top - least, right + least, bottom + least];
  }

  setFit(fit) {
    this.fit = fit;
    this.look();
    this.redraw();
  }

  zoom(factor, at) {
    const before = this.toWorld(at);
    this.fit = "free";
    this.camera.scale = Math.min(Math.max(this.camera.scale * factor, 1e-6), 1e6);
    const after = this.toWorld(at);
    this.pan(before.x - after.x, before.y - after.y);
  }

  pan(dx, dy) {
    this.fit = "free";
    this.camera = { ...this.camera, x: this.camera.x + dx, y: this.camera.y + dy };
    this.redraw();
  }

  get upright() {
    return this.scene?.downwards === false ? -1 : 1;
  }

  get middle() {
    return { x: this.width / 2, y: (this.height + MARGIN.top - MARGIN.bottom) / 2 };
  }

  toScreen({ x, y }) {
    const { camera, middle } = this;
    return {
      x: middle.x + (x - camera.x) * camera.scale,
      y: middle.y + (y - camera.y) * camera.scale * this.upright,
    };
  }

  toWorld({ x, y }) {
    const { camera, middle } = this;
    return {
      x: camera.x + (x - middle.x) / camera.scale,
      y: camera.y + ((y - middle.y) / camera.scale) * this.upright,
    };
  }

  // The boid nearest to a place on the screen, if it is within `reach` pixels, or null.
  boidAt(place, reach) {
    let [nearest, least] = [null, reach * reach];
    for (let i = 0; i < (this.frame?.n ?? 0); i++) {
      const [dx, dy] = [this.screenX[i] - place.x, this.screenY[i] - place.y];
      if (dx * dx + dy * dy < least) [nearest, least] = [i, dx * dx + dy * dy];
    }
    return nearest;
  }

  draw() {
    if (!this.scene || !this.width) return;
    const fresh = this.pending !== null;
    if (fresh) {
      this.accept(decode(this.pending));
      this.pending = null;
      this.taken(this.frame); // the next one is made and sent while this one is drawn
    }
    const { context, ratio } = this;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = this.colours.stage;
    context.fillRect(0, 0, this.width, this.height);
    drawGround(this);
    drawObstacles(this);
    drawGoal(this);
    if (this.frame) {
      this.project();
      if (this.overlays.has("trails")) drawTrails(this);
      drawPerception(this);
      drawBoids(this);
      if (this.overlays.has("accelerations")) drawAccelerations(this);
    }
    drawHandles(this);
    drawScale(this);
  }

  accept(frame) {
    const gone = this.frame &&
      (frame.step < this.frame.step || frame.n !== this.frame.n);
    if (gone) this.trail = [];
    if (gone) this.coverage = null;
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

  project() {
    const { x, y } = this.trail.at(-1) ?? { x: [], y: [] };
    const origin = this.toScreen({ x: 0, y: 0 });
    const [across, along] = [this.camera.scale, this.camera.scale * this.upright];
    const n = this.frame.n;
    if (this.screenX?.length !== n) {
      [this.screenX, this.screenY] = [new Float32Array(n), new Float32Array(n)];
    }
    for (let i = 0; i < n; i++) {
      this.screenX[i] = origin.x + across * x[i];
      this.screenY[i] = origin.y + along * y[i];
    }
  }

  box(x, y, width, height) {
    const corner = this.toScreen({ x, y: this.upright > 0 ? y : y + height });
    return [corner.x, corner.y, width * this.camera.scale, height * this.camera.scale];
  }

  get obstacles() {
    return this.edited ?? this.scene?.obstacles ?? [];
  }

  // Where the handles of an obstacle are, by what a drag of them changes: [sign of x,
  // sign of y].
  handles([x, y, halfWidth, halfHeight, round]) {
    const signs = round
      ? [[1, 0], [0, 1], [-1, 0], [0, -1]]
      : [[1, 1], [-1, 1], [-1, -1], [1, -1]];
    return signs.map(([a, b]) => ({
      signs: [a, b],
      ...this.toScreen({ x: x + a * halfWidth, y: y + b * halfHeight }),
    }));
  }
}
