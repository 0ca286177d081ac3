// Says how many boids have left the world, and follows them.

import { make, write } from "./dom.js";
import { placeX, placeY } from "./frames.js";

/** @import { Frame } from "./frames.js" */
/** @import { Scene } from "./protocol.d.ts" */

// Boids outside of the world. A place in a frame is exact to one of 65535 parts of its
// box, and a boid on the border is inside.
/** @param {Frame} frame @param {Scene} scene */
export function countOutside(frame, { width, height }) {
  const [left, top, right, bottom] = frame.box;
  const [across, along] = [(right - left) / 65535, (bottom - top) / 65535];
  let count = 0;
  for (let i = 0; i < frame.n; i++) {
    const [x, y] = [placeX(frame, i), placeY(frame, i)];
    if (x < -across || x > width + across || y < -along || y > height + along) count++;
  }
  return count;
}

const LAST = 65535; // the largest place in a frame
const NEARLY = 1e-6; // of a length: the corners of a box have 32 bits

// Boids that are farther away than a frame can say. Its box reaches beyond the world by
// no more than the size of the world, and such a boid is drawn at the edge of the box.
/** @param {Frame} frame @param {Scene} scene */
export function countFar(frame, { width, height }) {
  const [left, top, right, bottom] = frame.box;
  const [wide, high] = [width * (1 - NEARLY), height * (1 - NEARLY)];
  // The places in a frame that say "here, or farther"; none where a side reaches less.
  const across = [left < -wide ? 0 : -1, right - width > wide ? LAST : -1];
  const along = [top < -high ? 0 : -1, bottom - height > high ? LAST : -1];
  let count = 0;
  for (let i = 0; i < frame.n; i++) {
    if (across.includes(frame.x[i]) || along.includes(frame.y[i])) count++;
  }
  return count;
}

export class Outside {
  /** @param {() => void} follow */
  constructor(follow) {
    this.element = make("button", {
      type: "button",
      className: "outside",
      hidden: true,
      title: "Follow the boids",
      on: { click: follow },
    });
  }

  /** @param {Frame | null} frame @param {Scene | null} scene */
  show(frame, scene) {
    const count = frame && scene ? countOutside(frame, scene) : 0;
    this.element.hidden = !count;
    const boids = count === 1 ? "1 boid" : `${count} boids`;
    const far = frame && scene ? countFar(frame, scene) : 0;
    const edge = far ? `; ${far} of them too far to be shown, drawn at the edge` : "";
    write(this.element, `${boids} outside: follow${edge}`);
  }
}
