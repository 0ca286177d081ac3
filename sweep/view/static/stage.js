// The picture: a camera over the world, and its layers from the ground up to the handles of what is selected.

import { decode, FlockColours, OBSTACLE_PIXEL, placeX, placeY } from "./frames.js";
import { make, short } from "./dom.js";
import { CORNERS, Stamps } from "./stamps.js";

const COLOURS = ["stage", "ground", "border", "boid", "obstacle", "edge", "goal", "ink", "muted", "chosen", "published", "heat"];
export const RULES = 7; // colours of rules and flocks: --rule-0 to --rule-6
const TRAIL_FRAMES = 60;
const TRAIL_SEGMENTS = 12000;
const TRAIL_GAP = 10; // steps between two frames, from which on a straight line says nothing
const MANY = 300; // boids, from which on they are stamps
const ARROW = 26;
const MARGIN = { side: 18, top: 56, bottom: 34 }; // room for the tools and for the scale

// `taken` is called with each frame that is drawn, `renewed` when colours or size have changed.
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
    this.paintHeat();
    this.redraw();
    requestAnimationFrame(() => this.renewed()); // JupyterLab hides all while it changes its theme
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
    const size = this.scene && `${this.scene.width} ${this.scene.height} ${this.scene.downwards}`;
    this.scene = scene;
    if (size !== `${scene.width} ${scene.height} ${scene.downwards}`) this.fit = "world";
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
    const along = (this.height - MARGIN.top - MARGIN.bottom) / Math.max(bottom - top, 1e-9);
    this.camera = { scale: Math.min(across, along), x: (left + right) / 2, y: (top + bottom) / 2 };
  }

  bodies() {
    const { frame } = this;
    const least = Math.max(this.scene.width, this.scene.height) / 20;
    let [left, top, right, bottom] = [Infinity, Infinity, -Infinity, -Infinity];
    for (let i = 0; i < frame.n; i++) {
      const [x, y] = [placeX(frame, i), placeY(frame, i)];
      [left, right, top, bottom] = [Math.min(left, x), Math.max(right, x), Math.min(top, y), Math.max(bottom, y)];
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
    return { x: middle.x + (x - camera.x) * camera.scale, y: middle.y + (y - camera.y) * camera.scale * this.upright };
  }

  toWorld({ x, y }) {
    const { camera, middle } = this;
    return { x: camera.x + (x - middle.x) / camera.scale, y: camera.y + ((y - middle.y) / camera.scale) * this.upright };
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
    this.drawGround();
    this.drawObstacles();
    this.drawGoal();
    if (this.frame) {
      this.project();
      if (this.overlays.has("trails")) this.drawTrails();
      this.drawPerception();
      this.drawBoids();
      if (this.overlays.has("accelerations")) this.drawAccelerations();
    }
    this.drawHandles();
    this.drawScale();
  }

  accept(frame) {
    const gone = this.frame && (frame.step < this.frame.step || frame.n !== this.frame.n);
    if (gone) this.trail = [];
    if (gone) this.coverage = null;
    this.frame = frame;
    if (frame.coverage) this.coverage = frame.coverage;
    if (frame.coverage) this.paintHeat();
    if (frame.flocks) this.flocks.assign(frame.flocks);
    const [x, y] = [new Float32Array(frame.n), new Float32Array(frame.n)];
    for (let i = 0; i < frame.n; i++) [x[i], y[i]] = [placeX(frame, i), placeY(frame, i)];
    const most = Math.min(TRAIL_FRAMES, Math.max(4, Math.floor(TRAIL_SEGMENTS / Math.max(1, frame.n))));
    if (this.trail.at(-1)?.step !== frame.step) this.trail.push({ x, y, step: frame.step });
    this.trail.splice(0, this.trail.length - most);
    if (this.fit === "boids") this.look();
  }

  project() {
    const { x, y } = this.trail.at(-1) ?? { x: [], y: [] };
    const origin = this.toScreen({ x: 0, y: 0 });
    const [across, along] = [this.camera.scale, this.camera.scale * this.upright];
    const n = this.frame.n;
    if (this.screenX?.length !== n) [this.screenX, this.screenY] = [new Float32Array(n), new Float32Array(n)];
    for (let i = 0; i < n; i++) {
      this.screenX[i] = origin.x + across * x[i];
      this.screenY[i] = origin.y + along * y[i];
    }
  }

  box(x, y, width, height) {
    const corner = this.toScreen({ x, y: this.upright > 0 ? y : y + height });
    return [corner.x, corner.y, width * this.camera.scale, height * this.camera.scale];
  }

  drawGround() {
    const { context, scene } = this;
    const world = this.box(0, 0, scene.width, scene.height);
    context.fillStyle = this.colours.ground;
    context.fillRect(...world);
    if (this.overlays.has("coverage") && this.coverage) {
      context.imageSmoothingEnabled = false;
      context.save();
      context.translate(world[0], this.upright > 0 ? world[1] : world[1] + world[3]);
      context.scale(1, this.upright);
      context.drawImage(this.heat, 0, 0, world[2], world[3]);
      context.restore();
    }
    context.strokeStyle = this.colours.border;
    context.lineWidth = 1.5;
    context.setLineDash(scene.borders === "bounded" ? [] : scene.borders === "torus" ? [7, 4] : [2, 4]);
    context.strokeRect(...world);
    context.setLineDash([]);
  }

  paintHeat() {
    if (!this.coverage) return;
    const { rows, columns, visits } = this.coverage;
    this.heatMost = visits.reduce((most, count) => (count === OBSTACLE_PIXEL ? most : Math.max(most, count)), 0);
    const [red, green, blue] = this.colours.heat.match(/[\d.]+/g).map(Number);
    const table = new Uint32Array(256);
    for (let count = 1; count < OBSTACLE_PIXEL; count++) {
      const opacity = 0.16 + 0.84 * (Math.log1p(count) / Math.log1p(Math.max(this.heatMost, 8)));
      table[count] = (Math.round(255 * Math.min(1, opacity)) << 24) | (blue << 16) | (green << 8) | red;
    }
    if (this.heat.width !== columns || this.heat.height !== rows) [this.heat.width, this.heat.height] = [columns, rows];
    const context = this.heat.getContext("2d");
    const image = context.createImageData(columns, rows);
    const pixels = new Uint32Array(image.data.buffer);
    for (let i = 0; i < pixels.length; i++) pixels[i] = table[visits[i]];
    context.putImageData(image, 0, 0);
  }

  outline([x, y, halfWidth, halfHeight, round]) {
    const { context } = this;
    const middle = this.toScreen({ x, y });
    const [across, along] = [halfWidth * this.camera.scale, halfHeight * this.camera.scale];
    context.beginPath();
    if (round) context.arc(middle.x, middle.y, Math.max(across, 2.5), 0, 2 * Math.PI);
    else context.rect(middle.x - across, middle.y - along, 2 * across, 2 * along);
  }

  get obstacles() {
    return this.edited ?? this.scene?.obstacles ?? [];
  }

  drawObstacles() {
    const { context } = this;
    context.fillStyle = this.colours.obstacle;
    context.strokeStyle = this.colours.edge;
    context.lineWidth = 1;
    for (const obstacle of this.obstacles) {
      this.outline(obstacle);
      context.fill();
      context.stroke();
    }
  }

  drawGoal() {
    const { context } = this;
    const [x, y, radius] = this.scene.goal ?? [0, 0, 0];
    if (x === 0 && y === 0) return; // where no model wants anybody to go
    const at = this.toScreen({ x, y });
    context.strokeStyle = context.fillStyle = this.colours.goal;
    context.lineWidth = 1.5;
    context.setLineDash([4, 4]);
    context.beginPath();
    context.arc(at.x, at.y, radius * this.camera.scale, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
    context.fill(new Path2D(`M${at.x - 1} ${at.y}v-18h12l-3 4 3 4h-10v10z`));
    context.beginPath();
    context.arc(at.x, at.y, 3, 0, 2 * Math.PI);
    context.fill();
  }

  drawTrails() {
    const { context, trail } = this;
    const origin = this.toScreen({ x: 0, y: 0 });
    const [across, along] = [this.camera.scale, this.camera.scale * this.upright];
    const [farX, farY] = [this.scene.width / 2, this.scene.height / 2];
    context.strokeStyle = this.colours.boid;
    context.lineWidth = 1;
    for (let k = 1; k < trail.length; k++) {
      const [from, to] = [trail[k - 1], trail[k]];
      if (to.step - from.step > TRAIL_GAP) continue;
      context.globalAlpha = 0.55 * (k / trail.length) ** 1.5;
      context.beginPath();
      for (let i = 0; i < to.x.length; i++) {
        if (Math.abs(to.x[i] - from.x[i]) > farX || Math.abs(to.y[i] - from.y[i]) > farY) continue;
        context.moveTo(origin.x + across * from.x[i], origin.y + along * from.y[i]);
        context.lineTo(origin.x + across * to.x[i], origin.y + along * to.y[i]);
      }
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  drawPerception() {
    const { context, selection: chosen } = this;
    if (!chosen || chosen.boid >= this.frame.n) return;
    const [x, y] = [this.screenX[chosen.boid], this.screenY[chosen.boid]];
    const half = ((Math.min(chosen.fov ?? 360, 360) / 2) * Math.PI) / 180;
    const heading = (chosen.heading ?? 0) * this.upright;
    context.strokeStyle = context.fillStyle = this.colours.chosen;
    context.lineWidth = 1.25;
    if (Number.isFinite(chosen.range)) {
      context.beginPath();
      if (half < Math.PI) context.moveTo(x, y);
      context.arc(x, y, chosen.range * this.camera.scale, heading - half, heading + half);
      if (half < Math.PI) context.closePath();
      context.globalAlpha = 0.12;
      context.fill();
      context.globalAlpha = 0.8;
      context.stroke();
    }
    context.globalAlpha = 0.7;
    context.beginPath();
    for (const other of chosen.neighbours) {
      const [dx, dy] = [this.screenX[other] - x, this.screenY[other] - y];
      const far = Math.abs(dx) > (this.scene.width * this.camera.scale) / 2;
      if (far || Math.abs(dy) > (this.scene.height * this.camera.scale) / 2) continue;
      context.moveTo(x, y);
      context.lineTo(x + dx, y + dy);
    }
    context.stroke();
    context.globalAlpha = 1;
  }

  get boidLength() {
    const { scene, camera, frame } = this;
    const room = 0.42 * Math.sqrt((scene.width * scene.height) / Math.max(1, frame.n)) * camera.scale;
    return Math.min(Math.max(room, 4), 11);
  }

  drawBoids() {
    const { context, frame } = this;
    const size = this.boidLength;
    const of = this.overlays.has("flocks") && frame.flocks ? this.flocks.ofBoid : null;
    if (frame.n > MANY) this.stampBoids(size, of);
    else for (let i = 0; i < frame.n; i++) this.drawBoid(i, size, this.boidColour(of, i));
    const chosen = this.selection?.boid;
    if (chosen === undefined || chosen >= frame.n) return;
    this.drawBoid(chosen, 1.5 * size, this.colours.chosen);
    context.strokeStyle = this.colours.chosen;
    context.lineWidth = 2;
    context.beginPath();
    context.arc(this.screenX[chosen], this.screenY[chosen], size + 4, 0, 2 * Math.PI);
    context.stroke();
  }

  boidColour(flocks, i) {
    if (!flocks) return this.colours.boid;
    return flocks[i] < 0 ? this.colours.edge : this.rules[flocks[i]];
  }

  drawBoid(i, size, colour) {
    const { context } = this;
    const angle = (this.frame.heading[i] / 128) * Math.PI * this.upright;
    const [cos, sin] = [Math.cos(angle) * size, Math.sin(angle) * size];
    context.fillStyle = colour;
    context.beginPath();
    for (const [along, across] of CORNERS) {
      context.lineTo(this.screenX[i] + along * cos - across * sin, this.screenY[i] + along * sin + across * cos);
    }
    context.fill();
  }

  stampBoids(size, flocks) {
    const { context, canvas, frame, ratio } = this;
    const packed = (colour) => colour.match(/\d+/g).reduce((sum, part, place) => sum + (Number(part) << (8 * place)), 0);
    const colours = [this.colours.edge, ...this.rules].map(packed);
    const plain = packed(this.colours.boid);
    this.stamps.begin(canvas.width, canvas.height, Math.round(size * ratio * 4) / 4, this.upright);
    for (let i = 0; i < frame.n; i++) {
      const colour = flocks ? colours[flocks[i] + 1] : plain;
      this.stamps.add(this.screenX[i] * ratio, this.screenY[i] * ratio, frame.heading[i], colour);
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.stamps.end(), 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  drawAccelerations() {
    const { accelerations, rules, n } = this.frame;
    if (!accelerations) return;
    const chosen = this.selection ? [this.selection.boid] : Array.from({ length: n }, (_, i) => i);
    let [sum, count] = [0, 0];
    for (const length of this.lengths(chosen)) if (length > 0) [sum, count] = [sum + length * length, count + 1];
    if (!count) return;
    const scale = ARROW / Math.sqrt(sum / count);
    const sudden = !(this.arrowScale > scale / 5 && this.arrowScale < scale * 5);
    this.arrowScale = sudden ? scale : this.arrowScale * (scale / this.arrowScale) ** 0.08;
    for (let rule = 0; rule < rules; rule++) this.drawRule(rule, chosen);
  }

  *lengths(boids) {
    const { accelerations, rules, n } = this.frame;
    for (let rule = 0; rule < rules; rule++) {
      for (const i of boids) yield Math.hypot(accelerations[2 * rule * n + i], accelerations[(2 * rule + 1) * n + i]);
    }
  }

  drawRule(rule, boids) {
    const { context, screenX, screenY } = this;
    const { accelerations, n } = this.frame;
    context.strokeStyle = this.rules[rule % RULES];
    context.lineWidth = 1.5;
    context.setLineDash(rule < RULES ? [] : [3, 2]);
    context.beginPath();
    for (const i of boids) {
      let dx = accelerations[2 * rule * n + i] * this.arrowScale;
      let dy = accelerations[(2 * rule + 1) * n + i] * this.arrowScale * this.upright;
      const length = Math.hypot(dx, dy);
      if (!(length > 2)) continue;
      const part = Math.min(1, (3 * ARROW) / length);
      [dx, dy] = [dx * part, dy * part];
      const head = Math.min(5, length / 3) / (length * part);
      const [x, y] = [screenX[i] + dx, screenY[i] + dy];
      context.moveTo(screenX[i], screenY[i]);
      context.lineTo(x, y);
      context.lineTo(x - head * (dx + 0.6 * dy), y - head * (dy - 0.6 * dx));
      context.moveTo(x, y);
      context.lineTo(x - head * (dx - 0.6 * dy), y - head * (dy + 0.6 * dx));
    }
    context.stroke();
    context.setLineDash([]);
  }

  // Where the handles of an obstacle are, by what a drag of them changes: [sign of x, sign of y].
  handles([x, y, halfWidth, halfHeight, round]) {
    const signs = round ? [[1, 0], [0, 1], [-1, 0], [0, -1]] : [[1, 1], [-1, 1], [-1, -1], [1, -1]];
    return signs.map(([a, b]) => ({ signs: [a, b], ...this.toScreen({ x: x + a * halfWidth, y: y + b * halfHeight }) }));
  }

  drawHandles() {
    const chosen = this.obstacles[this.marked];
    if (!chosen) return;
    const { context } = this;
    context.strokeStyle = this.colours.chosen;
    context.fillStyle = this.colours.ground;
    context.lineWidth = 2;
    this.outline(chosen);
    context.stroke();
    for (const { x, y } of this.handles(chosen)) {
      context.beginPath();
      context.rect(x - 4, y - 4, 8, 8);
      context.fill();
      context.stroke();
    }
  }

  drawScale() {
    const { context } = this;
    const rough = 110 / this.camera.scale;
    const power = 10 ** Math.floor(Math.log10(rough));
    const length = [5, 2, 1].map((digit) => digit * power).find((one) => one <= rough) ?? power;
    const [left, right, y] = [MARGIN.side, MARGIN.side + length * this.camera.scale, this.height - 11];
    context.strokeStyle = context.fillStyle = this.colours.muted;
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(left, y - 4);
    context.lineTo(left, y);
    context.lineTo(right, y);
    context.lineTo(right, y - 4);
    context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.fillText(`${short(length)} ${this.scene.length}`, right + 7, y + 1);
  }
}
