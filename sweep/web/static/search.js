// A field to search a long list: entries without all of its words are hidden.

import { make } from "./dom.js";

const MANY = 12; // a list with fewer entries has no field

export class SearchField {
  // `changed` hears that the words have changed.
  /** @param {string} label @param {() => void} changed */
  constructor(label, changed) {
    this.input = make("input", {
      type: "search",
      placeholder: label,
      "aria-label": label,
      on: { input: changed },
    });
    this.none = make("p", { className: "facts", role: "status" });
    this.element = make("div", { className: "search" }, this.input, this.none);
  }

  // The words stay when a list is made anew, as long as they can be seen.
  /** @param {number} count of entries in the list */
  offer(count) {
    this.element.hidden = count < MANY;
    if (this.element.hidden) this.input.value = "";
  }

  get isEmpty() {
    return !this.input.value.trim();
  }

  // Hides the entries whose texts lack a word, and returns the others.
  /** @param {{ element: HTMLElement, text: string }[]} entries */
  apply(entries) {
    const words = this.input.value.toLowerCase().split(/[\s_]+/).filter(Boolean);
    const shown = entries.filter(({ element, text }) => {
      const known = text.replaceAll("_", " ").toLowerCase();
      element.hidden = !words.every((word) => known.includes(word));
      return !element.hidden;
    });
    this.none.textContent = shown.length ? "" : `nothing has "${this.input.value}"`;
    return shown;
  }
}
