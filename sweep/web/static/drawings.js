// The files of a figure, which the command below the figure writes too: as drawn, or in
// a width for a journal.

import { make } from "./dom.js";
import { ask, Refused } from "./ask.js";

/** @import { Choice, Figure } from "./explorer.d.ts" */

export class FigureFiles {
  drawing = false;

  // `asked` returns the question for the figure that is shown.
  /**
   * @param {string} prefix
   * @param {() => Record<string, string | string[]>} asked
   * @param {(change: Partial<Choice>) => void} go
   */
  constructor(prefix, asked, go) {
    this.asked = asked;
    this.width = make("select", {
      id: `${prefix}-width`,
      on: { change: () => go({ width: this.width.value }) },
    });
    this.formats = make("span", { className: "row" });
    this.words = make("span", { className: "facts", role: "status" });
    this.refusal = make("p", { className: "refusal", role: "alert", hidden: true });
    const label = make("label", {
      htmlFor: this.width.id,
      textContent: "save the figure, width",
    });
    this.element = make(
      "div",
      { hidden: true },
      make(
        "div",
        { className: "row files" },
        label,
        this.width,
        this.formats,
        this.words,
      ),
      this.refusal,
    );
  }

  /** @param {Figure} figure @param {string} width */
  show({ formats, widths }, width) {
    if (!this.width.options.length) {
      const options = ["", ...widths].map((value) =>
        make("option", { value, textContent: value ? `${value} mm` : "as drawn" })
      );
      this.width.append(...options);
      this.formats.append(...formats.map((format) => this.button(format)));
    }
    this.width.value = width;
    this.tell("", "");
  }

  /** @param {string} format */
  button(format) {
    return make("button", {
      type: "button",
      textContent: format.toUpperCase(),
      title: `the file of the command with --format ${format}`,
      on: { click: () => this.save(format) },
    });
  }

  /** @param {string} words @param {string} refusal */
  tell(words, refusal) {
    this.words.textContent = words;
    this.refusal.textContent = refusal;
    this.refusal.hidden = !refusal;
  }

  // The server draws one file at a time.
  /** @param {string} format */
  async save(format) {
    if (this.drawing) return;
    this.drawing = true;
    this.tell("drawing …", "");
    try {
      const { bytesOf, download } = await import("./files.js");
      /** @type {{ name: string, base64: string }} */
      const file = await ask("file", { ...this.asked(), format });
      download(file.name, "application/octet-stream", bytesOf(file.base64));
      this.tell(file.name, "");
    } catch (error) {
      const away = "The file was not drawn: the server does not answer.";
      this.tell("", error instanceof Refused ? error.message : away);
    } finally {
      this.drawing = false;
    }
  }
}
