// The whole view: built once in an element, then kept like what the other side of a
// transport says.

import { button, make, randomName, short, spaced, unitText, write } from "./dom.js";
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

const TOOLS = {
  select: ["V", "Select and move"],
  disc: ["D", "Draw a disc"],
  rectangle: ["B", "Draw a box"],
  goal: ["G", "Set the goal"],
};
const FILES = [
  ["png", "PNG", "this frame as pixels"],
  ["svg", "SVG", "this frame as lines"],
  ["gif", "GIF", "the run so far, plays anywhere"],
  ["mp4", "MP4", "the run so far, as a film"],
  ["html", "HTML", "the run so far, to open from disk"],
];
const [SAID_FOR, WRONG_FOR] = [6000, 15000]; // ms
const OPEN = ["schedule", "parameters"];
const SEED = {
  name: "seed",
  kind: "int",
  text: "the same seed gives the same run",
  unit: "",
  slider: null,
  low: 0,
};
let mounts = 0;

class View {
  constructor(element, transport, { page, shortcuts }) {
    Object.assign(this, {
      transport,
      page: page ?? randomName(),
      controls: null,
      state: null,
      rules: [],
      plots: new Map(),
      series: new Map(),
    });
    this.prefix = `boidsweep-${++mounts}`;
    this.counts = { asked: 0, drawn: 0, received: 0, since: performance.now() };
    this.fields = new Map();
    this.opened = new Map(OPEN.map((name) => [name, true]));
    this.root = make("div", {
      className: "boidsweep",
      on: { pointerdown: () => (this.pointed = true) },
    });
    element.append(this.root);
    this.send = (message) => this.ask(message);
    this.build();
    this.tip = new Tip(this.root);
    this.keys = new Keys(this, shortcuts ?? this.root);
    this.timer = setInterval(() => this.tick(), 500);
    Object.assign(transport, {
      onmessage: (message) => this.receive(message),
      onopen: () => this.opening(),
      onclose: (words) => this.lost(words),
      onend: (words) => this.end(words),
    });
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

  build() {
    this.pickers = new Pickers(this.prefix, this.send);
    this.run = new RunBar(this.send);
    const act = (picture, words, message) => button(picture, words, message, words);
    this.copy = button(
      "copy",
      "Copy as spec",
      () => this.send({ type: "spec" }),
      "Copy as spec",
      { className: "primary" },
    );
    this.files = new Menu(
      "Export",
      "save",
      FILES.map(([kind, name, hint]) => [name, hint, () => this.export(kind)]),
    );
    const help = act("keys", "Keys", () => this.help.showModal());
    const brand = make(
      "div",
      { className: "brand" },
      make("i", { "aria-hidden": "true" }),
      make("span", { textContent: "boidsweep" }),
    );
    const actions = make(
      "div",
      { className: "row" },
      this.copy,
      this.files.element,
      help,
    );
    this.canvas = make("canvas", {
      tabIndex: 0,
      role: "application",
      "aria-label": "the swarm",
    });
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
    const top = make(
      "header",
      { className: "top" },
      brand,
      this.pickers.element,
      actions,
    );
    this.root.append(
      make(
        "div",
        { className: "layout" },
        top,
        picture,
        this.run.element,
        right,
        left,
        this.buildStatus(),
      ),
    );
    this.stage = new Stage(
      this.canvas,
      (frame) => this.taken(frame),
      () => this.state && this.redrawPlots(),
    );
    this.hand = new Hand(this.stage, this.send, () => this.showHand());
    picture.append(
      this.buildTools(),
      this.buildFit(),
      this.banner = make("p", { className: "banner", role: "alert", hidden: true }),
    );
    picture.append(
      this.hint = make("p", { className: "hint", role: "status", hidden: true }),
    );
    this.buildWatch(left);
    this.buildSettings(right);
    this.spec = new SpecDialog(this.root);
    this.help = keysDialog(this.root);
    this.choice = new MetricsDialog(this.root, (names) => this.choosePlots(names));
  }

  buildTools() {
    const tools = Object.entries(TOOLS).map(([name, [key, words]]) => {
      const one = button(name, `${words} (${key})`, () => this.hand.use(name), "", {
        "aria-pressed": "false",
      });
      one.dataset.tool = name;
      return one;
    });
    this.tools = make("div", {
      className: "tools",
      role: "toolbar",
      "aria-label": "tools",
    }, ...tools);
    return this.tools;
  }

  buildFit() {
    const world = button("world", "Show the whole world (F)", () => this.fit("world"));
    const boids = button(
      "flock",
      "Follow the boids",
      () => this.fit(this.stage.fit === "boids" ? "world" : "boids"),
      "",
      { "aria-pressed": "false" },
    );
    this.follow = boids;
    return make(
      "div",
      { className: "tools right", role: "toolbar", "aria-label": "view" },
      world,
      boids,
    );
  }

  buildStatus() {
    this.exact = make("span", { className: "exact", role: "status" });
    this.rates = make("span", { className: "rates" });
    this.words = make("span", { className: "words" });
    return make("footer", { className: "status" }, this.exact, this.words, this.rates);
  }

  buildWatch(left) {
    this.overlays = new Overlays(this.stage, () => this.overlaid());
    this.boid = new BoidCard(this.send, this.stage);
    const choose = button(
      "chart",
      "Choose metrics",
      () => this.choice.show(this.controls.metrics, this.state.plots),
      "choose",
      { className: "quiet" },
    );
    this.chart = make("div", { className: "plots" });
    const metrics = make(
      "section",
      { "aria-label": "metrics" },
      make("div", { className: "row" }, make("h2", { textContent: "Metrics" }), choose),
      this.chart,
    );
    left.append(this.overlays.element, this.boid.element, metrics);
  }

  buildSettings(right) {
    this.record = new ReplayCard();
    this.groups = make("div");
    this.list = new ObstacleList(this.hand);
    right.append(this.record.element, this.groups, this.list.element);
  }

  opening() {
    this.banner.hidden = true;
    this.asked = null;
    this.transport.send({ type: "hello", page: this.page });
  }

  // Until the answer comes, states are older than what the controls show.
  ask(message) {
    this.asked = `${this.page} ${++this.counts.asked}`;
    this.asking = message;
    this.transport.send({ ...message, id: this.asked });
  }

  lost(words) {
    this.banner.textContent = words;
    this.banner.hidden = false;
  }

  // For good: what is seen stays to be looked at, and nothing acts any more.
  end(words) {
    this.lost(words);
    this.keys.stop();
    for (const part of this.root.querySelectorAll(".top, .run, aside")) {
      part.inert = true;
    }
    this.hand.frozen = true;
    if (!this.state) return;
    this.state.running = false;
    this.showRun();
    this.showHand();
  }

  receive(message) {
    if (message instanceof ArrayBuffer || ArrayBuffer.isView(message)) {
      this.counts.received++;
      this.stage.take(message);
    } else this[`on_${message.type}`]?.(message);
  }

  taken(frame) {
    this.counts.drawn++;
    this.transport.send({ type: "ready" });
    if (!this.state) return;
    this.run.showStep(frame.step);
    this.redrawPlots();
  }

  on_controls(controls) {
    this.say("");
    this.banner.hidden = true;
    const known = JSON.stringify(controls);
    if (known === this.known) return;
    Object.assign(this, { known, controls });
    this.overlays.offer(["trails", ...(controls.overlays ?? [])]);
    for (const plot of this.plots.values()) plot.element.remove();
    this.plots.clear();
    this.fields.clear();
    this.weights = [];
    const groups = controls.groups.map((group) => this.group(group)).sort((a, b) =>
      (b.dataset.first ?? 0) - (a.dataset.first ?? 0)
    );
    this.groups.replaceChildren(...groups);
    this.pickers.forget();
  }

  group({ name, fields }) {
    const shown = fields.filter((field) => field.name !== "map");
    const about = name === "schedule" ? [...shown, SEED] : shown;
    const rows = about.map((field) => {
      const row = new Field(field, this.prefix, this.send, {
        show: (one) => this.tip.show(one),
        hide: (one) => this.tip.hide(one),
      });
      this.fields.set(field.name, row);
      if (field.name.endsWith("_weight") && row.slide) this.weights.push(row);
      return row.element;
    });
    const count = make("span", { className: "count" });
    const summary = make(
      "summary",
      {},
      make("span", { textContent: spaced(name) }),
      count,
    );
    const group = make(
      "details",
      { className: "group", open: this.opened.get(name) ?? false },
      summary,
      ...rows,
    );
    group.addEventListener("toggle", () => this.opened.set(name, group.open));
    group.dataset.group = name;
    if (name === "schedule") group.dataset.first = 1;
    return group;
  }

  on_state(state) {
    if (state.answers === this.asked) this.asked = null;
    if (this.asked) return;
    if (state.answers !== this.refused) {
      for (const field of this.fields.values()) field.accept();
    }
    this.state = state;
    this.pickers.show(this.controls, state);
    this.showFields();
    this.showPlots();
    this.showRun();
    this.choice.follow(state.plots);
    this.overlays.show([
      ...state.overlays,
      ...(this.stage.overlays.has("trails") ? ["trails"] : []),
    ]);
    this.stage.overlays = new Set(this.overlays.chosen);
    this.boid.chosen = state.selected ?? null;
    if (this.boid.chosen === null) this.on_selection({ boid: null });
    this.hand.frozen = Boolean(state.replay);
    this.record.show(state.replay);
    this.files.element.hidden = Boolean(state.replay?.recorded);
    this.root.classList.toggle("replays", Boolean(state.replay));
    this.showHand();
    this.stage.redraw();
  }

  showFields() {
    const { settings, changed, seed, sweeps, replay } = this.state;
    for (const [name, field] of this.fields) {
      field.update(
        name === "seed" ? seed : settings[name],
        changed.includes(name),
        sweeps?.[name],
      );
      field.freeze(Boolean(replay));
    }
    for (const group of this.groups.children) {
      const own = [...group.querySelectorAll(".field.changed")].length;
      write(group.querySelector(".count"), own ? `${own} changed` : "");
    }
    for (const plot of this.plots.values()) plot.publish(settings);
  }

  showRun() {
    const { exact, note, sweeps } = this.state;
    const count = Object.keys(sweeps ?? {}).length;
    const swept = count
      ? ` · the spec sweeps ${count === 1 ? "1 setting" : `${count} settings`}`
      : "";
    write(
      this.exact,
      (exact ? "exact: the spec gives these very frames" : note) + swept,
    );
    this.exact.classList.toggle("not", !exact);
    this.run.show(this.state, this.shown);
    this.redrawPlots();
  }

  // The step of the frame on the screen.
  get shown() {
    return this.stage.frame?.step ?? this.state?.step ?? 0;
  }

  redrawPlots() {
    const now = performance.now();
    if (now - (this.plotted ?? 0) < 60 && this.state.running) return;
    this.plotted = now;
    for (const plot of this.plots.values()) plot.draw(this.shown, this.stage.colours);
  }

  showPlots() {
    const { plots, settings } = this.state;
    if (!this.controls) return;
    for (const [name, plot] of this.plots) {
      if (!plots.includes(name)) plot.element.remove(), this.plots.delete(name);
    }
    for (const name of plots.filter((one) => !this.plots.has(one))) {
      const metric = this.controls.metrics.find((one) => one.name === name) ?? { name };
      this.plots.set(
        name,
        new Plot(
          metric,
          this.seriesOf(name),
          settings,
          () => this.choosePlots(this.state.plots.filter((one) => one !== name)),
        ),
      );
    }
    const shown = plots.map((name) => this.plots.get(name).element);
    if (shown.some((one, i) => one !== this.chart.children[i])) {
      this.chart.append(...shown);
    }
  }

  choosePlots(names) {
    this.state.plots = names;
    this.send({ type: "metrics", names });
  }

  seriesOf(name) {
    if (!this.series.has(name)) this.series.set(name, new Series());
    return this.series.get(name);
  }

  on_metrics({ steps, values, reset }) {
    if (reset) { for (const series of this.series.values()) series.clear(); }
    for (const [name, row] of Object.entries(values)) {
      this.seriesOf(name).add(steps, row);
    }
    if (this.state) this.redrawPlots();
  }

  on_scene(scene) {
    this.stage.setScene(scene);
    this.hand.settle(scene);
    this.tools.querySelector("[data-tool=goal]").hidden = !scene.goal;
    this.canvas.setAttribute(
      "aria-label",
      `the swarm in a world of ${short(scene.width)} by ${
        short(scene.height)
      } ${scene.length}, with ${scene.obstacles.length} obstacles`,
    );
    this.showHand();
  }

  on_selection(selection) {
    this.stage.selection = selection.boid === null
      ? null
      : { ...selection, range: Number(selection.range ?? Infinity) };
    this.boid.show(this.stage.selection, this.stage.scene?.length);
    this.stage.redraw();
  }

  on_rules({ names }) {
    this.rules = names;
  }

  on_spec(message) {
    this.spec.show(message, Object.keys(this.state.sweeps ?? {}).length > 0);
  }

  on_file({ name, mime, data }) {
    this.say(`${name} is ready`);
    download(name, mime, bytesOf(data));
  }

  on_error({ message, answers }) {
    this.say(message, true);
    this.hand.refuse();
    this.pickers.forget();
    this.refused = answers;
    if (answers && answers === this.asked) this.fields.get(this.asking.name)?.refuse();
  }

  on_info({ message }) {
    this.say(message);
  }

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

  export(kind) {
    this.say(`making ${kind} ...`);
    this.send({ type: "export", kind });
  }

  overlaid() {
    this.stage.overlays = new Set(this.overlays.chosen);
    this.send({
      type: "overlays",
      names: this.overlays.chosen.filter((name) => name !== "trails"),
    });
    this.stage.redraw();
  }

  showHand() {
    if (!this.list || !this.state) return;
    this.tools.hidden = this.hand.frozen;
    for (const tool of this.tools.children) {
      tool.setAttribute("aria-pressed", String(tool.dataset.tool === this.hand.tool));
    }
    this.follow.setAttribute("aria-pressed", String(this.stage.fit === "boids"));
    if (this.stage.scene) this.list.show();
  }

  fit(how) {
    this.stage.setFit(how);
    this.showHand();
  }

  tick() {
    const { counts, stage } = this;
    const seconds = (performance.now() - counts.since) / 1000;
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

export function mount(element, transport, options = {}) {
  const view = new View(element, transport, options);
  return { unmount: () => view.unmount(), view };
}
