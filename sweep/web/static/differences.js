// What the metrics of two runs differ in, step by step, below both.

import { make, paced, spaced } from "./dom.js";
import { Plot, Series } from "./plots.js";

/** @import { View } from "./view.js" */

const APART = 60; // ms between two drawings

// The second less the first, at the steps that both have.
/** @param {Series} first @param {Series} second */
export function difference(first, second) {
  const found = new Series();
  let j = 0;
  for (let i = 0; i < first.steps.length; i++) {
    while (j < second.steps.length && second.steps[j] < first.steps[i]) j++;
    if (second.steps[j] !== first.steps[i]) continue;
    const [one, other] = [first.values[i], second.values[j]];
    found.steps.push(first.steps[i]);
    found.values.push(one === null || other === null ? null : other - one);
  }
  return found;
}

export class Differences {
  /** @type {Map<string, Plot>} */
  plots = new Map();

  /** @param {View[]} views the first and the second */
  constructor(views) {
    this.views = views;
    this.rows = make("div", { className: "plots" });
    this.none = make("p", { textContent: "Plot a metric in each run to compare it." });
    this.element = make(
      "section",
      { className: "differences", "aria-label": "differences" },
      make("h2", { textContent: "B − A" }),
      this.none,
      this.rows,
    );
    this.draw = paced(() => this.drawNow(), APART);
  }

  // The metrics that both plot, which both draw on the same axes.
  show() {
    const [first, second] = this.views.map((view) => view.charts.plots);
    const shared = [...first.keys()].filter((name) => second.has(name));
    for (const [plots, others] of [[first, second], [second, first]]) {
      for (const [name, plot] of plots) plot.peer = others.get(name) ?? null;
    }
    for (const [name, plot] of this.plots) {
      if (shared.includes(name)) continue;
      this.views[0].charts.closer.leave(plot);
      plot.element.remove();
      this.plots.delete(name);
    }
    for (const name of shared) {
      if (!this.plots.has(name)) this.add(name, first.get(name));
    }
    this.none.hidden = shared.length > 0;
    this.draw();
  }

  /** @param {string} name @param {Plot | undefined} like */
  add(name, like) {
    if (!like) return;
    const text = `${spaced(name)} of B less that of A`;
    const metric = { ...like.metric, text, published: [] };
    const remove = () => this.remove(name);
    const { acts, closer } = this.views[0].charts;
    const plot = new Plot(metric, new Series(), { settings: {}, exact: true }, {
      ...acts,
      read: (step) => this.read(step),
      remove,
      enlarge: (one) => closer.show(one, `${name}-B-less-A`),
    });
    this.plots.set(name, plot);
    this.rows.append(plot.element);
  }

  /** @param {number | null} step */
  read(step) {
    for (const plot of this.plots.values()) plot.cursor = step;
    this.draw();
  }

  /** @param {string} name */
  remove(name) {
    for (const { charts } of this.views) {
      charts.choose((charts.state?.plots ?? []).filter((one) => one !== name));
    }
  }

  drawNow() {
    const [first, second] = this.views;
    for (const [name, plot] of this.plots) {
      const pair = [first, second].map(({ charts }) => charts.seriesOf(name));
      plot.series = difference(pair[0], pair[1]);
      plot.draw(first.shown, first.stage.colours);
    }
  }

  leave() {
    for (const { charts } of this.views) {
      for (const plot of charts.plots.values()) plot.peer = null;
    }
    this.plots.clear();
  }
}
