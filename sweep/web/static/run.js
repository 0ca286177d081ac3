// The bar below the picture: it runs and pauses, takes single steps, resets, scrubs
// through a stored trial.

import { button, make, setIcon, short, write } from "./dom.js";

const SPEEDS = [1, 5, 15, 30, 60, 120, 300, 1000, 0];

export class RunBar {
  constructor(send) {
    this.send = send;
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
        value: speed,
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

  get ended() {
    const { replay, step, steps, running } = this.state;
    return !replay && !running && step >= steps;
  }

  toggle() {
    const { state } = this;
    this.send({ type: state.running ? "pause" : this.ended ? "continue" : "run" });
    state.running = !state.running; // until the answer comes
    this.show(state, this.step);
  }

  show(state, step) {
    this.state = state;
    const [picture, words, hint] = this.act();
    if (this.going.lastChild.textContent !== words) {
      setIcon(this.going, picture, `${hint} (Space)`);
    }
    this.going.lastChild.textContent = words;
    this.offer(state.speed);
    this.speed.value = String(state.speed);
    this.showStep(step);
  }

  // What the button does next: its picture, its word, and what that means.
  act() {
    if (this.state.running) return ["pause", "Pause", "Pause"];
    return this.ended
      ? ["forward", "Go on", "Go on: twice as many steps"]
      : ["play", "Run", "Run"];
  }

  // A speed from elsewhere becomes one that can be chosen.
  offer(speed) {
    if ([...this.speed.options].some((option) => Number(option.value) === speed)) {
      return;
    }
    this.speed.add(
      make("option", { value: speed, textContent: `${short(speed)} steps/s` }),
    );
  }

  showStep(step) {
    this.step = step;
    const { steps, replay } = this.state;
    const last = replay ? replay.frames[1] : steps;
    write(this.clock, `step ${step} of ${last}`);
    this.bar.hidden = Boolean(replay);
    this.scrub.hidden = !replay;
    this.bar.max = Math.max(1, last);
    this.bar.value = step;
    if (!replay) return;
    const { scrub } = this;
    if (!scrub.matches(":active")) {
      Object.assign(scrub, {
        min: replay.frames[0],
        max: last,
        step: replay.frames[2],
        value: step,
      });
    }
    scrub.style.setProperty(
      "--part",
      `${(100 * (scrub.value - scrub.min)) / Math.max(1, last - scrub.min)}%`,
    );
  }
}
