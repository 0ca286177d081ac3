// The start page: demos, which open in the simulator, each with a run of its own spec
// as a moving picture.

import { button, make, setIcon } from "./dom.js";
import { bytesOf } from "./files.js";
import { hashOfRun } from "./address.js";
import { Stage } from "./stage.js";

/** @import { Scene } from "./protocol.d.ts" */

/**
 * @typedef {{
 *   name: string,
 *   title: string,
 *   sentence: string,
 *   yaml: string,
 *   speed: number,
 *   overlays: string[],
 *   beside: string,
 * }} Demo
 */
/** @typedef {{ scene: Scene, frames: string[] }} Moving */

const APART = 70; // ms between two frames
const ROOM = { side: 8, top: 8, bottom: 8 };
const SIMULATOR = "./";

class Card {
  /** @param {Demo} demo */
  constructor({ name, title, sentence, yaml, ...opening }) {
    this.name = name;
    this.overlays = opening.overlays;
    /** @type {ArrayBuffer[]} */
    this.frames = [];
    this.place = 0;
    /** @type {Stage | null} */
    this.stage = null;
    this.canvas = make("canvas", { "aria-hidden": "true" });
    this.element = make(
      "li",
      {},
      make(
        "a",
        { href: SIMULATOR + hashOfRun(yaml, opening) },
        make("div", { className: "moving" }, this.canvas),
        make("h2", { textContent: title }),
        make("p", { textContent: sentence }),
      ),
    );
  }

  async load() {
    const answer = await fetch(`demos/${this.name}`);
    if (!answer.ok) return;
    /** @type {Moving} */
    const { scene, frames } = await answer.json();
    this.frames = frames.map((frame) => bytesOf(frame).buffer);
    this.stage = new Stage(this.canvas, () => {}, () => {}, ROOM);
    this.stage.overlays = new Set(this.overlays);
    this.stage.setScene(scene);
    this.stage.take(this.frames[0]);
  }

  next() {
    if (!this.stage) return;
    this.place = (this.place + 1) % this.frames.length;
    this.stage.take(this.frames[this.place]);
  }
}

// The pictures move until somebody stops them, or from the beginning only where nobody
// has asked their system for less motion.
class Cinema {
  /** @param {Card[]} cards */
  constructor(cards) {
    this.cards = cards;
    this.moves = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.button = button("pause", "", () => this.toggle(), " ");
    this.show();
    setInterval(() => this.tick(), APART);
  }

  toggle() {
    this.moves = !this.moves;
    this.show();
  }

  show() {
    const words = this.moves ? "Stop the animations" : "Play the animations";
    setIcon(this.button, this.moves ? "pause" : "play", words);
    this.button.lastChild?.replaceWith(make("span", { textContent: words }));
  }

  tick() {
    if (this.moves) { for (const card of this.cards) card.next(); }
  }
}

/** @param {HTMLElement} main @param {Demo[]} demos */
function build(main, demos) {
  const cards = demos.map((demo) => new Card(demo));
  const cinema = new Cinema(cards);
  const simulator = make("a", {
    className: "primary",
    href: SIMULATOR,
    textContent: "Start with a model",
  });
  main.append(
    make(
      "header",
      {},
      make("h1", { textContent: "boidsweep" }),
      make("p", {
        textContent:
          "Experiments with swarms that follow simple rules, as published papers" +
          " describe them. Choose a demo: it runs at once, and you can change it.",
      }),
      make("div", { className: "row" }, simulator, cinema.button),
    ),
    make("ul", { className: "demos" }, ...cards.map((card) => card.element)),
    make("p", {
      className: "facts",
      textContent:
        "The animations are runs of the specs of the demos, simulated on this machine.",
    }),
  );
  return cards;
}

const main = document.querySelector("main");
if (main) {
  const answer = await fetch("demos");
  /** @type {{ demos: Demo[] }} */
  const { demos } = await answer.json();
  const cards = build(main, demos);
  await Promise.all(cards.map((card) => card.load()));
}
