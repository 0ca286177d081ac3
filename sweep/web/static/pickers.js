// The choice of model, preset and map; and for a stored trial, how it compares with
// what is stored.

import { button, make, short, spaced } from "./dom.js";

/** @import { Picture } from "./dom.js" */
/** @import { Controls, Message, Replay, State } from "./protocol.d.ts" */
/** @import { Trial, Trials, Value } from "./protocol.d.ts" */

export class Pickers {
  /** @param {string} prefix @param {(message: Message) => void} send */
  constructor(prefix, send) {
    this.prefix = prefix;
    this.send = send;
    this.element = make("div", { className: "pickers" });
    this.shown = "";
  }

  // A refused choice may still be shown: the next state must be shown again.
  forget() {
    this.shown = "";
  }

  /** @param {Controls} controls @param {State} state */
  show(controls, { model, preset, settings, trial, replay }) {
    const shown = JSON.stringify([
      [model, preset, settings.map, Boolean(replay)],
      [trial, controls.trials],
    ]);
    if (shown === this.shown) return;
    this.shown = shown;
    /** @param {string} name */
    const presets = (name) =>
      controls.models.find((one) => one.name === name)?.presets ?? [];
    /** @param {string} name */
    const own = (name) =>
      presets(name).includes(preset) ? preset : presets(name).at(-1) ?? preset;
    const texts = controls.models.find((one) => one.name === model)?.texts ?? {};
    const models = controls.models.map(({ name, source }) => ({ name, text: source }));
    const maps = controls.maps.map(({ name, text }) => ({ name, text }));
    const map = String(settings.map);
    if (!maps.some(({ name }) => name === map)) maps.push({ name: map, text: "" });
    this.element.replaceChildren(
      this.picker(
        "model",
        model,
        models,
        (name) => this.send({ type: "model", model: name, preset: own(name) }),
      ),
      this.picker(
        "preset",
        preset,
        presets(model).map((name) => ({ name, text: texts[name] ?? "" })),
        (name) => this.send({ type: "model", model, preset: name }),
      ),
      this.picker(
        "map",
        map,
        maps,
        (name) => this.send({ type: "set", name: "map", value: name }),
      ),
      ...(controls.trials && trial ? this.trials(controls.trials, trial) : []),
    );
    for (const select of this.element.querySelectorAll(".choice > select")) {
      if (select instanceof HTMLSelectElement) select.disabled = Boolean(replay);
    }
  }

  // Which trial of the opened spec: the values of what varies, or the number of the
  // point where there are too many of them; and the replicate.
  /** @param {Trials} trials @param {Trial} trial */
  trials({ points, replicates, axes }, { point, replicate, values, before, after }) {
    const many = axes.some((axis) => !axis.values.length);
    const byValue = many
      ? []
      : axes.map(({ name, values: known, follows }) =>
        follows ? this.followed(name, values[name], follows) : this.picker(
          spaced(name),
          String(values[name]),
          known.map((one) => ({ name: String(one), text: "" })),
          (chosen) => {
            const value = known.find((one) => String(one) === chosen) ?? chosen;
            this.send({ type: "value", name, value });
          },
          "axis",
        )
      );
    /** @param {number} number */
    const to = (number) => this.send({ type: "trial", point: number, replicate });
    /** @param {number} number */
    const again = (number) => this.send({ type: "trial", point, replicate: number });
    return [
      ...byValue,
      ...(many ? [this.number("point", point, points, to)] : []),
      ...(replicates > 1
        ? [this.number("replicate", replicate, replicates, again)]
        : []),
      ...(before || after
        ? [
          this.beside("before", "Previous trial", before),
          this.beside("after", "Next trial", after),
        ]
        : []),
    ];
  }

  // A value that cannot be chosen alone, because it follows from another one.
  /** @param {string} name @param {Value} value @param {string} source */
  followed(name, value, source) {
    const words = typeof value === "number" ? short(value) : String(value);
    const textContent = `${words}, follows from ${spaced(source)}`;
    const title = make("label", { textContent: spaced(name) });
    title.append(make("output", { textContent }));
    return make("div", { className: "axis" }, title);
  }

  // To a trial beside the one that is shown.
  /**
   * @param {Picture} picture
   * @param {string} label
   * @param {[point: number, replicate: number] | null} place
   */
  beside(picture, label, place) {
    const go = () => {
      if (place) this.send({ type: "trial", point: place[0], replicate: place[1] });
    };
    return button(picture, label, go, "", { disabled: !place });
  }

  // One of `count` things, by its number in data, which begin at 0.
  /**
   * @param {string} label
   * @param {number} index
   * @param {number} count
   * @param {(index: number) => void} act
   */
  number(label, index, count, act) {
    const id = `${this.prefix}-${label}`;
    const input = make("input", {
      id,
      type: "number",
      min: "0",
      max: String(count - 1),
      value: String(index),
      on: {
        change: () => {
          if (input.reportValidity() && input.value) act(Number(input.value));
        },
      },
    });
    const words = make("span", {
      className: "unit",
      textContent: `of 0 to ${count - 1}`,
    });
    return make(
      "div",
      { className: "trial" },
      make("label", { htmlFor: id, textContent: label }),
      input,
      words,
    );
  }

  // A labelled list of names, whose texts are hints.
  /**
   * @param {string} label
   * @param {string} value
   * @param {{ name: string, text: string }[]} options
   * @param {(name: string) => void} act
   * @param {string} kind
   */
  picker(label, value, options, act, kind = "choice") {
    const id = `${this.prefix}-${kind}-${label}`;
    const choices = options.map(({ name, text }) =>
      make("option", { value: name, textContent: name, title: text })
    );
    const select = make(
      "select",
      { id, on: { change: () => act(select.value) } },
      ...choices,
    );
    select.value = value;
    const title = make("label", { htmlFor: id, textContent: label });
    return make("div", { className: kind }, title, select);
  }
}

export class ReplayCard {
  constructor() {
    this.element = make("section", {
      className: "record",
      hidden: true,
      "aria-label": "replay",
    });
    this.shown = "";
  }

  /** @param {Replay | null} replay */
  show(replay) {
    this.element.hidden = !replay;
    if (!replay || this.shown === JSON.stringify(replay)) return;
    this.shown = JSON.stringify(replay);
    const title = make("h2", {
      textContent: replay.recorded ? "A recorded run" : "Replay of a stored trial",
    });
    const trial = make("p", {
      className: "facts",
      textContent: [replay.study, replay.which, `trial ${replay.trial}`].filter(Boolean)
        .join(", "),
    });
    const verdict = make("p", {
      className: replay.equal ? "exact" : "exact not",
      textContent: replay.words,
    });
    this.element.replaceChildren(
      title,
      trial,
      verdict,
      ...this.table(Object.entries(replay.metrics ?? {})),
    );
  }

  /** @param {[string, { stored: number, replayed: number }][]} metrics */
  table(metrics) {
    if (!metrics.length) return [];
    const rows = metrics.map(([name, { stored, replayed }]) => {
      const cells = [stored, replayed].map((value) =>
        make("td", { textContent: short(value, 6) })
      );
      return make(
        "tr",
        {},
        make("th", { scope: "row", textContent: spaced(name) }),
        ...cells,
      );
    });
    const head = ["at the end", "stored", "replayed"].map((textContent) =>
      make("th", { scope: "col", textContent })
    );
    return [
      make(
        "table",
        {},
        make("thead", {}, make("tr", {}, ...head)),
        make("tbody", {}, ...rows),
      ),
    ];
  }
}
