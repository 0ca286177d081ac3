// The buttons over the picture: what the mouse does, and which part of the world is
// seen.

import { button, make } from "./dom.js";

/** @import { Hand, Tool } from "./pointer.js" */
/** @import { Fit, Stage } from "./stage.js" */

/** @type {[tool: Tool, key: string, words: string][]} */
const TOOLS = [
  ["select", "V", "Select and move"],
  ["disc", "D", "Draw a disc"],
  ["rectangle", "B", "Draw a box"],
  ["goal", "G", "Set the goal"],
];

export class Toolbar {
  /** @param {Hand} hand @param {Stage} stage @param {(how: Fit) => void} fit */
  constructor(hand, stage, fit) {
    this.hand = hand;
    this.stage = stage;
    this.buttons = new Map(
      TOOLS.map(([tool, key, words]) => [tool, this.button(tool, key, words)]),
    );
    this.tools = make(
      "div",
      { className: "tools", role: "toolbar", "aria-label": "tools" },
      ...this.buttons.values(),
    );
    const world = button("world", "Show the whole world (F)", () => fit("world"));
    this.follow = button(
      "flock",
      "Follow the boids",
      () => fit(stage.fit === "boids" ? "world" : "boids"),
      "",
      { "aria-pressed": "false" },
    );
    this.views = make(
      "div",
      { className: "tools right", role: "toolbar", "aria-label": "view" },
      world,
      this.follow,
    );
  }

  /** @param {Tool} tool @param {string} key @param {string} words */
  button(tool, key, words) {
    const one = button(tool, `${words} (${key})`, () => this.hand.use(tool), "", {
      "aria-pressed": "false",
    });
    one.dataset.tool = tool;
    return one;
  }

  show() {
    const { hand, stage } = this;
    this.tools.hidden = hand.frozen;
    for (const [tool, one] of this.buttons) {
      one.setAttribute("aria-pressed", String(tool === hand.tool));
    }
    const goal = this.buttons.get("goal");
    if (goal && stage.scene) goal.hidden = !stage.scene.goal;
    this.follow.setAttribute("aria-pressed", String(stage.fit === "boids"));
  }
}
