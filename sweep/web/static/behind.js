// The trials behind a point, those to look at first, and the one that plays.

import { make, short, spaced } from "./dom.js";
import { ask } from "./ask.js";
import { PagedTable } from "./rows.js";

/** @import { Choice, Trial, Trials } from "./explorer.d.ts" */
/** @import { StoredName } from "./protocol.d.ts" */
/** @import { View } from "./view.js" */

export const ALL = "all"; // in place of the ids of points
const SIDES = /** @type {const} */ (["trial", "beside"]);

/** @typedef {Required<StoredName>} Stored */

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
    const headings = ["trial", "replicate", value, "why look"].map((text) => ({
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
  return [`▶ ${id.slice(0, 8)}`, String(replicate + 1), short(value, 6), why];
}

/** @param {Record<string, unknown>} settings */
const settingsSaid = (settings) =>
  Object.entries(settings).map(([name, value]) =>
    `${spaced(name)} ${short(typeof value === "number" ? value : String(value))}`
  ).join(", ") || "the one point";

// The player of the simulator, beside the figure: one trial, or two on one clock. Its
// scripts are loaded when the first trial plays.
export class Player {
  /** @type {{ unmount(): void, view: View } | null} */
  mounted = null;
  shown = "";

  /** @param {(change: Partial<Choice>) => void} go */
  constructor(go) {
    this.go = go;
    this.title = make("h2");
    this.words = make("span", { className: "facts" });
    this.links = make("span", { className: "row" });
    this.place = make("div", { className: "player" });
    this.element = make(
      "section",
      { className: "card", "aria-label": "player", hidden: true },
      make("div", { className: "row spread" }, this.title, this.words, this.links),
      this.place,
    );
  }

  /** @param {Choice} choice */
  show({ study, trial, beside }) {
    if (trial && [study, trial, beside].join(" ") === this.shown) return;
    this.shown = "";
    this.mounted?.unmount();
    this.mounted = null;
    this.element.hidden = !trial;
    this.element.classList.toggle("two", Boolean(beside));
    if (!trial) return;
    this.title.textContent = beside ? "Two trials on one clock" : "Trial";
    this.play(this.tell({ study, trial, beside }));
  }

  // Which trials are played, in words.
  /** @param {Stored} stored */
  tell(stored) {
    const { study, trial, beside } = stored;
    const trials = [trial, beside].filter(Boolean);
    this.shown = [study, trial, beside].join(" ");
    this.words.textContent = trials.join(" and ");
    this.link(study, trials);
    return stored;
  }

  /** @param {Stored} stored */
  async play(stored) {
    const { shown } = this;
    const [{ mount }, { pageId, Socket }] = await Promise.all([
      import("./mount.js"),
      import("./socket.js"),
    ]);
    if (shown !== this.shown) return;
    // A view says `stored` to each server: what is gone to in the player is kept there.
    const mounted = mount(this.place, new Socket(), {
      page: [pageId(), shown].join(" "),
      stored,
      alone: (side) => this.go({ trial: stored[SIDES[side]], beside: "" }),
      playing: (side, id) => {
        if (mounted !== this.mounted || stored[SIDES[side]] === id) return;
        stored[SIDES[side]] = id;
        this.tell(stored);
        this.go({ [SIDES[side]]: id });
      },
    });
    this.mounted = mounted;
  }

  // A link to the simulator for each of the trials.
  /** @param {string} study @param {string[]} trials */
  async link(study, trials) {
    this.links.replaceChildren();
    const { shown } = this;
    const links = await Promise.all(
      trials.map(async (trial, i) => {
        /** @type {{ yaml: string, point: string, replicate: number }} */
        const { yaml, point, replicate } = await ask("spec", { study, trial });
        const told = { spec: yaml, point, replicate: String(replicate) };
        const which = trials.length > 1 ? `${"AB"[i]} ` : "";
        return make("a", {
          target: "_blank",
          rel: "noopener",
          textContent: `Open ${which}in the simulator`,
          href: `index.html#${new URLSearchParams(told)}`,
        });
      }),
    );
    if (shown === this.shown) this.links.replaceChildren(...links);
  }
}
