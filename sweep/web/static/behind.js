// The trials behind a point, those to look at first, and the one that plays.

import { make, short, spaced } from "./dom.js";
import { ask } from "./ask.js";
import { PagedTable } from "./rows.js";
import { pageId, Socket } from "./socket.js";
import { mount } from "./mount.js";

/** @import { Choice, Trial, Trials } from "./explorer.d.ts" */
/** @import { View } from "./view.js" */

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
      choose: () => this.go({ trial: trial.trial_id }),
      note: settingsSaid(settings[trial.point]),
    }));
    const value = `${spaced(metric)}${unit ? ` (${unit})` : ""}`;
    const headings = ["trial", "replicate", value, "why look"].map((text) => ({
      text,
    }));
    this.table.show({ ...trials, headings, rows, what: "trials" });
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
  return [`▶ ${id.slice(0, 8)}`, String(replicate + 1), short(value, 6), why];
}

/** @param {Record<string, unknown>} settings */
const settingsSaid = (settings) =>
  Object.entries(settings).map(([name, value]) =>
    `${spaced(name)} ${short(typeof value === "number" ? value : String(value))}`
  ).join(", ") || "the one point";

// The player of the simulator, beside the figure.
export class Player {
  /** @type {{ unmount(): void, view: View } | null} */
  mounted = null;
  shown = "";

  constructor() {
    this.words = make("span", { className: "facts" });
    this.open = make("a", {
      target: "_blank",
      rel: "noopener",
      textContent: "Open in the simulator",
      hidden: true,
    });
    this.place = make("div", { className: "player" });
    this.element = make(
      "section",
      { className: "card", "aria-label": "player", hidden: true },
      make(
        "div",
        { className: "row spread" },
        make("h2", { textContent: "Trial" }),
        this.words,
        this.open,
      ),
      this.place,
    );
  }

  /** @param {Choice} choice */
  show({ study, trial }) {
    const wanted = trial && `${study} ${trial}`;
    if (wanted === this.shown) return;
    this.shown = wanted;
    this.mounted?.unmount();
    this.mounted = null;
    this.element.hidden = !trial;
    if (!trial) return;
    this.words.textContent = trial;
    const page = `${pageId()} ${trial}`;
    this.mounted = mount(this.place, new Socket(), { page, stored: { study, trial } });
    this.link(study, trial);
  }

  /** @param {string} study @param {string} trial */
  async link(study, trial) {
    this.open.hidden = true;
    /** @type {{ yaml: string, point: string, replicate: number }} */
    const { yaml, point, replicate } = await ask("spec", { study, trial });
    const told = new URLSearchParams({
      spec: yaml,
      point,
      replicate: String(replicate),
    });
    this.open.href = `index.html#${told}`;
    this.open.hidden = false;
  }
}
