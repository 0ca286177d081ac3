// More points in a region of a study, or more trials: the change of its spec, what the
// change would do, and its launch.

import { make, short, spaced } from "./dom.js";
import { ask, Refused } from "./ask.js";
import { ALL } from "./behind.js";
import { regionOf } from "./region.js";

/** @import { Choice, Refined } from "./explorer.d.ts" */

const PARTS = ["2", "3", "4", "5", "10"];

export class RefineCard {
  /** @type {Choice | null} */
  choice = null;
  revision = "";
  asked = "";
  /** @type {import("./launch.js").LaunchCard | null} */
  launches = null;

  /** @param {(change: Partial<Choice>) => void} go */
  constructor(go) {
    this.go = go;
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
    this.about = make("span", { className: "facts" });
    this.element = make(
      "details",
      { className: "card refine", on: { toggle: () => this.ask() } },
      make("summary", {}, "Refine here", this.about),
      make("p", {
        className: "facts",
        textContent: "Drag across the figure, choose a point, or write a region: a" +
          " parameter with the least and the largest value. Existing points stay.",
      }),
      make(
        "div",
        { className: "choices-of-figure" },
        labelled("between", this.region),
        labelled("parts per segment", this.parts),
        labelled("replicates per point", this.replicates),
      ),
    );
  }

  // What shows the change, and launches it; its script is loaded for the first one.
  async launching() {
    const { LaunchCard } = await import("./launch.js");
    if (this.launches) return this.launches;
    const nothing = { region: "", point: "", parts: "", replicates: "" };
    this.launches = new LaunchCard({ launched: () => this.go(nothing) });
    this.element.append(this.launches.element);
    return this.launches;
  }

  /** @param {Choice} choice @param {string} revision */
  show(choice, revision) {
    // An address that asks for a change shows it.
    if (!this.choice && (choice.region || choice.replicates)) this.element.open = true;
    if (this.choice?.study !== choice.study) this.replicates.placeholder = "";
    this.choice = choice;
    this.about.textContent = aboutOf(choice);
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
    const about = region ? [] : idsOf(point);
    return { study, between, point: about, parts, replicates };
  }

  // Asks what the change would be, if it is looked at and another one than before.
  async ask() {
    const { question } = this;
    const wanted = JSON.stringify([question, this.revision]);
    if (!this.element.open || !this.choice || wanted === this.asked) return;
    this.asked = wanted;
    const launches = await this.launching();
    await launches.look();
    if (wanted !== this.asked) return;
    const { between, point, replicates } = question;
    if (![...between, ...point, replicates].some(Boolean)) {
      return launches.show(null);
    }
    try {
      /** @type {Refined} */
      const refined = await ask("refine", question);
      if (wanted !== this.asked) return;
      launches.show(refined);
      this.replicates.placeholder = String(refined.replicates ?? "");
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      if (wanted !== this.asked) return;
      launches.show(null);
      launches.refuse(error.message);
    }
  }
}

// The ids of the points that are chosen; all of them are no choice.
/** @param {string} point */
const idsOf = (point) => (point === ALL ? [] : point.split(" ").filter(Boolean));

// What would be refined, for the head of the card.
/** @param {Choice} choice */
function aboutOf({ region, point }) {
  const between = Object.entries(regionOf(region)).map(([name, [low, high]]) =>
    `${spaced(name)} ${short(low)} to ${short(high)}`
  );
  if (between.length) return between.join(", ");
  const many = idsOf(point).length;
  return many ? `about ${many === 1 ? "a point" : `${many} points`}` : "";
}

/** @param {string} words @param {HTMLInputElement | HTMLSelectElement} field */
const labelled = (words, field) =>
  make("div", {}, make("label", { htmlFor: field.id, textContent: words }), field);
