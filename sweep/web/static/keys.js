// The shortcuts of the keyboard, and their list.

import { short, spaced } from "./dom.js";

/** @import { View } from "./view.js" */

const HINTED_FOR = 2500; // ms

export const KEYS = [
  ["Space", "run or pause"],
  [".", "one step"],
  ["R", "reset: the same seed from step 0"],
  ["1 to 9, then + or −", "choose a weight and change it"],
  ["V, D, B, G", "tools: select, disc, box, goal"],
  ["Click, [ or ]", "select a boid, or the one before or after"],
  [
    "Arrow keys",
    "move the selected obstacle; with Shift, resize it; without one, move the view",
  ],
  ["Delete", "remove the selected obstacle"],
  ["Ctrl Z", "undo a change of the obstacles"],
  ["Wheel, Page Up, Page Down", "zoom; F shows the whole world"],
  ["C", "copy as spec"],
  ["Esc", "let go of what is selected"],
];

// The shortcuts of a view, for keys pressed in the element `from`.
export class Keys {
  /** @param {View} view @param {Document | HTMLElement} from */
  constructor(view, from) {
    this.view = view;
    this.from = from;
    this.weight = 0;
    this.hinted = 0;
    this.press = (/** @type {Event} */ event) => {
      if (event instanceof KeyboardEvent) this.key(event);
    };
    from.addEventListener("keydown", this.press);
  }

  stop() {
    this.from.removeEventListener("keydown", this.press);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { view } = this;
    if (event.key === "Tab") view.pointed = false;
    const target = event.target instanceof HTMLElement ? event.target : null;
    const typing = target?.closest(
      "input:not([type=range]):not([type=checkbox]), select, textarea, dialog[open]",
    );
    if (typing || !view.state) return;
    const undoing = event.key === "z" && (event.ctrlKey || event.metaKey);
    if (undoing) view.hand.undo();
    if ((event.ctrlKey || event.metaKey || event.altKey) && !undoing) return;
    if (event.key === " " && target?.closest("button, summary, [type=checkbox]")) {
      if (!view.pointed) return;
      // The button was clicked, not reached by Tab: the key is meant for the run.
      target.blur();
    }
    if (!undoing && !this.shortcut(event.key)) return;
    event.preventDefault();
  }

  /** @param {string} key */
  shortcut(key) {
    const { view } = this;
    /** @type {Record<string, () => void>} */
    const acts = {
      " ": () => view.run.toggle(),
      ".": () => view.send({ type: "step", count: 1 }),
      r: () => view.send({ type: "reset" }),
      f: () => view.fit("world"),
      c: () => view.send({ type: "spec" }),
      v: () => view.hand.use("select"),
      d: () => view.hand.use("disc"),
      b: () => view.hand.use("rectangle"),
      g: () => view.stage.scene?.goal && view.hand.use("goal"),
      "[": () => view.boid.beside(-1),
      "]": () => view.boid.beside(1),
      "?": () => view.help.showModal(),
      "+": () => this.weigh(1),
      "=": () => this.weigh(1),
      "-": () => this.weigh(-1),
      Delete: () => view.hand.remove(),
      Escape: () => view.hand.release(),
    };
    const act = /^[1-9]$/.test(key)
      ? () => this.weigh(0, Number(key) - 1)
      : acts[key.length === 1 ? key.toLowerCase() : key];
    act?.();
    return Boolean(act);
  }

  // Weights by keyboard: a digit chooses one, plus and minus change it.
  /** @param {number} direction @param {number} index */
  weigh(direction, index = this.weight) {
    const { view } = this;
    const field = view.groups.weights[index];
    if (!field || view.hand.frozen) return;
    this.weight = index;
    const value = direction ? field.step(direction) : field.value;
    view.hint.textContent = `${index + 1}  ${spaced(field.about.name)} ${
      short(value, 6)
    }  (+ or −)`;
    view.hint.hidden = false;
    clearTimeout(this.hinted);
    this.hinted = setTimeout(() => (view.hint.hidden = true), HINTED_FOR);
  }
}
