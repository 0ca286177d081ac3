// Axes of a figure: where a value lies on the screen, and which values are named.

import { short, unitText } from "./dom.js";

/** @import { FigureAxis } from "./explorer.d.ts" */
/** @typedef {{ at: number, text: string }} Tick a value and its name */

const EQUAL = 1e-12; // relative difference
const ROOM = 0.05; // of the span, beyond the outermost values
const LETTER = 7; // CSS pixels, about
const LINE = 14;
const ASIDE = 80; // between round values
const ABOVE = 45;
const MOST_LISTED = 12;
const SHORT_POWERS = [-2, 4]; // powers of ten that are written as numbers
const MOST_DECADES = 3; // between which round values have names too
const LINEAR = 0.9; // what a decade's length is worth on the linear part of an axis
const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";

export class Axis {
  /**
   * @param {number[]} values
   * @param {Partial<FigureAxis>} about
   * @param {number} room
   */
  constructor(values, about = {}, room = ROOM) {
    const { names = [], logarithmic = false, linear = 0 } = about;
    this.about = about;
    this.names = names;
    this.logarithmic = logarithmic;
    this.linear = linear;
    let [first, last] = bounds(values.map((value) => this.place(value)));
    // Equal but for rounding.
    this.constant = last - first <= EQUAL * Math.max(Math.abs(first), Math.abs(last));
    if (names.length) [first, last] = [-0.5, names.length - 0.5];
    else if (this.constant) {
      first -= first ? 0.1 * Math.abs(first) : 0.5;
      last += last ? 0.1 * Math.abs(last) : 0.5;
    }
    const beyond = names.length ? 0 : room * (last - first);
    this.first = first - beyond;
    this.last = last + beyond;
    this.from = 0;
    this.to = 1;
  }

  // Lays the axis from one place on the screen to another, to the right or upwards.
  /** @param {number} from @param {number} to in pixels */
  span(from, to) {
    [this.from, this.to] = [from, to];
    return this;
  }

  // What lies beyond the bounds of the axis lies at its edge.
  /** @param {number} value */
  place(value) {
    const { low, high } = this.about;
    const within = Math.min(Math.max(value, low ?? -Infinity), high ?? Infinity);
    if (this.linear) return symlog(within / this.linear);
    return this.logarithmic ? Math.log10(within) : within;
  }

  // Whether the numbers at ticks are not evenly spaced.
  get uneven() {
    return this.logarithmic || this.linear > 0;
  }

  // 1 for a value above the bounds of the axis, -1 for one below them, else 0.
  /** @param {number} value */
  beyond(value) {
    const { low, high } = this.about;
    return Number(value > (high ?? Infinity)) - Number(value < (low ?? -Infinity));
  }

  /** @param {number} value */
  pixel(value) {
    const part = (this.place(value) - this.first) / (this.last - this.first);
    return this.from + part * (this.to - this.from);
  }

  /** @param {number} pixel */
  value(pixel) {
    const part = (pixel - this.from) / (this.to - this.from);
    const place = this.first + part * (this.last - this.first);
    if (this.linear) return this.linear * fromSymlog(place);
    return this.logarithmic ? 10 ** place : place;
  }

  // The names, the listed values, or round values, as many as have room.
  /** @returns {Tick[]} */
  get ticks() {
    const { first, last } = this;
    const within = this.values.filter(
      (at) => this.place(at) >= first - 1e-9 && this.place(at) <= last + 1e-9,
    );
    const texts = this.texts(within);
    const ticks = within.map((at, i) => ({ at, text: texts[i] }));
    return this.apart(this.some(ticks));
  }

  // The names of values: as many digits as tell them apart.
  /** @param {number[]} values */
  texts(values) {
    if (this.names.length) return values.map((at) => this.names[at]);
    if (this.uneven) return values.map(powerOrNumber);
    const steps = values.slice(1).map((value, i) => Math.abs(value - values[i]));
    const most = Math.max(...values.map(Math.abs));
    const digits = Math.ceil(Math.log10(most / Math.min(...steps))) + 1;
    const enough = Number.isFinite(digits) ? Math.min(Math.max(digits, 4), 12) : 4;
    return values.map((value) => short(value / this.power, enough));
  }

  // The label of the axis. A power of ten is a part of the unit: "speed (10⁻³ m/s)".
  get label() {
    const label = unitText(this.about.label);
    if (this.power === 1) return label;
    const power = raised(Math.round(Math.log10(this.power)));
    return label.endsWith(")")
      ? label.replace(/\(([^(]*\))$/, `(${power} $1`)
      : `${label} (${power})`;
  }

  // The power of ten that is left out of all numbers at the ticks: 1 for numbers that
  // are short with it, and where no label says it.
  get power() {
    if (this.names.length || this.uneven || !this.about.label) return 1;
    const most = Math.max(...this.values.map(Math.abs));
    const power = Math.floor(Math.log10(most));
    return most > 0 && (power < SHORT_POWERS[0] || power > SHORT_POWERS[1])
      ? Number(`1e${power}`)
      : 1;
  }

  // Where ticks may be.
  get values() {
    const { listed = [] } = this.about;
    if (this.names.length) return this.names.map((_, place) => place);
    if (this.linear) return this.aroundZero;
    return listed.length ? listed : this.ofDecades ? this.decades : this.round;
  }

  get ofDecades() {
    const { listed = [] } = this.about;
    return this.logarithmic && !listed.length && this.last - this.first >= MOST_DECADES;
  }

  // 0, and powers of ten from the end of the linear part on, of both signs.
  get aroundZero() {
    const most = Math.ceil(Math.max(-this.first, this.last));
    const power = Math.round(Math.log10(this.linear));
    const above = multiples(0, most, 1).map((more) => Number(`1e${power + more}`));
    return [...above.toReversed().map((value) => -value), 0, ...above];
  }

  get most() {
    return Math.max(2, this.length / (this.to > this.from ? ASIDE : ABOVE));
  }

  get length() {
    return Math.abs(this.to - this.from);
  }

  // Powers of ten, every one or every few of them.
  get decades() {
    const every = Math.ceil((this.last - this.first) / this.most);
    return multiples(this.first, this.last, every).map((power) => Number(`1e${power}`));
  }

  // Round values. On a logarithmic axis of a decade or more: 1, 2, 5, 10, 20, ...
  get round() {
    const { first, last, logarithmic } = this;
    if (!logarithmic) return roundly(first, last, this.most);
    const [low, high] = [10 ** first, 10 ** last];
    if (last - first < 1) return roundly(low, high, this.most);
    return multiples(Math.floor(first), last, 1)
      .flatMap((power) => [1, 2, 5].map((one) => Number(`${one}e${power}`)))
      .filter((one) => one >= low && one <= high);
  }

  // Pixels that a text takes along the axis, with some room.
  /** @param {string} text */
  size(text) {
    return this.to > this.from ? LETTER * (text.length + 1) : LINE;
  }

  // Every k-th of some ticks, with the smallest k so that their texts have room.
  /** @param {Tick[]} ticks */
  some(ticks) {
    if (this.names.length || this.uneven) return ticks;
    for (let every = 1; every < ticks.length; every++) {
      const chosen = ticks.filter((_, i) => i % every === 0);
      const size = chosen.reduce((sum, { text }) => sum + this.size(text), 0);
      if (chosen.length <= MOST_LISTED && size <= this.length) return chosen;
    }
    return ticks.slice(0, 1);
  }

  // Those of some ticks whose texts do not touch the one before.
  /** @param {Tick[]} ticks */
  apart(ticks) {
    let free = -Infinity;
    const way = Math.sign(this.to - this.from);
    return ticks.filter(({ at, text }) => {
      const place = way * (this.pixel(at) - this.from);
      if (place - this.size(text) / 2 < free) return false;
      free = place + this.size(text) / 2;
      return true;
    });
  }
}

// The place of a number on an axis that is linear from -1 to 1, as in matplotlib, where
// 0 to 1 is a little longer than a decade.
/** @param {number} number */
function symlog(number) {
  const size = Math.abs(number);
  return Math.sign(number) * (size < 1 ? size / LINEAR : 1 / LINEAR + Math.log10(size));
}

/** @param {number} place */
function fromSymlog(place) {
  const beyond = Math.abs(place) - 1 / LINEAR;
  return beyond < 0 ? place * LINEAR : Math.sign(place) * 10 ** beyond;
}

// The multiples of a step from `low` to `high`.
/** @param {number} low @param {number} high @param {number} step */
function multiples(low, high, step) {
  const first = Math.ceil(low / step - 1e-9);
  const last = Math.floor(high / step + 1e-9);
  return Array.from(
    { length: Math.max(last - first + 1, 0) },
    (_, i) => Number(((first + i) * step).toPrecision(12)),
  );
}

// Round values: about so many, and two at least.
/** @param {number} low @param {number} high @param {number} most */
function roundly(low, high, most) {
  const parts = [most, 2 * most, 4 * most, 8 * most];
  const found = parts.map((part) => multiples(low, high, nice((high - low) / part)));
  return found.find((values) => values.length > 1) ?? found[0];
}

// A round step that is not below the least one.
/** @param {number} least */
function nice(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * ([1, 2, 5].find((one) => one * power >= least) ?? 10);
}

// A value of a logarithmic axis: a large or small power of ten as a power.
/** @param {number} value */
function powerOrNumber(value) {
  const power = Math.round(Math.log10(value));
  const [low, high] = SHORT_POWERS;
  const isPower = Math.abs(value / Number(`1e${power}`) - 1) < 1e-9;
  return isPower && (power < low - 1 || power > high) ? raised(power) : short(value);
}

/** @param {number} power */
function raised(power) {
  const digits = Array.from(String(Math.abs(power)), (one) => RAISED[Number(one)]);
  return `10${power < 0 ? "⁻" : ""}${digits.join("")}`;
}

// The least and the largest of some values.
/** @param {number[]} values @returns {[low: number, high: number]} */
export function bounds(values) {
  if (!values.length) return [0, 1];
  return values.reduce(
    ([low, high], value) => [Math.min(low, value), Math.max(high, value)],
    [Infinity, -Infinity],
  );
}
