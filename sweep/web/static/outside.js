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
    write(this.element, `${boids} outside: follow`);
  }
}
