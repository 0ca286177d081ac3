// The lists beside the picture: obstacles, the selected boid, and overlays.

import { button, make, short, spaced } from "./dom.js";
import { ARROW, sampled } from "./swarm.js";

/** @import { Picture } from "./dom.js" */
/** @import { Hand } from "./pointer.js" */
/** @import { Kind, Message, Obstacle } from "./protocol.d.ts" */
/** @import { Selected, Stage } from "./stage.js" */

export const OWN_OVERLAYS = ["trails", "headings"]; // which need no more of a frame
const MOST_ROWS = 200;
/** @type {Record<Kind, string[]>} */
const PARTS = { disc: ["x", "y", "radius"], rectangle: ["x", "y", "width", "height"] };

/** @type {(row: Obstacle) => Kind} */
const kindOf = (row) => (row[4] ? "disc" : "rectangle");
/** @type {(row: Obstacle) => string} */
const wordOf = (row) => {
  if (row[5]) return row[5].solid === "outside" ? "arena" : "polygon";
  return row[4] ? "disc" : "box";
};
/** @type {(row: Obstacle) => number[]} */
const partsOf = ([x, y, a, b, round]) => (round ? [x, y, a] : [x, y, 2 * a, 2 * b]);
/** @type {(kind: Kind, parts: number[]) => Obstacle} */
const rowOf = (kind, [x, y, a, b]) =>
  kind === "disc" ? [x, y, a, a, 1] : [x, y, a / 2, b / 2, 0];

// Every obstacle as a button; the chosen one shows its numbers.
export class ObstacleList {
  /** @param {Hand} hand */
  constructor(hand) {
    this.hand = hand;
    this.shown = "";
    this.count = make("span", { className: "count" });
    this.rows = make("ul", { className: "obstacles" });
    /** @param {Kind} kind @param {string} words */
    const add = (kind, words) =>
      button(
        "plus",
        `Add a ${words} in the middle of the world`,
        () => this.add(kind),
        words,
      );
    this.actions = make(
      "div",
      { className: "row" },
      add("disc", "disc"),
      add("rectangle", "box"),
    );
    const summary = make(
      "summary",
      {},
      make("span", { textContent: "Obstacles" }),
      this.count,
    );
    this.element = make(
      "details",
      { className: "group" },
      summary,
      this.actions,
      this.rows,
    );
  }

  /** @param {Kind} kind */
  add(kind) {
    const { width, height } = this.hand.stage.world;
    this.hand.add(kind, width / 2, height / 2);
  }

  show() {
    const { stage, fixed: frozen } = this.hand;
    const { obstacles, marked } = stage;
    this.actions.hidden = frozen;
    this.count.textContent = String(obstacles.length);
    const now = JSON.stringify([obstacles, marked, frozen]);
    const holds = this.hand.drag && this.rows.contains(document.activeElement);
    if (now === this.shown || holds) return;
    this.shown = now;
    const focus = this.focused();
    const shown = obstacles.slice(0, MOST_ROWS).map((row, i) =>
      this.row(row, i, i === marked && !frozen)
    );
    if (obstacles.length > MOST_ROWS) {
      shown.push(
        make("li", { textContent: `and ${obstacles.length - MOST_ROWS} more` }),
      );
    }
    this.rows.replaceChildren(...shown);
    const before = focus && this.rows.querySelector(`[data-place="${focus}"]`);
    if (before instanceof HTMLElement) before.focus();
    if (this.element.open) {
      this.rows.querySelector("[aria-pressed=true]")?.scrollIntoView({
        block: "nearest",
      });
    }
  }

  focused() {
    const { activeElement: focus } = document;
    const within = focus instanceof HTMLElement && this.rows.contains(focus);
    return within ? focus.dataset.place : "";
  }

  /** @param {Obstacle} row @param {number} index @param {boolean} open */
  row(row, index, open) {
    const kind = kindOf(row);
    const words = `${wordOf(row)} at ${short(row[0])}, ${short(row[1])}`;
    const choose = button(
      kind,
      `Select the ${words}`,
      () => this.hand.mark(open ? null : index),
      words,
      { "aria-pressed": String(open) },
    );
    choose.dataset.place = `row ${index}`;
    const away = button(
      "remove",
      `Remove the ${words}`,
      () => this.hand.remove(index),
      "",
      { className: "quiet" },
    );
    away.hidden = this.hand.fixed;
    const head = make("div", { className: "row" }, choose, away);
    return make(
      "li",
      {},
      head,
      ...(open && !row[5] ? [this.numbers(kind, row, index)] : []),
    );
  }

  /** @param {Kind} kind @param {Obstacle} row @param {number} index */
  numbers(kind, row, index) {
    /** @type {HTMLInputElement[]} */
    const inputs = partsOf(row).map((value, i) => {
      const input = make("input", {
        type: "text",
        inputMode: "decimal",
        value: String(value),
        "aria-label": `${kind} ${PARTS[kind][i]}`,
      });
      input.dataset.place = `part ${i}`;
      input.addEventListener("change", () => {
        const values = inputs.map((one) => Number(one.value));
        if (values.every(Number.isFinite)) this.hand.change(index, rowOf(kind, values));
      });
      return input;
    });
    const labelled = inputs.map((input, i) =>
      make("label", {}, make("span", { textContent: PARTS[kind][i] }), input)
    );
    return make("div", { className: "numbers" }, ...labelled);
  }
}

export class BoidCard {
  /** @param {(message: Message) => void} send @param {Stage} stage */
  constructor(send, stage) {
    this.stage = stage;
    this.send = send;
    /** @type {number | null} */
    this.chosen = null; // its selection may not have come yet
    this.input = make("input", {
      type: "text",
      inputMode: "numeric",
      "aria-label": "index of the selected boid",
      placeholder: "none",
    });
    this.input.addEventListener("change", () => this.entered());
    /** @param {Picture} picture @param {string} words @param {number} by */
    const around = (picture, words, by) =>
      button(picture, words, () => this.beside(by), "", { className: "quiet" });
    this.away = button("remove", "Select no boid", () => this.choose(null), "", {
      className: "quiet",
    });
    const head = make(
      "div",
      { className: "row" },
      make("h3", { textContent: "Boid" }),
      around("before", "Previous boid", -1),
      this.input,
    );
    head.append(around("after", "Next boid", 1), this.away);
    this.facts = make("p", { className: "facts" });
    this.element = make(
      "section",
      { className: "boid", "aria-label": "selected boid" },
      head,
      this.facts,
    );
    this.show(null);
  }

  entered() {
    const text = this.input.value.trim();
    const boid = Number(text);
    if (text === "") this.choose(null);
    else if (Number.isInteger(boid) && boid >= 0) this.choose(boid);
    else this.show(this.stage.selection);
  }

  /** @param {number | null} boid */
  choose(boid) {
    this.chosen = boid;
    this.send({ type: "select", boid });
  }

  /** @param {number} by */
  beside(by) {
    const n = this.stage.frame?.n ?? 0;
    if (n) this.choose(((this.chosen ?? (by > 0 ? -1 : 0)) + by + n) % n);
  }

  /** @param {Selected | null} selection @param {string} [unit] */
  show(selection, unit = "") {
    this.away.hidden = !selection;
    if (!this.input.matches(":focus")) {
      this.input.value = selection ? String(selection.boid) : "";
    }
    this.facts.textContent = selection
      ? this.words(selection, unit)
      : "Click a boid to see its neighbours.";
  }

  /** @param {Selected} selection @param {string} unit */
  words({ boid, x, y, range, fov, heading, neighbours }, unit) {
    const { failed, scene } = this.stage;
    const how = failed.includes(boid) ? `; failed: ${scene?.failing?.how}` : "";
    const turned = typeof heading === "number"
      ? `, heading ${short((heading * 180) / Math.PI, 3)}°`
      : "";
    const sees = Number.isFinite(range) ? ` within ${short(range)} ${unit}` : "";
    const cone = typeof fov === "number" && fov < 360
      ? `, in a cone of ${short(fov)}°`
      : "";
    const others = neighbours.length === 1
      ? "1 neighbour"
      : `${neighbours.length} neighbours`;
    const at = `at ${short(x)}, ${short(y)} ${unit}${turned}`;
    return `${at}; ${others}${sees}${cone}${how}`;
  }
}

// Switches for what is drawn besides the boids, with the legend of each; above them the
// colours of the kinds of boids, and the mark of those that have failed.
export class Overlays {
  /** @param {Stage} stage @param {() => void} changed */
  constructor(stage, changed) {
    this.stage = stage;
    /** @type {Map<string, HTMLInputElement>} */
    this.inputs = new Map();
    /** @type {Map<string, HTMLElement>} */
    this.legends = new Map();
    this.kinds = make("div", { className: "legend", hidden: true });
    this.legends.set("kinds", this.kinds);
    this.failed = make("div", { className: "legend", hidden: true });
    this.legends.set("failed", this.failed);
    this.rows = make("div", { className: "overlays" });
    this.element = make(
      "section",
      { "aria-label": "overlays" },
      make("h2", { textContent: "Show" }),
      this.kinds,
      this.failed,
      this.rows,
    );
    this.changed = changed;
  }

  /** @param {string[]} names */
  offer(names) {
    if (names.join() === [...this.inputs.keys()].join()) return;
    this.inputs.clear();
    this.rows.replaceChildren(...names.map((name) => this.row(name)));
  }

  /** @param {string} name */
  row(name) {
    const input = make("input", {
      type: "checkbox",
      className: "switch",
      on: { change: () => this.changed() },
    });
    const legend = make("div", { className: "legend" });
    this.inputs.set(name, input);
    this.legends.set(name, legend);
    return make(
      "div",
      {},
      make(
        "label",
        {},
        input,
        make("span", { textContent: spaced(name) }),
      ),
      legend,
    );
  }

  get chosen() {
    return [...this.inputs].filter(([, input]) => input.checked).map(([name]) => name);
  }

  /** @param {string[]} names */
  show(names) {
    for (const [name, input] of this.inputs) input.checked = names.includes(name);
  }

  /** @param {string[]} rules @param {string} unit */
  explain(rules, unit) {
    /** @param {string} name */
    const on = (name) => this.inputs.get(name)?.checked ?? false;
    this.legend("accelerations", on("accelerations") && rules.length > 0, () => [
      ...rules.map((rule, i) =>
        this.swatch(this.stage.rules[i % this.stage.rules.length], spaced(rule))
      ),
      make("small", {
        textContent: this.stage.arrowScale > 0
          ? `an arrow of ${ARROW} px is ${
            short(ARROW / this.stage.arrowScale, 2)
          } ${unit}`
          : "",
      }),
      make("small", { textContent: this.sample() }),
    ]);
    const { coverage } = this.stage;
    this.legend("coverage", on("coverage") && Boolean(coverage), () => [
      make("i", { className: "ramp" }),
      make("small", { textContent: "0 to 100 % of a cell was visited" }),
    ]);
    const kinds = this.stage.scene?.kinds ?? [];
    this.legend(
      "kinds",
      kinds.length > 0 && !on("flocks"),
      () =>
        kinds.map(([name, boids], i) =>
          this.swatch(
            this.stage.hues[i % this.stage.hues.length],
            `${boids} ${spaced(name)}`,
          )
        ),
    );
    this.kinds.hidden = !this.kinds.hasChildNodes();
    const failing = this.stage.scene?.failing;
    const count = this.stage.failed.length;
    this.legend("failed", Boolean(failing), () => [
      make(
        "span",
        { className: "swatch" },
        make("b", { textContent: "✕", "aria-hidden": "true" }),
        ` ${count} of ${failing?.boids.length} failed: ${failing?.how}`,
      ),
    ]);
    this.failed.hidden = !this.failed.hasChildNodes();
    this.legend("headings", on("headings") && !on("flocks"), () => [
      make("small", {
        textContent:
          "the wheel shows the colour of each heading; its arrow is the mean" +
          " heading, as long as boids agree, with the polarization below",
      }),
    ]);
    const flocks = new Set(this.stage.frame?.flocks ?? []);
    flocks.delete(65535);
    const words = `${flocks.size} of two or more boids; grey boids are alone`;
    this.legend(
      "flocks",
      on("flocks") && Boolean(this.stage.frame?.flocks),
      () => [make("small", { textContent: words })],
    );
  }

  sample() {
    const every = sampled(this.stage.frame?.n ?? 0);
    return every > 1 && !this.stage.selection ? `; of one boid in ${every}` : "";
  }

  /** @param {string} name @param {boolean} wanted @param {() => HTMLElement[]} parts */
  legend(name, wanted, parts) {
    const legend = this.legends.get(name);
    const fresh = wanted ? parts() : [];
    const words = fresh.map((part) => part.textContent).join("");
    if (legend && legend.textContent !== words) legend.replaceChildren(...fresh);
  }

  /** @param {string} colour @param {string} words */
  swatch(colour, words) {
    const sample = make("i");
    sample.style.backgroundColor = colour;
    return make("span", { className: "swatch" }, sample, words);
  }
}
