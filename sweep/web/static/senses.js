// Tells from the places and headings of a frame whom a boid sees, and who flocks
// together, as the kernels do.

import { asNumber } from "./dom.js";
import { bytesOf } from "./files.js";
import { placeX, placeY } from "./frames.js";

/** @import { Frame } from "./frames.js" */
/** @import { Scene, Seen, SensesOf } from "./protocol.d.ts" */

const ALONE = 65535;

// The difference `d` of two coordinates taken the short way round.
/** @param {number} d @param {number} period */
function shortest(d, period) {
  if (d > period / 2) return d - period;
  return d < -period / 2 ? d + period : d;
}

export class Senses {
  /** @param {SensesOf} about @param {Scene} scene */
  constructor(about, scene) {
    this.about = about;
    this.scene = scene;
    this.range = asNumber(about.range);
    this.resting = bytesOf(about.resting);
  }

  // Whether a boid sees all round because it rests.
  /** @param {number} bit */
  rests(bit) {
    return Boolean((this.resting[bit >> 3] >> (bit & 7)) & 1);
  }

  // What a boid sees in the frame at `place` of a recording.
  /** @param {Frame} frame @param {number} place @param {number} boid @returns {Seen} */
  seen(frame, place, boid) {
    const { fov, range } = this.about;
    const round = fov >= 360 || this.rests(place * frame.n + boid);
    const heading = round ? null : this.heading(frame, boid);
    const neighbours = [];
    for (let other = 0; other < frame.n; other++) {
      if (other !== boid && this.sees(frame, boid, other, heading)) {
        neighbours.push(other);
      }
    }
    const at = { x: placeX(frame, boid), y: placeY(frame, boid) };
    const about = { range, fov: round ? 360 : fov, heading, neighbours };
    return { type: "selection", boid, ...at, ...about };
  }

  // In radians, from -π to π.
  /** @param {Frame} frame @param {number} boid */
  heading(frame, boid) {
    const turn = frame.heading[boid] / 256;
    return 2 * Math.PI * (turn > 0.5 ? turn - 1 : turn);
  }

  /**
   * @param {Frame} frame
   * @param {number} boid
   * @param {number} other
   * @param {number | null} heading
   */
  sees(frame, boid, other, heading) {
    const { about, range, scene } = this;
    let dx = placeX(frame, other) - placeX(frame, boid);
    let dy = placeY(frame, other) - placeY(frame, boid);
    if (about.shortest_way) {
      [dx, dy] = [shortest(dx, scene.width), shortest(dy, scene.height)];
    }
    const distance = Math.hypot(dx, dy);
    if (about.inclusive ? distance > range : distance >= range) return false;
    if (heading === null || distance === 0) return true;
    const along = dx * Math.cos(heading) + dy * Math.sin(heading);
    return along / distance >= Math.cos((about.fov / 360) * Math.PI);
  }

  // Of each boid the smallest index of one of its flock; 65535 for one that is alone.
  /** @param {Frame} frame */
  flocks(frame) {
    const { n } = frame;
    const reach = this.about.flock_range;
    const [x, y] = [new Float64Array(n), new Float64Array(n)];
    for (let i = 0; i < n; i++) [x[i], y[i]] = [placeX(frame, i), placeY(frame, i)];
    const order = Uint32Array.from(x.keys()).sort((i, j) => x[i] - x[j]);
    const parent = Uint32Array.from(x.keys());
    const sizes = new Uint32Array(n).fill(1);
    /** @param {number} i */
    const root = (i) => {
      while (parent[i] !== i) i = parent[i] = parent[parent[i]];
      return i;
    };
    for (let k = 0; k < n; k++) {
      for (let m = k + 1; m < n && x[order[m]] - x[order[k]] < reach; m++) {
        const [i, j] = [order[k], order[m]];
        if (Math.hypot(x[j] - x[i], y[j] - y[i]) >= reach) continue;
        const [low, high] = [root(i), root(j)].sort((a, b) => a - b);
        if (low === high) continue;
        parent[high] = low;
        sizes[low] += sizes[high];
      }
    }
    return Uint16Array.from(
      parent,
      (_, i) => (sizes[root(i)] > 1 ? root(i) % ALONE : ALONE),
    );
  }
}
