// What a launch of a proposed spec would change, and the button that launches it.

import { button, make } from "./dom.js";
import { act, ask, Refused } from "./ask.js";

/** @import { Launches, Proposal } from "./explorer.d.ts" */

const LOOK_AGAIN = 1000; // ms

export class LaunchCard {
  /** @type {Proposal | null} */
  proposal = null;
  timer = 0;

  // `explorer` is the address of the explorer, where this is another page, and
  // `launched` is told when a launch has begun.
  /** @param {{ explorer?: string, launched?: () => void }} about */
  constructor({ explorer, launched = () => {} }) {
    this.explorer = explorer;
    this.launched = launched;
    this.refusal = make("p", { className: "refusal", role: "alert", hidden: true });
    this.difference = scrolling("difference", "output of sweep diff");
    this.lines = scrolling("lines", "changed lines of the spec");
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
      textContent: "Stop the launch",
      hidden: true,
      on: { click: () => this.end() },
    });
    this.said = make("p", { className: "facts said", role: "status" });
    this.follow = make("a", {
      target: "_blank",
      rel: "noopener",
      textContent: "Follow the launch in the explorer",
      hidden: true,
    });
    const copy = button(
      "copy",
      "Copy the command",
      () => navigator.clipboard.writeText(this.command.textContent ?? ""),
      "",
      { className: "quiet" },
    );
    const save = button("save", "Save the spec", () => this.save(), "Save the spec");
    const saved = explorer ? [] : [save]; // the simulator has a button for it
    this.content = make(
      "div",
      { className: "proposal", hidden: true },
      this.difference,
      make("details", {}, this.file, this.lines),
      make("div", { className: "command row" }, this.command, copy),
      make("div", { className: "row" }, this.launch, ...saved, this.why),
    );
    this.element = make(
      "div",
      { className: "launches" },
      this.refusal,
      this.content,
      this.said,
      make("div", { className: "row" }, this.stop, this.follow),
    );
  }

  // Proposes a text, and shows what its launch would change. Whether this page launches
  // anything.
  /** @param {string} yaml */
  async offer(yaml) {
    const { file } = await this.look();
    this.element.hidden = !file;
    if (!file) return false;
    await this.guarded(async () => {
      /** @type {Proposal} */
      const proposal = await act("propose", { yaml });
      this.show(proposal);
    });
    return true;
  }

  /** @param {Proposal | null} proposal */
  show(proposal) {
    this.proposal = proposal;
    this.refuse("");
    this.content.hidden = !proposal;
    if (!proposal) return;
    const { difference, lines, file, command, to_run: many, why_not: why } = proposal;
    this.difference.textContent = difference;
    this.file.textContent = lines ? `Changes in ${file}` : `${file} is unchanged`;
    this.lines.textContent = lines;
    this.command.textContent = command;
    const trials = many === 1 ? "1 trial" : `${many.toLocaleString("en")} trials`;
    const name = file.slice(file.search(/[^/\\]*$/));
    this.launch.textContent = lines
      ? `Write ${name} and launch ${trials}`
      : `Launch ${trials}`;
    this.launch.disabled = Boolean(why);
    this.why.textContent = why;
  }

  /** @param {string} words */
  refuse(words) {
    this.refusal.textContent = words;
    this.refusal.hidden = !words;
  }

  // Does what may be refused, also by a server that is no longer there.
  /** @param {() => Promise<void>} work */
  async guarded(work) {
    try {
      await work();
    } catch (error) {
      const gone = "The server does not answer; a launch continues without the server.";
      this.refuse(error instanceof Refused ? error.message : gone);
    }
  }

  async begin() {
    const { proposal } = this;
    if (!proposal) return;
    this.launch.disabled = true;
    const { text, seen } = proposal;
    await this.guarded(async () => {
      this.tell(await act("launch", { yaml: text, seen }));
      this.launched();
    });
  }

  async end() {
    await this.guarded(async () => this.tell(await act("stop", {})));
  }

  // Asks what has become of a launch, while it goes on.
  async look() {
    /** @type {Launches} */
    const launches = await ask("launch", {});
    this.tell(launches);
    return launches;
  }

  /** @param {Launches} launches */
  tell({ started }) {
    clearTimeout(this.timer);
    const running = started?.code === null;
    this.stop.hidden = !running;
    this.said.textContent = started ? saidOf(started) : "";
    this.follow.hidden = !started || !this.explorer;
    this.follow.href = `${this.explorer}#study=${
      encodeURIComponent(started?.study ?? "")
    }`;
    if (!running) return;
    const again = () => this.guarded(async () => void await this.look());
    this.timer = setTimeout(again, LOOK_AGAIN);
  }

  async save() {
    if (!this.proposal) return;
    const { download } = await import("./files.js");
    download("spec.yaml", "text/yaml", this.proposal.text);
  }
}

// A text of lines that may be too long for a narrow window.
/** @param {string} className @param {string} label */
const scrolling = (className, label) =>
  make("pre", { className, tabIndex: 0, role: "region", "aria-label": label });

/** @param {NonNullable<Launches["started"]>} started */
function saidOf({ study, process, code, said }) {
  if (code === null) {
    return `${study} is running as process ${process}, also without this page.`;
  }
  const end = code === 0 ? "has finished" : `has ended with code ${code}`;
  return [`The launch of ${study} ${end}.`, said].filter(Boolean).join("\n");
}
