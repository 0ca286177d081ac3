// The whole view: built once in an element, then kept like what the other side of a
// transport says.

import {
  asNumber,
  button,
  make,
  randomName,
  short,
  spaced,
  unitText,
  write,
} from "./dom.js";
import { Stage } from "./stage.js";
import { Hand } from "./pointer.js";
import { Plot, Series } from "./plots.js";
import { Field, Tip } from "./fields.js";
import { Keys } from "./keys.js";
import { Pickers, ReplayCard } from "./pickers.js";
import { RunBar } from "./run.js";
import { BoidCard, ObstacleList, Overlays } from "./lists.js";
import {
  bytesOf,
  download,
  keysDialog,
  Menu,
  MetricsDialog,
  SpecDialog,
} from "./dialogs.js";

/** @import { Frame } from "./frames.js" */
/** @import { Tool } from "./pointer.js" */
/**
 * @import {
 *   Controls,
 *   File,
 *   Group,
 *   Heard,
 *   Message,
 *   Metrics,
 *   Refusal,
 *   Scene,
 *   Selection,
 *   Setting,
 *   Spec,
 *   State,
 *   Transport,
 * } from "./protocol.d.ts"
 */
/** @import { Fit } from "./stage.js" */

/** @typedef {{ page?: string, shortcuts?: Document | HTMLElement }} Options */

/** @type {[tool: Tool, key: string, words: string][]} */
const TOOLS = [
  ["select", "V", "Select and move"],
  ["disc", "D", "Draw a disc"],
  ["rectangle", "B", "Draw a box"],
  ["goal", "G", "Set the goal"],
];
const FILES = [
  ["png", "PNG", "this frame as pixels"],
  ["svg", "SVG", "this frame as lines"],
  ["gif", "GIF", "the run so far, plays anywhere"],
  ["mp4", "MP4", "the run so far, as a film"],
  ["html", "HTML", "the run so far, to open from disk"],
];
const [SAID_FOR, WRONG_FOR] = [6000, 15000]; // ms
const OPEN = ["schedule", "parameters"];
/** @type {Setting} */
const SEED = {
  name: "seed",
  kind: "int",
  text: "the same seed gives the same run",
  unit: "",
  allowed: "",
  low: 0,
  high: null,
  slider: null,
  logarithmic: false,
  rule: "",
  choices: [],
  default: null,
};
let mounts = 0;

export class View {
  prefix = `boidsweep-${++mounts}`;
  counts = { asked: 0, drawn: 0, received: 0, since: performance.now() };
  plotted = 0; // when they were drawn
  saying = 0;
  pointed = false;
  /** @type {Controls | null} */
  controls = null;
  known = ""; // the controls that are shown
  /** @type {State | null} */
  state = null;
  /** @type {string[]} */
  rules = [];
  /** @type {string | null} */
  asked = null; // the id of the latest message
  /** @type {Message | null} */
  asking = null; // that message
  /** @type {string | undefined} */
  refused; // the id of the latest one that was refused

  /** @type {Map<string, Plot>} */
  plots = new Map();
  /** @type {Map<string, Series>} */
  series = new Map();
  /** @type {Map<string, Field>} */
  fields = new Map();
  /** @type {Field[]} */
  weights = [];
  /** @type {{ names: string[], count: HTMLElement }[]} */
  grouped = [];
  opened = new Map(OPEN.map((name) => [name, true]));

  root = make("div", {
    className: "boidsweep",
    on: { pointerdown: () => (this.pointed = true) },
  });
  canvas = make("canvas", {
    tabIndex: 0,
    role: "application",
    "aria-label": "the swarm",
  });
  banner = make("p", { className: "banner", role: "alert", hidden: true });
  hint = make("p", { className: "hint", role: "status", hidden: true });
  exact = make("span", { className: "exact", role: "status" });
  words = make("span", { className: "words" });
  rates = make("span", { className: "rates" });
  chart = make("div", { className: "plots" });
  groups = make("div");
  tools = new Map(
    TOOLS.map(([tool, key, words]) => [tool, this.tool(tool, key, words)]),
  );
  toolbar = make(
    "div",
    { className: "tools", role: "toolbar", "aria-label": "tools" },
    ...this.tools.values(),
  );
  follow = button(
    "flock",
    "Follow the boids",
    () => this.fit(this.stage.fit === "boids" ? "world" : "boids"),
    "",
    { "aria-pressed": "false" },
  );

  /** @param {Message} message */
  send = (message) => this.ask(message);
  pickers = new Pickers(this.prefix, this.send);
  run = new RunBar(this.send);
  files = new Menu(
    "Export",
    "save",
    FILES.map(([kind, name, hint]) => [name, hint, () => this.export(kind)]),
  );
  record = new ReplayCard();

  /** @param {Element} element @param {Transport} transport @param {Options} options */
  constructor(element, transport, { page, shortcuts }) {
    this.transport = transport;
    this.page = page ?? randomName();
    const picture = make(
      "section",
      { className: "picture", "aria-label": "picture" },
      this.canvas,
    );
    const left = make("aside", {
      className: "watch",
      "aria-label": "overlays and metrics",
    });
    const right = make("aside", { className: "settings", "aria-label": "settings" });
    const status = make(
      "footer",
      { className: "status" },
      this.exact,
      this.words,
      this.rates,
    );
    this.root.append(
      make(
        "div",
        { className: "layout" },
        this.top(),
        picture,
        this.run.element,
        right,
        left,
        status,
      ),
    );
    element.append(this.root); // without a document there are no colours to draw with
    this.stage = new Stage(
      this.canvas,
      (frame) => this.taken(frame),
      () => this.state && this.redrawPlots(),
    );
    this.hand = new Hand(this.stage, this.send, () => this.showHand());
    picture.append(this.toolbar, this.views(), this.banner, this.hint);
    this.overlays = new Overlays(this.stage, () => this.overlaid());
    this.boid = new BoidCard(this.send, this.stage);
    left.append(this.overlays.element, this.boid.element, this.metrics());
    this.list = new ObstacleList(this.hand);
    right.append(this.record.element, this.groups, this.list.element);
    this.spec = new SpecDialog(this.root);
    this.help = keysDialog(this.root);
    this.choice = new MetricsDialog(this.root, (names) => this.choosePlots(names));
    this.tip = new Tip(this.root, status);
    this.keys = new Keys(this, shortcuts ?? this.root);
    this.timer = setInterval(() => this.tick(), 500);
    this.listen();
  }

  listen() {
    const { transport } = this;
    transport.onmessage = (heard) => this.receive(heard);
    transport.onopen = () => this.opening();
    transport.onclose = (words) => this.lost(words);
    transport.onend = (words) => this.end(words);
    if (transport.start) transport.start();
    else this.opening();
  }

  unmount() {
    clearInterval(this.timer);
    this.keys.stop();
    this.stage.stop();
    this.transport.close();
    this.root.remove();
  }

  top() {
    const brand = make(
      "div",
      { className: "brand" },
      make("i", { "aria-hidden": "true" }),
      make("span", { textContent: "boidsweep" }),
    );
    const copy = button(
      "copy",
      "Copy as spec",
      () => this.send({ type: "spec" }),
      "Copy as spec",
      { className: "primary" },
    );
    const help = button("keys", "Keys", () => this.help.showModal(), "Keys");
    const actions = make("div", { className: "row" }, copy, this.files.element, help);
    return make("header", { className: "top" }, brand, this.pickers.element, actions);
  }

  /** @param {Tool} tool @param {string} key @param {string} words */
  tool(tool, key, words) {
    const one = button(tool, `${words} (${key})`, () => this.hand.use(tool), "", {
      "aria-pressed": "false",
    });
    one.dataset.tool = tool;
    return one;
  }

  views() {
    const world = button("world", "Show the whole world (F)", () => this.fit("world"));
    return make(
      "div",
      { className: "tools right", role: "toolbar", "aria-label": "view" },
      world,
      this.follow,
    );
  }

  metrics() {
    const choose = button("chart", "Choose metrics", () => this.choose(), "choose", {
      className: "quiet",
    });
    const heading = make("h2", { textContent: "Metrics" });
    return make(
      "section",
      { "aria-label": "metrics" },
      make("div", { className: "row" }, heading, choose),
      this.chart,
    );
  }

  opening() {
    this.banner.hidden = true;
    this.asked = null;
    this.transport.send({ type: "hello", page: this.page });
  }

  // Until the answer comes, states are older than what the controls show.
  /** @param {Message} message */
  ask(message) {
    this.asked = `${this.page} ${++this.counts.asked}`;
    this.asking = message;
    this.transport.send({ ...message, id: this.asked });
  }

  /** @param {string} words */
  lost(words) {
    this.banner.textContent = words;
    this.banner.hidden = false;
  }

  // For good: what is seen stays to be looked at, and nothing acts any more.
  /** @param {string} words */
  end(words) {
    this.lost(words);
    this.keys.stop();
    for (const part of this.root.querySelectorAll(".top, .run, aside")) {
      part.toggleAttribute("inert", true);
    }
    this.hand.frozen = true;
    if (!this.state) return;
    this.state.running = false;
    this.showRun(this.state);
    this.showHand();
  }

  /** @param {Heard} heard */
  receive(heard) {
    if (heard instanceof ArrayBuffer || heard instanceof DataView) {
      this.counts.received++;
      return this.stage.take(heard);
    }
    switch (heard.type) {
      case "controls":
        return this.showControls(heard);
      case "state":
        return this.showState(heard);
      case "scene":
        return this.showScene(heard);
      case "metrics":
        return this.plot(heard);
      case "selection":
        return this.showSelection(heard);
      case "rules":
        this.rules = heard.names;
        return;
      case "spec":
        return this.showSpec(heard);
      case "file":
        return this.save(heard);
      case "error":
        return this.refuse(heard);
      case "info":
        return this.say(heard.message);
    }
  }

  /** @param {Frame} frame */
  taken(frame) {
    this.counts.drawn++;
    this.transport.send({ type: "ready" });
    if (!this.state) return;
    this.run.showStep(frame.step);
    this.redrawPlots();
  }

  /** @param {Controls} controls */
  showControls(controls) {
    this.say("");
    this.banner.hidden = true;
    const known = JSON.stringify(controls);
    if (known === this.known) return;
    this.known = known;
    this.controls = controls;
    this.overlays.offer(["trails", ...controls.overlays]);
    for (const plot of this.plots.values()) plot.element.remove();
    this.plots.clear();
    this.fields.clear();
    this.weights = [];
    this.grouped = [];
    const schedule = controls.groups.filter(({ name }) => name === "schedule");
    const others = controls.groups.filter(({ name }) => name !== "schedule");
    const groups = [...schedule, ...others].map((group) => this.group(group));
    this.groups.replaceChildren(...groups);
    this.pickers.forget();
  }

  /** @param {Group} group */
  group({ name, fields }) {
    const shown = fields.filter((field) => field.name !== "map");
    const about = name === "schedule" ? [...shown, SEED] : shown;
    const rows = about.map((field) => {
      const row = new Field(field, this.prefix, this.send, this.tip);
      this.fields.set(field.name, row);
      if (field.rule && row.slide) this.weights.push(row);
      return row.element;
    });
    const count = make("span", { className: "count" });
    this.grouped.push({ names: about.map((field) => field.name), count });
    const heading = make("span", { textContent: spaced(name) });
    const group = make(
      "details",
      { className: "group", open: this.opened.get(name) ?? false },
      make("summary", {}, heading, count),
      ...rows,
    );
    group.addEventListener("toggle", () => this.opened.set(name, group.open));
    group.dataset.group = name;
    return group;
  }

  /** @param {State} state */
  showState(state) {
    if (state.answers === this.asked) this.asked = null;
    if (this.asked || !this.controls) return;
    if (state.answers !== this.refused) {
      for (const field of this.fields.values()) field.accept();
    }
    this.state = state;
    this.pickers.show(this.controls, state);
    this.showFields(state);
    this.showPlots(this.controls, state);
    this.showRun(state);
    this.choice.follow(state.plots);
    const own = this.stage.overlays.has("trails") ? ["trails"] : [];
    this.overlays.show([...state.overlays, ...own]);
    this.stage.overlays = new Set(this.overlays.chosen);
    this.boid.chosen = state.selected;
    if (state.selected === null) this.showSelection({ type: "selection", boid: null });
    this.hand.frozen = Boolean(state.replay);
    this.record.show(state.replay);
    this.files.element.hidden = Boolean(state.replay?.recorded);
    this.root.classList.toggle("replays", Boolean(state.replay));
    this.showHand();
    this.stage.redraw();
  }

  /** @param {State} state */
  showFields({ settings, changed, seed, sweeps, replay }) {
    for (const [name, field] of this.fields) {
      const value = name === "seed" ? seed : settings[name];
      field.update(value, changed.includes(name), sweeps[name]);
      field.freeze(Boolean(replay));
    }
    for (const { names, count } of this.grouped) {
      const own = names.filter((name) => changed.includes(name)).length;
      write(count, own ? `${own} changed` : "");
    }
    for (const plot of this.plots.values()) plot.publish(settings);
  }

  /** @param {State} state */
  showRun(state) {
    const { exact, note, sweeps } = state;
    const count = Object.keys(sweeps).length;
    const settings = count === 1 ? "1 setting" : `${count} settings`;
    const swept = count ? ` · the spec sweeps ${settings}` : "";
    const words = exact ? "exact: the spec gives these very frames" : note;
    write(this.exact, words + swept);
    this.exact.classList.toggle("not", !exact);
    this.run.show(state, this.shown);
    this.redrawPlots();
  }

  // The step of the frame on the screen.
  get shown() {
    return this.stage.frame?.step ?? this.state?.step ?? 0;
  }

  redrawPlots() {
    const now = performance.now();
    if (now - this.plotted < 60 && this.state?.running) return;
    this.plotted = now;
    for (const plot of this.plots.values()) plot.draw(this.shown, this.stage.colours);
  }

  /** @param {Controls} controls @param {State} state */
  showPlots(controls, { plots, settings }) {
    for (const [name, plot] of this.plots) {
      if (plots.includes(name)) continue;
      plot.element.remove();
      this.plots.delete(name);
    }
    const shown = plots.map((name) => {
      const known = controls.metrics.find((one) => one.name === name);
      const metric = known ?? { name, text: "", unit: "", published: [] };
      const remove = () => this.choosePlots(without(this.state?.plots ?? [], name));
      const plot = this.plots.get(name) ??
        new Plot(metric, this.seriesOf(name), settings, remove);
      this.plots.set(name, plot);
      return plot.element;
    });
    if (shown.some((one, i) => one !== this.chart.children[i])) {
      this.chart.append(...shown);
    }
  }

  choose() {
    if (!this.controls || !this.state) return;
    this.choice.show(this.controls.metrics, this.state.plots);
  }

  /** @param {string[]} names */
  choosePlots(names) {
    if (this.state) this.state.plots = names;
    this.send({ type: "metrics", names });
  }

  /** @param {string} name */
  seriesOf(name) {
    const series = this.series.get(name) ?? new Series();
    this.series.set(name, series);
    return series;
  }

  /** @param {Metrics} metrics */
  plot({ steps, values, reset }) {
    if (reset) {
      for (const series of this.series.values()) series.clear();
    }
    for (const [name, row] of Object.entries(values)) {
      this.seriesOf(name).add(steps, row);
    }
    if (this.state) this.redrawPlots();
  }

  /** @param {Scene} scene */
  showScene(scene) {
    this.stage.setScene(scene);
    this.hand.settle(scene);
    const goal = this.tools.get("goal");
    if (goal) goal.hidden = !scene.goal;
    const size = `${short(scene.width)} by ${short(scene.height)} ${scene.length}`;
    this.canvas.setAttribute(
      "aria-label",
      `the swarm in a world of ${size}, with ${scene.obstacles.length} obstacles`,
    );
    this.showHand();
  }

  /** @param {Selection} selection */
  showSelection(selection) {
    const { stage } = this;
    stage.selection = selection.boid === null
      ? null
      : { ...selection, range: asNumber(selection.range) };
    this.boid.show(stage.selection, stage.scene?.length);
    stage.redraw();
  }

  /** @param {Spec} message */
  showSpec(message) {
    this.spec.show(message, Object.keys(this.state?.sweeps ?? {}).length > 0);
  }

  /** @param {File} file */
  save({ name, mime, data }) {
    this.say(`${name} is ready`);
    download(name, mime, bytesOf(data));
  }

  /** @param {Refusal} refusal */
  refuse({ message, answers }) {
    this.say(message, true);
    this.hand.refuse();
    this.pickers.forget();
    this.refused = answers;
    if (!answers || answers !== this.asked || !this.asking) return;
    if ("name" in this.asking) this.fields.get(this.asking.name)?.refuse();
  }

  /** @param {string} words */
  say(words, wrong = false) {
    this.words.textContent = words;
    this.words.classList.toggle("wrong", wrong);
    this.words.setAttribute("role", wrong ? "alert" : "status");
    clearTimeout(this.saying);
    this.saying = setTimeout(
      () => (this.words.textContent = ""),
      wrong ? WRONG_FOR : SAID_FOR,
    );
  }

  /** @param {string} kind */
  export(kind) {
    this.say(`making ${kind} ...`);
    this.send({ type: "export", kind });
  }

  overlaid() {
    this.stage.overlays = new Set(this.overlays.chosen);
    this.send({ type: "overlays", names: without(this.overlays.chosen, "trails") });
    this.stage.redraw();
  }

  showHand() {
    if (!this.state) return;
    this.toolbar.hidden = this.hand.frozen;
    for (const [tool, one] of this.tools) {
      one.setAttribute("aria-pressed", String(tool === this.hand.tool));
    }
    this.follow.setAttribute("aria-pressed", String(this.stage.fit === "boids"));
    if (this.stage.scene) this.list.show();
  }

  /** @param {Fit} how */
  fit(how) {
    this.stage.setFit(how);
    this.showHand();
  }

  tick() {
    const { counts, stage } = this;
    const seconds = (performance.now() - counts.since) / 1000;
    /** @param {number} count */
    const rate = (count) => Math.round(count / seconds);
    const rates = this.state?.running
      ? `${rate(counts.drawn)} frames/s drawn, ${rate(counts.received)} received`
      : "paused";
    write(this.rates, rates);
    Object.assign(counts, { drawn: 0, received: 0, since: performance.now() });
    const { length = "", time = "" } = stage.scene ?? {};
    this.overlays.explain(this.rules, unitText(`${length}/${time}^2`));
  }
}

/** @param {string[]} names @param {string} name */
const without = (names, name) => names.filter((one) => one !== name);

/** @param {Element} element @param {Transport} transport @param {Options} options */
export function mount(element, transport, options = {}) {
  const view = new View(element, transport, options);
  return { unmount: () => view.unmount(), view };
}
