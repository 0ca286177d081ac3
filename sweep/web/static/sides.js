// The form in which two sides are named, to be compared.

import { ask } from "./ask.js";
import { make } from "./dom.js";

/** @import { Choice, Study } from "./explorer.d.ts" */

export const SIDES = /** @type {const} */ (["a", "b"]);
export const LETTERS = { a: "A", b: "B" };

// Two sides as sweep compare takes them, to be compared.
export class SidesForm {
  known = "";

  /** @param {string} prefix @param {(change: Partial<Choice>) => void} go */
  constructor(prefix, go) {
    this.names = make("datalist", { id: `${prefix}-names` });
    this.fields = SIDES.map((side) =>
      make("input", {
        type: "text",
        id: `${prefix}-${side}`,
        placeholder: "STUDY, STUDY:setting=value or STUDY:PRESET",
        required: true,
      })
    );
    for (const field of this.fields) field.setAttribute("list", this.names.id);
    const submit = make("button", { type: "submit", textContent: "compare" });
    this.element = make(
      "form",
      { className: "sides row" },
      ...this.fields.flatMap((field, i) => [
        make("label", { htmlFor: field.id, textContent: LETTERS[SIDES[i]] }),
        field,
      ]),
      submit,
      this.names,
    );
    // Not before somebody uses the form: the server reads all studies.
    this.element.addEventListener("focusin", () => this.offer(), { once: true });
    this.element.addEventListener("submit", (event) => {
      event.preventDefault();
      const [a, b] = this.fields.map((field) => field.value.trim());
      go({ study: "", a, b, point: "", trial: "" });
    });
  }

  // Offers the names of all studies; an object store has no list of them.
  async offer() {
    /** @type {{ studies: Study[] }} */
    const { studies } = await ask("studies", {}).catch(() => ({ studies: [] }));
    const options = studies.map(({ study }) => make("option", { value: study }));
    this.names.replaceChildren(...options);
  }

  // What somebody types stays until other sides are shown.
  /** @param {string} a @param {string} b */
  show(a, b) {
    const known = JSON.stringify([a, b]);
    if (known === this.known) return;
    this.known = known;
    [a, b].forEach((text, i) => this.fields[i].value = text);
  }
}
