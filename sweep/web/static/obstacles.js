// Where obstacles are, and what lies within them.

/** @import { Obstacle, Polygon, Scene } from "./protocol.d.ts" */
/** @import { Place } from "./stage.js" */

// Whether a place is within what is solid of a polygon: a ray along x crosses its sides
// an odd number of times from inside.
/** @param {Polygon} polygon @param {Place} place */
export function isSolid({ vertices, solid }, { x, y }) {
  let odd = false;
  vertices.forEach(([bx, by], k) => {
    const [ax, ay] = vertices.at(k - 1) ?? [bx, by];
    if (ay > y !== by > y && x < ax + ((y - ay) * (bx - ax)) / (by - ay)) odd = !odd;
  });
  return odd !== (solid === "outside");
}

/** @param {Polygon} polygon @param {number} across @param {number} along */
export function shifted(polygon, across, along) {
  /** @type {Polygon["vertices"]} */
  const vertices = polygon.vertices.map(([x, y]) => [
    Number((x + across).toPrecision(15)),
    Number((y + along).toPrecision(15)),
  ]);
  return { ...polygon, vertices };
}

// The obstacles of a scene after so many steps, as kernels.moving places them: wrapped
// round the world, or mirrored at its borders.
/** @param {Scene} scene @param {number} step @returns {Obstacle[]} */
export function obstaclesAt({ obstacles, paths, width, height }, step) {
  if (!paths) return obstacles;
  const [vx, vy] = paths.velocities;
  return obstacles.map(([x, y, a, b, round, polygon], m) => {
    const time = step * paths.dt;
    const [newX, newY] = [
      placeAlong(x, vx[m] * time, width, paths.wraps),
      placeAlong(y, vy[m] * time, height, paths.wraps),
    ];
    if (!polygon) return [newX, newY, a, b, round];
    return [newX, newY, a, b, round, shifted(polygon, newX - x, newY - y)];
  });
}

/**
 * @param {number} start
 * @param {number} way
 * @param {number} length
 * @param {boolean} wraps
 */
function placeAlong(start, way, length, wraps) {
  if (way === 0) return start;
  if (wraps) return start + way - length * Math.floor((start + way) / length);
  const low = Math.min(0, start);
  const span = Math.max(length, start) - low;
  const place = start - low + way;
  const rest = place - 2 * span * Math.floor(place / (2 * span));
  return low + Math.min(rest, 2 * span - rest);
}
