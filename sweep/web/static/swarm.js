// Draws what moves: boids with their trails, the neighbours of one boid, and the
// accelerations by rule.

import { WHEEL } from "./headings.js";
import { CORNERS, packed } from "./stamps.js";

/** @import { Frame } from "./frames.js" */
/** @import { Scene } from "./protocol.d.ts" */
/** @import { Camera, Stage } from "./stage.js" */

export const HUES = 7; // colours of rules, --rule-0 ..., and of boids, --hue-0 ...
// Two frames that are so many steps apart are not joined: a straight line would
// mislead.
const TRAIL_GAP = 10;
const MANY = 300; // boids, from which on they are stamps
export const ARROW = 26; // CSS pixels, a usual acceleration
const MOST_ARROWS = 500; // boids; of more, a sample has arrows

// Of how many boids one has arrows, if none is selected.
/** @param {number} n */
export const sampled = (n) => Math.ceil(n / MOST_ARROWS);

/** @param {Stage} stage @param {Scene} scene */
export function drawTrails(stage, scene) {
  const { context, trail } = stage;
  const origin = stage.toScreen({ x: 0, y: 0 });
  const [across, along] = [stage.camera.scale, stage.camera.scale * stage.upright];
  const [farX, farY] = [scene.width / 2, scene.height / 2];
  context.strokeStyle = stage.colours.boid;
  context.lineWidth = 1;
  for (let k = 1; k < trail.length; k++) {
    const [from, to] = [trail[k - 1], trail[k]];
    if (to.step - from.step > TRAIL_GAP) continue;
    context.globalAlpha = 0.55 * (k / trail.length) ** 1.5;
    context.beginPath();
    for (let i = 0; i < to.x.length; i++) {
      if (
        Math.abs(to.x[i] - from.x[i]) > farX || Math.abs(to.y[i] - from.y[i]) > farY
      ) continue;
      context.moveTo(origin.x + across * from.x[i], origin.y + along * from.y[i]);
      context.lineTo(origin.x + across * to.x[i], origin.y + along * to.y[i]);
    }
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** @param {Stage} stage @param {Scene} scene @param {Frame} frame */
export function drawPerception(stage, scene, frame) {
  const { context, selection: chosen } = stage;
  if (!chosen || chosen.boid >= frame.n) return;
  const [x, y] = [stage.screenX[chosen.boid], stage.screenY[chosen.boid]];
  const half = ((Math.min(chosen.fov ?? 360, 360) / 2) * Math.PI) / 180;
  const heading = (chosen.heading ?? 0) * stage.upright;
  context.strokeStyle = context.fillStyle = stage.colours.chosen;
  context.lineWidth = 1.25;
  if (Number.isFinite(chosen.range)) {
    context.beginPath();
    if (half < Math.PI) context.moveTo(x, y);
    context.arc(
      x,
      y,
      chosen.range * stage.camera.scale,
      heading - half,
      heading + half,
    );
    if (half < Math.PI) context.closePath();
    context.globalAlpha = 0.12;
    context.fill();
    context.globalAlpha = 0.8;
    context.stroke();
  }
  context.globalAlpha = 0.7;
  context.beginPath();
  for (const other of chosen.neighbours) {
    const [dx, dy] = [stage.screenX[other] - x, stage.screenY[other] - y];
    const far = Math.abs(dx) > (scene.width * stage.camera.scale) / 2;
    if (far || Math.abs(dy) > (scene.height * stage.camera.scale) / 2) continue;
    context.moveTo(x, y);
    context.lineTo(x + dx, y + dy);
  }
  context.stroke();
  drawKnown(stage, chosen.known ?? []);
  context.globalAlpha = 1;
}

// A ring where the selected boid knows each of its neighbours to be.
/** @param {Stage} stage @param {[number, number][]} known */
function drawKnown(stage, known) {
  for (const [x, y] of known) {
    const at = stage.toScreen({ x, y });
    stage.context.beginPath();
    stage.context.arc(at.x, at.y, 4, 0, 2 * Math.PI);
    stage.context.stroke();
  }
}

/** @param {Scene} scene @param {Frame} frame @param {Camera} camera */
function boidLength(scene, frame, { scale }) {
  const room = 0.42 * Math.sqrt((scene.width * scene.height) / Math.max(1, frame.n)) *
    scale;
  return Math.min(Math.max(room, 4), 11);
}

/** @param {Stage} stage @param {Scene} scene @param {Frame} frame */
export function drawBoids(stage, scene, frame) {
  const { context } = stage;
  const size = boidLength(scene, frame, stage.camera);
  const of = boidColours(stage, frame);
  const plain = stage.colours.boid;
  if (frame.n > MANY && context instanceof CanvasRenderingContext2D) {
    stampBoids(stage, context, frame, size, of);
  } else {
    for (let i = 0; i < frame.n; i++) {
      drawBoid(stage, frame, i, size, of ? of.colours[of.places[i]] : plain);
    }
  }
  const chosen = stage.selection?.boid;
  if (chosen === undefined || chosen >= frame.n) return;
  drawBoid(stage, frame, chosen, 1.5 * size, stage.colours.chosen);
  context.strokeStyle = stage.colours.chosen;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(stage.screenX[chosen], stage.screenY[chosen], size + 4, 0, 2 * Math.PI);
  context.stroke();
}

// A cross below each boid that has failed: its ends stand out on any ground, and the
// colour and the heading of the boid stay visible.
/** @param {Stage} stage @param {Scene} scene @param {Frame} frame */
export function drawFailed(stage, scene, frame) {
  const { context, failed, screenX, screenY } = stage;
  if (!failed.length) return;
  const arm = 0.9 * boidLength(scene, frame, stage.camera);
  context.beginPath();
  for (const i of failed) {
    const [x, y] = [screenX[i], screenY[i]];
    context.moveTo(x - arm, y - arm);
    context.lineTo(x + arm, y + arm);
    context.moveTo(x - arm, y + arm);
    context.lineTo(x + arm, y - arm);
  }
  context.strokeStyle = stage.colours.stage;
  context.lineWidth = 4;
  context.stroke();
  context.strokeStyle = stage.colours.ink;
  context.lineWidth = 1.75;
  context.stroke();
}

// For each boid the colour of its flock, its heading, or its kind. A boid that is alone
// has the last colour.
/** @typedef {{ places: ArrayLike<number>, colours: string[] }} BoidColours */
/** @param {Stage} stage @param {Frame} frame @returns {BoidColours | null} */
function boidColours({ overlays, flocks, kinds, hues, colours: { edge } }, frame) {
  if (overlays.has("flocks") && frame.flocks) {
    const places = flocks.ofBoid.map((flock) => (flock < 0 ? hues.length : flock));
    return { places, colours: [...hues, edge] };
  }
  if (overlays.has("headings")) return { places: frame.heading, colours: WHEEL };
  return kinds?.length === frame.n ? { places: kinds, colours: hues } : null;
}

/**
 * @param {Stage} stage
 * @param {Frame} frame
 * @param {number} i
 * @param {number} size
 * @param {string} colour
 */
function drawBoid(stage, frame, i, size, colour) {
  const { context } = stage;
  const angle = (frame.heading[i] / 128) * Math.PI * stage.upright;
  const [cos, sin] = [Math.cos(angle) * size, Math.sin(angle) * size];
  context.fillStyle = colour;
  context.beginPath();
  for (const [along, across] of CORNERS) {
    context.lineTo(
      stage.screenX[i] + along * cos - across * sin,
      stage.screenY[i] + along * sin + across * cos,
    );
  }
  context.fill();
}

/**
 * @param {Stage} stage
 * @param {CanvasRenderingContext2D} context
 * @param {Frame} frame
 * @param {number} size
 * @param {BoidColours | null} of
 */
function stampBoids(stage, context, frame, size, of) {
  const { ratio } = stage;
  const { canvas } = context;
  const colours = of?.colours.map(packed) ?? [];
  const plain = packed(stage.colours.boid);
  stage.stamps.begin(
    canvas.width,
    canvas.height,
    Math.round(size * ratio * 4) / 4,
    stage.upright,
  );
  for (let i = 0; i < frame.n; i++) {
    const colour = of ? colours[of.places[i]] : plain;
    stage.stamps.add(
      stage.screenX[i] * ratio,
      stage.screenY[i] * ratio,
      frame.heading[i],
      colour,
    );
  }
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.drawImage(stage.stamps.end(), 0, 0);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
}

/** @param {Stage} stage @param {Frame} frame */
export function drawAccelerations(stage, { accelerations, rules, n }) {
  if (!accelerations) return;
  const chosen = stage.selection
    ? [stage.selection.boid]
    : Array.from({ length: Math.ceil(n / sampled(n)) }, (_, i) => i * sampled(n));
  let [sum, count] = [0, 0];
  for (const length of lengths(accelerations, n, chosen)) {
    if (length > 0) [sum, count] = [sum + length * length, count + 1];
  }
  if (!count) return;
  const scale = ARROW / Math.sqrt(sum / count);
  const sudden = !(stage.arrowScale > scale / 5 && stage.arrowScale < scale * 5);
  stage.arrowScale = sudden
    ? scale
    : stage.arrowScale * (scale / stage.arrowScale) ** 0.08;
  for (let rule = 0; rule < rules; rule++) {
    drawRule(stage, accelerations, n, rule, chosen);
  }
}

/** @param {Float32Array} accelerations @param {number} n @param {number[]} boids */
function* lengths(accelerations, n, boids) {
  for (let from = 0; from < accelerations.length; from += 2 * n) {
    for (const i of boids) {
      yield Math.hypot(accelerations[from + i], accelerations[from + n + i]);
    }
  }
}

/**
 * @param {Stage} stage
 * @param {Float32Array} accelerations
 * @param {number} n
 * @param {number} rule
 * @param {number[]} boids
 */
function drawRule(stage, accelerations, n, rule, boids) {
  const { context, screenX, screenY } = stage;
  context.strokeStyle = stage.rules[rule % HUES];
  context.lineWidth = 1.5;
  context.setLineDash(rule < HUES ? [] : [3, 2]);
  context.beginPath();
  for (const i of boids) {
    let dx = accelerations[2 * rule * n + i] * stage.arrowScale;
    let dy = accelerations[(2 * rule + 1) * n + i] * stage.arrowScale * stage.upright;
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
