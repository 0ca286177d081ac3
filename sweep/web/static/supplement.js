// A study as a page that opens from disk: its figure, and behind every mark recorded
// runs. A click plays the run of a mark; a drag across the figure leafs through the
// runs at the same step. An address that ends in ?embed shows figure and run alone.

import { Changes } from "./changed.js";
import { button, make, short, unitText } from "./dom.js";
import { download } from "./files.js";
import { Computer } from "./computed.js";
import { LivingCells } from "./living.js";
import { Player } from "./player.js";
import { estimated, Plotted } from "./plotted.js";

/** @import { Changed } from "./changed.js" */
/** @import { Recording, State } from "./protocol.d.ts" */
/**
 * @import {
 *   SupplementData,
 *   SupplementFront,
 *   SupplementRun,
 * } from "./supplement.d.ts"
 */

const VERIFIED =
  "Run again for this page: every number equals the stored one, bit for" +
  " bit.";
const COMPUTED = "Computed in this browser. Equal to the stored values at the last" +
  " frame, bit for bit: ";
const DIFFERS =
  "Computed in this browser. Different from the stored values at the last" +
  " frame: some of ";
const CANNOT = "This browser cannot compute a trial:";
const MOST_FRAMES = 64 * 2 ** 20; // bytes of computed frames that the page keeps
// In the address, after its #.
const TRIAL = "trial";
const SWARMS = "swarms";
const SECONDS = 12; // that a run takes on the page, about
const SPEEDS = [1, 5, 15, 30, 60, 120, 300, 1000];
const HATCHED = "Hatched: the confidence interval is wider than all steps to adjacent" +
  " cells.";
const WAYS = "Click a point to play its run. Drag across the figure, or use the arrow" +
  " keys, to see other runs at the same step; Enter plays.";

const named = () => new URLSearchParams(location.hash.slice(1));

/** @param {string} text */
const paragraph = (text, className = "") => make("p", { textContent: text, className });

class Supplement {
  place = 0; // of the chosen point
  /** @type {SupplementRun | null} */
  run = null; // the one on the stage

  /** @param {HTMLElement} root @param {SupplementData} data */
  constructor(root, data) {
    this.root = root;
    this.data = data;
    this.role = data.role; // of the trials that are shown
    const { computation } = data;
    this.computer = computation.modules.length ? new Computer(computation) : null;
    this.kept = 0; // bytes of computed frames
    this.changes = new Changes((changed) => this.change(changed));
    this.plotted = new Plotted(data, (place, clicked) => this.choose(place, clicked));
    this.reading = make("p", { className: "told", role: "status" });
    this.roles = make("div", {
      className: "roles row",
      role: "group",
      "aria-label": "which trial of the point",
    });
    this.again = make("pre", { tabIndex: 0 });
    const room = make("div", { className: "room" });
    const figure = make(
      "figure",
      { className: "chart" },
      this.legend(),
      this.plotted.element,
      this.reading,
      this.roles,
      make(
        "figcaption",
        {},
        paragraph(data.figure.note),
        ...(data.figure.form === "cells" ? [paragraph(HATCHED)] : []),
        paragraph(WAYS, "ways"),
      ),
      this.checks(),
      this.changes.element,
    );
    const stand = make("div", { className: "stand" }, figure, room);
    root.append(stand);
    this.living = data.figure.form === "cells" ? this.enliven(stand) : null;
    this.player = new Player(root, room);
    this.lacking = make("p", { className: "lacking", hidden: true });
    this.player.canvas.after(this.lacking);
    this.table = new Numbers(data, (place) => this.choose(place, true));
    root.prepend(above(data.front));
    root.append(this.table.element, ...this.below());
    document.addEventListener("keydown", (event) => this.player.key(event));
    this.choose(this.first(), false);
    this.print();
  }

  /** @param {HTMLElement} stand */
  enliven(stand) {
    const living = new LivingCells(stand, this.data, this.plotted, {
      runOf: (place) => this.runOf(place),
      switched: () => {
        this.name();
        if (this.computer && this.living?.wanted) this.verify();
      },
    });
    living.input.checked = named().has(SWARMS);
    this.plotted.element.before(living.element);
    return living;
  }

  legend() {
    const { by } = this.data.figure;
    if (!by) return make("span", { hidden: true });
    const entries = by.values.map((value, i) =>
      make("li", { className: `colour-${i % 7}`, textContent: value })
    );
    const name = make("span", { textContent: by.label });
    return make("div", { className: "key" }, name, make("ul", {}, ...entries));
  }

  // The point with which the page begins: the one whose run the address names.
  first() {
    const { points, runs } = this.data;
    const first = runs.findIndex(({ trial }) => trial === named().get(TRIAL));
    const place = points.findIndex((point) => point.runs.includes(first));
    if (place < 0) return points.findIndex((point) => point.runs.length > 0);
    const { roles } = runs[first];
    if (!roles.includes(this.role)) this.role = roles[0];
    return place;
  }

  // Shows the run of a point at the step that was on the screen. A click plays it, from
  // its beginning where it was at its end.
  /** @param {number} place @param {boolean} clicked */
  choose(place, clicked) {
    this.place = place;
    this.plotted.show(place);
    this.table.show(place);
    const run = this.runOf(place);
    this.tell(run);
    const { why } = this.data.points[place];
    const ready = run !== null && run.steps.length > 0;
    this.lacking.hidden = ready;
    this.lacking.textContent = run ? "Computing …" : why;
    if (ready) this.load(run);
    else this.player.obey({ type: "pause" });
    if (ready && clicked) this.player.obey({ type: "run" });
    if (run && !ready) this.prepare(run, clicked);
  }

  // Computes the run of the chosen point, and shows it unless a reader has gone on.
  /** @param {SupplementRun} run @param {boolean} clicked */
  async prepare(run, clicked) {
    try {
      await this.compute(run, true);
    } catch (error) {
      if (this.runOf(this.place) !== run) return;
      this.lacking.textContent = `${CANNOT} ${error}`;
      return;
    }
    if (this.runOf(this.place) === run) this.choose(this.place, clicked);
  }

  // Computes the trial that is shown with other settings, or shows it as it is stored.
  /** @param {Changed} changed */
  async change(changed) {
    const { changes, computer, player, run } = this;
    if (!computer || !run?.start) return;
    const { words } = changes;
    // Until another trial or another value is chosen.
    const wanted = () => this.run === run && changes.values === changed;
    const order = { ...this.order(run), changed, wanted };
    const computed = await computer.run(run.start, order).catch((error) => {
      this.fail(error);
      return null;
    });
    if (!computed || !wanted()) return;
    const { frames, resting, steps, values } = computed;
    const senses = { ...run.senses, resting };
    player.play(
      this.recording({ ...run, altered: words, frames, senses, steps, values }),
    );
    player.obey({ type: "run" });
  }

  // Computes a run; its frames stay where they are to be shown.
  /** @param {SupplementRun} run @param {boolean} keep */
  async compute(run, keep) {
    const { computer } = this;
    if (!computer || !run.start || run.steps.length) return;
    const computed = await computer.run(run.start, this.order(run));
    if (!computed || run.steps.length) return;
    run.same = computed.same;
    this.count();
    if (!keep) return;
    const { frames, resting, steps, values } = computed;
    this.kept += frames.length;
    Object.assign(run, { frames, steps, values });
    run.senses = { ...run.senses, resting };
  }

  /** @param {SupplementRun} run */
  order(run) {
    const { figure: { metric }, scenes } = this.data;
    const { width, height } = scenes[run.scene];
    const size = /** @type {[number, number]} */ ([width, height]);
    return { every: run.every, size, metric: metric.name };
  }

  // Says how many of the trials this browser has verified, and has a button for all.
  checks() {
    this.verified = make("span", { role: "status" });
    const all = () => this.verify();
    const words = "Verify all trials";
    this.verifier = make("button", { type: "button", on: { click: all } }, words);
    const row = make("div", { className: "verified row", hidden: !this.computer });
    row.append(this.verified, this.verifier);
    this.count();
    return row;
  }

  count() {
    const { data: { runs }, verified } = this;
    const done = runs.filter(({ same }) => same !== undefined);
    const same = done.filter((run) => run.same).length;
    const different = done.length - same;
    const words = `Verified in this browser, bit for bit: ${same} of ${runs.length} ` +
      (runs.length === 1 ? "trial." : "trials.");
    if (verified) {
      verified.textContent = different ? `${words} Different: ${different}.` : words;
    }
    if (this.verifier) this.verifier.hidden = done.length === runs.length;
  }

  // The metrics that the page computes, in words.
  /** @param {SupplementRun} run */
  compared({ start }) {
    const module = start && this.data.computation.modules[start.module];
    return module?.metrics.map((name) => name.replaceAll("_", " ")).join(", ") ?? "";
  }

  // Computes all trials, those that cells show first.
  async verify() {
    const { data: { runs }, verifier } = this;
    if (!verifier || verifier.disabled) return;
    verifier.disabled = true;
    try {
      await this.computeShown();
      this.living?.settle();
      for (const run of runs) {
        if (run.same === undefined) await this.compute(run, false);
      }
      // Another trial of the cells may have been picked meanwhile.
      await this.computeShown();
    } catch (error) {
      this.fail(error);
    }
    verifier.disabled = false;
    this.living?.settle();
  }

  async computeShown() {
    for (const place of this.data.points.keys()) {
      const run = this.runOf(place);
      if (run) await this.compute(run, this.kept < MOST_FRAMES);
    }
  }

  /** @param {unknown} error */
  fail(error) {
    if (this.verified) this.verified.textContent = `${CANNOT} ${error}`;
  }

  /** @param {number} place */
  runsOf(place) {
    const { points, runs } = this.data;
    return points[place].runs.map((one) => runs[one]);
  }

  // The run of a point that has the chosen role, or another one.
  /** @param {number} place */
  runOf(place) {
    const runs = this.runsOf(place);
    return runs.find(({ roles }) => roles.includes(this.role)) ?? runs[0] ?? null;
  }

  /** @param {SupplementRun | null} shown */
  tell(shown) {
    const { figure, points, rows } = this.data;
    const own = this.runsOf(this.place);
    const row = rows[this.place];
    const count = row[`${figure.column}_n`];
    this.reading.textContent = `${points[this.place].words}: ${
      estimated(row, figure)
    }, ${count === 1 ? "1 trial" : `${count} trials`}.`;
    this.roles.hidden = own.length < 2;
    this.roles.replaceChildren(
      ...own.map((run) => {
        const pick = () => this.pick(run.roles[0]);
        const words = run.roles.join(" and ");
        const one = make("button", { type: "button", on: { click: pick } }, words);
        one.setAttribute("aria-pressed", String(run === shown));
        return one;
      }),
    );
  }

  /** @param {string} role */
  pick(role) {
    this.role = role;
    if (this.computer && this.living?.wanted) this.verify();
    else this.living?.settle();
    this.choose(this.place, true);
  }

  /** @param {SupplementRun} run */
  load(run) {
    if (run === this.run) return;
    const { player } = this;
    const { step } = player;
    const going = player.run?.state.running ?? false;
    // Not before a choice: the address of a page that was opened stays as it is.
    const opened = this.run === null;
    this.run = run;
    this.changes.offer(run.start?.changes ?? []);
    if (!opened) this.name();
    player.play(this.recording(run));
    player.obey({ type: "seek", frame: step });
    if (going) player.obey({ type: "run" });
    const { front, study } = this.data;
    const last = `sweep view ${study} ${run.trial}`;
    this.again.textContent = [...front.run.slice(0, -1), last].join("\n");
  }

  // The address has the run that is shown, and whether a reader wants swarms.
  name() {
    const address = new URLSearchParams();
    if (this.run) address.set(TRIAL, this.run.trial);
    if (this.living?.wanted) address.set(SWARMS, "on");
    history.replaceState(null, "", `#${address}`);
  }

  /** @param {SupplementRun} run @returns {Recording} */
  recording(run) {
    const { figure, scenes, spec } = this.data;
    const { metric } = figure;
    return {
      groups: [],
      metrics: [{ ...metric, unit: unitText(metric.unit), source: "", published: [] }],
      state: this.state(run),
      scene: scenes[run.scene],
      senses: run.senses,
      spec,
      steps: run.steps,
      values: { [metric.name]: run.values },
      about: {},
      frames: run.frames,
    };
  }

  /** @param {SupplementRun} run @returns {State} */
  state(run) {
    const { figure: { metric }, points, study } = this.data;
    const { steps, values, stored, every, roles, replicate } = run;
    const last = steps[steps.length - 1];
    const replayed = values[values.length - 1];
    const known = stored !== null && replayed !== null;
    const among = `the ${roles.join(" and ")} of its trials, replicate ${replicate}`;
    const which = `${points[this.place].words}, ${among}`;
    const recorded = every > 1 ? `A frame is kept every ${every} steps.` : "";
    const { altered, same = true } = run;
    const equal = `${same ? COMPUTED : DIFFERS}${this.compared(run)}.`;
    const other = `Computed in this browser with ${altered}: not a stored trial.`;
    const computed = altered ? other : equal;
    return {
      type: "state",
      run: 0,
      model: "",
      preset: "",
      settings: {},
      changed: [],
      shapes: null,
      seed: 0,
      running: false,
      speed: SPEEDS.find((speed) => speed * SECONDS >= last) ?? 1000,
      step: 0,
      steps: last,
      past: [steps[0], last],
      undo: "",
      redo: "",
      exact: true,
      note: "",
      sweeps: {},
      follows: {},
      selected: null,
      overlays: [],
      plots: [metric.name],
      trial: null,
      files: {},
      replay: {
        study,
        trial: run.trial,
        which,
        frames: [steps[0], last, 1],
        equal: same && !altered,
        words: [run.start ? computed : VERIFIED, recorded, ...run.notes]
          .filter(Boolean).join(" "),
        metrics: known ? { [metric.name]: { stored, replayed } } : {},
        // The card of a trial that was computed has the title of a replay.
        recorded: run.start ? undefined : true,
      },
    };
  }

  // What stands below the numbers.
  below() {
    const { front, spec } = this.data;
    const copy = () => navigator.clipboard.writeText(this.again.textContent ?? "");
    const save = button(
      "save",
      "Save as spec.yaml",
      () => download("spec.yaml", "text/yaml", spec),
      "Save as spec.yaml",
    );
    const lines = make("ul", {}, ...front.cite.map((one) => make("li", {}, one)));
    const origin = front.origin.flatMap(([name, words]) => [
      make("dt", { textContent: name }),
      make("dd", { textContent: words }),
    ]);
    return [
      make(
        "section",
        { className: "about" },
        make("h2", { textContent: "Run it yourself" }),
        this.again,
        make("div", { className: "row" }, button("copy", "Copy", copy, "Copy"), save),
        paragraph(front.needs),
        make(
          "details",
          {},
          make("summary", { textContent: "spec.yaml" }),
          make("pre", { textContent: spec, tabIndex: 0 }),
        ),
      ),
      make(
        "footer",
        { className: "about" },
        make("h2", { textContent: "How to cite" }),
        lines,
        make("h2", { textContent: "Licence" }),
        paragraph(`Of these data: ${front.licence}.`),
        make("h2", { textContent: "Origin" }),
        make("dl", {}, ...origin),
      ),
    ];
  }

  // On paper colours are those of a light page, and everything is open.
  print() {
    const { player, root } = this;
    /** @param {string} scheme */
    const dress = (scheme) => {
      root.style.colorScheme = scheme;
      player.stage.readColours();
      player.stage.draw();
      player.charts.draw(player.step);
    };
    addEventListener("beforeprint", () => {
      dress("light");
      for (const one of root.querySelectorAll("details")) one.open = true;
    });
    addEventListener("afterprint", () => dress(""));
  }
}

/** @param {SupplementFront} front */
function above({ title, authors, doi, caption }) {
  const head = make("header", {}, make("h1", { textContent: title }));
  if (authors.length) head.append(paragraph(authors.join(", "), "authors"));
  if (doi) {
    const href = `https://doi.org/${doi}`;
    const link = make("a", { href, textContent: href, rel: "noreferrer" });
    head.append(make("p", {}, link));
  }
  if (caption) head.append(paragraph(caption, "caption"));
  return head;
}

// The table of the means: the very numbers of `sweep table --json`.
class Numbers {
  /** @param {SupplementData} data @param {(place: number) => void} play */
  constructor(data, play) {
    const { figure: { column, label }, headings, points, rows } = data;
    const names = [column, `${column}_low`, `${column}_high`, `${column}_n`];
    const words = [label, "95 % low", "95 % high", "trials with a value", "not done"];
    const columns = [...headings, ...names, "not_done"];
    const head = [...headings.map((name) => name.replaceAll("_", " ")), ...words];
    this.rows = rows.map((row, place) => {
      const act = () => play(place);
      const can = points[place].runs.length > 0;
      const first = can
        ? button("play", `Play ${points[place].words}`, act, "", { className: "quiet" })
        : "";
      const cells = columns.map((name) =>
        make("td", { textContent: short(row[name], 6), title: String(row[name] ?? "") })
      );
      return make("tr", {}, make("td", {}, first), ...cells);
    });
    const titles = ["", ...head].map((textContent) =>
      textContent
        ? make("th", { scope: "col", textContent })
        : make("td", { "aria-hidden": "true" })
    );
    this.element = make(
      "details",
      { className: "means", open: true },
      make("summary", { textContent: "The numbers" }),
      make(
        "div",
        { className: "scrolls", tabIndex: 0, role: "region", "aria-label": "numbers" },
        make(
          "table",
          {},
          make("thead", {}, make("tr", {}, ...titles)),
          make("tbody", {}, ...this.rows),
        ),
      ),
    );
    this.shown = 0;
  }

  /** @param {number} place */
  show(place) {
    this.rows[this.shown].removeAttribute("aria-current");
    this.rows[place].setAttribute("aria-current", "true");
    this.shown = place;
  }
}

const main = document.querySelector("main");
const content = document.getElementById("data")?.textContent;
if (main && content) {
  const embedded = new URLSearchParams(location.search).has("embed");
  const root = make("div", { className: "boidsweep supplement" });
  root.classList.toggle("embedded", embedded);
  main.append(root);
  window.supplement = new Supplement(root, JSON.parse(content));
}
