// Two sides compared: a forest plot and a table of the same rows, and behind each row
// the trials of both sides.

import { make, spaced } from "./dom.js";
import { ask, Refused } from "./ask.js";
import { Player, TrialTable } from "./behind.js";
import { download } from "./files.js";
import { described, Forest } from "./forest.js";
import { PagedTable } from "./rows.js";
import { LETTERS, SIDES, SidesForm } from "./sides.js";

/** @import { Behind, Choice, Compared } from "./explorer.d.ts" */

export class ComparedView {
  page = 0;
  /** @type {Compared | null} */
  compared = null;
  /** @type {Choice | null} */
  choice = null;
  /** @type {Forest[]} */
  forests = [];

  /**
   * @param {(change: Partial<Choice>) => void} go
   * @param {(command: string) => HTMLElement} command
   */
  constructor(go, command) {
    this.go = go;
    this.command = command;
    this.form = new SidesForm("compared", go);
    this.metric = labelled(
      "metric",
      make("select"),
      (metric) => this.choose({ metric }),
    );
    this.half = labelled("of", make("select"), (half) => this.choose({ half }));
    this.together = labelled(
      "together",
      make("select"),
      (together) => this.choose({ together }),
    );
    this.margin = labelled(
      "margin",
      make("input", { type: "text" }),
      (margin) => this.choose({ margin }),
    );
    this.confidence = labelled(
      "confidence",
      make("input", { type: "text" }),
      (confidence) => this.choose({ confidence }),
    );
    const choices = [
      this.metric,
      this.half,
      this.margin,
      this.together,
      this.confidence,
    ];
    this.heading = make("p", { className: "said" });
    this.summary = make("p", { className: "said verdicts", role: "status" });
    this.notes = make("p", { className: "facts said" });
    this.refusal = make("p", { className: "refusal", role: "alert", hidden: true });
    this.tip = make("div", { className: "tip", hidden: true });
    this.panels = make("div", { className: "panels" });
    this.table = new PagedTable("differences", (page) => this.turn(page));
    this.line = make("div");
    const save = make("button", {
      type: "button",
      textContent: "csv",
      on: { click: () => this.save() },
    });
    this.shown = make(
      "div",
      {},
      this.heading,
      this.summary,
      this.panels,
      make(
        "div",
        { className: "row spread" },
        make("h2", { textContent: "Rows" }),
        save,
      ),
      this.table.element,
      this.notes,
      this.line,
    );
    const seen = make(
      "section",
      { className: "card figure", "aria-label": "comparison" },
      this.form.element,
      make(
        "div",
        { className: "choices-of-figure" },
        ...choices.map((one) => one.element),
      ),
      this.refusal,
      this.shown,
      this.tip,
    );
    this.trials = SIDES.map((side) =>
      new TrialTable(
        (change) => go({ ...change, side }),
        `trials of ${LETTERS[side]}`,
      )
    );
    this.player = new Player(go);
    this.element = make(
      "div",
      { className: "study", hidden: true },
      make("div", { className: "seen" }, seen),
      make(
        "div",
        { className: "behind" },
        this.player.element,
        ...this.trials.map((one) => one.element),
      ),
    );
  }

  // Another choice has other rows.
  /** @param {Partial<Choice>} change */
  choose(change) {
    this.go({ ...change, point: "", trial: "" });
  }

  get asked() {
    const {
      a = "",
      b = "",
      metric = "",
      half = "",
      margin = "",
      confidence = "",
      together = "",
    } = this.choice ?? {};
    return { a, b, metric: metric.split(" "), half, margin, confidence, together };
  }

  // Asks for the comparison, unless nothing was stored since it was last asked for.
  /** @param {Choice} choice @param {boolean} all */
  async show(choice, all) {
    const before = JSON.stringify(this.asked);
    this.choice = choice;
    this.form.show(choice.a, choice.b);
    const asked = JSON.stringify(this.asked);
    const other = asked !== before;
    if (other) this.page = 0;
    const seen = (!all && !other && this.compared?.revision) || "";
    const page = this.page ? String(this.page) : "";
    try {
      /** @type {Compared | { revision: string }} */
      const compared = await ask("compare", { ...this.asked, page, seen });
      if (asked !== JSON.stringify(this.asked)) return;
      this.refuse("");
      if (!("facts" in compared)) return;
      this.compared = compared;
      this.draw();
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      if (asked === JSON.stringify(this.asked)) this.refuse(error.message);
    }
  }

  /** @param {string} words */
  refuse(words) {
    this.refusal.textContent = words;
    this.refusal.hidden = !words;
    this.shown.hidden = Boolean(words);
  }

  draw() {
    const { compared, choice } = this;
    if (!compared || !choice) return;
    const { facts, heading, notes, command } = compared;
    this.offer(compared, choice);
    this.heading.textContent = heading.join("\n");
    this.summary.textContent = facts.summary.join("\n");
    this.notes.textContent = notes.join("\n");
    this.line.replaceChildren(this.command(command));
    this.plant(compared, choice);
    this.list(compared, choice);
    const points = choice.point.split(" ");
    SIDES.forEach((side, i) =>
      this.trials[i].show({
        ...choice,
        study: facts[side].study,
        metric: choice.ranked,
        point: points[i] ?? "",
        trial: choice.side === side ? choice.trial : "",
      })
    );
    const { study } = facts[choice.side === "b" ? "b" : "a"];
    this.player.show({ ...choice, study });
  }

  /** @param {Compared} compared @param {Choice} choice */
  offer({ metrics, corrections, facts }, choice) {
    const several = choice.metric.includes(" ") ? [choice.metric] : [];
    offer(this.metric.control, [["", "all"], ...[...metrics, ...several].map(named)]);
    offer(this.half.control, [["", "the last frame"], ["yes", "the mean over frames"]]);
    offer(this.together.control, corrections.map(named));
    this.metric.control.value = choice.metric || (metrics.length > 1 ? "" : metrics[0]);
    this.half.control.value = choice.half;
    this.together.control.value = facts.method.together;
    this.margin.control.value = choice.margin;
    this.confidence.control.value = String(facts.method.confidence);
  }

  // A forest for each metric: they have units of their own.
  /** @param {Compared} compared @param {Choice} choice */
  plant({ facts, behind, cells, settings }, choice) {
    for (const forest of this.forests) forest.remove();
    const lines = facts.rows.map((about, i) => ({
      about,
      label: cells[i].slice(1, 1 + settings.length).join(", ") || spaced(about.metric),
      chosen: isChosen(behind[i], choice),
      choose: () => this.open(behind[i]),
    }));
    const metrics = [...new Set(facts.rows.map(({ metric }) => metric))];
    this.forests = metrics.map(() => new Forest((line, at) => this.hover(line, at)));
    this.panels.replaceChildren(...this.forests.map((forest) => forest.element));
    this.forests.forEach((forest, i) =>
      forest.show(
        lines.filter(({ about }) => about.metric === metrics[i]),
        facts.method.margin,
        settings.map(spaced).join(", "),
      )
    );
  }

  /** @param {Compared} compared @param {Choice} choice */
  list(compared, choice) {
    const { facts, behind, cells, titles, settings } = compared;
    const alone = new Set(facts.rows.map(({ metric }) => metric)).size === 1;
    const from = alone && titles.length > 1 ? 1 : 0;
    const headings = titles.slice(from).map((title, i, all) => ({
      text: spaced(title),
      isNumber: i + 1 < all.length &&
        (settings.includes(title)
          ? facts.rows.every((row) => typeof row[title] === "number")
          : title !== "metric"),
    }));
    const rows = cells.map((row, i) => ({
      cells: row.slice(from),
      chosen: isChosen(behind[i], choice),
      choose: () => this.open(behind[i]),
    }));
    this.table.show({ ...compared, headings, rows, what: "rows" });
  }

  /** @param {Behind} behind */
  open({ a, b, metric }) {
    this.go({ point: `${a} ${b}`, ranked: metric, trial: "", side: "" });
  }

  /**
   * @param {{ about: Compared["facts"]["rows"][number] } | null} line
   * @param {{ x: number, y: number }} at
   */
  hover(line, at) {
    this.tip.hidden = !line;
    if (!line) return;
    this.tip.textContent = described(line.about);
    const box = this.tip.parentElement?.getBoundingClientRect();
    if (!box) return;
    this.tip.style.left = `${
      Math.max(Math.min(at.x - box.left + 14, box.width - 300), 0)
    }px`;
    this.tip.style.top = `${at.y - box.top + 14}px`;
  }

  /** @param {number} page */
  turn(page) {
    this.page = page;
    if (this.choice) this.show(this.choice, true);
  }

  async save() {
    /** @type {{ csv: string }} */
    const { csv } = await ask("compare", { ...this.asked, csv: "yes" });
    download("comparison.csv", "text/csv", new TextEncoder().encode(csv));
  }
}

/** @param {Behind} behind @param {Choice} choice */
const isChosen = ({ a, b, metric }, { point, ranked }) =>
  point === `${a} ${b}` && ranked === metric;

/** @param {string} name @returns {[string, string]} */
const named = (name) => [name, name.split(" ").map(spaced).join(", ")];

/**
 * @template {HTMLSelectElement | HTMLInputElement} C
 * @param {string} label
 * @param {C} control
 * @param {(value: string) => void} act
 */
function labelled(label, control, act) {
  control.id = `compared-${label}`;
  control.addEventListener("change", () => act(control.value.trim()));
  const words = make("label", { htmlFor: control.id, textContent: label });
  return { element: make("div", {}, words, control), control };
}

/** @param {HTMLSelectElement} select @param {[string, string][]} options */
function offer(select, options) {
  select.replaceChildren(
    ...options.map(([value, textContent]) => make("option", { value, textContent })),
  );
}
