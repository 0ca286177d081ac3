// The trials behind a point, those to look at first, and the place of the one that
// plays.

import { make, short, spaced } from "./dom.js";
import { ask } from "./ask.js";
import { PagedTable } from "./rows.js";

/** @import { Choice, Trial, Trials } from "./explorer.d.ts" */

export const ALL = "all"; // in place of the ids of points

export class TrialTable {
  page = 0;
  /** @type {Trials | null} */
  trials = null;
  /** @type {Choice | null} */
  choice = null;

  /** @param {(change: Partial<Choice>) => void} go @param {string} name */
  constructor(go, name = "trials") {
    this.go = go;
    this.name = name;
    this.title = make("h2");
    this.table = new PagedTable(name, (page) => this.turn(page));
    this.element = make(
      "section",
      { className: "card", "aria-label": name, hidden: true },
      this.title,
      this.table.element,
    );
  }

  get asked() {
    const { study = "", half = "", metric = "", point = "", where = "" } =
      this.choice ??
        {};
    return {
      study,
      half,
      where,
      metric: metric.split(" ")[0].replace(/[+-]$/, ""),
      point: point === ALL ? [] : point.split(" "),
    };
  }

  /** @param {Choice} choice */
  async show(choice) {
    const before = JSON.stringify(this.asked);
    this.choice = choice;
    if (JSON.stringify(this.asked) !== before) this.page = 0;
    this.element.hidden = !choice.point;
    if (!choice.point) return;
    const asked = JSON.stringify(this.asked);
    const page = this.page ? String(this.page) : "";
    /** @type {Trials} */
    const trials = await ask("trials", { ...this.asked, page });
    if (asked !== JSON.stringify(this.asked)) return;
    this.trials = trials;
    this.draw();
  }

  draw() {
    const { trials, choice } = this;
    if (!trials || !choice) return;
    const { settings, unit, metric } = trials;
    const points = Object.values(settings);
    this.title.textContent = points.length === 1
      ? `${capital(this.name)} at ${settingsSaid(points[0])}`
      : `${capital(this.name)} of ${points.length} points`;
    const rows = trials.rows.map((trial) => ({
      cells: cellsOf(trial),
      chosen: trial.trial_id === choice.trial,
      choose: () => this.go({ trial: trial.trial_id, beside: "" }),
      note: settingsSaid(settings[trial.point]),
      more: this.besideOf(trial.trial_id, choice),
    }));
    const value = `${spaced(metric)}${unit ? ` (${unit})` : ""}`;
    const headings = ["trial", "replicate", value, "reason"].map((text) => ({
      text,
    }));
    this.table.show({ ...trials, headings, rows, what: "trials" });
  }

  // Any trial but the one that plays can be played beside that one.
  /** @param {string} id @param {Choice} choice */
  besideOf(id, { trial, beside }) {
    if (!trial || id === trial) return null;
    return {
      text: "beside",
      label: `Play ${id.slice(0, 8)} beside ${trial.slice(0, 8)}`,
      chosen: id === beside,
      choose: () => this.go({ beside: id === beside ? "" : id }),
    };
  }

  /** @param {number} page */
  turn(page) {
    this.page = page;
    if (this.choice) this.show(this.choice);
  }
}

/** @param {string} text */
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** @param {Trial} trial */
function cellsOf({ trial_id: id, replicate, value, part, status, error }) {
  const why = status === "done" ? part : `${status}: ${error}`;
  return [`▶ ${id.slice(0, 8)}`, String(replicate), short(value, 6), why];
}

/** @param {Record<string, unknown>} settings */
const settingsSaid = (settings) =>
  Object.entries(settings).map(([name, value]) =>
    `${spaced(name)} ${short(typeof value === "number" ? value : String(value))}`
  ).join(", ") || "the only point";

// The place of the player, whose scripts are loaded when the first trial plays.
export class Player {
  /** @type {import("./played.js").Played | null} */
  played = null;
  /** @type {Choice | null} */
  choice = null;

  /** @param {(change: Partial<Choice>) => void} go */
  constructor(go) {
    this.go = go;
    this.element = make("section", {
      className: "card",
      "aria-label": "player",
      hidden: true,
    });
  }

  /** @param {Choice} choice */
  async show(choice) {
    this.choice = choice;
    this.element.hidden = !choice.trial;
    if (!choice.trial && !this.played) return;
    const { Played } = await import("./played.js");
    this.played ??= new Played(this.element, this.go);
    this.played.show(this.choice);
  }
}
