// The settings as controls. They are made from what the server says of each setting, so
// a new model needs no script.

import { asNumber, button, make, paced, short, spaced, unitText } from "./dom.js";

const NOTCHES = 1000;
const SEND_EVERY = 60; // ms while a slider moves
const SWEEP_POINTS = 5;

/** @import { Message, Setting, Sweep, Value } from "./protocol.d.ts" */

// A slider's notches over a linear or a logarithmic range.
export class Slide {
  /** @param {[number, number, number]} range @param {Setting} about */
  constructor([low, high, step], { logarithmic, kind }) {
    this.low = low;
    this.high = high;
    this.step = step;
    this.logarithmic = logarithmic;
    this.whole = kind === "int";
  }

  /** @param {number} value */
  notch(value) {
    const part = this.logarithmic
      ? Math.log(Math.max(value, this.low) / this.low) / Math.log(this.high / this.low)
      : (value - this.low) / (this.high - this.low);
    return Math.round(NOTCHES * Math.min(Math.max(part, 0), 1));
  }

  /** @param {number} notch @returns {number} */
  value(notch) {
    const part = notch / NOTCHES;
    if (this.logarithmic) {
      return this.tidy(this.low * (this.high / this.low) ** part, 3);
    }
    const steps = Math.round((part * (this.high - this.low)) / this.step);
    return this.tidy(Math.min(this.low + steps * this.step, this.high), 9);
  }

  /** @param {number} value @param {number} digits */
  tidy(value, digits) {
    return this.whole ? Math.round(value) : Number(value.toPrecision(digits));
  }

  // The next value up or down, for the keyboard.
  /** @param {number} value @param {number} direction @returns {number} */
  beside(value, direction) {
    if (!this.logarithmic) {
      return this.tidy(
        Math.min(Math.max(value + direction * this.step, this.low), this.high),
        9,
      );
    }
    return this.value(this.notch(value) + direction * (NOTCHES / 50));
  }
}

// A range within the slider's in which `value` is one of SWEEP_POINTS points: the
// middle one, or an end where the middle would not have the very same bits.
/** @param {number} value @param {{ low: number, high: number }} slide */
export function rangeAbout(value, { low, high }) {
  if (!Number.isFinite(value) || value === low || value === high) return { low, high };
  if (value < low) return { low: value, high };
  const half = Math.min(value - low, high - value);
  const [first, last] = [value - half, value + half];
  const gap = (last - first) / (SWEEP_POINTS - 1);
  const middle = first + ((SWEEP_POINTS - 1) / 2) * gap;
  const fits = half > 0 && middle === value && first >= low && last <= high;
  return fits ? { low: first, high: last } : { low, high: value };
}

// The range over which the copied spec sweeps a setting: `button` says whether it does.
class Sweeper {
  /**
   * @param {Setting} about
   * @param {Slide} slide
   * @param {(message: Message) => void} send
   */
  constructor({ name }, slide, send) {
    this.name = name;
    this.send = send;
    this.slide = slide;
    this.value = NaN;
    const words = spaced(name);
    this.button = button(
      "range",
      `Sweep ${words} in the copied spec`,
      () => this.toggle(),
      "",
      { className: "quiet sweeps", "aria-pressed": "false" },
    );
    /** @param {string} part */
    const bound = (part) =>
      make("input", {
        type: "text",
        inputMode: "decimal",
        "aria-label": `${words}, sweep: ${part}`,
        autocomplete: "off",
        on: { change: () => this.entered() },
      });
    this.low = bound("low");
    this.high = bound("high");
    this.points = bound("points");
    this.element = make(
      "div",
      { className: "bounds", hidden: true },
      make("span", { textContent: "sweep" }),
      "from",
      this.low,
      "to",
      this.high,
      this.points,
      "points",
    );
  }

  toggle() {
    const { name } = this;
    const { low, high } = rangeAbout(this.value, this.slide);
    if (this.button.getAttribute("aria-pressed") === "true") {
      this.send({ type: "sweep", name, off: true });
    } else this.send({ type: "sweep", name, low, high, points: SWEEP_POINTS });
  }

  entered() {
    const [low, high, points] = [this.low, this.high, this.points].map((input) =>
      Number(input.value)
    );
    this.send({ type: "sweep", name: this.name, low, high, points });
  }

  /** @param {Value} value @param {Sweep | undefined} sweep */
  show(value, sweep) {
    this.value = asNumber(value);
    this.button.setAttribute("aria-pressed", String(Boolean(sweep)));
    this.element.hidden = !sweep;
    for (const part of /** @type {const} */ (["low", "high", "points"])) {
      if (sweep && !this[part].matches(":focus")) {
        this[part].value = String(sweep[part]);
      }
    }
  }
}

/** @param {string[]} sources */
const followed = (sources) =>
  sources.length ? `follows from ${sources.map(spaced).join(", ")}` : "";

export class Field {
  /**
   * @param {Setting} about
   * @param {string} prefix
   * @param {(message: Message) => void} send
   * @param {Pick<Tip, "show" | "hide">} tip
   */
  constructor(about, prefix, send, tip) {
    this.about = about;
    this.send = send;
    this.value = about.default ?? "";
    this.known = ""; // what is shown
    this.typing = false;
    this.id = `${prefix}-${about.name}`;
    this.slide = about.slider ? new Slide(about.slider, about) : null;
    this.sendPaced = paced(
      (/** @type {Value} */ value, /** @type {boolean} */ part) =>
        this.set(value, part),
      SEND_EVERY,
    );
    this.input = this.entry();
    this.slider = this.slide ? this.sliding() : null;
    this.sweeper = this.slide
      ? new Sweeper(about, this.slide, (message) => this.ask(message))
      : null;
    this.back = this.undo();
    this.meaning = make("span", { className: "about", textContent: about.text });
    this.element = this.row();
    for (const event of ["pointerenter", "focusin"]) {
      this.element.addEventListener(event, () => tip.show(this));
    }
    for (const event of ["pointerleave", "focusout"]) {
      this.element.addEventListener(event, () => tip.hide(this));
    }
  }

  row() {
    const { name, kind, unit } = this.about;
    const title = make("label", { htmlFor: this.id, textContent: spaced(name) });
    const head = make("div", { className: "head" }, title, this.meaning, this.back);
    const line = make("div", { className: "line" }, this.input);
    if (this.slider) line.prepend(this.slider);
    const element = make("div", { className: `field ${kind}` }, head, line);
    element.dataset.name = name;
    if (this.input.type === "text") {
      line.append(make("span", { className: "unit", textContent: unitText(unit) }));
    }
    if (this.sweeper) {
      line.append(this.sweeper.button);
      element.append(this.sweeper.element);
    }
    return element;
  }

  undo() {
    const { name, default: preset } = this.about;
    const label = `Set ${spaced(name)} back to the preset`;
    const back = () => preset !== null && this.set(preset);
    return button("undo", label, back, "", { className: "quiet back" });
  }

  /** @param {Value} value */
  set(value, part = false) {
    this.accept();
    this.ask({ type: "set", name: this.about.name, value, part });
  }

  // The answer must be shown, whether the value was taken or refused.
  /** @param {Message} message */
  ask(message) {
    this.known = "";
    this.send(message);
  }

  entry() {
    const { kind, choices } = this.about;
    const act = { id: this.id, on: { change: () => this.entered() } };
    if (kind === "choice") {
      const options = choices.map((one) =>
        make("option", { value: one, textContent: spaced(one) })
      );
      return make("select", act, ...options);
    }
    if (kind === "bool") {
      return make("input", { ...act, type: "checkbox", className: "switch" });
    }
    const input = make("input", {
      ...act,
      type: "text",
      inputMode: kind === "places" ? "text" : "decimal",
      autocomplete: "off",
      spellcheck: false,
    });
    input.addEventListener("keydown", (event) => this.nudge(event));
    input.addEventListener("input", () => (this.typing = true));
    return input;
  }

  sliding() {
    const slider = make("input", {
      type: "range",
      min: "0",
      max: String(NOTCHES),
      step: "1",
      "aria-label": `${spaced(this.about.name)}, slider`,
      on: { input: () => this.slid(true), change: () => this.slid(false) },
    });
    slider.addEventListener("keydown", (event) => this.nudge(event));
    return slider;
  }

  // A drag of the slider is one edit, however many values it has on the way.
  /** @param {boolean} part */
  slid(part) {
    if (!this.slide || !this.slider) return;
    const value = this.slide.value(Number(this.slider.value));
    this.input.value = String(value);
    this.sendPaced(value, part);
  }

  /** @param {KeyboardEvent} event */
  nudge(event) {
    const sliding = event.target === this.slider;
    const up = event.key === "ArrowUp" || (sliding && event.key === "ArrowRight");
    const down = event.key === "ArrowDown" || (sliding && event.key === "ArrowLeft");
    if (!this.slide || !(up || down)) return;
    event.preventDefault();
    this.step(up ? 1 : -1);
  }

  // Changes to the next value up or down, if there is one. Returns the value.
  /** @param {number} direction @returns {Value} */
  step(direction) {
    if (!this.slide) return this.value;
    this.typing = false;
    const next = this.slide.beside(asNumber(this.value), direction);
    this.value = next;
    this.show();
    this.sendPaced(next, false);
    return next;
  }

  entered() {
    const { input } = this;
    this.typing = false;
    if (input instanceof HTMLSelectElement) return this.set(input.value);
    if (input.type === "checkbox") return this.set(input.checked);
    const text = input.value.trim().toLowerCase();
    // The server refuses what is no number, and says why.
    const value = text === "" || Number.isNaN(Number(text)) ? text : Number(text);
    if (value !== this.value) this.set(value);
  }

  accept() {
    this.input.removeAttribute("aria-invalid");
  }

  refuse() {
    this.known = "";
    this.input.setAttribute("aria-invalid", "true");
  }

  // A value that follows from the settings of these names is no axis of its own.
  /**
   * @param {Value} value
   * @param {boolean} changed
   * @param {Sweep | undefined} sweep
   * @param {string[]} follows
   */
  update(value, changed, sweep, follows = []) {
    const known = JSON.stringify([value, changed, sweep, follows]);
    if (known === this.known) return;
    this.known = known;
    this.value = value;
    this.element.classList.toggle("changed", changed);
    this.back.hidden = !changed;
    this.show();
    this.sweeper?.show(value, sweep);
    if (this.sweeper) this.sweeper.button.hidden = follows.length > 0;
    this.meaning.textContent = followed(follows) || this.about.text;
  }

  show() {
    const { input, value, slide, slider } = this;
    if (input instanceof HTMLInputElement && input.type === "checkbox") {
      input.checked = Boolean(value);
    } else if (!this.typing && input.value !== String(value)) {
      input.value = String(value);
    }
    if (!slide || !slider) return;
    if (!slider.matches(":active")) slider.value = String(slide.notch(asNumber(value)));
    slider.style.setProperty("--part", `${Number(slider.value) / (NOTCHES / 100)}%`);
    slider.setAttribute("aria-valuetext", `${value} ${this.about.unit}`.trim());
  }

  /** @param {boolean} frozen */
  freeze(frozen) {
    if (this.input.disabled === frozen) return;
    for (const tag of /** @type {const} */ (["input", "select", "button"])) {
      for (const one of this.element.querySelectorAll(tag)) one.disabled = frozen;
    }
  }
}

// The explanation of a setting, beside the one under the pointer or in focus.
export class Tip {
  /** @param {HTMLElement} root @param {HTMLElement} floor */
  constructor(root, floor) {
    this.root = root;
    this.floor = floor;
    this.name = make("code");
    this.text = make("p");
    this.facts = make("p", { className: "facts" });
    this.element = make(
      "div",
      { className: "tip", role: "tooltip", hidden: true },
      this.name,
      this.text,
      this.facts,
    );
    root.append(this.element);
    /** @type {Field | null} */
    this.field = null;
  }

  /** @param {Field} field */
  show(field) {
    this.field = field;
    const { name, text, allowed, default: preset } = field.about;
    this.name.textContent = name;
    this.text.textContent = text;
    const usual = preset === null
      ? ""
      : `preset: ${typeof preset === "number" ? short(preset, 6) : preset}`;
    this.facts.textContent = [unitText(allowed), usual].filter(Boolean).join(" · ");
    this.element.hidden = false;
    this.place(field.element.getBoundingClientRect());
  }

  /** @param {DOMRect} beside */
  place(beside) {
    const [space, own] = [
      this.root.getBoundingClientRect(),
      this.element.getBoundingClientRect(),
    ];
    // The pointer may also stay on the explanation.
    const floor = this.floor.getBoundingClientRect().top;
    const left = beside.left - own.width - 10 > space.left
      ? beside.left - own.width - 10
      : beside.right + 10;
    const inside = left + own.width <= space.right;
    const top = inside ? beside.top : beside.bottom + 4;
    this.element.style.left = `${(inside ? left : beside.left) - space.left}px`;
    this.element.style.top = `${Math.min(top, floor - own.height - 6) - space.top}px`;
  }

  /** @param {Field} field */
  hide(field) {
    if (this.field === field) this.element.hidden = true;
  }
}
