// Draws what does not move: the world, its visits and obstacles, the goal, the handles
// of the selection, and the scale.

import { OBSTACLE_CELL, WHOLE_CELL } from "./frames.js";
import { contextOf, partsOf, short } from "./dom.js";

/** @import { Obstacle, Polygon, Scene } from "./protocol.d.ts" */
/** @import { Stage } from "./stage.js" */

// Room for the tools and for the scale.
export const MARGIN = { side: 18, top: 56, bottom: 34 };
const FLAG = [[-1, 0], [-1, -18], [11, -18], [8, -14], [11, -10], [1, -10], [1, 0]];

/** @param {Stage} stage @param {Scene} scene */
export function drawGround(stage, scene) {
  const { context } = stage;
  const world = stage.box(0, 0, scene.width, scene.height);
  context.fillStyle = stage.colours.ground;
  context.fillRect(...world);
  if (stage.overlays.has("coverage") && stage.coverage) {
    context.imageSmoothingEnabled = false;
    context.save();
    context.translate(world[0], stage.upright > 0 ? world[1] : world[1] + world[3]);
    context.scale(1, stage.upright);
    context.drawImage(stage.heat, 0, 0, world[2], world[3]);
    context.restore();
  }
  context.strokeStyle = stage.colours.border;
  context.lineWidth = 1.5;
  context.setLineDash(
    scene.borders === "bounded" ? [] : scene.borders === "torus" ? [7, 4] : [2, 4],
  );
  context.strokeRect(...world);
  context.setLineDash([]);
}

// A cell is as opaque as the share of it that was visited: what is painted is the
// metric coverage.
/** @param {Stage} stage */
export function paintHeat(stage) {
  if (!stage.coverage) return;
  const { rows, columns, shares } = stage.coverage;
  const [red, green, blue] = partsOf(stage.colours.heat);
  const table = new Uint32Array(256);
  for (let share = 1; share < OBSTACLE_CELL; share++) {
    table[share] = (Math.round(255 * (share / WHOLE_CELL)) << 24) | (blue << 16) |
      (green << 8) | red;
  }
  if (stage.heat.width !== columns || stage.heat.height !== rows) {
    [stage.heat.width, stage.heat.height] = [columns, rows];
  }
  const context = contextOf(stage.heat);
  const image = context.createImageData(columns, rows);
  const pixels = new Uint32Array(image.data.buffer);
  for (let i = 0; i < pixels.length; i++) pixels[i] = table[shares[i]];
  context.putImageData(image, 0, 0);
}

/** @param {Stage} stage @param {Obstacle} obstacle */
function outline(stage, [x, y, halfWidth, halfHeight, round, polygon]) {
  const { context } = stage;
  if (polygon) {
    context.beginPath();
    for (const [across, along] of polygon.vertices) {
      const at = stage.toScreen({ x: across, y: along });
      context.lineTo(at.x, at.y);
    }
    context.closePath();
    return;
  }
  const middle = stage.toScreen({ x, y });
  const [across, along] = [
    halfWidth * stage.camera.scale,
    halfHeight * stage.camera.scale,
  ];
  context.beginPath();
  if (round) context.arc(middle.x, middle.y, Math.max(across, 2.5), 0, 2 * Math.PI);
  else context.rect(middle.x - across, middle.y - along, 2 * across, 2 * along);
}

// Adds to the outline of an arena a rectangle that holds it and the world, so that what
// is between them is filled.
/** @param {Stage} stage @param {Scene} scene @param {Polygon} arena */
function addAround(stage, { width, height }, { vertices }) {
  const [x, y] = [0, 1].map((axis) => vertices.map((vertex) => vertex[axis]));
  const [left, low] = [Math.min(0, ...x), Math.min(0, ...y)];
  const [right, high] = [Math.max(width, ...x), Math.max(height, ...y)];
  stage.context.rect(...stage.box(left, low, right - left, high - low));
}

/** @param {Stage} stage @param {Scene} scene */
export function drawObstacles(stage, scene) {
  const { context } = stage;
  context.fillStyle = stage.colours.obstacle;
  context.strokeStyle = stage.colours.edge;
  context.lineWidth = 1;
  for (const obstacle of stage.obstacles) {
    outline(stage, obstacle);
    if (obstacle[5]?.solid === "outside") addAround(stage, scene, obstacle[5]);
    context.fill("evenodd");
    context.stroke();
  }
}

// The places of all goals, in their turn.
/** @param {Scene} scene @returns {[x: number, y: number][]} */
export function goalsOf(scene) {
  if (!scene.goal) return [];
  const [x, y] = scene.goal;
  // (0, 0) stands for no goal
  if (x === 0 && y === 0 && scene.next_goals.length === 0) return [];
  return [[x, y], ...scene.next_goals];
}

// All goals, with numbers where there are several.
/** @param {Stage} stage @param {Scene} scene */
export function drawGoals(stage, scene) {
  const [places, radius] = [goalsOf(scene), scene.goal?.[2] ?? 0];
  for (const [index, place] of places.entries()) {
    drawGoal(stage, place, radius, places.length > 1 ? String(index + 1) : "");
  }
}

/**
 * @param {Stage} stage
 * @param {[x: number, y: number]} place
 * @param {number} radius
 * @param {string} label
 */
function drawGoal(stage, [x, y], radius, label) {
  const { context } = stage;
  const at = stage.toScreen({ x, y });
  context.strokeStyle = context.fillStyle = stage.colours.goal;
  context.lineWidth = 1.5;
  context.setLineDash([4, 4]);
  context.beginPath();
  context.arc(at.x, at.y, radius * stage.camera.scale, 0, 2 * Math.PI);
  context.stroke();
  context.setLineDash([]);
  context.beginPath();
  for (const [across, along] of FLAG) context.lineTo(at.x + across, at.y + along);
  context.closePath();
  context.fill();
  context.beginPath();
  context.arc(at.x, at.y, 3, 0, 2 * Math.PI);
  context.fill();
  context.font = "12px system-ui, sans-serif";
  context.fillText(label, at.x + 6, at.y + 12);
}

// A ring about a goal that is selected: a drag moves it.
/** @param {Stage} stage @param {[x: number, y: number]} goal */
function markGoal(stage, [x, y]) {
  const { context } = stage;
  const at = stage.toScreen({ x, y });
  context.strokeStyle = stage.colours.chosen;
  context.lineWidth = 2;
  context.beginPath();
  context.arc(at.x, at.y, 9, 0, 2 * Math.PI);
  context.stroke();
}

/** @param {Stage} stage */
export function drawHandles(stage) {
  const { chosen, context } = stage;
  const goal = stage.scene && goalsOf(stage.scene)[stage.goalMarked ?? -1];
  if (goal) markGoal(stage, goal);
  if (!chosen) return;
  context.strokeStyle = stage.colours.chosen;
  context.fillStyle = stage.colours.ground;
  context.lineWidth = 2;
  outline(stage, chosen);
  context.stroke();
  for (const { x, y } of stage.handles(chosen)) {
    context.beginPath();
    context.rect(x - 4, y - 4, 8, 8);
    context.fill();
    context.stroke();
  }
}

/** @param {Stage} stage @param {Scene} scene */
export function drawScale(stage, scene) {
  const { context } = stage;
  const rough = 110 / stage.camera.scale;
  const power = 10 ** Math.floor(Math.log10(rough));
  const length = [5, 2, 1].map((digit) => digit * power).find((one) => one <= rough) ??
    power;
  const [left, right, y] = [
    MARGIN.side,
    MARGIN.side + length * stage.camera.scale,
    stage.height - 11,
  ];
  context.strokeStyle = context.fillStyle = stage.colours.muted;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(left, y - 4);
  context.lineTo(left, y);
  context.lineTo(right, y);
  context.lineTo(right, y - 4);
  context.stroke();
  context.font = "12px system-ui, sans-serif";
  context.fillText(`${short(length)} ${scene.length}`, right + 7, y + 1);
}
