// The bar below the picture. It runs and pauses, takes single steps, resets, and goes
// to any step of a stored trial.

import { button, make, setIcon, short, write } from "./dom.js";

/** @import { Picture } from "./dom.js" */
/** @import { Message, State } from "./protocol.d.ts" */

const SPEEDS = [1, 5, 15, 30, 60, 120, 300, 1000, 0];

/** @param {State} state */
const ended = ({ replay, step, steps, running }) =>
  !replay && !running && step >= steps;

// What the button does next: its picture, its word, and what that means.
/**
 * @param {State} state
 * @returns {[picture: Picture, word: string, meaning: string]}
 */
function next(state) {
  if (state.running) return ["pause", "Pause", "Pause"];
  return ended(state)
    ? ["forward", "Go on", "Go on: twice as many steps"]
    : ["play", "Run", "Run"];
}

export class RunBar {
  /** @param {(message: Message) => void} send */
  constructor(send) {
    this.send = send;
    /** @type {State | null} */
    this.state = null;
    this.step = 0;
    const back = button(
      "reset",
      "Reset: the same seed from step 0 (R)",
      () => send({ type: "reset" }),
    );
    const single = button(
      "step",
      "One step (.)",
      () => send({ type: "step", count: 1 }),
    );
    this.going = button("play", "Run (Space)", () => this.toggle(), "Run", {
      className: "primary going",
    });
    this.bar = make("progress", { "aria-label": "steps done", max: 1, value: 0 });
    this.scrub = make("input", { type: "range", hidden: true, "aria-label": "step" });
    this.scrub.addEventListener(
      "input",
      () => send({ type: "seek", frame: Number(this.scrub.value) }),
    );
    this.clock = make("output", { className: "clock" });
    const options = SPEEDS.map((speed) =>
      make("option", {
        value: String(speed),
        textContent: speed ? `${speed} steps/s` : "as fast as it goes",
      })
    );
    this.speed = make("select", { "aria-label": "speed" }, ...options);
    this.speed.addEventListener(
      "change",
      () => send({ type: "speed", steps_per_second: Number(this.speed.value) }),
    );
    this.element = make(
      "section",
      { className: "run", "aria-label": "run" },
      back,
      this.going,
      single,
      this.bar,
      this.scrub,
      this.clock,
      this.speed,
    );
  }

  toggle() {
    const { state } = this;
    if (!state) return;
    this.send({ type: state.running ? "pause" : ended(state) ? "continue" : "run" });
    state.running = !state.running; // until the answer comes
    this.show(state, this.step);
  }

  /** @param {State} state @param {number} step */
  show(state, step) {
    this.state = state;
    const { lastChild: word } = this.going;
    const [picture, words, hint] = next(state);
    if (word && word.textContent !== words) {
      setIcon(this.going, picture, `${hint} (Space)`);
      word.textContent = words;
    }
    this.offer(state.speed);
    this.speed.value = String(state.speed);
    this.showStep(step);
  }

  // Adds the speed to the choices if it is none of them: another page may have set it.
  /** @param {number} speed */
  offer(speed) {
    if ([...this.speed.options].some((option) => Number(option.value) === speed)) {
      return;
    }
    this.speed.add(
      make("option", { value: String(speed), textContent: `${short(speed)} steps/s` }),
    );
  }

  /** @param {number} step */
  showStep(step) {
    if (!this.state) return;
    this.step = step;
    const { steps, replay } = this.state;
    const last = replay ? replay.frames[1] : steps;
    write(this.clock, `step ${step} of ${last}`);
    this.bar.hidden = Boolean(replay);
    this.scrub.hidden = !replay;
    this.bar.max = Math.max(1, last);
    this.bar.value = step;
    if (!replay) return;
    this.seekable(replay.frames, step);
  }

  /**
   * @param {[first: number, last: number, every: number]} frames
   * @param {number} step
   */
  seekable([first, last, every], step) {
    const { scrub } = this;
    if (!scrub.matches(":active")) {
      [scrub.min, scrub.max, scrub.step] = [first, last, every].map(String);
      scrub.value = String(step);
    }
    const part = (Number(scrub.value) - first) / Math.max(1, last - first);
    scrub.style.setProperty("--part", `${100 * part}%`);
  }
}
