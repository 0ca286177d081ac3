// Tells from the frames of a recording which pixels boids have visited, as the kernels
// do. Each is a cell of its own.

import { OBSTACLE_CELL, placeX, placeY, WHOLE_CELL } from "./frames.js";
import { isSolid } from "./obstacles.js";

/** @import { Coverage, Frame } from "./frames.js" */
/** @import { Obstacle, Pixels, Scene } from "./protocol.d.ts" */
/** @import { Tape } from "./tape.js" */

export class Visits {
  /** @param {Tape} tape @param {Pixels} pixels @param {Scene} scene */
  constructor(tape, pixels, scene) {
    this.tape = tape;
    this.pixels = pixels;
    this.empty = new Uint8Array(pixels.rows * pixels.columns);
    for (const obstacle of scene.obstacles) this.block(obstacle);
    this.shares = this.empty.slice();
    this.place = 0; // the start is no visit
  }

  // Pixels that lie strictly within an obstacle are not visited.
  /** @param {Obstacle} obstacle */
  block([x, y, halfWidth, halfHeight, round, polygon]) {
    const { per_length: scale } = this.pixels;
    this.each(
      [(x - halfWidth) * scale, (x + halfWidth) * scale],
      [(y - halfHeight) * scale, (y + halfHeight) * scale],
      (column, row, at) => {
        const [dx, dy] = [column / scale - x, row / scale - y];
        const place = { x: column / scale, y: row / scale };
        const inside = polygon
          ? isSolid(polygon, place)
          : round
          ? dx * dx + dy * dy < halfWidth * halfWidth
          : Math.abs(dx) < halfWidth && Math.abs(dy) < halfHeight;
        if (inside) this.empty[at] = OBSTACLE_CELL;
      },
    );
  }

  // Calls `act` for all pixels of the world between two columns and two rows.
  /**
   * @param {[low: number, high: number]} across
   * @param {[low: number, high: number]} along
   * @param {(column: number, row: number, at: number) => void} act
   */
  each([left, right], [low, high], act) {
    const { columns, rows } = this.pixels;
    const [first, last] = [
      Math.max(0, Math.ceil(left)),
      Math.min(columns - 1, Math.floor(right)),
    ];
    const top = Math.min(rows - 1, Math.floor(high));
    for (let row = Math.max(0, Math.ceil(low)); row <= top; row++) {
      for (let column = first; column <= last; column++) {
        act(column, row, row * columns + column);
      }
    }
  }

  // What was visited in the frames up to `place`.
  /** @param {number} place @returns {Coverage} */
  until(place) {
    if (place < this.place) {
      this.shares.set(this.empty);
      this.place = 0;
    }
    while (this.place < place) this.mark(this.tape.frame(++this.place));
    const { rows, columns } = this.pixels;
    return { rows, columns, shares: this.shares };
  }

  /** @param {Frame} frame */
  mark(frame) {
    const { per_length: scale, radius, truncated } = this.pixels;
    for (let i = 0; i < frame.n; i++) {
      let [x, y] = [placeX(frame, i) * scale, placeY(frame, i) * scale];
      if (truncated) [x, y] = [Math.trunc(x), Math.trunc(y)];
      this.each(
        [x - radius, x + radius],
        [y - radius, y + radius],
        (column, row, at) => {
          const near = (column - x) ** 2 + (row - y) ** 2 <= radius * radius;
          if (near && this.shares[at] !== OBSTACLE_CELL) this.shares[at] = WHOLE_CELL;
        },
      );
    }
  }
}
