// The settings that a reader may change in a trial that the page computes.

import { make, short, unitText } from "./dom.js";

/** @import { ComputedChange } from "./supplement.d.ts" */
/** @typedef {Map<number, number>} Changed Values by their row in the memory. */

const STEPS = 100; // of a slider
const WAITS = 150; // ms without a change, before the trial is computed

export class Changes {
  /** @type {ComputedChange[]} */
  all = [];
  /** @type {Changed} */
  values = new Map();
  waiting = 0;

  /** @param {(values: Changed) => void} act */
  constructor(act) {
    this.act = act;
    this.rows = make("div", { className: "changes" });
    this.reset = make("button", { type: "button", on: { click: () => this.undo() } });
    this.reset.textContent = "As stored";
    this.element = make(
      "details",
      { className: "changing", hidden: true },
      make("summary", { textContent: "Change settings" }),
      make("p", {
        textContent:
          "The trial runs again from the same start. All other settings stay," +
          " derived ones too.",
      }),
      this.rows,
      this.reset,
    );
  }

  // In words: what differs from the stored trial.
  get words() {
    return this.all.filter(({ row }) => this.values.has(row)).map(({ name, row }) =>
      `${name.replaceAll("_", " ")} ${short(this.values.get(row))}`
    ).join(", ");
  }

  // Offers the settings of a trial, as they are stored.
  /** @param {ComputedChange[]} all */
  offer(all) {
    this.all = all;
    this.element.hidden = all.length === 0;
    this.undo(false);
  }

  undo(told = true) {
    this.values = new Map();
    this.rows.replaceChildren(...this.all.map((one) => this.row(one)));
    this.reset.disabled = true;
    clearTimeout(this.waiting);
    if (told) this.act(this.values);
  }

  /** @param {ComputedChange} change */
  row({ name, text, unit, value, low, high, row }) {
    const words = name.replaceAll("_", " ");
    const shown = make("output", { textContent: short(value) });
    // In hundredths of the range: a step of a float could miss the upper end.
    const slider = make("input", {
      type: "range",
      min: "0",
      max: String(STEPS),
      title: text,
    });
    slider.value = String(Math.round((STEPS * (value - low)) / (high - low)));
    slider.setAttribute("aria-valuetext", short(value));
    slider.addEventListener("input", () => {
      const part = Number(slider.value) / STEPS;
      const chosen = part === 1 ? high : low + part * (high - low);
      shown.textContent = short(chosen);
      slider.setAttribute("aria-valuetext", short(chosen));
      this.values = new Map(this.values).set(row, chosen);
      this.reset.disabled = false;
      clearTimeout(this.waiting);
      this.waiting = setTimeout(() => this.act(this.values), WAITS);
    });
    const label = unit ? `${words} (${unitText(unit)})` : words;
    return make("label", {}, make("span", { textContent: label }), slider, shown);
  }
}
