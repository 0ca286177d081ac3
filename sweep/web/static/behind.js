// The trials behind a point, those to look at first, and the place of the one that
// plays.

import { make, short, spaced, unitText } from "./dom.js";
import { ask } from "./ask.js";
import { Axis } from "./axes.js";
import { PagedTable } from "./rows.js";

/** @import { Choice, Trial, Trials } from "./explorer.d.ts" */

export const ALL = "all"; // in place of the ids of points
export const MEDIAN = "median"; // in place of the id of a trial

export class TrialTable {
  page = 0;
  /** @type {Trials | null} */
  trials = null;
  /** @type {Choice | null} */
  choice = null;

  // `settle` goes to a choice in place of the present one.
  /**
   * @param {(change: Partial<Choice>) => void} go
   * @param {string} name
   * @param {(change: Partial<Choice>) => void} settle
   */
  constructor(go, name = "trials", settle = go) {
    this.go = go;
    this.settle = settle;
    this.dots = new TrialDots(go);
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
    if (!choice.point) return this.dots.clear();
    const asked = JSON.stringify(this.asked);
    const page = this.page ? String(this.page) : "";
    /** @type {Trials} */
    const trials = await ask("trials", { ...this.asked, page });
    if (asked !== JSON.stringify(this.asked)) return;
    this.trials = trials;
    this.draw();
    const isLatest = choice === this.choice;
    if (choice.trial === MEDIAN && isLatest) this.settle({ trial: trials.median });
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
    const value = `${spaced(metric)}${unit ? ` (${unitText(unit)})` : ""}`;
    if (!trials.page) this.dots.show(points.length === 1 ? trials.rows : [], value);
    this.dots.mark(choice);
    const row = trials.rows.find(({ trial_id: id }) => id === choice.trial);
    if (row) this.dots.tell([settingsSaid(settings[row.point]), told(row, unit)]);
    const headings = ["trial", "replicate", value, "reason"].map((text, i) => ({
      text,
      isNumber: i === 1 || i === 2,
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

// A trial by its replicate, with its value.
/** @param {Trial} trial @param {string} unit */
function told({ replicate, value, part }, unit) {
  const of = unit && ` ${unitText(unit)}`;
  return `replicate ${replicate}: ${short(value)}${of}${part ? `, the ${part}` : ""}`;
}

// The trials of a point as dots on the axis of the metric. A click plays the nearest
// trial; with Alt or Shift it plays beside the one that plays. The table has the same.
export class TrialDots {
  /** @type {{ trial: Trial, place: number, dot: HTMLElement }[]} */
  dots = [];
  playing = "";

  /** @param {(change: Partial<Choice>) => void} go */
  constructor(go) {
    this.go = go;
    this.words = make("p", { className: "facts" });
    this.line = make("div", { className: "line", "aria-hidden": "true" });
    this.low = make("span");
    this.name = make("span");
    this.high = make("span");
    this.scale = make(
      "div",
      { className: "row spread" },
      this.low,
      this.name,
      this.high,
    );
    this.element = make(
      "div",
      { className: "dots" },
      this.words,
      this.line,
      this.scale,
    );
    this.line.addEventListener("click", (event) => this.take(event));
  }

  clear() {
    this.dots = [];
    this.line.hidden = this.scale.hidden = true;
    this.tell([]);
  }

  // What is said of the trial that plays.
  /** @param {string[]} parts */
  tell(parts) {
    this.words.textContent = parts.join("; ");
  }

  /** @param {Trial[]} trials @param {string} name */
  show(trials, name) {
    const known = trials.filter(({ status, value }) =>
      status === "done" && value !== null
    );
    const values = known.map(({ value }) => Number(value));
    const axis = new Axis(values).span(0, 100);
    this.line.hidden = this.scale.hidden = known.length < 2;
    this.tell([]);
    this.dots = known.map((trial) => {
      const place = axis.pixel(Number(trial.value));
      const dot = make("i", { title: told(trial, "") });
      dot.style.left = `${place}%`;
      return { trial, place, dot };
    });
    this.line.replaceChildren(...this.dots.map(({ dot }) => dot));
    this.low.textContent = short(axis.value(0), 3);
    this.high.textContent = short(axis.value(100), 3);
    this.name.textContent = name;
  }

  // The trials that play stand out.
  /** @param {Choice} choice */
  mark({ trial: playing, beside }) {
    this.playing = playing;
    for (const { trial: { trial_id: id }, dot } of this.dots) {
      dot.classList.toggle("chosen", id === playing || id === beside);
    }
  }

  /** @param {MouseEvent} event */
  take({ clientX, altKey, shiftKey }) {
    const { left, width } = this.line.getBoundingClientRect();
    const at = 100 * (clientX - left) / width;
    const [nearest] = this.dots.toSorted((a, b) =>
      Math.abs(a.place - at) - Math.abs(b.place - at)
    );
    if (!nearest) return;
    const { trial_id: id } = nearest.trial;
    const together = (altKey || shiftKey) && this.playing && this.playing !== id;
    this.go(together ? { beside: id } : { trial: id, beside: "" });
  }
}

// The place of the player, whose scripts are loaded when the first trial plays.
export class Player {
  /** @type {import("./played.js").Played | null} */
  played = null;
  /** @type {Choice | null} */
  choice = null;

  // `about` is what stands above the player.
  /** @param {(change: Partial<Choice>) => void} go @param {HTMLElement[]} about */
  constructor(go, ...about) {
    this.go = go;
    this.about = about;
    this.element = make("section", {
      className: "card",
      "aria-label": "player",
      hidden: true,
    });
  }

  /** @param {Choice} choice */
  async show(choice) {
    if (choice.trial === MEDIAN) return; // its id is asked for
    this.choice = choice;
    this.element.hidden = !choice.trial;
    if (!choice.trial && !this.played) return;
    const { Played } = await import("./played.js");
    this.played ??= new Played(this.element, this.go, this.about);
    this.played.show(this.choice);
  }
}
