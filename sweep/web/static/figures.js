// A figure of a study: what is chosen, its panels, its note, and its command.

import { make, short, spaced, unitText } from "./dom.js";
import { ask, Refused } from "./ask.js";
import { MEDIAN } from "./behind.js";
import { Dots, shade } from "./dots.js";
import { FigureFiles } from "./drawings.js";
import { Lines } from "./lines.js";
import { MOST_POINTS } from "./picking.js";
import { Region } from "./region.js";

/**
 * @import {
 *   Choice,
 *   Dot,
 *   Figure,
 *   FigureAxis,
 *   Known,
 *   Panel,
 *   Published,
 *   StudyState,
 * } from "./explorer.d.ts"
 */
/** @import { Choose, Place } from "./picking.js" */
/** @typedef {typeof import("./cells.js")} Heatmaps loaded for the first heatmap */

/**
 * @typedef {{ value: string, text: string, title?: string, group?: string }} Option
 */

const NOTHING = { kind: "", metric: "", x: "", y: "", by: "" }; // chosen
const UNSUITABLE = "not without other choices or data";
const AXES = /** @type {const} */ (["x", "y", "by"]);

export class FigurePanel {
  /** @type {(Lines | Dots | InstanceType<Heatmaps["Cells"]>)[]} */
  boards = [];
  /** @type {Region[]} */
  regions = [];
  /** @type {Figure | null} */
  figure = null;
  /** @type {Choice | null} */
  choice = null;
  shown = ""; // what was asked for, at which revision
  told = ""; // the same, of published numbers
  /** @type {Published[]} */
  published = [];

  /**
   * @param {string} prefix
   * @param {(change: Partial<Choice>) => void} go
   * @param {(command: string) => HTMLElement} command
   */
  constructor(prefix, go, command) {
    this.go = go;
    this.command = command;
    this.kind = this.picker(
      prefix,
      "kind",
      "figure",
      (kind) => go({ kind, metric: "", x: "", y: "", by: "" }),
    );
    this.metric = this.picker(prefix, "metric", "metric", (metric) => go({ metric }));
    this.half = this.picker(prefix, "half", "of", (half) => go({ half }));
    this.axes = AXES.map((axis) =>
      this.picker(prefix, axis, axis, (name) => go({ [axis]: name }))
    );
    this.trials = make("input", {
      id: `${prefix}-trials`,
      type: "checkbox",
      "aria-describedby": `${prefix}-why`,
      on: { change: () => go({ trials: this.trials.checked ? "yes" : "" }) },
    });
    this.why = make("span", { id: `${prefix}-why`, className: "facts" });
    const switches = make(
      "div",
      {},
      this.trials,
      make("label", { htmlFor: this.trials.id, textContent: "trials" }),
      this.why,
    );
    const pickers = [this.kind, this.metric, this.half, ...this.axes].map((one) =>
      one.element
    );
    this.tip = make("div", { className: "tip", role: "status", hidden: true });
    this.crowd = make("p", { className: "refusal", role: "alert", hidden: true });
    this.panels = make("div", { className: "panels" });
    this.legend = make("div");
    this.mentioned = make("p", { className: "legend" });
    this.note = make("p", { className: "facts said" });
    this.refusal = make("p", { className: "refusal", role: "alert", hidden: true });
    this.line = make("div");
    this.files = new FigureFiles(prefix, () => this.asked, go);
    this.suiting = make("button", {
      type: "button",
      textContent: "Show a suitable figure",
      on: { click: () => go(NOTHING) },
    });
    // Before the first figure there is nothing to choose from.
    this.pickers = make(
      "div",
      { className: "choices-of-figure", hidden: true },
      ...pickers,
      switches,
    );
    this.element = make(
      "section",
      { className: "card figure", "aria-label": "figure" },
      this.pickers,
      this.refusal,
      this.crowd,
      this.legend,
      this.panels,
      this.note,
      this.line,
      this.files.element,
      this.tip,
    );
  }

  /**
   * @param {string} prefix
   * @param {string} name
   * @param {string} label
   * @param {(value: string) => void} act
   */
  picker(prefix, name, label, act) {
    const select = make("select", {
      id: `${prefix}-${name}`,
      on: { change: () => act(select.value) },
    });
    const words = make("label", { htmlFor: select.id, textContent: label });
    return { element: make("div", {}, words, select), select };
  }

  get asked() {
    const {
      study = "",
      kind = "",
      metric = "",
      x = "",
      y = "",
      by = "",
      where = "",
      half = "",
      trials = "",
      width = "",
    } = this.choice ?? {};
    const drawn = { kind, metric: metric.split(" "), x, y, by, half, trials, width };
    return { study, where, ...drawn };
  }

  /** @param {Choice} choice @param {StudyState} state */
  async show(choice, state) {
    this.choice = choice;
    const asked = JSON.stringify(this.asked);
    const wanted = `${state.revision} ${asked}`;
    if (wanted === this.shown) return this.mark(); // only other points are chosen
    try {
      /** @type {Figure} */
      const figure = await ask("figure", this.asked);
      const heatmaps = figure.form === "cells" ? await import("./cells.js") : null;
      if (asked !== JSON.stringify(this.asked)) return;
      this.offer(figure, state);
      this.refuse(figure.refusal);
      this.figure = figure.refusal ? null : figure;
      if (this.figure) this.draw(figure, heatmaps);
      this.shown = wanted;
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      if (asked !== JSON.stringify(this.asked)) return;
      this.refuse(error.message);
      this.shown = "";
    }
  }

  // Published numbers come after the figure: to read them takes longer.
  async mention() {
    const { figure, shown } = this;
    if (!figure || !shown || shown === this.told) return;
    this.told = shown;
    const { metrics, panels, form } = figure;
    const ofTime = panels[0].x.name === "frame";
    if (metrics.length !== 1 || ofTime || form === "paths") return;
    const { study, half } = this.asked;
    /** @type {{ published: Published[] }} */
    const answer = await ask("published", { study, half, metric: metrics[0] });
    if (shown !== this.shown) return;
    this.published = answer.published;
    this.mentioned.textContent = publishedLegend(this.published, form);
    for (const board of this.boards) board.mention(this.published);
  }

  /** @param {string} words */
  refuse(words) {
    const names = /** @type {(keyof typeof NOTHING)[]} */ (Object.keys(NOTHING));
    const hasChoices = names.some((name) => this.choice?.[name]);
    this.refusal.replaceChildren(words, " ", hasChoices ? this.suiting : "");
    this.refusal.hidden = !words;
    const { panels, legend, note, line, files } = this;
    for (const part of [panels, legend, note, line, files.element]) {
      part.hidden = Boolean(words);
    }
  }

  /** @param {Figure} figure @param {Heatmaps | null} heatmaps */
  draw(figure, heatmaps) {
    this.published = [];
    this.mentioned.textContent = "";
    this.tip.hidden = true;
    for (const part of [...this.boards, ...this.regions]) part.remove();
    const drawerOf = this.boardsOf(figure, heatmaps);
    this.boards = figure.panels.map((panel, i) => {
      /** @type {Choose} */
      const choose = (points, about, trial = "") =>
        this.choosePoints(points, about ? this.regions[i].of(about) : "", trial);
      return drawerOf(panel, (dot, at) => this.hover(panel, dot, at), choose);
    });
    const titled = this.boards.map((board, i) =>
      make(
        "figure",
        {},
        make("figcaption", { textContent: figure.panels[i].title }),
        board.element,
      )
    );
    this.panels.replaceChildren(...titled);
    this.panels.classList.toggle("several", titled.length > 1);
    for (const board of this.boards) board.draw();
    this.regions = this.boards.map((board, i) =>
      new Region(board, figure.panels[i], figure.settings)
    );
    this.legend.replaceChildren(
      heatmaps?.rampLegend(figure) ?? this.colours(figure),
      this.mentioned,
    );
    this.note.textContent = [
      figure.thinned && `${figure.thinned} are shown`,
      figure.note,
    ].filter(Boolean).join("\n");
    this.line.replaceChildren(this.command(figure.command));
    this.files.show(figure, this.asked.width);
    this.mark();
  }

  // What draws a panel of a figure.
  /**
   * @param {Figure} figure
   * @param {Heatmaps | null} heatmaps
   * @returns {(
   *   panel: Panel,
   *   over: (dot: Dot | null, at: Place) => void,
   *   choose: Choose,
   * ) => Lines | Dots | InstanceType<Heatmaps["Cells"]>}
   */
  boardsOf(figure, heatmaps) {
    if (heatmaps) {
      const range = heatmaps.shadesOf(figure);
      return (...parts) => new heatmaps.Cells(range, ...parts);
    }
    const kind = figure.form === "lines" ? Lines : Dots;
    return (...parts) => new kind(figure, ...parts);
  }

  /**
   * @param {string[]} points
   * @param {string} region that was drawn about them
   * @param {string} single the id of a trial that was chosen, or ""
   */
  choosePoints(points, region, single) {
    const many = points.length > MOST_POINTS;
    this.crowd.hidden = !many;
    this.crowd.textContent = `${points.length.toLocaleString("en")} points; up to ` +
      `${MOST_POINTS} can be chosen at once`;
    const chosen = many ? {} : { point: points.join(" ") };
    const { point = "", trial = "" } = this.choice ?? {};
    const plays = trial && points.join(" ") === point;
    const median = points.length === 1 ? MEDIAN : "";
    const next = { trial: single || median, beside: "" };
    this.go({ region, ...chosen, ...(plays && !single ? {} : next) });
  }

  // The points that are chosen stand out, before anything is asked.
  mark(choice = this.choice) {
    const points = new Set(choice?.point.split(" ").filter(Boolean));
    for (const board of this.boards) board.mark(points, choice?.trial ?? "");
    for (const region of this.regions) region.show(choice?.region ?? "");
  }

  /** @param {Figure} figure */
  colours({ by, values, colours, panels }) {
    const line = panels[0]?.line.text ?? "";
    const beyond = panels.some(({ y }) =>
      typeof y.low === "number" || typeof y.high === "number"
    );
    const ink = getComputedStyle(this.element).color;
    const swatches = values.map((value, i) => {
      const swatch = make("i", { className: "swatch" });
      swatch.style.background = shade(colours[i % colours.length], ink);
      return make("span", {}, swatch, value);
    });
    return make(
      "p",
      { className: "legend" },
      by && make("span", { textContent: `${spaced(by)}:` }),
      ...swatches,
      line && make("span", { textContent: `line: ${line}` }),
      beyond ? make("span", { textContent: "triangle: beyond the edge" }) : "",
    );
  }

  /** @param {Figure} figure @param {StudyState} state */
  offer(figure, state) {
    const { kinds, kind, takes, settings, metrics, form } = figure;
    this.pickers.hidden = false;
    fill(
      this.kind.select,
      Object.keys(kinds).map((name) => ({
        value: name,
        text: name,
        title: kinds[name].text,
        group: kinds[name].why_not && UNSUITABLE,
      })),
      kind,
    );
    const shown = form === "lines" && figure.panels[0]?.x.name === "frame"
      ? state.series
      : state.metrics;
    const pairs = metrics.length > 1
      ? shown.flatMap((one) =>
        shown.filter((other) => other !== one).map((other) => `${one} ${other}`)
      )
      : shown;
    const plain = metrics.map((one) => one.replace(/[+-]$/, "")).join(" ");
    fill(
      this.metric.select,
      pairs.map((name) => ({
        value: name,
        text: name.split(" ").map(spaced).join(" against "),
      })),
      plain,
    );
    this.trials.disabled = Boolean(figure.trials_why_not);
    this.trials.checked = !this.trials.disabled && this.choice?.trials === "yes";
    this.why.textContent = figure.trials_why_not;
    this.metric.element.hidden = !metrics.length;
    this.half.element.hidden = !metrics.length;
    fill(this.half.select, [{ value: "", text: "the last frame" }, {
      value: "yes",
      text: "the mean over frames",
    }], this.choice?.half ?? "");
    AXES.forEach((axis, i) => {
      const { element, select } = this.axes[i];
      element.hidden = !takes.includes(axis);
      const chosen = this.choice?.[axis] ?? "";
      const names = [...new Set([...settings, chosen])].filter(Boolean);
      const options = names.map((name) => ({ value: name, text: spaced(name) }));
      fill(select, [{ value: "", text: "automatic" }, ...options], chosen);
    });
  }

  /**
   * @param {Panel} panel
   * @param {Dot | null} dot
   * @param {Place} at
   */
  hover(panel, dot, at) {
    this.tip.hidden = !dot;
    if (!dot) return;
    const published = this.published.filter(({ point }) => point === dot.point);
    const lines = published.map(({ value, where }) => `published: ${value}, ${where}`);
    const said = this.figure ? described(this.figure, panel, dot) : "";
    this.tip.textContent = [said, ...lines].join("\n");
    const box = this.element.getBoundingClientRect();
    const most = box.width - this.tip.offsetWidth - 8;
    this.tip.style.left = `${Math.max(0, Math.min(at.x - box.left + 14, most))}px`;
    this.tip.style.top = `${at.y - box.top + 14}px`;
  }
}

/** @param {Published[]} published @param {string} form */
function publishedLegend(published, form) {
  if (!published.length) return "";
  const coloured = form === "cells" ? "; the colour is the value" : "";
  return `◇ a published number for the parameters of the point${coloured}`;
}

// Where a mark is, its metric with an interval, and the number of trials.
/** @param {Figure} figure @param {Panel} panel @param {Dot} dot */
function described(figure, { title, x, y }, dot) {
  const trials = dot.trial ? "" : `${dot.n} trials`;
  const hint = dot.point.includes(" ")
    ? "click to list them"
    : `click to play the ${dot.trial ? "trial" : "median"}`;
  if (dot.half !== undefined) {
    const half = dot.half === null
      ? ""
      : ` ± ${short(dot.half, 2)} (95 % confidence interval)`;
    const many = dot.points === 1 ? "" : `, the mean of ${dot.points} points`;
    return [
      title,
      `${unitText(x.label)}: ${placeOfCell(x, dot.across, [dot.left, dot.right])}`,
      `${unitText(y.label)}: ${placeOfCell(y, dot.up, [dot.bottom, dot.top])}`,
      `${unitText(figure.by)}: ${short(dot.y, 3)}${half}`,
      `${trials}${many}; ${hint}`,
    ].filter(Boolean).join("\n");
  }
  const place = x.names.length ? x.names[Number(dot.x)] : short(dot.x);
  const ends = dot.low === null || dot.trial
    ? ""
    : ` (95 % confidence interval ${short(dot.low, 3)} to ${short(dot.high, 3)})`;
  return [
    title,
    figure.by && figure.values.length > 0
      ? `${unitText(figure.by)}: ${figure.values[dot.colour]}`
      : "",
    `${unitText(x.label)}: ${place}`,
    `${unitText(y.label)}: ${short(dot.y, dot.trial ? 4 : 3)}${ends}`,
    dot.trial ? `trial ${dot.trial.slice(0, 8)}, replicate ${dot.replicate}` : "",
    [trials, hint].filter(Boolean).join("; "),
  ].filter(Boolean).join("\n");
}

// The value of a cell along an axis, or the ends of a bin.
/** @param {FigureAxis} axis @param {Known} place @param {[number, number]} edges */
function placeOfCell({ names }, place, [low, high]) {
  if (place === null) return `${short(low)} to ${short(high)}`;
  return names.length ? names[place] : short(place);
}

/**
 * @param {HTMLSelectElement} select
 * @param {Option[]} options
 * @param {string} chosen
 */
function fill(select, options, chosen) {
  const known = JSON.stringify(options);
  if (select.dataset.known !== known) {
    select.dataset.known = known;
    select.replaceChildren();
    for (const [label, some] of Map.groupBy(options, ({ group = "" }) => group)) {
      const made = some.map(({ value, text, title = "" }) =>
        make("option", { value, textContent: text, title })
      );
      select.append(...(label ? [make("optgroup", { label }, ...made)] : made));
    }
  }
  select.value = chosen;
}
