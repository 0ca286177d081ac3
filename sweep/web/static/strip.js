// How far a study is: counts, all trials as a strip, and why some are not done.

import { contextOf, make, named, short } from "./dom.js";

/** @import { Cause, Strip, StudyState } from "./explorer.d.ts" */

const HEIGHT = 24; // pixels
const LARGEST = 8; // of a mark
const WORDS = ["done", "not done", "missing"];

/** @param {number} seconds */
function lasting(seconds) {
  if (seconds < 90) return `${Math.ceil(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${short(seconds / 3600, 2)} h`;
}

export class StatePanel {
  /** @param {(trial: string) => void} play */
  constructor(play) {
    this.play = play;
    this.counts = make("p", { className: "counts", role: "status" });
    this.strip = make("canvas", {
      className: "strip",
      role: "img",
      "aria-label": "all trials",
    });
    this.key = make("p", { className: "legend" });
    this.causes = make("ul", { className: "causes" });
    this.element = make(
      "section",
      { className: "card state", "aria-label": "state" },
      make(
        "div",
        { className: "row" },
        this.counts,
        make("div", { className: "strips" }, this.strip),
        this.key,
      ),
      this.causes,
    );
  }

  /** @param {StudyState} state */
  show(state) {
    this.element.classList.toggle("going", state.running.length > 0);
    this.counts.textContent = sentence(state);
    this.draw(state.strip, state);
    this.causes.replaceChildren(...state.causes.map((cause) => this.cause(cause)));
  }

  /** @param {Cause} cause */
  cause({ status, trials, cause, first }) {
    const act = () => this.play(first);
    return make(
      "li",
      {},
      make("b", { textContent: `${trials.toLocaleString("en")} ${status}: ` }),
      make("span", { textContent: `${cause} ` }),
      make("button", {
        type: "button",
        textContent: "play the first trial",
        on: { click: act },
      }),
    );
  }

  /** @param {Strip} strip @param {StudyState} state */
  draw({ marks, row, per }, { points }) {
    const { strip } = this;
    const room = Math.max(this.strip.parentElement?.clientWidth ?? 0, 200);
    const few = Math.ceil(Math.sqrt((marks.length * HEIGHT) / room));
    const down = row && row <= HEIGHT ? row : Math.min(HEIGHT, few);
    const across = Math.ceil(marks.length / down);
    const most = Math.min(
      LARGEST,
      Math.floor(HEIGHT / down),
      Math.floor(room / across),
    );
    const size = Math.max(1, most);
    strip.width = across * size;
    strip.height = down * size;
    const context = contextOf(strip);
    const colours = ["--good", "--bad", "--line"].map((name) => named(strip, name));
    marks.forEach((mark, i) => {
      context.fillStyle = colours[mark];
      const gap = size > 3 ? 1 : 0;
      context.fillRect(
        Math.floor(i / down) * size,
        (i % down) * size,
        size - gap,
        size - gap,
      );
    });
    const one = per === 1 ? "one trial" : `${per.toLocaleString("en")} trials`;
    const order = down === row
      ? "; a column is a point, its replicates from top to bottom"
      : "";
    strip.setAttribute(
      "aria-label",
      `all trials of ${points} points, a mark for ${one}`,
    );
    this.key.replaceChildren(
      ...WORDS.map((word, i) =>
        make("span", {}, make("i", { className: `swatch mark-${i}` }), word)
      ),
      make("span", { textContent: `a mark is ${one}${order}` }),
    );
  }
}

/** @param {StudyState} state */
function sentence({ counts, missing, trials, points, running, rate, left, search }) {
  const parts = Object.entries(counts).map(([status, count]) =>
    `${count.toLocaleString("en")} ${status}`
  );
  if (missing) parts.push(`${missing.toLocaleString("en")} missing`);
  const said = [
    `${trials.toLocaleString("en")} trials at ${points.toLocaleString("en")} points: ${
      parts.join(", ")
    }`,
  ];
  if (running.length) said.push(`launched now by ${running.join(", ")}`);
  else if (missing) said.push("no launch is running");
  if (rate) said.push(`${short(rate, 3)} trials per second`);
  if (left) said.push(`about ${lasting(left)} left`);
  if (missing) said.push("means of an unfinished study may change");
  if (search) said.push(search);
  return `${said.join("; ")}.`;
}
