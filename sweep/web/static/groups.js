// The settings of the model, a row each, in groups that fold.

import { make, spaced, write } from "./dom.js";
import { Field } from "./fields.js";
import { SearchField } from "./search.js";

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
  /** @type {Map<string, HTMLDetailsElement>} */
  groups = new Map();
  // Which groups the user has left open or closed, by name.
  opened = new Map(OPEN.map((name) => [name, true]));
  list = make("div");

  /**
   * @param {string} prefix
   * @param {(message: Message) => void} send
   * @param {Tip} tip
   */
  constructor(prefix, send, tip) {
    this.prefix = prefix;
    this.send = send;
    this.tip = tip;
    this.search = new SearchField("Search settings", () => this.find());
    this.element = make("div", {}, this.search.element, this.list);
  }

  // Shows the settings that have the words of the search, in groups that are open.
  find() {
    const entries = [...this.fields.values()].map(({ element, about }) => ({
      element,
      text: `${about.name} ${about.text}`,
    }));
    this.search.apply(entries);
    for (const [name, group] of this.groups) {
      group.hidden = !group.querySelector("[data-name]:not([hidden])");
      group.open = this.search.isEmpty ? this.opened.get(name) ?? false : true;
    }
  }

  // Builds all groups anew: another model has other settings.
  /** @param {Controls} controls */
  offer({ groups }) {
    this.fields.clear();
    this.weights = [];
    this.counted = [];
    this.groups.clear();
    const schedule = groups.filter(({ name }) => name === "schedule");
    const others = groups.filter(({ name }) => name !== "schedule");
    const built = [...schedule, ...others].map((group) => this.group(group));
    this.list.replaceChildren(...built);
    this.search.offer(this.fields.size);
    this.find();
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
    group.addEventListener("toggle", () => {
      if (this.search.isEmpty) this.opened.set(name, group.open);
    });
    this.groups.set(name, group);
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
  show({ settings, changed, seed, sweeps, follows, replay }) {
    for (const [name, field] of this.fields) {
      const value = name === "seed" ? seed : settings[name];
      field.update(value, changed.includes(name), sweeps[name], follows[name]);
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
