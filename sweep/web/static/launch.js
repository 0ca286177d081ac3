// What a launch of a proposed spec would change, and the button that launches it.

import { button, make } from "./dom.js";
import { act, ask, Refused } from "./ask.js";
import { download } from "./files.js";

/** @import { Launches, Proposal } from "./explorer.d.ts" */

const LOOK_AGAIN = 1000; // ms

export class LaunchCard {
  /** @type {Proposal | null} */
  proposal = null;
  timer = 0;

  constructor() {
    this.refusal = make("p", { className: "refusal", role: "alert", hidden: true });
    this.difference = make("pre", { className: "difference" });
    this.lines = make("pre", { className: "lines" });
    this.file = make("summary");
    this.command = make("code");
    this.launch = make("button", {
      type: "button",
      className: "primary",
      on: { click: () => this.begin() },
    });
    this.why = make("span", { className: "facts" });
    this.stop = make("button", {
      type: "button",
      textContent: "Stop it",
      hidden: true,
      on: { click: () => this.end() },
    });
    this.said = make("p", { className: "facts said", role: "status" });
    const copy = button(
      "copy",
      "Copy the command",
      () => navigator.clipboard.writeText(this.command.textContent ?? ""),
      "",
      { className: "quiet" },
    );
    const save = button("save", "Save the spec", () => this.save(), "Save the spec");
    this.content = make(
      "div",
      { className: "proposal", hidden: true },
      this.difference,
      make("details", {}, this.file, this.lines),
      make("div", { className: "command row" }, this.command, copy),
      make("div", { className: "row" }, this.launch, save, this.why),
    );
    const element = make("div", { className: "launches" });
    element.append(
      this.refusal,
      this.content,
      make("div", { className: "row" }, this.stop),
      this.said,
    );
    this.element = element;
  }

  // Proposes a text, and shows what its launch would change.
  /** @param {string} yaml */
  async propose(yaml) {
    await this.guarded(async () => {
      /** @type {Proposal} */
      const proposal = await act("propose", { yaml });
      this.show(proposal);
    });
    await this.look();
  }

  /** @param {Proposal | null} proposal */
  show(proposal) {
    this.proposal = proposal;
    this.refuse("");
    this.content.hidden = !proposal;
    if (!proposal) return;
    const { difference, lines, file, command, to_run: many, why_not: why } = proposal;
    this.difference.textContent = difference;
    this.file.textContent = lines ? `What changes in ${file}` : `${file} stays`;
    this.lines.textContent = lines;
    this.command.textContent = command;
    const trials = many === 1 ? "1 trial" : `${many.toLocaleString("en")} trials`;
    this.launch.textContent = lines
      ? `Write ${file} and launch ${trials}`
      : `Launch ${trials}`;
    this.launch.disabled = Boolean(why);
    this.why.textContent = why;
  }

  /** @param {string} words */
  refuse(words) {
    this.refusal.textContent = words;
    this.refusal.hidden = !words;
  }

  /** @param {() => Promise<void>} work */
  async guarded(work) {
    try {
      await work();
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.refuse(error.message);
    }
  }

  async begin() {
    const { proposal } = this;
    if (!proposal) return;
    this.launch.disabled = true;
    const { text, seen } = proposal;
    await this.guarded(async () =>
      this.tell(await act("launch", { yaml: text, seen }))
    );
  }

  async end() {
    await this.guarded(async () => this.tell(await act("stop", {})));
  }

  // Asks what has become of a launch, while it goes on.
  async look() {
    this.tell(await ask("launch", {}));
  }

  /** @param {Launches} launches */
  tell({ started }) {
    clearTimeout(this.timer);
    const running = started?.code === null;
    this.stop.hidden = !running;
    this.said.textContent = started ? saidOf(started) : "";
    if (running) this.timer = setTimeout(() => this.look(), LOOK_AGAIN);
  }

  save() {
    if (this.proposal) download("spec.yaml", "text/yaml", this.proposal.text);
  }
}

/** @param {NonNullable<Launches["started"]>} started */
function saidOf({ study, process, code, said }) {
  if (code === null) {
    return `${study} is running, as process ${process}, also without this page.`;
  }
  const end = code === 0 ? "has come to its end" : `has ended with code ${code}`;
  return [`The launch of ${study} ${end}.`, said].filter(Boolean).join("\n");
}
