// Draws many boids. A triangle is a mask of pixels. It is made once for each heading,
// and written straight into an image. Without a graphics card ten thousand boids take a
// few ms in this way; as paths they take a quarter of a second.

import { contextOf, partsOf } from "./dom.js";

const PHASES = 2; // places of a boid within a pixel, along each axis
const SAMPLES = 4; // of a pixel, along each axis

/** @typedef {{ places: Int32Array, opacities: Uint8Array }} Mask */

// The corners of a boid of length 1 that goes along +x: [along, across].
/** @type {[along: number, across: number][]} */
export const CORNERS = [[0.62, 0], [-0.38, 0.36], [-0.38, -0.36]];

// A colour as a browser gives it, as 0xbbggrr.
/** @param {string} colour */
export const packed = (colour) =>
  partsOf(colour).reduce((sum, part, place) => sum + (part << (8 * place)), 0);

export class Stamps {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.context = contextOf(this.canvas);
    this.image = this.context.createImageData(1, 1);
    this.pixels = new Uint32Array(0);
    this.made = "";
    this.size = 0;
    this.turn = 1;
    this.half = 0;
    /** @type {Mask[]} */
    this.masks = [];
  }

  // An empty image for boids of a length; all in pixels of the device. `turn` is -1
  // where y grows upwards.
  /**
   * @param {number} width
   * @param {number} height
   * @param {number} size
   * @param {number} turn
   */
  begin(width, height, size, turn) {
    if (this.image.width !== width || this.image.height !== height) {
      [this.canvas.width, this.canvas.height] = [width, height];
      this.image = this.context.createImageData(width, height);
      this.pixels = new Uint32Array(this.image.data.buffer);
    }
    const made = `${width} ${size} ${turn}`;
    if (this.made !== made) {
      [this.made, this.size, this.turn, this.masks] = [made, size, turn, []];
      this.half = Math.ceil(0.65 * size) + 1;
    }
    this.pixels.fill(0);
  }

  // One boid; `colour` is 0xbbggrr. Those that touch the edge are left out.
  /**
   * @param {number} x
   * @param {number} y
   * @param {number} heading
   * @param {number} colour
   */
  add(x, y, heading, colour) {
    const [nearX, nearY] = [Math.round(x * PHASES), Math.round(y * PHASES)];
    const [column, row] = [Math.floor(nearX / PHASES), Math.floor(nearY / PHASES)];
    const { half, pixels } = this;
    const { width, height } = this.canvas;
    if (column < half || row < half || column >= width - half || row >= height - half) {
      return;
    }
    const kind = (heading * PHASES + (nearX - column * PHASES)) * PHASES + nearY -
      row * PHASES;
    const { places, opacities } = (this.masks[kind] ??= this.mask(kind));
    const origin = row * width + column;
    for (let k = 0; k < places.length; k++) {
      const at = origin + places[k];
      if (opacities[k] > pixels[at] >>> 24) {
        pixels[at] = ((opacities[k] << 24) | colour) >>> 0;
      }
    }
  }

  /** @param {number} kind */
  mask(kind) {
    const angle = (Math.floor(kind / PHASES ** 2) / 128) * Math.PI * this.turn;
    const [cos, sin] = [Math.cos(angle) * this.size, Math.sin(angle) * this.size];
    const [x, y] = [
      (Math.floor(kind / PHASES) % PHASES) / PHASES,
      (kind % PHASES) / PHASES,
    ];
    const corners = CORNERS.map((
      [along, across],
    ) => [x + along * cos - across * sin, y + along * sin + across * cos]);
    /** @type {[number[], number[]]} */
    const [places, opacities] = [[], []];
    for (let row = -this.half; row <= this.half; row++) {
      for (let column = -this.half; column <= this.half; column++) {
        const opacity = Math.round(255 * covered(corners, column, row));
        if (opacity > 0) {
          places.push(row * this.canvas.width + column);
          opacities.push(opacity);
        }
      }
    }
    return { places: Int32Array.from(places), opacities: Uint8Array.from(opacities) };
  }

  end() {
    this.context.putImageData(this.image, 0, 0);
    return this.canvas;
  }
}

// How much of a pixel lies within a triangle.
/** @param {number[][]} corners @param {number} column @param {number} row */
function covered(corners, column, row) {
  let inside = 0;
  for (let i = 0; i < SAMPLES ** 2; i++) {
    const x = column + ((i % SAMPLES) + 0.5) / SAMPLES;
    const y = row + (Math.floor(i / SAMPLES) + 0.5) / SAMPLES;
    const sides = corners.map(([x0, y0], k) => {
      const [x1, y1] = corners[(k + 1) % 3];
      return (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) >= 0;
    });
    if (sides[0] === sides[1] && sides[1] === sides[2]) inside++;
  }
  return inside / SAMPLES ** 2;
}
