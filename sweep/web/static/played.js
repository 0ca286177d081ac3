// The player of the simulator, beside the figure: one trial, or two on one clock.

import { make } from "./dom.js";
import { ask } from "./ask.js";
import { mount } from "./mount.js";
import { pageId, Socket } from "./socket.js";

/** @import { Choice } from "./explorer.d.ts" */
/** @import { StoredName } from "./protocol.d.ts" */
/** @import { View } from "./view.js" */

const SIDES = /** @type {const} */ (["trial", "beside"]);

/** @typedef {Required<StoredName>} Stored */

export class Played {
  /** @type {{ unmount(): void, view: View } | null} */
  mounted = null;
  shown = "";

  /**
   * @param {HTMLElement} element
   * @param {(change: Partial<Choice>) => void} go
   * @param {HTMLElement[]} about
   */
  constructor(element, go, about) {
    this.element = element;
    this.go = go;
    this.title = make("h2");
    this.words = make("span", { className: "facts" });
    this.links = make("span", { className: "row" });
    this.place = make("div", { className: "player bare" });
    this.more = make("button", {
      type: "button",
      textContent: "All controls",
      "aria-pressed": "false",
      on: { click: () => this.widen() },
    });
    const right = make("div", { className: "row" }, this.words, this.links, this.more);
    element.append(make("div", { className: "row spread" }, this.title, right));
    element.append(...about, this.place);
  }

  // Shows what else the simulator has, or hides it again.
  widen() {
    const bare = this.place.classList.toggle("bare");
    this.more.setAttribute("aria-pressed", String(!bare));
  }

  /** @param {Choice} choice */
  show({ study, trial, beside }) {
    if (trial && [study, trial, beside].join(" ") === this.shown) return;
    this.shown = "";
    this.mounted?.unmount();
    this.mounted = null;
    this.element.classList.toggle("two", Boolean(beside));
    if (!trial) return;
    this.title.textContent = beside ? "Two trials side by side" : "Trial";
    this.play(this.tell({ study, trial, beside }));
  }

  // Which trials are played, in words.
  /** @param {Stored} stored */
  tell(stored) {
    const { study, trial, beside } = stored;
    const trials = [trial, beside].filter(Boolean);
    this.shown = [study, trial, beside].join(" ");
    this.words.textContent = trials.join(" and ");
    this.link(study, trials);
    return stored;
  }

  /** @param {Stored} stored */
  play(stored) {
    // A view says `stored` to each server: what is gone to in the player is kept there.
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const mounted = mount(this.place, new Socket(), {
      opening: { run: !still },
      page: [pageId(), this.shown].join(" "),
      stored,
      alone: (side) => this.go({ trial: stored[SIDES[side]], beside: "" }),
      playing: (side, id) => {
        if (mounted !== this.mounted || stored[SIDES[side]] === id) return;
        stored[SIDES[side]] = id;
        this.tell(stored);
        this.go({ [SIDES[side]]: id });
      },
    });
    this.mounted = mounted;
  }

  // A link to the simulator for each of the trials.
  /** @param {string} study @param {string[]} trials */
  async link(study, trials) {
    this.links.replaceChildren();
    const { shown } = this;
    const links = await Promise.all(
      trials.map(async (trial, i) => {
        /** @type {{ yaml: string, point: string, replicate: number }} */
        const { yaml, point, replicate } = await ask("spec", { study, trial });
        const told = { spec: yaml, point, replicate: String(replicate) };
        const which = trials.length > 1 ? `${"AB"[i]} ` : "";
        return make("a", {
          target: "_blank",
          rel: "noopener",
          textContent: `Open ${which}in the simulator`,
          href: `index.html#${new URLSearchParams(told)}`,
        });
      }),
    );
    if (shown === this.shown) this.links.replaceChildren(...links);
  }
}
