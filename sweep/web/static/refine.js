// More points in a region of a study, or more trials: the change of its spec, what the
// change would do, and its launch.

import { make } from "./dom.js";
import { ask, Refused } from "./ask.js";
import { LaunchCard } from "./launch.js";

/** @import { Choice, Refined } from "./explorer.d.ts" */

const PARTS = ["2", "3", "4", "5", "10"];

export class RefineCard {
  /** @type {Choice | null} */
  choice = null;
  revision = "";
  asked = "";

  /** @param {(change: Partial<Choice>) => void} go */
  constructor(go) {
    this.launches = new LaunchCard();
    this.region = make("input", {
      type: "text",
      id: "region",
      placeholder: "separation_weight 0.4 0.6",
      on: { change: () => go({ region: this.region.value.trim() }) },
    });
    this.parts = make(
      "select",
      { id: "parts", on: { change: () => go({ parts: this.parts.value }) } },
      ...PARTS.map((value) => make("option", { value, textContent: value })),
    );
    this.replicates = make("input", {
      type: "text",
      inputMode: "numeric",
      id: "replicates",
      on: { change: () => go({ replicates: this.replicates.value }) },
    });
    this.element = make(
      "details",
      { className: "card refine", on: { toggle: () => this.ask() } },
      make("summary", { textContent: "Refine here" }),
      make("p", {
        className: "facts",
        textContent: "Drag across the figure, choose a point, or write a region: a" +
          " setting with its least and its largest value. Points that there are stay.",
      }),
      make(
        "div",
        { className: "choices-of-figure" },
        labelled("between", this.region),
        labelled("parts of each interval", this.parts),
        labelled("replicates of all points", this.replicates),
      ),
      this.launches.element,
    );
  }

  /** @param {Choice} choice @param {string} revision */
  show(choice, revision) {
    const given = Boolean(choice.region || choice.replicates);
    if (given && !this.choice?.region && !this.choice?.replicates) {
      this.element.open = true;
    }
    this.choice = choice;
    this.revision = revision;
    this.region.value = choice.region;
    this.parts.value = choice.parts || PARTS[0];
    this.replicates.value = choice.replicates;
    this.ask();
  }

  get question() {
    const { study = "", region = "", point = "", parts = "", replicates = "" } =
      this.choice ?? {};
    const between = region.split(",").map((one) => one.trim());
    const about = region ? [] : point.split(" ");
    return { study, between, point: about, parts, replicates };
  }

  // Asks what the change would be, if it is looked at and another one than before.
  async ask() {
    const { question } = this;
    const wanted = JSON.stringify([question, this.revision]);
    if (!this.element.open || !this.choice || wanted === this.asked) return;
    this.asked = wanted;
    await this.launches.look();
    if (!this.choice.region && !this.choice.point && !this.choice.replicates) {
      return this.launches.show(null);
    }
    try {
      /** @type {Refined} */
      const refined = await ask("refine", question);
      if (wanted !== this.asked) return;
      this.launches.show(refined);
      this.replicates.placeholder = String(refined.replicates ?? "");
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      if (wanted !== this.asked) return;
      this.launches.show(null);
      this.launches.refuse(error.message);
    }
  }
}

/** @param {string} words @param {HTMLInputElement | HTMLSelectElement} field */
const labelled = (words, field) =>
  make("div", {}, make("label", { htmlFor: field.id, textContent: words }), field);
