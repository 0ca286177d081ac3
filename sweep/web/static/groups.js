// The settings of the model, a row each, in groups that fold.

import { make, spaced, write } from "./dom.js";
import { Field } from "./fields.js";

/** @import { Tip } from "./fields.js" */
/** @import { Controls, Group, Message, Setting, State } from "./protocol.d.ts" */

const OPEN = ["schedule", "parameters"];
/** @type {Setting} */
const SEED = {
  name: "seed",
  kind: "int",
  text: "equal seeds give equal runs",
  unit: "",
  allowed: "",
  low: 0,
  high: null,
  slider: null,
  logarithmic: false,
  rule: "",
  choices: [],
  default: null,
};

export class SettingGroups {
  /** @type {Map<string, Field>} */
  fields = new Map();
  // The fields of weights, which the keyboard chooses by their number.
  /** @type {Field[]} */
  weights = [];
  /** @type {{ names: string[], count: HTMLElement }[]} */
  counted = [];
  // Which groups the user has left open or closed, by name.
  opened = new Map(OPEN.map((name) => [name, true]));
  element = make("div");

  /**
   * @param {string} prefix
   * @param {(message: Message) => void} send
   * @param {Tip} tip
   */
  constructor(prefix, send, tip) {
    this.prefix = prefix;
    this.send = send;
    this.tip = tip;
  }

  // Builds all groups anew: another model has other settings.
  /** @param {Controls} controls */
  offer({ groups }) {
    this.fields.clear();
    this.weights = [];
    this.counted = [];
    const schedule = groups.filter(({ name }) => name === "schedule");
    const others = groups.filter(({ name }) => name !== "schedule");
    const built = [...schedule, ...others].map((group) => this.group(group));
    this.element.replaceChildren(...built);
  }

  /** @param {Group} group */
  group({ name, fields }) {
    const shown = fields.filter((field) => field.name !== "map");
    const about = name === "schedule" ? [...shown, SEED] : shown;
    const rows = about.map((field) => this.row(field));
    const count = make("span", { className: "count" });
    this.counted.push({ names: about.map((field) => field.name), count });
    const heading = make("span", { textContent: spaced(name) });
    const group = make(
      "details",
      { className: "group", open: this.opened.get(name) ?? false },
      make("summary", {}, heading, count),
      ...rows,
    );
    group.addEventListener("toggle", () => this.opened.set(name, group.open));
    group.dataset.group = name;
    return group;
  }

  /** @param {Setting} about */
  row(about) {
    const row = new Field(about, this.prefix, this.send, this.tip);
    this.fields.set(about.name, row);
    if (about.rule && row.slide) this.weights.push(row);
    return row.element;
  }

  /** @param {State} state */
  show({ settings, changed, seed, sweeps, replay }) {
    for (const [name, field] of this.fields) {
      const value = name === "seed" ? seed : settings[name];
      field.update(value, changed.includes(name), sweeps[name]);
      field.freeze(Boolean(replay));
    }
    for (const { names, count } of this.counted) {
      const own = names.filter((name) => changed.includes(name)).length;
      write(count, own ? `${own} changed` : "");
    }
  }

  // The other side has taken what was entered.
  accept() {
    for (const field of this.fields.values()) field.accept();
  }
}
