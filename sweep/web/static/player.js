// Plays recorded runs: a picture with its bar, and beside it what is drawn, the boid
// that is looked at, and the metrics. Nothing in it can be changed.

import { make, unitText } from "./dom.js";
import { Charts } from "./charts.js";
import { SpecDialog } from "./dialogs.js";
import { BoidCard, Overlays, OWN_OVERLAYS } from "./lists.js";
import { ReplayCard } from "./pickers.js";
import { Hand } from "./pointer.js";
import { RunBar } from "./run.js";
import { Senses } from "./senses.js";
import { Stage } from "./stage.js";
import { Tape } from "./tape.js";
import { Toolbar } from "./toolbar.js";
import { Visits } from "./visits.js";

/** @import { Message, Recording, State } from "./protocol.d.ts" */

const NEARLY = "Computed from recorded positions (16 bits) and headings (8 bits).";
const MEASURED = " Measured and received states are not recorded: neighbours are" +
  " computed from true positions.";
const THINNED = " Visits between recorded frames are not counted.";
const LEGENDS_EVERY = 500; // ms

/**
 * What is played: a recording with what is told from it. A recording without pixels
 * has no visits.
 *
 * @typedef {object} Run
 * @property {Recording} recording
 * @property {State} state
 * @property {Tape} tape
 * @property {Senses} senses
 * @property {Visits | null} visits
 */

export class Player {
  /** @type {Run | null} */
  run = null;
  place = 0; // of the frame on the screen
  clock = 0; // steps, a fraction of one included
  seen = 0; // when the clock was looked at
  request = 0;
  /** @type {number | null} */
  selected = null;

  canvas = make("canvas", {
    tabIndex: 0,
    role: "application",
    "aria-label": "the swarm",
  });

  // Dialogs are put into `root`, the element of class boidsweep in which `room` is.
  /** @param {HTMLElement} root @param {HTMLElement} room */
  constructor(root, room) {
    /** @param {Message} message */
    const send = (message) => this.obey(message);
    const picture = make(
      "section",
      { className: "picture", "aria-label": "picture" },
      this.canvas,
    );
    const watch = make("aside", { className: "watch", "aria-label": "about the run" });
    this.bar = new RunBar(send);
    this.element = make("div", { className: "player" }, picture, this.bar.element);
    this.element.append(watch);
    room.append(this.element); // without a document there are no colours to draw with
    this.stage = new Stage(
      this.canvas,
      () => this.shown(),
      () => this.charts.draw(this.step),
    );
    this.hand = new Hand(this.stage, send, () => this.toolbar.show());
    this.hand.frozen = true;
    this.toolbar = new Toolbar(this.hand, this.stage, (fit) => this.stage.setFit(fit));
    picture.append(this.toolbar.views);
    this.card = new ReplayCard();
    this.overlays = new Overlays(this.stage, () => this.draw());
    this.boid = new BoidCard(send, this.stage);
    this.charts = new Charts(root, this.stage, send, (use) => use(this.name));
    this.nearly = make("small");
    this.overlays.element.append(this.nearly);
    watch.append(this.card.element, this.overlays.element);
    watch.append(this.boid.element, this.charts.element);
    this.spec = new SpecDialog(root, undefined);
    this.legends = setInterval(() => this.explain(), LEGENDS_EVERY);
  }

  // The step of the frame on the screen.
  get step() {
    return this.run?.tape.steps[this.place] ?? 0;
  }

  // Of files of this run.
  get name() {
    const { study = "", trial = "" } = this.run?.state.replay ?? {};
    return `${study.replaceAll("/", "-")}-${trial.slice(0, 8)}`;
  }

  // Shows a recording from its beginning; what is drawn and how fast stays.
  /** @param {Recording} recording */
  play(recording) {
    const { scene, senses: about } = recording;
    const tape = new Tape(recording);
    const speed = this.run?.state.speed ?? recording.state.speed;
    this.run = {
      recording,
      state: { ...recording.state, speed },
      tape,
      senses: new Senses(about, scene),
      visits: about.pixels && new Visits(tape, about.pixels, scene),
    };
    const { metrics, steps, values } = recording;
    this.selected = this.boid.chosen = null;
    this.stage.clear();
    this.stage.setScene(scene);
    this.overlays.offer([
      ...OWN_OVERLAYS,
      "flocks",
      ...(about.pixels ? ["coverage"] : []),
    ]);
    const every = recording.state.replay?.frames[2] ?? 1;
    this.nearly.textContent = NEARLY + (about.measured ? MEASURED : "") +
      (about.pixels && every > 1 ? THINNED : "");
    this.card.show(this.run.state.replay);
    this.charts.offer({ metrics });
    this.charts.show(this.run.state);
    this.charts.add({ type: "metrics", steps, values, reset: true });
    this.toolbar.show();
    this.go(0);
    this.showRun();
  }

  stop() {
    clearInterval(this.legends);
    cancelAnimationFrame(this.request);
    this.stage.stop();
    this.element.remove();
  }

  /** @param {Message} message */
  obey(message) {
    const { run } = this;
    if (!run) return;
    switch (message.type) {
      case "run":
        return this.begin(run);
      case "pause":
        return this.pause(run);
      case "step":
        this.pause(run);
        return this.go(this.place + (message.count ?? 1));
      case "reset":
        return this.go(0);
      case "seek":
        return this.go(run.tape.at(message.frame));
      case "speed":
        run.state.speed = message.steps_per_second;
        return;
      case "select":
        return this.select(run, message.boid);
      case "metrics":
        run.state.plots = message.names;
        this.charts.show(run.state);
        return this.charts.draw(this.step);
    }
  }

  /** @param {Run} run */
  begin(run) {
    if (this.place === run.tape.last) this.go(0);
    run.state.running = true;
    [this.seen, this.clock] = [performance.now(), this.step];
    this.showRun();
    this.request ||= requestAnimationFrame((now) => this.advance(now));
  }

  /** @param {Run} run */
  pause(run) {
    cancelAnimationFrame(this.request);
    this.request = 0;
    run.state.running = false;
    this.showRun();
  }

  /** @param {number} now */
  advance(now) {
    const { run } = this;
    this.request = 0;
    if (!run?.state.running) return;
    const { tape, state: { speed } } = run;
    this.clock += (Math.max(0, now - this.seen) / 1000) * speed;
    this.seen = now;
    const to = speed > 0 ? tape.at(this.clock) : this.place + 1;
    if (to !== this.place) this.turn(to);
    if (this.place === tape.last) return this.pause(run);
    this.request = requestAnimationFrame((later) => this.advance(later));
  }

  // Shows another frame, from which the clock goes on.
  /** @param {number} to */
  go(to) {
    this.turn(to);
    this.clock = this.step;
  }

  /** @param {number} to */
  turn(to) {
    if (!this.run) return;
    this.place = Math.min(Math.max(to, 0), this.run.tape.last);
    this.draw();
  }

  draw() {
    if (!this.run) return;
    const { tape, senses, visits } = this.run;
    const frame = tape.frame(this.place);
    this.stage.overlays = new Set(this.overlays.chosen);
    if (this.stage.overlays.has("flocks")) frame.flocks = senses.flocks(frame);
    if (this.stage.overlays.has("coverage") && visits) {
      frame.coverage = visits.until(this.place);
    }
    this.stage.selection = this.selected === null
      ? null
      : { ...senses.seen(frame, this.place, this.selected), range: senses.range };
    this.boid.show(this.stage.selection, this.stage.scene?.length);
    this.stage.take(frame);
  }

  /** @param {Run} run @param {number | null} boid */
  select({ tape }, boid) {
    const { n } = tape.frame(this.place);
    this.selected = boid !== null && boid >= n ? n - 1 : boid;
    this.boid.chosen = this.selected;
    this.draw();
  }

  shown() {
    this.bar.showStep(this.step);
    this.charts.draw(this.step);
  }

  // The bar changes its state until an answer comes: it has one of its own.
  showRun() {
    if (this.run) this.bar.show({ ...this.run.state }, this.step);
  }

  explain() {
    const { length = "", time = "" } = this.stage.scene ?? {};
    this.overlays.explain([], unitText(`${length}/${time}^2`));
  }

  copySpec() {
    if (!this.run) return;
    const yaml = this.run.recording.spec;
    this.spec.show({ type: "spec", yaml, trial: "", exact: true, note: "" }, false);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { run } = this;
    const target = event.target instanceof HTMLElement ? event.target : null;
    const typing = target?.closest(
      "input:not([type=range]):not([type=checkbox]), select, textarea, dialog[open]",
    );
    if (!run || typing || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && target?.closest("button, summary, [type=checkbox]")) {
      return;
    }
    /** @type {Record<string, () => void>} */
    const acts = {
      " ": () => this.bar.toggle(),
      ".": () => this.obey({ type: "step" }),
      r: () => this.obey({ type: "reset" }),
      f: () => this.stage.setFit("world"),
      c: () => this.copySpec(),
      "[": () => this.boid.beside(-1),
      "]": () => this.boid.beside(1),
      Escape: () => this.select(run, null),
    };
    const act = acts[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    act();
    event.preventDefault();
  }
}
