// The explorer: the studies of a folder; one study with its state, a figure, its
// points, the trials behind a point, and a trial that plays; two sides compared; or the
// scorecard. What is shown is what the address says.

import { button, make, spaced } from "./dom.js";
import { ask, Refused } from "./ask.js";
import { Player, TrialTable } from "./behind.js";
import { FigurePanel } from "./figures.js";
import { RefineCard } from "./refine.js";
import { PagedTable } from "./rows.js";
import { SearchPanel } from "./searched.js";
import { SidesForm } from "./sides.js";
import { StatePanel } from "./strip.js";
import { PointTable } from "./tables.js";

/** @import { Choice, Study, StudyState } from "./explorer.d.ts" */

const LOOK_AGAIN = 2000; // ms
const NO_STUDY = "No study is stored in this folder. Launch a first study:";
const KEYS = /** @type {const} */ ([
  "study",
  "kind",
  "metric",
  "x",
  "y",
  "by",
  "where",
  "half",
  "trials",
  "width",
  "sort",
  "point",
  "trial",
  "beside",
  "a",
  "b",
  "margin",
  "confidence",
  "together",
  "ranked",
  "side",
  "scorecard",
  "claim",
  "verdict",
  "region",
  "parts",
  "replicates",
]);

/**
 * What fills the page in place of a study.
 *
 * @typedef {{
 *   element: HTMLElement,
 *   player: Player,
 *   show(choice: Choice, all: boolean): Promise<void>,
 * }} OtherView
 */

// The views that are not of one study: each is loaded when it is first gone to.
const OTHERS = {
  compared: async () => (await import("./compared.js")).ComparedView,
  scorecard: async () => (await import("./scored.js")).ScorecardView,
};

// The view that an address asks for, other than that of a study or of all studies.
/** @param {Choice} choice @returns {keyof typeof OTHERS | ""} */
function otherOf({ scorecard, a, b }) {
  if (scorecard) return "scorecard";
  return a && b ? "compared" : "";
}

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
  /** @type {Partial<Record<keyof typeof OTHERS, OtherView>>} */
  others = {};

  /** @param {HTMLElement} root */
  constructor(root) {
    this.root = root;
    const go = (/** @type {Partial<Choice>} */ change) => this.go(change);
    const settle = (/** @type {Partial<Choice>} */ change) => this.settle(change);
    const command = (/** @type {string} */ text) => commandLine(text);
    this.parts = { go, command };
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
        change: () => this.go({ where: this.where.value.trim(), point: "" }),
      },
    });
    this.chosen = make(
      "div",
      { className: "row", hidden: true },
      make("label", { htmlFor: "where", textContent: "where" }),
      this.where,
    );
    this.scorecards = make("p", { className: "row" });
    this.list = new PagedTable("studies", () => {});
    this.list.element.hidden = true;
    this.none = make("div", { hidden: true }, NO_STUDY);
    this.studies = make(
      "section",
      { className: "card", "aria-label": "studies" },
      this.scorecards,
      this.list.element,
      this.none,
    );
    this.panel = new StatePanel((trial) => this.go({ trial, beside: "" }));
    this.figure = new FigurePanel("figure", go, command);
    this.search = new SearchPanel(go, command);
    this.refine = new RefineCard(go);
    this.points = new PointTable(go, command);
    this.trials = new TrialTable(go, "trials", settle);
    this.player = new Player(go, this.trials.dots.element);
    this.origin = make("details", { className: "card" });
    this.sides = new SidesForm("study", go);
    const compare = make(
      "details",
      { className: "card", "aria-label": "compare" },
      make("summary", { textContent: "Compare with another side" }),
      this.sides.element,
    );
    this.study = make(
      "div",
      { className: "study", hidden: true },
      this.panel.element,
      make(
        "div",
        { className: "seen" },
        this.figure.element,
        this.search.element,
        this.refine.element,
        this.points.element,
      ),
      make("div", { className: "behind" }, this.player.element, this.trials.element),
      compare,
      this.origin,
    );
    root.append(
      make("header", { className: "top" }, brand, this.chosen),
      this.banner,
      this.studies,
      this.study,
    );
    this.own = { element: this.study, player: this.player };
    addEventListener("hashchange", () => this.follow());
    this.follow();
  }

  // Goes to another choice, which the address then says.
  /** @param {Partial<Choice>} change */
  go(change) {
    location.hash = this.addressOf(change);
  }

  // The same, without a step of the history to go back to.
  /** @param {Partial<Choice>} change */
  settle(change) {
    location.replace(`#${this.addressOf(change)}`);
  }

  /** @param {Partial<Choice>} change */
  addressOf(change) {
    const wanted = Object.entries({ ...this.choice, ...change }).filter(([, value]) =>
      value
    );
    return String(new URLSearchParams(wanted));
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
      await this.lookAt(this.choice, all);
      this.complain("");
    } catch (error) {
      const away = "The server does not answer; is sweep show still running?";
      this.complain(error instanceof Refused ? error.message : away);
    }
    if (look === this.looks) {
      this.timer = setTimeout(() => this.look(false), LOOK_AGAIN);
    }
  }

  /** @param {Choice} choice @param {boolean} all */
  async lookAt(choice, all) {
    const other = otherOf(choice);
    if (other) this.others[other] ??= await this.load(other);
    if (choice !== this.choice) return;
    this.display(choice);
    if (other) await this.others[other]?.show(choice, all);
    else if (choice.study) await this.lookAtStudy(all);
    else await this.lookAtStudies();
  }

  /** @param {keyof typeof OTHERS} name @returns {Promise<OtherView>} */
  async load(name) {
    const made = await OTHERS[name]();
    const view = this.others[name] ?? new made(this.parts.go, this.parts.command);
    this.root.append(view.element);
    return view;
  }

  /** @param {string} words */
  complain(words) {
    this.banner.textContent = words;
    this.banner.hidden = !words;
  }

  async lookAtStudies() {
    /** @type {{ studies: Study[], scorecards: string[], first: string[] }} */
    const { studies, scorecards, first } = await ask("studies", {});
    this.scorecards.replaceChildren(...scorecards.map(scorecardLink));
    this.none.hidden = studies.length > 0;
    if (!this.none.children.length) this.none.append(...first.map(commandLine));
    this.list.element.hidden = !studies.length;
    const rows = studies.map((one) => ({
      cells: [
        one.study,
        `${one.model ?? ""} ${one.preset ?? ""}`.trim(),
        spaced(one.varied ?? ""),
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
      "varied",
      "trials",
      "done",
      "not done",
      "missing",
      "error",
    ].map((text, i) => ({ text, isNumber: i > 2 && i < 7 }));
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
    await this.figure.show(choice, state); // first: of many trials all takes seconds
    if (choice !== this.choice) return; // another one was chosen meanwhile
    await Promise.all([
      this.search.show(choice, state),
      this.points.show(choice, state.revision),
      this.trials.show(choice),
      this.figure.mention(),
    ]);
  }

  /** @param {Choice} choice */
  display(choice) {
    const { study, a, b, where } = choice;
    const shown = otherOf(choice);
    const name =
      { scorecard: "Scorecard", compared: `${a} and ${b}`, "": study }[shown];
    this.study.hidden = Boolean(shown) || !study;
    this.studies.hidden = Boolean(name);
    const views = Object.entries(this.others);
    for (const [one, { element }] of views) element.hidden = one !== shown;
    for (const { element, player } of [this.own, ...views.map(([, view]) => view)]) {
      if (element.hidden) player.show({ ...choice, trial: "" });
    }
    this.chosen.hidden = this.study.hidden;
    this.home.hidden = !name;
    this.name.textContent = name || "Results";
    this.where.value = where;
    this.sides.show(study, "");
    this.figure.mark(choice);
    document.title = `${name || "results"} · boidsweep`;
  }

  /** @param {StudyState} state */
  originOf({ about: { spec, ...others } }) {
    const facts = Object.entries(others).map(([name, value]) => `${name} ${value}`);
    this.origin.replaceChildren(
      make("summary", { textContent: "Origin of these results" }),
      make("p", { className: "facts", textContent: facts.join("; ") }),
      make("pre", { textContent: spec }),
    );
  }
}

/** @param {string} scale */
const scorecardLink = (scale) =>
  make("a", {
    href: `#${new URLSearchParams({ scorecard: scale })}`,
    textContent: `Scorecard, ${scale} scale`,
  });

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
