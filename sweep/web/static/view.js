// The whole view. It builds its parts once in an element. Then it sends what they ask
// for to the other side of a transport, and shows in them what comes back.

import { asNumber, button, make, randomName, short, unitText } from "./dom.js";
import { Charts } from "./charts.js";
import { SettingGroups } from "./groups.js";
import { Stage } from "./stage.js";
import { StatusLine } from "./status.js";
import { Toolbar } from "./toolbar.js";
import { Hand } from "./pointer.js";
import { Tip } from "./fields.js";
import { Keys } from "./keys.js";
import { Pickers, ReplayCard } from "./pickers.js";
import { RunBar } from "./run.js";
import { BoidCard, ObstacleList, Overlays } from "./lists.js";
import { bytesOf, download, keysDialog, Menu, SpecDialog } from "./dialogs.js";

/** @import { Frame } from "./frames.js" */
/**
 * @import {
 *   Controls,
 *   File,
 *   Heard,
 *   Message,
 *   Metrics,
 *   Refusal,
 *   Scene,
 *   Selection,
 *   Spec,
 *   State,
 *   Transport,
 * } from "./protocol.d.ts"
 */
/** @import { Fit } from "./stage.js" */

/** @typedef {{ page?: string, shortcuts?: Document | HTMLElement }} Options */

const FILES = [
  ["png", "PNG", "this frame as pixels"],
  ["svg", "SVG", "this frame as lines"],
  ["gif", "GIF", "the run so far, plays anywhere"],
  ["mp4", "MP4", "the run so far, as a film"],
  ["html", "HTML", "the run so far, to open from disk"],
];
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
    this.root.append(
      make(
        "div",
        { className: "layout" },
        this.top(),
        picture,
        this.run.element,
        right,
        left,
        this.status.element,
      ),
    );
    element.append(this.root); // without a document there are no colours to draw with
    this.stage = new Stage(
      this.canvas,
      (frame) => this.taken(frame),
      () => this.state && this.charts.draw(this.shown),
    );
    this.hand = new Hand(this.stage, this.send, () => this.showHand());
    this.toolbar = new Toolbar(this.hand, this.stage, (how) => this.fit(how));
    picture.append(this.toolbar.tools, this.toolbar.views, this.banner, this.hint);
    this.overlays = new Overlays(this.stage, () => this.overlaid());
    this.boid = new BoidCard(this.send, this.stage);
    this.charts = new Charts(this.root, this.stage, this.send);
    left.append(this.overlays.element, this.boid.element, this.charts.element);
    const tip = new Tip(this.root, this.status.element);
    this.groups = new SettingGroups(this.prefix, this.send, tip);
    this.list = new ObstacleList(this.hand);
    right.append(this.record.element, this.groups.element, this.list.element);
    this.spec = new SpecDialog(this.root);
    this.help = keysDialog(this.root);
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

  opening() {
    this.banner.hidden = true;
    this.asked = null;
    this.transport.send({ type: "hello", page: this.page });
  }

  // Until the answer comes, states are older than what the controls show.
  /** @param {Message} message */
  ask(message) {
    this.asked = `${this.page} ${++this.sent}`;
    this.asking = message;
    this.transport.send({ ...message, id: this.asked });
  }

  /** @param {string} words */
  lost(words) {
    this.banner.textContent = words;
    this.banner.hidden = false;
  }

  // The end of the connection: the picture stays, and nothing can be changed any more.
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
      case "file":
        return this.save(heard);
      case "error":
        return this.refuse(heard);
      case "info":
        return this.status.say(heard.message);
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

  /** @param {Controls} controls */
  showControls(controls) {
    this.status.say("");
    this.banner.hidden = true;
    const known = JSON.stringify(controls);
    if (known === this.known) return;
    this.known = known;
    this.controls = controls;
    this.overlays.offer(["trails", ...controls.overlays]);
    this.charts.offer(controls);
    this.groups.offer(controls);
    this.pickers.forget();
  }

  /** @param {State} state */
  showState(state) {
    if (state.answers === this.asked) this.asked = null;
    if (this.asked || !this.controls) return;
    if (state.answers !== this.refused) this.groups.accept();
    this.state = state;
    this.pickers.show(this.controls, state);
    this.groups.show(state);
    this.charts.show(state);
    this.showRun(state);
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
  }

  /** @param {File} file */
  save({ name, mime, data }) {
    this.status.say(`${name} is ready`);
    download(name, mime, bytesOf(data));
  }

  /** @param {Refusal} refusal */
  refuse({ message, answers }) {
    this.status.say(message, true);
    this.hand.refuse();
    this.pickers.forget();
    this.refused = answers;
    if (!answers || answers !== this.asked || !this.asking) return;
    if ("name" in this.asking) this.groups.fields.get(this.asking.name)?.refuse();
  }

  /** @param {string} kind */
  export(kind) {
    this.status.say(`making ${kind} ...`);
    this.send({ type: "export", kind });
  }

  overlaid() {
    this.stage.overlays = new Set(this.overlays.chosen);
    this.send({ type: "overlays", names: without(this.overlays.chosen, "trails") });
    this.stage.redraw();
  }

  showHand() {
    if (!this.state) return;
    this.toolbar.show();
    if (this.stage.scene) this.list.show();
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
  }
}

/** @param {string[]} names @param {string} name */
const without = (names, name) => names.filter((one) => one !== name);

/** @param {Element} element @param {Transport} transport @param {Options} options */
export function mount(element, transport, options = {}) {
  const view = new View(element, transport, options);
  return { unmount: () => view.unmount(), view };
}
