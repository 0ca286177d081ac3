// In which settings other presets of the model differ from the one that is shown, with
// a switch for each.

import { button, make, short, spaced } from "./dom.js";

/** @import { Controls, Message, State, Value } from "./protocol.d.ts" */

export class PresetList {
  /** @param {(message: Message) => void} send */
  constructor(send) {
    this.send = send;
    this.element = make("div");
    /** @type {{ input: HTMLInputElement, name: string, there: Value }[]} */
    this.switches = [];
  }

  /** @param {Controls} controls */
  offer({ others, groups }) {
    this.switches = [];
    const fields = groups.flatMap((group) => group.fields);
    const defaults = new Map(fields.map((field) => [field.name, field.default ?? ""]));
    const groupsOf = Object.entries(others).map(([other, values]) =>
      this.group(other, Object.entries(values), defaults)
    );
    const twice = this.beside(
      "",
      "Compare with a copy",
      "Show this run twice from here on, to change one copy",
    );
    this.element.replaceChildren(twice, ...groupsOf);
  }

  /**
   * @param {string} other
   * @param {[name: string, there: Value][]} values
   * @param {Map<string, Value>} defaults
   */
  group(other, values, defaults) {
    const many = values.length === 1 ? "1 differs" : `${values.length} differ`;
    const heading = make("span", { textContent: `against ${other}` });
    const count = make("span", { className: "count", textContent: many });
    const rows = values.map(([name, there]) =>
      this.row(other, name, defaults.get(name) ?? "", there)
    );
    return make(
      "details",
      { className: "group presets" },
      make("summary", {}, heading, count),
      this.beside(other, "Side by side", `Show ${other} next to this run`),
      ...rows,
    );
  }

  /** @param {string} preset @param {string} words @param {string} label */
  beside(preset, words, label) {
    const act = () => this.send({ type: "beside", preset });
    return button("beside", label, act, words, { className: "beside" });
  }

  /**
   * @param {string} other
   * @param {string} name
   * @param {Value} here
   * @param {Value} there
   */
  row(other, name, here, there) {
    const input = make("input", {
      type: "checkbox",
      className: "switch",
      "aria-label": `${spaced(name)} as in ${other}: ${short(there, 6)}`,
    });
    input.addEventListener("change", () => {
      this.send({ type: "set", name, value: input.checked ? there : here });
    });
    this.switches.push({ input, name, there });
    const words = make(
      "span",
      { className: "words" },
      make("b", {
        textContent: spaced(name),
      }),
    );
    words.append(` ${short(here, 6)} → ${short(there, 6)}`);
    return make("label", { className: "differs" }, words, input);
  }

  /** @param {State} state */
  show({ settings, replay }) {
    this.element.classList.toggle("fixed", Boolean(replay));
    for (const { input, name, there } of this.switches) {
      input.checked = settings[name] === there;
      input.disabled = Boolean(replay);
    }
  }
}
