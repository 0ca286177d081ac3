// Unpacks frames of the server, and gives each flock a colour for as long as it lives.

/** @import { Bytes } from "./protocol.d.ts" */

const MAGIC = 0x31465342; // "BSF1"
const FLOCKS = 1;
const ACCELERATIONS = 2;
const COVERAGE = 4;
const ALONE = 65535;
export const OBSTACLE_CELL = 255;
export const WHOLE_CELL = 254; // all of it was visited

/**
 * @typedef {object} Frame
 * @property {number} step
 * @property {number} n
 * @property {number[]} box
 * @property {Uint16Array} x
 * @property {Uint16Array} y
 * @property {Uint8Array} heading
 * @property {Uint16Array | null} flocks
 * @property {Float32Array | null} accelerations
 * @property {number} rules
 * @property {Coverage | null} coverage
 */

/** @typedef {{ rows: number, columns: number, shares: Uint8Array }} Coverage */

/** @param {number} bytes */
const padded = (bytes) => (bytes + 3) & ~3;

// x and y are 16 bits across `box`, headings 8 bits of a turn; sections that were not
// sent are null. Accelerations are those of each rule in turn: all ax, then all ay.
/** @param {Bytes} data @returns {Frame} */
export function decode(data) {
  const buffer = data instanceof ArrayBuffer
    ? data
    : data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
  const view = new DataView(buffer);
  if (view.getUint32(0, true) !== MAGIC) throw new Error("not a frame");
  const [flags, step, n] = [4, 8, 12].map((at) => view.getUint32(at, true));
  const box = [16, 20, 24, 28].map((at) => view.getFloat32(at, true));
  let at = 32;
  /**
   * @template {Uint8Array | Uint16Array | Uint32Array | Float32Array} T
   * @param {new (buffer: ArrayBuffer, at: number, count: number) => T} type
   * @param {number} count
   */
  const take = (type, count) => {
    const values = new type(buffer, at, count);
    at += values.byteLength;
    return values;
  };
  /** @type {Frame} */
  const frame = {
    step,
    n,
    box,
    x: take(Uint16Array, n),
    y: take(Uint16Array, n),
    heading: take(Uint8Array, n),
    flocks: null,
    accelerations: null,
    rules: 0,
    coverage: null,
  };
  at = padded(at);
  if (flags & FLOCKS) {
    frame.flocks = take(Uint16Array, n);
    at = padded(at);
  }
  if (flags & ACCELERATIONS) {
    [frame.rules] = take(Uint32Array, 1);
    frame.accelerations = take(Float32Array, frame.rules * n * 2);
  }
  if (flags & COVERAGE) {
    const [rows, columns] = take(Uint32Array, 2);
    frame.coverage = { rows, columns, shares: take(Uint8Array, rows * columns) };
  }
  return frame;
}

/** @param {Frame} frame @param {number} i */
export const placeX = (frame, i) =>
  frame.box[0] + (frame.x[i] / 65535) * (frame.box[2] - frame.box[0]);
/** @param {Frame} frame @param {number} i */
export const placeY = (frame, i) =>
  frame.box[1] + (frame.y[i] / 65535) * (frame.box[3] - frame.box[1]);

// A flock gets the colour that most of its boids had before. Larger flocks choose
// first. A boid that is alone has no colour (-1).
export class FlockColours {
  /** @param {number} colours */
  constructor(colours) {
    this.colours = colours;
    this.ofBoid = new Int16Array(0);
  }

  /** @param {Uint16Array} flocks */
  assign(flocks) {
    const n = flocks.length;
    const before = this.ofBoid.length === n ? this.ofBoid : new Int16Array(n).fill(-1);
    /** @type {Map<number, { size: number, counts: Uint32Array }>} */
    const votes = new Map();
    for (let i = 0; i < n; i++) {
      let vote = votes.get(flocks[i]);
      if (!vote) {
        votes.set(flocks[i], vote = { size: 0, counts: new Uint32Array(this.colours) });
      }
      vote.size++;
      if (before[i] >= 0) vote.counts[before[i]]++;
    }
    /** @type {Map<number, number>} */
    const chosen = new Map();
    const used = new Uint32Array(this.colours);
    for (const [flock, vote] of [...votes].sort((a, b) => b[1].size - a[1].size)) {
      const colour = flock === ALONE ? -1 : this.choose(vote.counts, used);
      if (colour >= 0) used[colour]++;
      chosen.set(flock, colour);
    }
    this.ofBoid = Int16Array.from(flocks, (flock) => chosen.get(flock) ?? -1);
    return this.ofBoid;
  }

  /** @param {Uint32Array} counts @param {Uint32Array} used */
  choose(counts, used) {
    const most = counts.indexOf(Math.max(...counts));
    const least = used.indexOf(Math.min(...used));
    return counts[most] > 0 && (used[most] === 0 || used[least] > 0) ? most : least;
  }
}
