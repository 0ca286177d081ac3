// The explorer: the studies of a folder, or one study with its state, a figure, its
// points, the trials behind a point, and a trial that plays. What is shown is what the
// address says.

import { button, make } from "./dom.js";
import { ask, Refused } from "./ask.js";
import { Player, TrialTable } from "./behind.js";
import { FigurePanel } from "./figures.js";
import { RefineCard } from "./refine.js";
import { PagedTable } from "./rows.js";
import { StatePanel } from "./strip.js";
import { PointTable } from "./tables.js";

/** @import { Choice, Study, StudyState } from "./explorer.d.ts" */

const LOOK_AGAIN = 2000; // ms
const KEYS = /** @type {const} */ ([
  "study",
  "kind",
  "metric",
  "x",
  "y",
  "by",
  "where",
  "half",
  "sort",
  "point",
  "trial",
  "region",
  "parts",
  "replicates",
]);

/** @returns {Choice} */
function addressed() {
  const told = new URLSearchParams(location.hash.slice(1));
  const entries = KEYS.map((name) => [name, told.get(name) ?? ""]);
  return Object.fromEntries(entries);
}

export class Explorer {
  choice = addressed();
  /** @type {StudyState | null} */
  state = null;
  looks = 0;

  /** @param {HTMLElement} root */
  constructor(root) {
    const go = (/** @type {Partial<Choice>} */ change) => this.go(change);
    const command = (/** @type {string} */ text) => commandLine(text);
    this.banner = make("p", { className: "refusal", role: "alert", hidden: true });
    this.home = make("a", { href: "#", textContent: "Studies" });
    this.name = make("h1", { textContent: "boidsweep" });
    const brand = make(
      "div",
      { className: "brand" },
      make("i", { "aria-hidden": "true" }),
      this.home,
      this.name,
    );
    this.where = make("input", {
      type: "text",
      id: "where",
      placeholder: "n=50, or separation_weight > 1",
      on: {
        change: () => this.go({ where: this.where.value.trim(), point: "", trial: "" }),
      },
    });
    this.chosen = make(
      "div",
      { className: "row", hidden: true },
      make("label", { htmlFor: "where", textContent: "where" }),
      this.where,
    );
    this.list = new PagedTable("studies", () => {});
    this.studies = make(
      "section",
      { className: "card", "aria-label": "studies" },
      this.list.element,
    );
    this.panel = new StatePanel((trial) => this.go({ trial }));
    this.figure = new FigurePanel("figure", go, command);
    this.refine = new RefineCard(go);
    this.points = new PointTable(go, command);
    this.trials = new TrialTable(go);
    this.player = new Player();
    this.origin = make("details", { className: "card" });
    this.study = make(
      "div",
      { className: "study", hidden: true },
      this.panel.element,
      make(
        "div",
        { className: "seen" },
        this.figure.element,
        this.refine.element,
        this.points.element,
      ),
      make("div", { className: "behind" }, this.trials.element, this.player.element),
      this.origin,
    );
    root.append(
      make("header", { className: "top" }, brand, this.chosen),
      this.banner,
      this.studies,
      this.study,
    );
    addEventListener("hashchange", () => this.follow());
    this.follow();
  }

  // Goes to another choice, which the address then says.
  /** @param {Partial<Choice>} change */
  go(change) {
    const wanted = Object.entries({ ...this.choice, ...change }).filter(([, value]) =>
      value
    );
    location.hash = String(new URLSearchParams(wanted));
  }

  follow() {
    const before = this.choice.study;
    this.choice = addressed();
    if (this.choice.study !== before) this.state = null;
    clearTimeout(this.timer);
    this.look(true);
  }

  // Looks what is stored now. Only if it is more than before, or if something else was
  // chosen, is all the rest asked for.
  /** @param {boolean} all */
  async look(all) {
    const look = ++this.looks;
    try {
      await (this.choice.study ? this.lookAtStudy(all) : this.lookAtStudies());
      this.complain("");
    } catch (error) {
      const away = "The server does not answer; is sweep show still running?";
      this.complain(error instanceof Refused ? error.message : away);
    }
    if (look === this.looks) {
      this.timer = setTimeout(() => this.look(false), LOOK_AGAIN);
    }
  }

  /** @param {string} words */
  complain(words) {
    this.banner.textContent = words;
    this.banner.hidden = !words;
  }

  async lookAtStudies() {
    this.display(false);
    /** @type {{ studies: Study[] }} */
    const { studies } = await ask("studies", {});
    const rows = studies.map((one) => ({
      cells: [
        one.study,
        `${one.model ?? ""} ${one.preset ?? ""}`.trim(),
        numberOf(one.trials),
        numberOf(one.done),
        numberOf(one.not_done),
        numberOf(one.missing),
        one.error,
      ],
      chosen: false,
      choose: () => this.go({ study: one.study }),
    }));
    const headings = [
      "study",
      "model and preset",
      "trials",
      "done",
      "not done",
      "missing",
      "",
    ].map((text) => ({ text }));
    this.list.show({
      headings,
      rows,
      total: rows.length,
      page: 0,
      size: rows.length,
      what: "studies",
    });
  }

  /** @param {boolean} all */
  async lookAtStudy(all) {
    const { study } = this.choice;
    this.display(true);
    /** @type {StudyState} */
    const state = await ask("state", { study, seen: this.state?.revision ?? "" });
    if (study !== this.choice.study) return;
    const changed = state.revision !== this.state?.revision;
    this.state = this.state && !changed
      ? { ...this.state, running: state.running }
      : state;
    this.panel.show(this.state);
    if (all || changed) await this.refresh(this.state);
  }

  /** @param {StudyState} state */
  async refresh(state) {
    const { choice } = this;
    this.player.show(choice);
    this.originOf(state);
    this.refine.show(choice, state.revision);
    await Promise.all([
      this.figure.show(choice, state),
      this.points.show(choice),
      this.trials.show(choice),
    ]);
  }

  /** @param {boolean} one */
  display(one) {
    this.studies.hidden = one;
    this.study.hidden = !one;
    this.chosen.hidden = !one;
    this.home.hidden = !one;
    this.name.textContent = this.choice.study || "Results";
    this.where.value = this.choice.where;
    document.title = `${this.choice.study || "results"} · boidsweep`;
  }

  /** @param {StudyState} state */
  originOf({ about: { spec, ...others } }) {
    const facts = Object.entries(others).map(([name, value]) => `${name} ${value}`);
    this.origin.replaceChildren(
      make("summary", { textContent: "Where this comes from" }),
      make("p", { className: "facts", textContent: facts.join("; ") }),
      make("pre", { textContent: spec }),
    );
  }
}

/** @param {number | null} value */
const numberOf = (value) => value?.toLocaleString("en") ?? "";

// A command, to be copied.
/** @param {string} text */
function commandLine(text) {
  const copy = button(
    "copy",
    "Copy the command",
    () => navigator.clipboard.writeText(text),
    "",
    { className: "quiet" },
  );
  return make(
    "div",
    { className: "command row" },
    make("code", { textContent: text }),
    copy,
  );
}

const main = document.querySelector("main");
if (main) window.explorer = new Explorer(main);
