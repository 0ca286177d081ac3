// Packs and unpacks frames, and gives each flock a colour for as long as it lives.

/** @import { Bytes } from "./protocol.d.ts" */

const MAGIC = 0x31465342; // "BSF1"
const HEAD = 32; // bytes before the boids
const SPAN = 65535; // the largest number of a position
const TURN = 256; // numbers of headings
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
  let at = HEAD;
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

// Halves go to the even neighbour, as in NumPy.
/** @param {number} value */
function rounded(value) {
  const low = Math.floor(value);
  const part = value - low;
  if (part !== 0.5) return part < 0.5 ? low : low + 1;
  return low % 2 ? low + 1 : low;
}

/** @param {number} value @param {number} low @param {number} high */
function place(value, low, high) {
  const part = (value - low) * (SPAN / (high - low));
  return rounded(Math.min(SPAN, Math.max(0, part)));
}

// The ends of positions: at least the world, at most one world on each side of it.
/** @param {Float64Array} values @param {number} length */
function ends(values, length) {
  const least = values.reduce((a, b) => Math.min(a, b), 0);
  const most = values.reduce((a, b) => Math.max(a, b), length);
  const low = Math.max(-length, least);
  const high = Math.min(2 * length, most);
  return [Math.fround(low), Math.fround(high)];
}

// The frame of a step, as the server packs it: `size` is that of the world, `angles`
// are headings in radians.
/**
 * @param {number} step
 * @param {[number, number]} size
 * @param {Record<"x" | "y" | "angles", Float64Array>} boids
 */
export function encode(step, size, { x, y, angles }) {
  const n = x.length;
  const frame = new Uint8Array(padded(HEAD + 5 * n));
  const view = new DataView(frame.buffer);
  const [left, right] = ends(x, size[0]);
  const [low, high] = ends(y, size[1]);
  [MAGIC, 0, step, n].forEach((value, k) => view.setUint32(4 * k, value, true));
  [left, low, right, high].forEach((end, k) => view.setFloat32(16 + 4 * k, end, true));
  for (let i = 0; i < n; i++) {
    view.setUint16(HEAD + 2 * i, place(x[i], left, right), true);
    view.setUint16(HEAD + 2 * (n + i), place(y[i], low, high), true);
    frame[HEAD + 4 * n + i] = rounded(angles[i] * (TURN / (2 * Math.PI))) & 255;
  }
  return frame;
}

/** @param {Frame} frame @param {number} i */
export const placeX = (frame, i) =>
  frame.box[0] + (frame.x[i] / SPAN) * (frame.box[2] - frame.box[0]);
/** @param {Frame} frame @param {number} i */
export const placeY = (frame, i) =>
  frame.box[1] + (frame.y[i] / SPAN) * (frame.box[3] - frame.box[1]);

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
