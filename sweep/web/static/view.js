// The whole view. It builds its parts once in an element. Then it sends what they ask
// for to the other side of a transport, and shows in them what comes back.

import { asNumber, button, make, randomName, short, spaced, unitText } from "./dom.js";
import { Charts } from "./charts.js";
import { SettingGroups } from "./groups.js";
import { Stage } from "./stage.js";
import { StatusLine } from "./status.js";
import { Toolbar } from "./toolbar.js";
import { About } from "./about.js";
import { Outside } from "./outside.js";
import { Panels, Presentation } from "./panels.js";
import { Hand } from "./pointer.js";
import { Tip } from "./fields.js";
import { Keys } from "./keys.js";
import { Toasts } from "./toasts.js";
import { Pickers, ReplayCard } from "./pickers.js";
import { PresetList } from "./presets.js";
import { RunBar } from "./run.js";
import { BoidCard, ObstacleList, Overlays, OWN_OVERLAYS } from "./lists.js";
import { EditBar } from "./edits.js";
import { keysDialog, SpecDialog } from "./dialogs.js";
import { Exports } from "./exports.js";
import { bytesOf, download } from "./files.js";

/** @import { Frame } from "./frames.js" */
/**
 * @import {
 *   Controls,
 *   File,
 *   Heard,
 *   Kept,
 *   Message,
 *   Metrics,
 *   Refusal,
 *   Scene,
 *   Selection,
 *   Spec,
 *   State,
 *   StoredName,
 *   Transport,
 * } from "./protocol.d.ts"
 */
/** @import { Fit } from "./stage.js" */
/** @import { LaunchCard } from "./launch.js" */
/** @import { Opening } from "./address.js" */

/**
 * `memory` keeps what a page goes on with when its session is gone, and has an address
 * of it; `entitle` is told what is shown, in a few words; `stored` names the stored
 * trial that is played, or two; then `alone` is told if only one shall be shown, and
 * `playing` which trial each side shows;
 * `opening` says how the first state is shown, `demos` is the address of the start
 * page, and `launches` launches a spec.
 *
 * @typedef {{
 *   page?: string,
 *   stored?: StoredName,
 *   alone?: (side: number) => void,
 *   playing?: (side: number, trial: string) => void,
 *   shortcuts?: Document | HTMLElement,
 *   memory?: {
 *     read(): Kept | null,
 *     write(kept: Kept): void,
 *     address(opening: Partial<Opening>): string,
 *   },
 *   entitle?: (words: string) => void,
 *   opening?: Partial<Opening>,
 *   demos?: string,
 *   launches?: LaunchCard,
 * }} Options
 */

const KEEP_AFTER = 400; // ms after the last change

let mounts = 0;

export class View {
  prefix = `boidsweep-${++mounts}`;
  sent = 0; // messages
  // Whether the mouse was used last, or the keyboard.
  pointed = false;
  /** @type {Controls | null} */
  controls = null;
  known = ""; // the controls that are shown
  /** @type {State | null} */
  state = null;
  /** @type {string[]} */
  rules = [];
  /** @type {string | null} */
  asked = null; // the id of the latest message, until it is answered
  /** @type {Message | null} */
  asking = null; // that message
  /** @type {string | undefined} */
  refused; // the id of the latest one that was refused
  edited = ""; // the state that is kept
  keeping = 0;
  away = false;

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
  status = new StatusLine();

  /** @param {Message} message */
  send = (message) => this.ask(message);
  pickers = new Pickers(this.prefix, this.send);
  presets = new PresetList(this.send);
  run = new RunBar(this.send);
  toasts = new Toasts();
  edits = new EditBar((type) => this.undo(type));
  actions = make("div", { className: "row" });
  record = new ReplayCard();
  about = new About();
  panels = new Panels(this.root);
  presentation = new Presentation(this.root, (words) => this.keys.hint(words));
  outside = new Outside(() => this.fit("boids"));

  /** @param {Element} element @param {Transport} transport @param {Options} options */
  constructor(element, transport, options) {
    const { page, stored, shortcuts, memory, entitle, opening, demos, launches } =
      options;
    this.stored = stored;
    this.beginning = opening;
    this.demos = demos;
    this.memory = memory;
    this.entitle = entitle;
    this.transport = transport;
    this.page = page ?? randomName();
    const picture = make(
      "section",
      { className: "picture", "aria-label": "picture" },
      this.canvas,
    );
    this.picture = picture;
    const left = make("aside", {
      className: "watch",
      "aria-label": "overlays and metrics",
    });
    const right = make("aside", { className: "settings", "aria-label": "parameters" });
    this.root.append(
      make(
        "div",
        { className: "layout" },
        this.top(),
        picture,
        this.run.element,
        this.presentation.stand,
        this.panels.bar,
        right,
        left,
        this.status.element,
      ),
      this.toasts.element,
    );
    element.append(this.root); // without a document there are no colours to draw with
    this.stage = new Stage(
      this.canvas,
      (frame) => this.taken(frame),
      () => this.state && this.charts.draw(this.shown),
    );
    this.files = new Exports(this.stage, this.send);
    this.actions.insertBefore(this.files.element, this.actions.lastChild);
    this.hand = new Hand(this.stage, this.send, () => this.showHand());
    this.toolbar = new Toolbar(this.hand, this.stage, (how) => this.fit(how));
    this.toolbar.views.append(
      ...this.panels.toggles.values(),
      button("present", "Present (P)", () => this.present()),
    );
    picture.append(
      this.toolbar.tools,
      this.toolbar.views,
      this.outside.element,
      this.banner,
      this.hint,
    );
    this.overlays = new Overlays(this.stage, () => this.overlaid());
    this.boid = new BoidCard(this.send, this.stage);
    this.charts = new Charts(
      this.root,
      this.stage,
      this.send,
      (use) => this.files.origin(({ trial }) => use(trial)),
    );
    left.append(this.overlays.element, this.boid.element, this.charts.element);
    const tip = new Tip(this.root, this.status.element);
    this.groups = new SettingGroups(this.prefix, this.send, tip);
    this.list = new ObstacleList(this.hand);
    right.append(
      this.record.element,
      this.about.element,
      this.edits.element,
      this.presets.element,
      this.groups.element,
      this.list.element,
    );
    const address = memory && (() => memory.address(this.viewed));
    this.spec = new SpecDialog(this.root, address, launches);
    this.help = keysDialog(this.root);
    this.keys = new Keys(this, shortcuts ?? this.root);
    this.timer = setInterval(() => this.tick(), 500);
    this.listen();
  }

  listen() {
    const { transport } = this;
    transport.onmessage = (heard) => this.receive(heard);
    transport.onopen = () => this.opening();
    transport.onclose = (words) => {
      this.lost(words);
      this.freeze(true);
    };
    transport.onend = (words) => this.end(words);
    if (transport.start) transport.start();
    else this.opening();
  }

  // The run bar where it belongs, if it was elsewhere.
  settle() {
    this.picture.after(this.run.element);
  }

  unmount() {
    clearInterval(this.timer);
    clearTimeout(this.keeping);
    this.keys.stop();
    this.presentation.stop();
    this.stage.stop();
    this.transport.close();
    this.root.remove();
  }

  top() {
    const brand = make(
      "div",
      { className: "brand" },
      make("i", { "aria-hidden": "true" }),
      make("h1", { textContent: "boidsweep" }),
    );
    const copy = button(
      "copy",
      "Copy as spec",
      () => this.copySpec(),
      "Copy as spec",
      { className: "primary" },
    );
    const help = button("keys", "Keys", () => this.help.showModal(), "Keys");
    const demos = this.demos
      ? [make("a", { className: "quiet", href: this.demos, textContent: "Demos" })]
      : [];
    this.actions.append(...demos, copy, help);
    const { actions, pickers } = this;
    return make("header", { className: "top" }, brand, pickers.element, actions);
  }

  opening() {
    this.banner.hidden = true;
    this.asked = null;
    this.freeze(false);
    const kept = this.memory?.read() ?? {};
    this.transport.send({ type: "hello", page: this.page, ...kept, ...this.stored });
  }

  // While the other side is away nothing can be changed: it would be lost.
  /** @param {boolean} away */
  freeze(away) {
    if (this.away === away) return;
    this.away = away;
    this.run.element.toggleAttribute("inert", away);
    for (const part of this.root.querySelectorAll(".pickers, aside")) {
      part.toggleAttribute("inert", away);
    }
    this.hand.frozen = away || Boolean(this.state?.replay);
    this.showHand();
  }

  // Asks for what this page would go on with, once nothing has changed for a while.
  /** @param {State} state */
  keep({ settings, shapes, seed, plots, sweeps, trial }) {
    if (!this.memory) return;
    const edited = JSON.stringify([settings, shapes, seed, plots, sweeps, trial]);
    if (edited === this.edited) return;
    this.edited = edited;
    clearTimeout(this.keeping);
    this.keeping = setTimeout(() => this.transport.send({ type: "keep" }), KEEP_AFTER);
  }

  // What was kept is no longer what is shown: the next state is kept anew.
  forget() {
    this.edited = "";
  }

  /** @param {"undo" | "redo"} type */
  undo(type) {
    this.hand.forget();
    if (this.state?.[type]) this.send({ type });
  }

  copySpec() {
    if (!this.away) return this.send({ type: "spec" });
    const yaml = this.memory?.read()?.yaml;
    const note = "sweep view does not answer: this is the spec of the last state.";
    if (yaml) this.showSpec({ type: "spec", yaml, trial: "", exact: false, note });
  }

  // Until the answer comes, states are older than what the controls show.
  /** @param {Message} message */
  ask(message) {
    if (this.away) return;
    this.asked = `${this.page} ${++this.sent}`;
    this.asking = message;
    this.transport.send({ ...message, id: this.asked });
  }

  /** @param {string} words */
  lost(words) {
    this.banner.classList.remove("waits");
    this.banner.textContent = words;
    this.banner.hidden = false;
  }

  // The end of the connection: the picture stays, and nothing can be changed any more.
  /** @param {string} words */
  end(words) {
    this.lost(words);
    this.keys.stop();
    this.run.element.toggleAttribute("inert", true);
    for (const part of this.root.querySelectorAll(".top, aside")) {
      part.toggleAttribute("inert", true);
    }
    this.hand.frozen = true;
    if (!this.state) return;
    this.state.running = false;
    this.showRun(this.state);
    this.showHand();
  }

  // Who is heard is not away: a kernel that was busy at first has answered.
  /** @param {Heard} heard */
  receive(heard) {
    if (this.away) {
      this.banner.hidden = true;
      this.freeze(false);
    }
    if (heard instanceof ArrayBuffer || heard instanceof DataView) {
      this.status.counts.received++;
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
        return this.showMetrics(heard);
      case "selection":
        return this.showSelection(heard);
      case "rules":
        this.rules = heard.names;
        return;
      case "spec":
        return this.showSpec(heard);
      case "kept":
        return this.memory?.write(heard);
      case "file":
        return this.save(heard);
      case "progress":
        return this.files.tell(heard);
      case "origin":
        return this.files.name(heard);
      case "error":
        return this.refuse(heard);
      case "info":
        return this.waitFor(heard.message);
    }
  }

  /** @param {Frame} frame */
  taken(frame) {
    this.status.counts.drawn++;
    this.transport.send({ type: "ready" });
    if (!this.state) return;
    this.run.showStep(frame.step);
    this.charts.draw(this.shown);
  }

  // What takes long is said until the next state, or until it is refused.
  /** @param {string} words */
  waitFor(words) {
    this.lost(words);
    this.banner.classList.add("waits");
  }

  /** @param {Controls} controls */
  showControls(controls) {
    const known = JSON.stringify(controls);
    if (known === this.known) return;
    this.known = known;
    this.controls = controls;
    this.overlays.offer([...OWN_OVERLAYS, ...controls.overlays]);
    this.presentation.end();
    this.about.offer(controls);
    this.charts.offer(controls);
    this.groups.offer(controls);
    this.presets.offer(controls);
    this.pickers.forget();
  }

  /** @param {State} state */
  showState(state) {
    this.stage.run = state.run;
    this.banner.hidden = true;
    if (state.answers === this.asked) this.asked = null;
    if (this.asked || !this.controls) return;
    if (state.answers && state.answers !== this.refused) {
      this.groups.accept();
      this.status.accept();
    }
    this.state = state;
    this.pickers.show(this.controls, state);
    this.groups.show(state);
    this.presets.show(state);
    this.edits.show(state);
    this.charts.show(state);
    this.showRun(state);
    const own = OWN_OVERLAYS.filter((name) => this.stage.overlays.has(name));
    this.overlays.show([...state.overlays, ...own]);
    this.stage.overlays = new Set(this.overlays.chosen);
    this.boid.chosen = state.selected;
    if (state.selected === null) this.showSelection({ type: "selection", boid: null });
    this.hand.frozen = Boolean(state.replay);
    this.record.show(state.replay);
    this.files.show(state);
    this.root.classList.toggle("replays", Boolean(state.replay));
    this.entitle?.(titleOf(this.controls, state));
    this.keep(state);
    this.showHand();
    this.stage.redraw();
    this.begin();
  }

  // As the address says, once.
  begin() {
    const { beginning } = this;
    if (!beginning) return;
    this.beginning = undefined;
    const { overlays = [], beside, run, ...opening } = beginning;
    const { step, speed = null, plots, boid = null } = opening;
    if (speed !== null) this.send({ type: "speed", steps_per_second: speed });
    if (plots) this.send({ type: "metrics", names: plots });
    this.overlays.show(overlays);
    if (overlays.length) this.overlaid();
    if (boid !== null) this.send({ type: "select", boid });
    if (beside) this.send({ type: "beside", preset: beside });
    if (step) this.send({ type: "step", count: step });
    if (run) this.run.toggle();
  }

  // How the state is shown, for an address. A run whose parameters were changed on the
  // way cannot be opened at its step.
  get viewed() {
    const { exact = false, speed = null, plots = null, selected = null } = this.state ??
      {};
    return {
      step: exact ? this.shown : 0,
      speed,
      overlays: this.overlays.chosen,
      plots,
      boid: selected,
    };
  }

  /** @param {State} state */
  showRun(state) {
    this.status.show(state);
    this.run.show(state, this.shown);
    this.charts.draw(this.shown);
  }

  // The step of the frame on the screen.
  get shown() {
    return this.stage.frame?.step ?? this.state?.step ?? 0;
  }

  /** @param {Metrics} metrics */
  showMetrics(metrics) {
    this.charts.add(metrics);
    if (this.state) this.charts.draw(this.shown);
  }

  /** @param {Scene} scene */
  showScene(scene) {
    this.stage.setScene(scene);
    this.hand.settle(scene);
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
    if (!this.away) this.spec.offer(message.yaml);
  }

  /** @param {File} file */
  save({ name, mime, data }) {
    this.status.say(`${name} is ready`);
    download(name, mime, bytesOf(data));
  }

  /** @param {Refusal} refusal */
  refuse({ message, answers }) {
    this.banner.hidden = true;
    if (answers) this.status.say(message, true);
    else this.toasts.say(message);
    this.hand.refuse();
    this.pickers.forget();
    this.refused = answers;
    if (!answers || answers !== this.asked || !this.asking) return;
    if ("name" in this.asking) this.groups.fields.get(this.asking.name)?.refuse();
  }

  overlaid() {
    this.stage.overlays = new Set(this.overlays.chosen);
    this.send({
      type: "overlays",
      names: this.overlays.chosen.filter((name) => !OWN_OVERLAYS.includes(name)),
    });
    this.stage.redraw();
  }

  showHand() {
    if (!this.state) return;
    this.toolbar.show();
    if (this.stage.scene) this.list.show();
  }

  // The picture, the slider of a weight, and the first plot.
  present() {
    const { presentation } = this;
    if (presentation.going) presentation.end();
    else presentation.begin(this.weighed, this.plotted);
  }

  // Another slider for the presentation.
  presentWeight() {
    if (this.presentation.going) this.presentation.put(this.weighed, this.plotted);
  }

  get weighed() {
    return (this.groups.weights[this.keys.weight] ?? this.groups.weights[0])?.element;
  }

  get plotted() {
    const [first] = this.state?.plots ?? [];
    return this.charts.plots.get(first)?.element;
  }

  /** @param {Fit} how */
  fit(how) {
    this.stage.setFit(how);
    this.showHand();
  }

  tick() {
    this.status.showRates(this.state?.running);
    const { length = "", time = "" } = this.stage.scene ?? {};
    this.overlays.explain(this.rules, unitText(`${length}/${time}^2`));
    this.outside.show(this.stage.frame, this.stage.scene);
  }
}

// What is shown, for a window among many.
/** @param {Controls} controls @param {State} state */
function titleOf({ trials }, { model, preset, trial, replay }) {
  if (replay) {
    return `${replay.study}, ${replay.which ?? `trial ${replay.trial.slice(0, 8)}`}`;
  }
  if (!trials || !trial) return `${model}, ${preset}`;
  const values = Object.entries(trial.values).map(([name, value]) =>
    `, ${spaced(name)} ${short(value)}`
  );
  const { replicate } = trial;
  const last = trials.replicates - 1;
  return `${trials.study}${values.join("")}, replicate ${replicate} (of 0 to ${last})`;
}
