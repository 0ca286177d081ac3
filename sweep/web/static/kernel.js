// In a notebook: questions to the kernel, and lines to the runs that it plays. The page
// of the explorer has this in place of ask.js and socket.js.

import { make, randomName } from "./dom.js";

/** @import { Channel, Line } from "./kernel.d.ts" */
/** @import { Listener, Message } from "./protocol.d.ts" */

const WAITED = 1500; // ms
const WAITING = "Waiting for the kernel, which is busy or gone.";
const GONE = "The kernel of these results has stopped. Run the cell again.";

/** A refusal: one sentence of the kernel. */
export class Refused extends Error {}

class Kernel {
  /** @type {Map<string, { hear(answer: any): void, refuse(why: Error): void }>} */
  asked = new Map();
  /** @type {Map<string, Line>} */
  lines = new Map();
  /** @type {Map<string, number>} */
  unheard = new Map();
  gone = false;

  /** @param {Channel} channel */
  constructor(channel) {
    this.channel = channel;
    this.note = make("p", {
      className: "kernel-note",
      role: "status",
      hidden: true,
      textContent: WAITING,
    });
    document.body.prepend(this.note);
    channel.onmessage = (said) => this.receive(said);
    channel.onend = () => this.end();
    document.documentElement.dataset.scheme = channel.scheme;
    if (channel.hash) location.hash = channel.hash;
    addEventListener("hashchange", () => (channel.hash = location.hash));
  }

  // Says something to the kernel, which answers at once that it has heard it.
  /** @param {Record<string, unknown>} message */
  say(message) {
    const id = randomName();
    this.unheard.set(id, setTimeout(() => (this.note.hidden = false), WAITED));
    this.channel.send({ ...message, id });
    return id;
  }

  /** @param {string} question @param {string[][]} query */
  ask(question, query) {
    if (this.gone) return Promise.reject(new Refused(GONE));
    return new Promise((hear, refuse) => {
      this.asked.set(this.say({ type: "ask", question, query }), { hear, refuse });
    });
  }

  /** @param {Parameters<Channel["onmessage"]>[0]} said */
  receive(said) {
    switch (said.type) {
      case "heard":
        clearTimeout(this.unheard.get(said.id));
        this.unheard.delete(said.id);
        this.note.hidden = this.unheard.size === 0 || this.note.hidden;
        break;
      case "answer":
        this.asked.get(said.id)?.hear(said.answer);
        this.asked.delete(said.id);
        break;
      case "refusal":
        this.asked.get(said.id)?.refuse(new Refused(said.why));
        this.asked.delete(said.id);
        break;
      default:
        this.lines.get(said.line)?.receive(said);
    }
  }

  // The kernel is gone for good.
  end() {
    this.gone = true;
    for (const timer of this.unheard.values()) clearTimeout(timer);
    this.note.hidden = true;
    for (const { refuse } of this.asked.values()) refuse(new Refused(GONE));
    for (const line of this.lines.values()) line.onend(GONE);
  }
}

const frame = /** @type {{ boidsweep: Channel } | null} */ (
  /** @type {unknown} */ (window.frameElement)
);
if (!frame) throw new Error("this page is a part of a notebook");
const kernel = new Kernel(frame.boidsweep);
const page = randomName();

export const pageId = () => page;

/**
 * @template T
 * @param {string} question
 * @param {Record<string, string | string[]>} words a key that is empty is left out
 * @returns {Promise<T>}
 */
export function ask(question, words) {
  const query = Object.entries(words).flatMap(([name, values]) =>
    [values].flat().filter(Boolean).map((value) => [name, value])
  );
  return /** @type {Promise<T>} */ (kernel.ask(question, query));
}

// A notebook launches nothing: that is a cell of its own, with sweep.run.
/** @returns {Promise<never>} */
export const act = () =>
  Promise.reject(new Refused("In a notebook this page cannot launch trials."));

// A line to a run of the kernel, as a transport.
export class Socket {
  // The view sets these, to listen.
  /** @type {Listener["onopen"]} */
  onopen = () => {};
  /** @type {Listener["onmessage"]} */
  onmessage = () => {};
  /** @type {Listener["onend"]} */
  onend = () => {};
  name = randomName();

  start() {
    kernel.lines.set(this.name, this);
    kernel.say({ type: "open", line: this.name });
    this.onopen();
  }

  /** @param {Parameters<Line["receive"]>[0]} said */
  receive(said) {
    if (said.type === "over") this.onend(said.why);
    else this.onmessage(said.frame ?? said.message);
  }

  /** @param {Message} message */
  send(message) {
    kernel.say({ type: "say", line: this.name, text: JSON.stringify(message) });
  }

  close() {
    kernel.lines.delete(this.name);
    kernel.say({ type: "close", line: this.name });
  }
}
