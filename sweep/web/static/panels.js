// Which panels there are: each may be hidden, a narrow page has one at a time, and a
// presentation has none, but one slider and one plot in large type.

import { button, make } from "./dom.js";

/** @typedef {"settings" | "watch"} Panel */
/** @type {Record<Panel, [words: string, key: string]>} */
const WORDS = { settings: ["Parameters", "S"], watch: ["Overlays and metrics", "M"] };
/** @type {Panel[]} */
const PANELS = ["watch", "settings"];

export class Panels {
  /** @param {HTMLElement} root */
  constructor(root) {
    this.root = root;
    /** @type {Map<Panel, HTMLButtonElement>} */
    this.toggles = new Map(PANELS.map((panel) => [panel, this.toggle(panel)]));
    /** @type {Map<Panel, HTMLButtonElement>} */
    this.tabs = new Map(PANELS.map((panel) => [panel, this.tab(panel)]));
    this.bar = make(
      "div",
      { className: "tabs", role: "group", "aria-label": "panel" },
      ...this.tabs.values(),
    );
    this.choose("settings");
  }

  /** @param {Panel} panel */
  toggle(panel) {
    const [words, key] = WORDS[panel];
    const label = `${words} (${key})`;
    return button(panel, label, () => this.hide(panel), "", {
      "aria-pressed": "true",
      className: "panel",
    });
  }

  /** @param {Panel} panel */
  tab(panel) {
    const [textContent] = WORDS[panel];
    const one = make("button", { type: "button", textContent });
    one.addEventListener("click", () => this.choose(panel));
    return one;
  }

  // Hides a panel, or shows it again.
  /** @param {Panel} panel */
  hide(panel) {
    const hidden = this.root.classList.toggle(`without-${panel}`);
    this.toggles.get(panel)?.setAttribute("aria-pressed", String(!hidden));
  }

  // Of a narrow page, which has room for one.
  /** @param {Panel} chosen */
  choose(chosen) {
    this.root.dataset.panel = chosen;
    for (const [panel, one] of this.tabs) {
      one.setAttribute("aria-pressed", String(panel === chosen));
    }
  }
}

// The picture alone, with one slider and one plot, over the whole screen where that is
// allowed.
export class Presentation {
  // What is on the stand, each with a mark at its place in the page.
  /** @type {{ element: HTMLElement, mark: Comment }[]} */
  taken = [];
  stand = make("section", { className: "stand", "aria-label": "presentation" });

  /** @param {HTMLElement} root @param {(words: string) => void} say */
  constructor(root, say) {
    this.root = root;
    this.say = say;
    this.leaving = () => {
      if (!document.fullscreenElement && this.filling) this.end();
    };
    this.filling = false; // the screen
    document.addEventListener("fullscreenchange", this.leaving);
  }

  get going() {
    return this.root.classList.contains("presents");
  }

  stop() {
    document.removeEventListener("fullscreenchange", this.leaving);
  }

  /** @param {(HTMLElement | undefined)[]} elements */
  begin(...elements) {
    this.put(...elements);
    this.root.classList.add("presents");
    this.say("P or Esc ends the presentation; 1 to 9 choose another slider");
    this.root.requestFullscreen?.().then(() => (this.filling = true), () => {});
  }

  // Puts other elements on the stand. What was there goes back to its place.
  /** @param {(HTMLElement | undefined)[]} elements */
  put(...elements) {
    this.clear();
    for (const element of elements) {
      if (!element) continue;
      const mark = document.createComment("");
      element.replaceWith(mark);
      this.taken.push({ element, mark });
      this.stand.append(element);
    }
  }

  clear() {
    for (const { element, mark } of this.taken) mark.replaceWith(element);
    this.taken = [];
  }

  end() {
    if (!this.going) return;
    this.clear();
    this.root.classList.remove("presents");
    if (this.filling && document.fullscreenElement) document.exitFullscreen();
    this.filling = false;
  }
}
