// The line below everything: whether a spec gives these frames, what was said last, and
// how fast frames come.

import { make, write } from "./dom.js";

/** @import { State } from "./protocol.d.ts" */

const SAID_FOR = 6000; // ms

export class StatusLine {
  saying = 0;
  counts = { drawn: 0, received: 0, since: performance.now() };
  exact = make("span", { className: "exact", role: "status" });
  words = make("span", { className: "words" });
  rates = make("span", { className: "rates" });
  element = make(
    "footer",
    { className: "status" },
    this.exact,
    this.words,
    this.rates,
  );

  // What was refused is no longer so.
  accept() {
    if (this.words.classList.contains("wrong")) this.say("");
  }

  // What is wrong is said until something else is.
  /** @param {string} words */
  say(words, wrong = false) {
    this.words.textContent = words;
    this.words.classList.toggle("wrong", wrong);
    this.words.setAttribute("role", wrong ? "alert" : "status");
    clearTimeout(this.saying);
    if (wrong) return;
    this.saying = setTimeout(() => (this.words.textContent = ""), SAID_FOR);
  }

  /** @param {State} state */
  show({ exact, note, sweeps }) {
    const count = Object.keys(sweeps).length;
    const settings = count === 1 ? "1 parameter" : `${count} parameters`;
    const swept = count ? ` · the spec sweeps ${settings}` : "";
    const words = exact ? "exact: the spec gives these frames, bit for bit" : "";
    write(this.exact, [words, note].filter(Boolean).join(" · ") + swept);
    this.exact.classList.toggle("not", !exact);
  }

  // Frames a second since the last call.
  /** @param {boolean | undefined} running */
  showRates(running) {
    const { drawn, received, since } = this.counts;
    const now = performance.now();
    /** @param {number} count */
    const rate = (count) => Math.round((1000 * count) / (now - since));
    const rates = `${rate(drawn)} frames/s drawn, ${rate(received)} received`;
    write(this.rates, running ? rates : "paused");
    this.counts = { drawn: 0, received: 0, since: now };
  }
}
