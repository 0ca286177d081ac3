// Computes stored trials in the page, by the WebAssembly of their kernels. A trial
// begins from the memory of a device before the first step. Its metrics are compared
// with the stored ones, bit for bit.

import { bytesOf } from "./files.js";
import { encode } from "./frames.js";
import { unpacked } from "./packed.js";

/** @import { Changed } from "./changed.js" */
/**
 * @import {
 *   ComputedModule,
 *   ComputedRun,
 *   ComputedStart,
 *   ComputedTables,
 *   Computation,
 * } from "./supplement.d.ts"
 */

const PAGE = 65536; // bytes of a page of memory
const FINE = 64; // arrays begin at multiples of this address
const TAKE = 0; // the task of a call that takes steps
const GOING = 0; // the state of a trial that is not lost
// What a compiled function returns without an error: with and without a value.
const RETURNED = [0, -2];
const SLICE = 30; // ms of computing between two looks at the reader
const BOID_STEPS = 20000; // of a call, some 20 ms

/**
 * What is computed of a trial: frames so many steps apart of a world of this size, and
 * a metric, with changed numbers.
 *
 * @typedef {object} Order
 * @property {number} every
 * @property {[number, number]} size
 * @property {string} metric
 * @property {Changed} [changed]
 * @property {() => boolean} [wanted]
 */

/** @type {Changed} */
const NOTHING = new Map();
const always = () => true;

const breath = () => new Promise((done) => setTimeout(done, 0));

// A trial in the memory of its module.
class Machine {
  /**
   * @param {WebAssembly.Module} module
   * @param {ComputedModule} about
   * @param {ComputedStart} start
   */
  constructor(module, about, start) {
    this.start = start;
    this.tables = about.tables;
    const bytes = start.rooms.reduce(
      (sum, [size, item]) => sum + size * item + FINE,
      0,
    );
    const initial = about.pages + Math.ceil(bytes / PAGE) + 1;
    this.memory = new WebAssembly.Memory({ initial });
    const { exports } = new WebAssembly.Instance(module, {
      env: { memory: this.memory },
    });
    this.kernel = /** @type {(...numbers: (number | bigint)[]) => number} */ (
      exports.fly
    );
    this.top = about.pages * PAGE; // after the memory of the module itself
    this.scratch = this.take(16);
    this.rooms = start.rooms.map(([size, item]) => this.take(size * item));
    this.integers = new BigInt64Array(bytesOf(start.wholes).buffer);
    this.floats = new Float64Array(bytesOf(start.reals).buffer);
  }

  /** @param {number} bytes @returns {number} */
  take(bytes) {
    const address = Math.ceil(this.top / FINE) * FINE;
    this.top = address + bytes;
    return address;
  }

  /** @param {Uint8Array[]} contents @param {Changed} changed */
  fill(contents, changed) {
    for (const [room, first, content] of this.start.pieces) {
      const at = this.rooms[room] + first * this.start.rooms[room][1];
      new Uint8Array(this.memory.buffer).set(contents[content], at);
    }
    const numbers = this.floatsOf("numbers");
    for (const [row, value] of changed) numbers[row] = value;
    const [task, steps] = this.integers;
    this.call(task, steps);
  }

  /** @param {bigint} task @param {bigint} steps */
  call(task, steps) {
    const [, , ...more] = this.integers;
    const status = this.kernel(
      this.scratch,
      this.scratch + 8,
      0n,
      task,
      steps,
      ...more,
      ...this.floats,
      ...this.rooms,
    );
    if (!RETURNED.includes(status)) throw new Error(`the kernel reports ${status}`);
  }

  /** @param {number} steps */
  advance(steps) {
    this.call(BigInt(TAKE), BigInt(steps));
  }

  /** @param {keyof ComputedTables} table */
  integersOf(table) {
    return new BigInt64Array(this.memory.buffer, ...this.whereOf(table));
  }

  /** @param {keyof ComputedTables} table */
  floatsOf(table) {
    return new Float64Array(this.memory.buffer, ...this.whereOf(table));
  }

  // Address and number of elements of an array of the kernel.
  /** @param {keyof ComputedTables} table @returns {[number, number]} */
  whereOf(table) {
    const place = this.tables[table];
    return [this.rooms[place], this.start.rooms[place][0]];
  }

  // The number of frames that were measured.
  get measured() {
    return Number(this.integersOf("marks")[1]);
  }

  get going() {
    return Number(this.integersOf("marks")[0]) === GOING;
  }

  // x, y, vx and vy of the boids.
  bodies() {
    const { n, bodies: [room, firsts] } = this.start;
    const all = new Float64Array(this.memory.buffer, this.rooms[room]);
    return firsts.map((first) => all.slice(first, first + n));
  }
}

// The frames of a trial, packed as the server packs them.
class Film {
  /** @param {ComputedStart} start @param {[number, number]} size */
  constructor(start, size) {
    this.start = start;
    this.size = size;
    const { n } = start;
    /** @type {Uint8Array[]} */
    this.frames = [];
    /** @type {number[]} */
    this.steps = [];
    /** @type {boolean[]} */
    this.resting = [];
    /** @type {Float64Array[]} */
    this.last = [0, 1, 2, 3].map(() => new Float64Array(n));
    this.ahead = [new Float64Array(n).fill(1), new Float64Array(n)];
  }

  /** @param {number} step @param {Float64Array[]} bodies */
  add(step, bodies) {
    // A boid that has left keeps its last position.
    bodies.forEach((values, k) =>
      values.forEach((value, i) => {
        if (Number.isNaN(value)) values[i] = this.last[k][i];
      })
    );
    this.last = bodies;
    const [x, y, vx, vy] = bodies;
    const [ahead, aside] = this.ahead;
    const angles = new Float64Array(x.length);
    for (let i = 0; i < x.length; i++) {
      const rests = vx[i] === 0 && vy[i] === 0;
      if (!rests) [ahead[i], aside[i]] = [vx[i], vy[i]];
      angles[i] = rests && !this.start.faces ? 0 : Math.atan2(aside[i], ahead[i]);
      this.resting.push(rests);
    }
    this.frames.push(encode(step, this.size, { x, y, angles }));
    this.steps.push(step);
  }

  get bytes() {
    const size = this.frames[0].length;
    const bytes = new Uint8Array(size * this.frames.length);
    this.frames.forEach((frame, k) => bytes.set(frame, k * size));
    return bytes;
  }

  // A bit for each boid of each frame, in base64; nothing where all boids move, or
  // where a boid at rest keeps its heading.
  get rest() {
    const { resting, start } = this;
    if (start.faces || !resting.includes(true)) return "";
    const bytes = new Uint8Array(Math.ceil(resting.length / 8));
    resting.forEach((rests, k) => {
      if (rests) bytes[k >> 3] |= 1 << (k & 7);
    });
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  }
}

export class Computer {
  /** @param {Computation} computation */
  constructor({ modules, contents }) {
    this.modules = modules;
    this.compiled = modules.map(async ({ code }) =>
      WebAssembly.compile(await unpacked(code))
    );
    // An error is met by the first trial that needs the module.
    for (const one of this.compiled) one.catch(() => {});
    this.contents = contents.map(unpacked);
  }

  // Computes a trial; null where nobody wants it any more.
  /**
   * @param {ComputedStart} start
   * @param {Order} order
   * @returns {Promise<ComputedRun | null>}
   */
  async run(start, { every, size, metric, changed = NOTHING, wanted = always }) {
    const about = this.modules[start.module];
    const module = await this.compiled[start.module];
    const machine = new Machine(module, about, start);
    machine.fill(await Promise.all(this.contents), changed);
    const film = new Film(start, size);
    film.add(0, machine.bodies());
    let seen = performance.now();
    const portion = Math.max(1, Math.floor(BOID_STEPS / start.n));
    for (let step = 0; step < start.steps && machine.going;) {
      const frame = Math.min(start.steps, (Math.floor(step / every) + 1) * every);
      const steps = Math.min(portion, frame - step);
      machine.advance(steps);
      step += steps;
      if (step === frame || !machine.going) film.add(step, machine.bodies());
      if (performance.now() - seen > SLICE) {
        await breath();
        if (!wanted()) return null;
        seen = performance.now();
      }
    }
    return this.result(machine, film, about.metrics.indexOf(metric));
  }

  /** @param {Machine} machine @param {Film} film @param {number} shown */
  result(machine, film, shown) {
    const { start, measured } = machine;
    const values = machine.floatsOf("values");
    const stored = new Float64Array(bytesOf(start.last).buffer);
    const room = values.length / stored.length;
    const last = stored.map((_, k) => values[k * room + measured - 1]);
    /** @type {Map<number, number | null>} */
    const at = new Map([[0, start.first[shown]]]);
    const steps = machine.integersOf("steps_of");
    for (let k = 0; k < measured; k++) {
      const value = values[shown * room + k];
      at.set(Number(steps[k]), Number.isFinite(value) ? value : null);
    }
    return {
      steps: film.steps,
      values: film.steps.map((step) => at.get(step) ?? null),
      frames: film.bytes,
      resting: film.rest,
      // Object.is tells -0 from 0, and every NaN is the same.
      same: machine.going && last.every((value, k) => Object.is(value, stored[k])),
    };
  }
}
