// Axes of a figure: where a value lies on the screen, and which values are named.

import { short } from "./dom.js";

const LETTER = 7; // CSS pixels, about
const ROUND = [1, 2, 5, 10];

export class Axis {
  // `from` and `to` are the places of `low` and `high` on the screen.
  /**
   * @param {number} low
   * @param {number} high
   * @param {number} from
   * @param {number} to
   */
  constructor(low, high, from, to, logarithmic = false) {
    this.logarithmic = logarithmic;
    const [first, last] = [this.scaled(low), this.scaled(high)];
    this.first = first;
    this.last = last > first ? last : first + 1;
    this.from = from;
    this.to = to;
  }

  /** @param {number} value */
  scaled(value) {
    return this.logarithmic ? Math.log10(value) : value;
  }

  /** @param {number} value */
  at(value) {
    const part = (this.scaled(value) - this.first) / (this.last - this.first);
    return this.from + part * (this.to - this.from);
  }

  // About `most` round values; on a logarithmic axis powers of ten, or round values
  // where there are fewer than two of them.
  /** @param {number} most */
  round(most) {
    const span = this.last - this.first;
    if (this.logarithmic && span >= 2) {
      const every = Math.ceil(span / most);
      const powers = [];
      for (let k = Math.ceil(this.first); k <= this.last; k += every) {
        powers.push(10 ** k);
      }
      return powers;
    }
    const [low, high] = this.logarithmic
      ? [10 ** this.first, 10 ** this.last]
      : [this.first, this.last];
    const rough = (high - low) / Math.max(1, most);
    const power = 10 ** Math.floor(Math.log10(rough));
    const apart = power * (ROUND.find((one) => one * power >= rough) ?? 10);
    const values = [];
    for (let k = Math.ceil(low / apart - 1e-9); k * apart <= high + 1e-9 * apart; k++) {
      values.push(k * apart);
    }
    return values;
  }

  // The listed values where all their names fit side by side, else round ones.
  /** @param {number[]} values */
  ticks(values) {
    const room = Math.abs(this.to - this.from);
    const letters = values.map((value) => short(value).length + 2);
    const wide = LETTER * Math.max(...letters);
    const places = values.map((value) => this.at(value)).toSorted((a, b) => a - b);
    const apart = places.every((place, i) => i === 0 || place - places[i - 1] >= wide);
    return apart ? values : this.round(Math.max(2, Math.floor(room / 80)));
  }
}

// The bounds of some values, with some room about them.
/** @param {number[]} values @returns {[low: number, high: number]} */
export function around(values) {
  const [low, high] = bounds(values);
  const room = 0.06 * (high - low) || 0.1 * Math.abs(high) || 1;
  return [low - room, high + room];
}

/** @param {number[]} values @returns {[low: number, high: number]} */
export function bounds(values) {
  if (!values.length) return [0, 1];
  return values.reduce(
    ([low, high], value) => [Math.min(low, value), Math.max(high, value)],
    [Infinity, -Infinity],
  );
}
