// A plot seen closer: larger, with what its metric is, who defines it, what was
// published of it, and its values as a file.

import { button, make, unitText } from "./dom.js";
import { dialog } from "./dialogs.js";
import { download } from "./files.js";
import { linked } from "./about.js";
import { Plot } from "./plots.js";

export class Closer {
  // The plot that is shown.
  /** @type {Plot | null} */
  of = null;
  what = "";

  /**
   * @param {HTMLElement} root
   * @param {(use: (name: string) => void) => void} named names a file of the run
   */
  constructor(root, named) {
    this.named = named;
    this.content = make("div", { className: "closer" });
    const save = button("save", "Save as CSV", () => this.save(), "Save as CSV");
    this.note = make("span", { className: "facts" });
    this.log = make("input", { type: "checkbox", on: { change: () => this.scale() } });
    const scale = make(
      "label",
      { className: "row", title: "Omits values of 0 and below" },
      this.log,
      "logarithmic axis",
    );
    const below = make("footer", {}, save, scale, this.note);
    this.box = dialog(root, "Metric", this.content, below);
    this.box.classList.add("wide");
    this.box.addEventListener("close", () => this.of && this.leave(this.of));
  }

  // `what` is shown, in the name of the file: of a metric its name.
  /** @param {Plot} plot @param {string} what */
  show(plot, what = plot.metric.name) {
    this.what = what;
    if (this.of) this.leave(this.of);
    const { metric, series, acts: { read, seek, clock } } = plot;
    const acts = { read, seek, clock };
    this.of = plot;
    plot.larger = new Plot(metric, series, { settings: {}, exact: true }, acts);
    plot.larger.line.replaceWith(this.about(plot));
    this.tell(plot);
    this.log.checked = plot.logarithmic;
    this.log.disabled = plot.known().every((value) => value <= 0);
    this.content.replaceChildren(plot.larger.element);
    this.box.showModal();
    read(null); // which draws it
  }

  /** @param {Plot} plot */
  about({ metric: { text, unit, source, published: all }, published }) {
    /** @type {[string, (Node | string)[]][]} */
    const rows = [
      ["definition", [text]],
      ["unit", [unitText(unit) || "none"]],
    ];
    if (source) rows.push(["source", linked(source)]);
    for (const { where, says } of published) {
      rows.push(["published", [`${where}: ${says}`]]);
    }
    const others = all.length - published.length;
    if (others) rows.push(["published", [`${others} more for other parameters`]]);
    const cells = rows.flatMap(([term, words]) => [
      make("dt", { textContent: term }),
      make("dd", {}, ...words),
    ]);
    return make("dl", {}, ...cells);
  }

  // Runs side by side have the same axes.
  scale() {
    const { of } = this;
    if (!of) return;
    for (const one of [of, of.peer]) if (one) one.logarithmic = this.log.checked;
    of.acts.read(null); // which draws it
  }

  // Which steps have a value, now: more may have been shown since.
  /** @param {Plot} plot */
  tell({ series: { steps, values } }) {
    const known = steps.filter((_, i) => values[i] !== null);
    const apart = known.reduce(
      (most, step, i) => (i ? Math.max(most, step - known[i - 1]) : most),
      1,
    );
    this.note.textContent = apart > 1
      ? `Measured steps only, up to ${apart} apart; a launch measures all steps.`
      : `All steps from ${known[0] ?? 0} to ${known.at(-1) ?? 0}, with all digits.`;
  }

  // The text of a number is the shortest one that gives it again.
  save() {
    if (!this.of) return;
    this.tell(this.of);
    const { metric: { name, unit }, series: { steps, values } } = this.of;
    const head = `step,${name}${unit && ` (${unit})`}`;
    const rows = steps.map((step, i) => `${step},${values[i] ?? ""}`);
    const text = `${[head, ...rows].join("\n")}\n`;
    const { what } = this;
    this.named((file) => download(`${file}-${what}.csv`, "text/csv", text));
  }

  /** @param {Plot} plot */
  leave(plot) {
    if (this.of !== plot) return;
    plot.larger = null;
    this.of = null;
    if (this.box.open) this.box.close();
  }
}
