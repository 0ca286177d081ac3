// The metrics that the user has chosen, a plot each, and what has been measured so far.

import { Closer } from "./closer.js";
import { button, make, short } from "./dom.js";
import { MetricsDialog } from "./dialogs.js";
import { Plot, Series } from "./plots.js";

/** @import { Controls, Message, Metric, Metrics, State } from "./protocol.d.ts" */
/** @import { Stage } from "./stage.js" */

const APART = 60; // ms between two drawings of a run

export class Charts {
  /** @type {Map<string, Plot>} */
  plots = new Map();
  // A metric that is chosen again has its earlier values.
  /** @type {Map<string, Series>} */
  series = new Map();
  /** @type {Metric[]} */
  metrics = [];
  /** @type {State | null} */
  state = null;
  drawn = 0; // when
  step = 0; // at which

  /**
   * @param {HTMLElement} root
   * @param {Stage} stage
   * @param {(message: Message) => void} send
   * @param {(use: (name: string) => void) => void} named names a file of this run
   */
  constructor(root, stage, send, named) {
    this.stage = stage;
    this.send = send;
    this.closer = new Closer(root, named);
    this.choice = new MetricsDialog(root, (names) => this.choose(names));
    this.rows = make("div", { className: "plots" });
    this.opener = button("chart", "Choose metrics", () => this.open(), "choose", {
      className: "quiet",
      disabled: true, // until there is a state: a click would do nothing
    });
    const heading = make("h2", { textContent: "Metrics" });
    this.element = make(
      "section",
      { "aria-label": "metrics" },
      make("div", { className: "row" }, heading, this.opener),
      this.rows,
    );
  }

  open() {
    if (this.state) this.choice.show(this.metrics, this.state.plots);
  }

  /** @param {string[]} names */
  choose(names) {
    if (this.state) this.state.plots = names;
    this.send({ type: "metrics", names });
  }

  // Another model has other metrics.
  /** @param {Pick<Controls, "metrics">} controls */
  offer({ metrics }) {
    this.metrics = metrics;
    for (const [name, plot] of this.plots) this.remove(name, plot);
  }

  /** @param {State} state */
  show(state) {
    this.state = state;
    this.opener.disabled = false;
    this.choice.follow(state.plots);
    for (const [name, plot] of this.plots) {
      if (state.plots.includes(name)) plot.publish(state);
      else this.remove(name, plot);
    }
    const shown = state.plots.map((name) => this.plot(name, state).element);
    if (shown.some((one, i) => one !== this.rows.children[i])) {
      this.rows.append(...shown);
    }
  }

  /** @param {string} name @param {Plot} plot */
  remove(name, plot) {
    this.closer.leave(plot);
    plot.element.remove();
    this.plots.delete(name);
  }

  /** @param {string} name @param {State} shown */
  plot(name, shown) {
    const there = this.plots.get(name);
    if (there) return there;
    const known = this.metrics.find((one) => one.name === name);
    const metric = known ?? { name, text: "", unit: "", source: "", published: [] };
    const remove = () =>
      this.choose((this.state?.plots ?? []).filter((one) => one !== name));
    const plot = new Plot(metric, this.seriesOf(name), shown, {
      ...this.acts,
      remove,
      enlarge: (one) => this.closer.show(one),
    });
    this.plots.set(name, plot);
    return plot;
  }

  // What all plots of this run do.
  get acts() {
    return {
      /** @param {number | null} step */
      read: (step) => this.read(step),
      /** @param {number} step */
      seek: (step) => this.send({ type: "seek", frame: step }),
      /** @param {number} step */
      clock: (step) => this.clock(step),
    };
  }

  // One cursor in all plots.
  /** @param {number | null} step */
  read(step) {
    for (const plot of this.plots.values()) plot.cursor = step;
    this.drawNow();
  }

  /** @param {number} step */
  clock(step) {
    const { time = "" } = this.stage.scene ?? {};
    const passed = Number(this.state?.settings.dt ?? 1) * step;
    return time === "step" && passed === step
      ? `step ${step}`
      : `step ${step}, ${short(passed, 6)} ${time}`;
  }

  /** @param {string} name */
  seriesOf(name) {
    const series = this.series.get(name) ?? new Series();
    this.series.set(name, series);
    return series;
  }

  /** @param {Metrics} metrics */
  add({ steps, values, restarts = {}, reset }) {
    if (reset) {
      for (const series of this.series.values()) series.clear();
    }
    for (const [name, row] of Object.entries(values)) {
      const series = this.seriesOf(name);
      series.add(steps, row);
      series.restarts = restarts[name] ?? [];
    }
  }

  // Draws all plots at `step`; those of a run only now and then.
  /** @param {number} step */
  draw(step) {
    const now = performance.now();
    if (now - this.drawn < APART && this.state?.running) return;
    this.drawn = now;
    this.step = step;
    this.drawNow();
  }

  drawNow() {
    for (const plot of this.plots.values()) plot.draw(this.step, this.stage.colours);
  }
}
