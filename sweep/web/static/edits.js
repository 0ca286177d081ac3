// Undo and redo of all edits; each says what it undoes.

import { button, make, write } from "./dom.js";

/** @import { State } from "./protocol.d.ts" */

const NAMES = { undo: "Undo", redo: "Redo" };
const KEYS = { undo: "Ctrl Z", redo: "Ctrl Shift Z" };

export class EditBar {
  /** @param {(type: "undo" | "redo") => void} act */
  constructor(act) {
    this.act = act;
    this.buttons = { undo: this.button("undo"), redo: this.button("redo") };
    this.element = make(
      "div",
      { className: "edits", role: "group", "aria-label": "edits" },
      this.buttons.undo,
      this.buttons.redo,
    );
  }

  /** @param {"undo" | "redo"} type */
  button(type) {
    return button(type, NAMES[type], () => this.act(type), NAMES[type], {
      disabled: true,
    });
  }

  /** @param {State} state */
  show(state) {
    this.element.hidden = Boolean(state.replay);
    for (const type of /** @type {const} */ (["undo", "redo"])) {
      const [one, words] = [this.buttons[type], state[type]];
      const label = words ? `${NAMES[type]} ${words}` : NAMES[type];
      one.disabled = !words;
      one.title = `${label} (${KEYS[type]})`;
      if (one.lastElementChild) write(one.lastElementChild, label);
    }
  }
}
