// The shortcuts of the keyboard, and their list.

import { short, spaced } from "./dom.js";

/** @import { View } from "./view.js" */

const HINTED_FOR = 2500; // ms

export const KEYS = [
  ["Space", "run or pause"],
  [".", "one step"],
  ["R", "reset: start again at step 0 with the same seed"],
  ["1 to 9, then + or −", "choose and change a weight"],
  ["V, D, B, G", "tools: select, disc, box, goal; G again: the next of several goals"],
  ["Click, [ or ]", "select a boid, or the previous or next boid"],
  [
    "Arrow keys",
    "move the selected obstacle or goal, with Shift resize it; or move the view",
  ],
  ["Delete", "remove the selected obstacle"],
  ["Ctrl Z, Ctrl Shift Z", "undo or redo an edit"],
  ["Wheel, Page Up, Page Down", "zoom; F shows the whole world"],
  ["C", "copy as spec"],
  ["S, M", "hide or show the parameters, the overlays and metrics"],
  ["P", "presentation: only the animation, one slider and one plot"],
  ["Esc", "clear the selection, or end the presentation"],
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
    // Of two runs side by side each has its own keys.
    const side = target?.closest(".side");
    if (side && !side.contains(view.root)) return;
    const typing = target?.closest(
      "input:not([type=range]):not([type=checkbox]), select, textarea, dialog[open]",
    );
    if (typing || !view.state) return;
    if (view.away && event.key.toLowerCase() !== "c") return;
    const held = event.ctrlKey || event.metaKey;
    const undoing = held && event.key.toLowerCase() === "z";
    if (undoing) view.undo(event.shiftKey ? "redo" : "undo");
    if ((held || event.altKey) && !undoing) return;
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
      c: () => view.copySpec(),
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
      s: () => view.panels.hide("settings"),
      m: () => view.panels.hide("watch"),
      p: () => view.present(),
      Escape: () => {
        view.presentation.end();
        view.hand.release();
      },
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
    const other = this.weight !== index;
    this.weight = index;
    if (other) view.presentWeight();
    const value = direction ? field.step(direction) : field.value;
    const weight = `${spaced(field.about.name)} ${short(value, 6)}`;
    this.hint(`${index + 1}  ${weight}  (+ or −)`);
  }

  // Says something over the picture, for a moment.
  /** @param {string} words */
  hint(words) {
    const { hint } = this.view;
    hint.textContent = words;
    hint.hidden = false;
    clearTimeout(this.hinted);
    this.hinted = setTimeout(() => (hint.hidden = true), HINTED_FOR);
  }
}
