// The bar below the picture. It runs and pauses, takes single steps, resets, and goes
// to any step that was run before, or of a stored trial.

import { button, make, paced, setIcon, short, write } from "./dom.js";

/** @import { Picture } from "./dom.js" */
/** @import { Message, State } from "./protocol.d.ts" */

const SEEK_EVERY = 40; // ms
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
    ? ["forward", "Continue", "Continue: twice as many steps"]
    : ["play", "Run", "Run"];
}

export class RunBar {
  /** @param {(message: Message) => void} send */
  constructor(send) {
    this.send = send;
    /** @type {State | null} */
    this.state = null;
    this.step = 0;
    this.wanted = false; // pressed before there was a run
    const back = button(
      "reset",
      "Reset: start again at step 0 with the same seed (R)",
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
    this.scrub = make("input", { type: "range", "aria-label": "step" });
    const seek = paced(
      () => send({ type: "seek", frame: Number(this.scrub.value) }),
      SEEK_EVERY,
    );
    this.scrub.addEventListener("input", seek);
    this.words = make("p", { className: "past", role: "status", hidden: true });
    this.clock = make("output", { className: "clock" });
    const options = SPEEDS.map((speed) =>
      make("option", {
        value: String(speed),
        textContent: speed ? `${speed} steps/s` : "as fast as possible",
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
      this.scrub,
      this.clock,
      this.speed,
      this.words,
    );
  }

  toggle() {
    const { state } = this;
    if (!state) {
      this.wanted = !this.wanted;
      return;
    }
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
    const { wanted } = this;
    this.wanted = false;
    if (wanted && !state.running) this.toggle();
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
    const { past, replay, steps } = this.state;
    const [first, last, every] = replay?.frames ?? [past[0], steps, 1];
    const known = replay ? last : Math.max(past[1], step);
    write(this.clock, `step ${step} of ${last}`);
    this.seekable([first, last, every], step, known);
    this.explain(step, known);
  }

  /**
   * @param {[first: number, last: number, every: number]} frames
   * @param {number} step
   * @param {number} known
   */
  seekable([first, last, every], step, known) {
    const { scrub } = this;
    if (!scrub.matches(":active")) {
      [scrub.min, scrub.max, scrub.step] = [first, last, every].map(String);
      scrub.value = String(step);
    }
    /** @param {number} one */
    const part = (one) => `${100 * (one - first) / Math.max(1, last - first)}%`;
    scrub.style.setProperty("--part", part(Number(scrub.value)));
    scrub.style.setProperty("--known", part(known));
  }

  // What going on from the past means.
  /** @param {number} step @param {number} known */
  explain(step, known) {
    const { running = false, replay = null, past = [0, 0] } = this.state ?? {};
    this.words.hidden = Boolean(replay) || running || step >= known;
    const gone = past[0] > 0
      ? ` Steps before ${past[0]} are not kept after very many changes.`
      : "";
    write(
      this.words,
      `${known} steps were run. Run repeats the later steps with their changes;` +
        ` a change made here replaces the later steps.${gone}`,
    );
  }
}
