// The frames of a recording, by their place on it.

import { decode } from "./frames.js";

/** @import { Recording } from "./protocol.d.ts" */

export class Tape {
  // All frames have as many bytes.
  /** @param {Pick<Recording, "frames" | "steps">} recording */
  constructor({ frames, steps }) {
    this.bytes = frames;
    this.steps = steps;
    this.size = this.bytes.length / steps.length;
  }

  // The last place.
  get last() {
    return this.steps.length - 1;
  }

  // The place of the latest frame that is not after `step`.
  /** @param {number} step */
  at(step) {
    let [low, high] = [0, this.last];
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (this.steps[middle] <= step) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** @param {number} place */
  frame(place) {
    return decode(this.bytes.buffer.slice(place * this.size, (place + 1) * this.size));
  }
}
