// The living phase diagram: each cell of a heatmap plays the run behind it. One canvas
// over the marks has all swarms. What is left of a cell around its swarm has the colour
// of its value.

import { button, contextOf, make, setIcon, write } from "./dom.js";
import { drawObstacles } from "./ground.js";
import { drawRing, WHEEL } from "./headings.js";
import { Stage } from "./stage.js";
import { packed } from "./stamps.js";
import { Tape } from "./tape.js";

/** @import { Frame } from "./frames.js" */
/** @import { Plotted } from "./plotted.js" */
/** @import { Scene } from "./protocol.d.ts" */
/** @import { SupplementData, SupplementRun } from "./supplement.d.ts" */

/** @typedef {{ x: number, y: number, width: number, height: number }} Box */
/** @typedef {{ box: Box, scene: Scene, tape: Tape }} Cell */
/** @typedef {{ width: number, height: number }} Size */
/**
 * A cell that has a run, and its largest part that no other cell covers, as a part of
 * the plot.
 *
 * @typedef {{ place: number, part: Box }} Part
 */

const RATE = 12; // frames per second
const EARLY = 4; // ms by which a frame of the screen may come too early
const ROUND = 240; // frames from the first step to the last one
const HOLD = 12; // frames for which the last step stays
const LEAST = 40; // CSS pixels, the shorter side of a cell that plays
const ENOUGH = 0.5; // of the area of all cells plays
const COLOURED = 5; // CSS pixels of the colour of a cell around its swarm
const WITHIN = 4; // between the colour and the world: a boid at its edge is whole
const LENGTH = { part: 0.42, least: 4, most: 6 }; // of a boid
const PADDING = 30; // of the figure, on both sides together
const BESIDE = 380; // CSS pixels that a player needs next to the figure
const ABOVE = 120; // of the window, for the title and the switch
const LEAST_PLOT = { width: 240, height: 200 };
const LARGE_SCREEN = { width: 1680, height: 1080 };
const WHEEL_SIZE = 22;
const MOST_PARTS = 16;
const NO_ROOM = { side: 0, top: 0, bottom: 0 };
const COLOURS = WHEEL.map(packed);
const LEGEND = "Boids have the colour of their heading, frames that of the value.";
const TOO_SMALL = `Swarms need cells of ${LEAST} × ${LEAST} pixels: widen the window.`;

/** @param {Box} box @param {number} by */
const inset = ({ x, y, width, height }, by) => ({
  x: x + by,
  y: y + by,
  width: width - 2 * by,
  height: height - 2 * by,
});

/** @param {Size} size */
const areaOf = ({ width, height }) => width * height;

/** @param {Part[]} parts */
const areaOfAll = (parts) => parts.reduce((sum, { part }) => sum + areaOf(part), 0);

// What another box leaves of a box, as boxes that may overlap.
/** @param {Box} box @param {Box} over @returns {Box[]} */
function outside(box, over) {
  const { x, y, width, height } = box;
  const [right, bottom] = [x + width, y + height];
  const [overRight, overBottom] = [over.x + over.width, over.y + over.height];
  const across = over.x < right && overRight > x;
  if (!across || over.y >= bottom || overBottom <= y) return [box];
  return [
    { ...box, width: over.x - x },
    { ...box, x: overRight, width: right - overRight },
    { ...box, height: over.y - y },
    { ...box, y: overBottom, height: bottom - overBottom },
  ].filter((left) => left.width > 0 && left.height > 0);
}

// The largest part of a box that no other one covers.
/** @param {Box} box @param {Box[]} others @returns {Box | undefined} */
function uncovered(box, others) {
  let parts = [box];
  for (const over of others) {
    parts = parts.flatMap((part) => outside(part, over))
      .toSorted((a, b) => areaOf(b) - areaOf(a)).slice(0, MOST_PARTS);
  }
  return parts[0];
}

// Draws the swarms of all cells at one step.
class CellStage extends Stage {
  /** @type {Cell[]} */
  cells = [];
  step = 0;
  centre = { x: 0, y: 0 };

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    contextOf(canvas); // the marks below shine through, unlike through other stages
    super(canvas, () => {}, () => {}, NO_ROOM);
  }

  /** @override */
  get middle() {
    return this.centre;
  }

  // Each cell has a camera of its own.
  /** @override */
  look() {}

  /** @override */
  draw() {
    const { canvas, cells, context, ratio, stamps } = this;
    if (!cells.length || !(context instanceof CanvasRenderingContext2D)) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, this.width, this.height);
    const size = Math.round(this.boid * ratio * 4) / 4;
    stamps.begin(canvas.width, canvas.height, size, this.upright);
    for (const cell of cells) this.drawCell(context, cell);
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(stamps.end(), 0, 0);
  }

  // The length of a boid, one for all cells: it suits the cell in the middle.
  get boid() {
    const room = this.cells.map(({ box, tape }) =>
      areaOf(inset(box, COLOURED + WITHIN)) / Math.max(1, tape.frame(0).n)
    ).toSorted((a, b) => a - b);
    const usual = LENGTH.part * Math.sqrt(room[room.length >> 1]);
    return Math.min(Math.max(usual, LENGTH.least), LENGTH.most);
  }

  /** @param {CanvasRenderingContext2D} context @param {Cell} cell */
  drawCell(context, { box, scene, tape }) {
    const inner = inset(box, COLOURED);
    const room = inset(inner, WITHIN);
    this.scene = scene;
    this.centre = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
    this.camera = {
      scale: Math.min(room.width / scene.width, room.height / scene.height),
      x: scene.width / 2,
      y: scene.height / 2,
    };
    const [x, y, width, height] = this.box(0, 0, scene.width, scene.height);
    const world = inset({ x, y, width, height }, -WITHIN);
    context.fillStyle = this.colours.stage;
    context.fillRect(inner.x, inner.y, inner.width, inner.height);
    context.fillStyle = this.colours.ground;
    context.fillRect(world.x, world.y, world.width, world.height);
    this.frame = tape.frame(tape.at(this.step));
    this.project(this.frame);
    if (scene.obstacles.length) this.block(context, inner, scene);
    this.stamp(this.frame, inset(room, -0.5));
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Box} inner
   * @param {Scene} scene
   */
  block(context, inner, scene) {
    context.save();
    context.beginPath();
    context.rect(inner.x, inner.y, inner.width, inner.height);
    context.clip();
    drawObstacles(this, scene);
    context.restore();
  }

  // Boids outside the room of a cell are left out.
  /** @param {Frame} frame @param {Box} room */
  stamp({ heading, n }, { x, y, width, height }) {
    const { ratio, screenX, screenY, stamps } = this;
    for (let i = 0; i < n; i++) {
      const [across, along] = [screenX[i] - x, screenY[i] - y];
      if (across < 0 || across > width || along < 0 || along > height) continue;
      const colour = COLOURS[heading[i]];
      stamps.add(screenX[i] * ratio, screenY[i] * ratio, heading[i], colour);
    }
  }
}

export class LivingCells {
  /** @type {Part[]} */
  parts = [];
  around = { width: 0, height: 0 }; // of the figure, next to its plot
  /** @type {Map<SupplementRun, Tape>} */
  tapes = new Map();
  /** @type {CellStage | null} */
  stage = null;
  place = 0; // in the longest recording
  held = 0; // frames, at the last step
  request = 0;
  latest = 0; // when a frame was drawn, in ms
  running = false;
  seen = false; // the figure is on the screen

  // `stand` holds the figure. `runOf` has the run of a point, and `switched` is called
  // when a reader wants swarms, or no longer.
  /**
   * @param {HTMLElement} stand
   * @param {SupplementData} data
   * @param {Plotted} plotted
   * @param {{
   *   runOf: (place: number) => SupplementRun | null,
   *   switched: () => void,
   * }} acts
   */
  constructor(stand, data, plotted, { runOf, switched }) {
    this.stand = stand;
    this.data = data;
    this.plotted = plotted;
    this.runOf = runOf;
    this.input = make("input", {
      type: "checkbox",
      className: "switch",
      on: {
        change: () => {
          this.settle();
          switched();
        },
      },
    });
    this.reason = make("small", { textContent: TOO_SMALL });
    const rest = () => this.rest(this.running);
    this.pause = button("pause", "Pause swarms", rest, "", { className: "quiet" });
    this.at = make("span", { className: "at" });
    this.wheel = make("canvas", {
      width: 2 * WHEEL_SIZE,
      height: 2 * WHEEL_SIZE,
      role: "img",
      "aria-label": "colours of headings",
    });
    this.words = make("small");
    this.shown = make("div", { className: "row" });
    this.shown.append(this.pause, this.at, this.wheel, this.words);
    const name = make("span", { textContent: "swarms" });
    const label = make("label", { className: "row" }, this.input, name);
    this.element = make("div", { className: "living row" });
    this.element.append(label, this.reason, this.shown);
    this.watcher = new IntersectionObserver((entries) => {
      this.seen = entries.some(({ isIntersecting }) => isIntersecting);
      this.move();
    });
    plotted.redrawn = () => this.settle();
    addEventListener("resize", () => this.settle());
  }

  // Whether a reader wants swarms.
  get wanted() {
    return this.input.checked;
  }

  // Brings the figure into the state that the switch and the window ask for.
  settle() {
    const { element, input, plotted, reason, shown, stand } = this;
    if (!plotted.width) return;
    if (!this.parts.length) this.measure();
    const room = { width: stand.clientWidth - PADDING, height: innerHeight - ABOVE };
    const plot = this.plotIn(room);
    const can = this.suits(plot);
    const on = can && this.wanted;
    const wide = plot.width + this.around.width;
    element.hidden = !can && !this.suits(this.plotIn(LARGE_SCREEN));
    input.disabled = !can;
    reason.hidden = can;
    shown.hidden = !on;
    stand.classList.toggle("alive", on);
    stand.classList.toggle("wide", on && room.width - wide < BESIDE);
    stand.style.setProperty("--figure", `${wide}px`);
    plotted.tall = on ? plot.height + this.around.height : 0;
    plotted.draw();
    if (on) this.start(plot);
    else this.stop();
  }

  // Measures the cells that are seen, from the uppermost on.
  measure() {
    const { area, height, layered, marks, width } = this.plotted;
    const [wide, tall] = [area.right - area.left, area.bottom - area.top];
    this.around = { width: width - wide, height: height - tall };
    /** @type {Box[]} */
    const above = [];
    for (const mark of layered.toReversed()) {
      if (!mark.box) continue;
      const { box, point } = mark;
      const scaled = {
        x: (box.x - area.left) / wide,
        y: (box.y - area.top) / tall,
        width: box.width / wide,
        height: box.height / tall,
      };
      const part = uncovered(scaled, above);
      above.push(scaled);
      if (part && point.runs.length) {
        this.parts.push({ place: marks.indexOf(mark), part });
      }
    }
  }

  // The plot that a room has: cells have the aspects of their worlds, or else there is
  // no room for that, and they are as large as possible.
  /** @param {Size} room @returns {Size} */
  plotIn(room) {
    const { around } = this;
    const aspect = this.aspect();
    const largest = {
      width: room.width - around.width,
      height: Math.max(room.height - around.height, LEAST_PLOT.height),
    };
    const fitting = Math.max(largest.height * aspect, LEAST_PLOT.width);
    const width = Math.floor(Math.min(largest.width, fitting));
    const suiting = Math.max(width / aspect, LEAST_PLOT.height);
    const plot = { width, height: Math.floor(Math.min(largest.height, suiting)) };
    return this.suits(plot) ? plot : largest;
  }

  // The width of a plot by its height with which cells have, on geometric average, the
  // aspects of their worlds.
  aspect() {
    const { data, parts } = this;
    const logs = parts.map(({ place, part }) => {
      const run = this.runOf(place);
      const { width, height } = run ? data.scenes[run.scene] : part;
      return Math.log((width * part.height) / (height * part.width));
    });
    return Math.exp(logs.reduce((sum, log) => sum + log, 0) / Math.max(1, logs.length));
  }

  /** @param {Size} plot */
  largeIn(plot) {
    return this.parts.filter(({ part: { width, height } }) =>
      Math.min(width * plot.width, height * plot.height) >= LEAST
    );
  }

  /** @param {Size} plot */
  suits(plot) {
    const large = areaOfAll(this.largeIn(plot));
    return large > 0 && large >= ENOUGH * areaOfAll(this.parts);
  }

  /** @param {Size} plot */
  start(plot) {
    const fresh = !this.stage;
    this.stage ??= this.mount();
    const parts = this.largeIn(plot);
    const small = this.parts.length - parts.length;
    const except = small ? ` Cells too small for a swarm: ${small}.` : "";
    write(this.words, LEGEND + except);
    this.take(parts);
    if (!fresh) return;
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.turn(still ? this.last : 0);
    this.rest(still);
  }

  mount() {
    const canvas = make("canvas", { className: "swarms", "aria-hidden": "true" });
    this.plotted.element.append(canvas);
    this.watcher.observe(canvas);
    return new CellStage(canvas);
  }

  stop() {
    if (!this.stage) return;
    this.watcher.disconnect();
    this.seen = false;
    this.move();
    this.stage.stop();
    this.stage.canvas.remove();
    this.stage = null;
  }

  // Takes the present runs of cells.
  /** @param {Part[]} parts */
  take(parts) {
    const { stage } = this;
    if (!stage) return;
    stage.cells = parts.flatMap(({ place, part }) => {
      const run = this.runOf(place);
      if (!run?.steps.length) return [];
      const scene = this.data.scenes[run.scene];
      return [{ box: this.onScreen(part), scene, tape: this.tapeOf(run) }];
    });
    if (!stage.cells.length) return;
    stage.scene = stage.cells[0].scene;
    const at = { x: WHEEL_SIZE, y: WHEEL_SIZE };
    const radii = /** @type {[number, number]} */ ([0.55 * WHEEL_SIZE, WHEEL_SIZE]);
    drawRing(contextOf(this.wheel), at, radii, stage.upright);
    this.turn(this.place);
  }

  /** @param {Box} part @returns {Box} */
  onScreen({ x, y, width, height }) {
    const { left, right, top, bottom } = this.plotted.area;
    const [across, along] = [right - left, bottom - top];
    return {
      x: left + x * across,
      y: top + y * along,
      width: width * across,
      height: height * along,
    };
  }

  /** @param {SupplementRun} run */
  tapeOf(run) {
    const tape = this.tapes.get(run) ?? new Tape(run);
    this.tapes.set(run, tape);
    return tape;
  }

  // The steps of the recording with the latest one: all swarms follow them.
  get steps() {
    const all = this.stage?.cells.map(({ tape: { steps } }) => steps) ?? [];
    return all.reduce((a, b) => ((a.at(-1) ?? 0) >= (b.at(-1) ?? 0) ? a : b), [0]);
  }

  get last() {
    return this.steps.length - 1;
  }

  /** @param {number} place */
  turn(place) {
    const { stage, steps, last } = this;
    if (!stage) return;
    this.place = Math.min(place, last);
    stage.step = steps[this.place];
    stage.redraw();
    write(this.at, `step ${stage.step} of ${steps[last]}`);
  }

  /** @param {boolean} still */
  rest(still) {
    this.running = !still;
    const [name, words] = still ? ["play", "Play swarms"] : ["pause", "Pause swarms"];
    setIcon(this.pause, /** @type {"play" | "pause"} */ (name), words);
    this.move();
  }

  // Frames go on as long as they are seen. A hidden page asks for no frames.
  move() {
    cancelAnimationFrame(this.request);
    if (!this.running || !this.seen) return;
    this.request = requestAnimationFrame((now) => this.advance(now));
  }

  /** @param {number} now */
  advance(now) {
    if (now - this.latest >= 1000 / RATE - EARLY) {
      this.latest = now;
      this.next();
    }
    this.move();
  }

  next() {
    const { last, place } = this;
    this.held = place === last ? this.held + 1 : 0;
    const each = Math.max(1, Math.round(last / ROUND));
    if (place < last) this.turn(place + each);
    else if (this.held > HOLD) this.turn(0);
  }
}
