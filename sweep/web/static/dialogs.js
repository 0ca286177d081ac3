// Dialogs: the copied spec, the menu of files, the keys, and the choice of metrics.

import { button, make, spaced } from "./dom.js";
import { download } from "./files.js";
import { KEYS } from "./keys.js";
import { SearchField } from "./search.js";

/** @import { Picture } from "./dom.js" */
/** @import { LaunchCard } from "./launch.js" */
/** @import { Metric, Spec } from "./protocol.d.ts" */

/** @param {HTMLElement} root @param {string} title @param {HTMLElement[]} children */
export function dialog(root, title, ...children) {
  const close = button("remove", "Close", () => box.close(), "", {
    className: "quiet",
  });
  const heading = make("h2", { textContent: title });
  const box = make(
    "dialog",
    { "aria-label": title },
    make("header", {}, heading, close),
    ...children,
  );
  box.addEventListener("click", (event) => event.target === box && box.close());
  root.append(box);
  return box;
}

const COMMAND = "sweep launch spec.yaml";
// The line of a key at the top of a spec: the key, its value, and a comment.
/** @param {string} key */
const lineOf = (key) =>
  new RegExp(`^(${key}: *)("[^"\\\\]*"|[^\\s#{["']\\S*)((?: +#.*)?)$`, "m");
const NAME = /^[A-Za-z0-9_][A-Za-z0-9_.-]*(\/[A-Za-z0-9_][A-Za-z0-9_.-]*)*$/;
const WHOLE = /^[1-9]\d{0,5}$/;

export class SpecDialog {
  /**
   * @param {HTMLElement} root
   * @param {(() => string) | undefined} address
   * @param {LaunchCard} [launches]
   */
  constructor(root, address, launches) {
    this.words = "";
    this.exact = false;
    this.given = "";
    this.replicatesBefore = 1;
    this.launches = launches;
    this.usual = make(
      "p",
      {},
      "In the folder of the saved file: ",
      make("code", {}, COMMAND),
    );
    this.text = make("textarea", {
      readOnly: true,
      spellcheck: false,
      rows: 18,
      "aria-label": "spec.yaml",
    });
    this.note = make("p", { role: "status" });
    this.name = this.field("study", NAME, { spellcheck: false });
    this.replicates = this.field("replicates", WHOLE, { inputMode: "numeric" });
    const copy = button("copy", "Copy", () => this.copy(), "Copy", {
      className: "primary",
    });
    const save = button(
      "save",
      "Save as spec.yaml",
      () => download("spec.yaml", "text/yaml", this.text.value),
      "Save as spec.yaml",
    );
    this.box = dialog(
      root,
      "This state as a spec",
      this.note,
      make(
        "div",
        { className: "keys-of-spec" },
        this.name.label,
        this.replicates.label,
      ),
      this.text,
      this.usual,
      ...(launches ? [launches.element] : []),
      make("footer", {}, copy, save, ...(address ? [this.link(address)] : [])),
    );
  }

  // A key of the spec that can be changed here: an allowed value goes into the text.
  /**
   * @param {string} key
   * @param {RegExp} allowed
   * @param {Record<string, unknown>} about
   */
  field(key, allowed, about) {
    const input = make("input", {
      type: "text",
      ...about,
      on: { change: () => this.write(key, input, allowed) },
    });
    const label = make("label", {}, key, input);
    return { input, label };
  }

  /** @param {string} key @param {HTMLInputElement} input @param {RegExp} allowed */
  write(key, input, allowed) {
    const value = input.value.trim();
    if (!allowed.test(value)) {
      this.note.textContent = key === "study"
        ? "A name has letters, digits, _, - and . in it, and / between its parts."
        : "The number of replicates is an integer from 1.";
      this.read();
      return;
    }
    if (key === "replicates" && this.exact) {
      this.words = Number(value) < this.replicatesBefore
        ? "A launch with fewer replicates may lack the shown trial."
        : `${this.given} reproduces these frames.`;
    }
    // Quotes keep a name such as 2024 or true from being a number or a truth value.
    const written = key === "study" ? JSON.stringify(value) : value;
    this.text.value = this.text.value.replace(
      lineOf(key),
      (_, before, __, after) => `${before}${written}${after}`,
    );
    this.copy();
    this.offer(this.text.value);
  }

  // What the text says of the keys; a spec may have a rule in place of a number.
  read() {
    for (
      const [key, { input, label }] of Object.entries({
        study: this.name,
        replicates: this.replicates,
      })
    ) {
      const found = lineOf(key).exec(this.text.value);
      label.hidden = !found;
      input.value = found?.[2].replace(/^"|"$/g, "") ?? "";
    }
  }

  // An address that opens this state again, while a server is at this port.
  /** @param {() => string} address */
  link(address) {
    const copied = async () => {
      await navigator.clipboard.writeText(address());
      this.note.textContent = this.exact
        ? "The address of this state is in the clipboard."
        : "The address in the clipboard opens these parameters at step 0.";
    };
    return button("copy", "Copy as link", copied, "Copy as link");
  }

  /** @param {Spec} spec @param {boolean} sweeps */
  show({ yaml, trial, exact, note }, sweeps) {
    this.text.value = yaml;
    this.read();
    this.exact = exact;
    this.replicatesBefore = Number(this.replicates.input.value);
    this.given = sweeps ? "Without the sweep, a launch" : "A launch";
    const which = trial ? ` as ${trial}` : "";
    this.words = exact ? `${this.given} reproduces these frames${which}.` : note;
    if (!this.box.open) this.box.showModal();
    this.text.scrollTop = 0;
    this.copy();
  }

  // Where the page may launch, what a launch of this spec would change.
  /** @param {string} yaml */
  async offer(yaml) {
    const offered = await this.launches?.offer(yaml);
    this.usual.hidden = Boolean(offered);
  }

  async copy() {
    try {
      await navigator.clipboard.writeText(this.text.value);
      this.note.textContent = `Copied to the clipboard. ${this.words}`;
    } catch {
      this.text.select();
      this.note.textContent = `Select the text and copy it. ${this.words}`;
    }
  }
}

/** @param {HTMLElement} root */
export function keysDialog(root) {
  const rows = KEYS.map(([keys, words]) =>
    make(
      "tr",
      {},
      make("th", { scope: "row", textContent: keys }),
      make("td", { textContent: words }),
    )
  );
  return dialog(root, "Keys", make("table", {}, make("tbody", {}, ...rows)));
}

export class MetricsDialog {
  /** @param {HTMLElement} root @param {(names: string[]) => void} chosen */
  constructor(root, chosen) {
    this.list = make("div", { className: "choices" });
    this.search = new SearchField("Search metrics", () => this.find());
    this.box = dialog(root, "Plotted metrics", this.search.element, this.list);
    this.chosen = chosen;
  }

  /** @param {Metric[]} metrics @param {string[]} plots */
  show(metrics, plots) {
    const rows = metrics.map(({ name, text }) => {
      const input = make("input", {
        type: "checkbox",
        value: name,
        checked: plots.includes(name),
      });
      const words = make(
        "span",
        {},
        make("b", { textContent: spaced(name) }),
        ` ${text}`,
      );
      return make("label", {}, input, words);
    });
    this.list.replaceChildren(...rows);
    this.list.onchange = () => this.chosen(this.checked());
    this.search.offer(rows.length);
    this.find();
    this.box.showModal();
  }

  find() {
    const rows = [...this.list.querySelectorAll("label")];
    this.search.apply(
      rows.map((element) => ({ element, text: element.textContent ?? "" })),
    );
  }

  checked() {
    const inputs = [...this.list.querySelectorAll("input")];
    return inputs.filter((input) => input.checked).map((input) => input.value);
  }

  // Shows which metrics are plotted now: a choice may have been refused.
  /** @param {string[]} plots */
  follow(plots) {
    for (const input of this.list.querySelectorAll("input")) {
      input.checked = plots.includes(input.value);
    }
  }
}

// A button that opens a list of commands below it.
export class Menu {
  /**
   * @param {string} label
   * @param {Picture} picture
   * @param {[words: string, hint: string, act: () => void][]} commands
   */
  constructor(label, picture, commands) {
    this.items = commands.map(([words, hint, act]) => {
      const item = make(
        "button",
        { type: "button", role: "menuitem", tabIndex: -1 },
        make("b", { textContent: words }),
        make("small", { textContent: hint }),
      );
      item.addEventListener("click", () => {
        if (item.getAttribute("aria-disabled") === "true") return;
        this.toggle(false);
        act();
      });
      return item;
    });
    this.list = make("div", {
      className: "menu",
      role: "menu",
      hidden: true,
      "aria-label": label,
    }, ...this.items);
    this.opener = button(
      picture,
      label,
      () => this.toggle(Boolean(this.list.hidden)),
      label,
      {
        "aria-haspopup": "menu",
        "aria-expanded": "false",
      },
    );
    this.element = make("div", { className: "opens" }, this.opener, this.list);
    this.element.addEventListener("keydown", (event) => this.key(event));
    this.element.addEventListener("focusout", ({ relatedTarget: next }) => {
      const within = next instanceof Node && this.element.contains(next);
      if (!within) this.toggle(false, false);
    });
  }

  // The first item comes after the last one.
  /** @param {number} place */
  focus(place) {
    this.items.at(place % this.items.length)?.focus();
  }

  /** @param {boolean} open */
  toggle(open, focus = true) {
    this.list.hidden = !open;
    this.opener.setAttribute("aria-expanded", String(open));
    if (focus) (open ? this.items[0] : this.opener).focus();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (this.list.hidden) return;
    const place = this.items.findIndex((item) => item === document.activeElement);
    if (event.key === "ArrowDown") this.focus(place + 1);
    else if (event.key === "ArrowUp") this.focus(place - 1);
    else if (event.key === "Escape") this.toggle(false);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
