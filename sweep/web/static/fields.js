// The settings as controls, generated from what the server says of each: so a new model
// has its page for nothing.

import { asNumber, button, make, paced, short, spaced, unitText } from "./dom.js";

const NOTCHES = 1000;
const SEND_EVERY = 60; // ms while a slider moves
const SWEEP_POINTS = 5;

// A slider's notches over a linear or a logarithmic range.
export class Slide {
  constructor({ slider: [low, high, step], logarithmic = false, kind }) {
    Object.assign(this, { low, high, step, logarithmic, whole: kind === "int" });
  }

  notch(value) {
    const part = this.logarithmic
      ? Math.log(Math.max(value, this.low) / this.low) / Math.log(this.high / this.low)
      : (value - this.low) / (this.high - this.low);
    return Math.round(NOTCHES * Math.min(Math.max(part, 0), 1));
  }

  value(notch) {
    const part = notch / NOTCHES;
    if (this.logarithmic) {
      return this.tidy(this.low * (this.high / this.low) ** part, 3);
    }
    const steps = Math.round((part * (this.high - this.low)) / this.step);
    return this.tidy(Math.min(this.low + steps * this.step, this.high), 9);
  }

  tidy(value, digits) {
    return this.whole ? Math.round(value) : Number(value.toPrecision(digits));
  }

  // The next value up or down, for the keyboard.
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

export class Field {
  constructor(about, prefix, send, tip) {
    Object.assign(this, { about, send, tip, value: about.default });
    this.id = `${prefix}-${about.name}`;
    this.slide = about.slider ? new Slide(about) : null;
    this.sendPaced = paced((value) => this.set(value), SEND_EVERY);
    const { name, text, unit } = about;
    const title = make("label", { htmlFor: this.id, textContent: spaced(name) });
    const meaning = make("span", { className: "about", textContent: text });
    this.back = button(
      "undo",
      `Set ${spaced(name)} back to the preset`,
      () => this.set(about.default),
      "",
      { className: "quiet back" },
    );
    const head = make("div", { className: "head" }, title, meaning, this.back);
    this.line = make("div", { className: "line" }, ...this.inputs());
    if (this.input.type === "text") {
      this.line.append(
        make("span", { className: "unit", textContent: unitText(unit) }),
      );
    }
    this.element = make("div", { className: `field ${about.kind}` }, head, this.line);
    this.element.dataset.name = name;
    if (this.slide) this.addSweep();
    for (const event of ["pointerenter", "focusin"]) {
      this.element.addEventListener(event, () => tip.show(this));
    }
    for (const event of ["pointerleave", "focusout"]) {
      this.element.addEventListener(event, () => tip.hide(this));
    }
  }

  set(value) {
    this.accept();
    this.known = null; // whatever comes of it is to be shown
    this.send({ type: "set", name: this.about.name, value });
  }

  inputs() {
    const { kind, choices } = this.about;
    const act = { id: this.id, on: { change: () => this.entered() } };
    if (kind === "choice") {
      this.input = make(
        "select",
        act,
        ...choices.map((one) =>
          make("option", { value: one, textContent: spaced(one) })
        ),
      );
      return [this.input];
    }
    if (kind === "bool") {
      this.input = make("input", { ...act, type: "checkbox", className: "switch" });
      return [this.input];
    }
    this.input = make("input", {
      ...act,
      type: "text",
      inputMode: "decimal",
      autocomplete: "off",
      spellcheck: false,
    });
    this.input.addEventListener("keydown", (event) => this.nudge(event));
    this.input.addEventListener("input", () => (this.typing = true));
    if (!this.slide) return [this.input];
    const label = `${spaced(this.about.name)}, slider`;
    this.slider = make("input", {
      type: "range",
      min: 0,
      max: NOTCHES,
      step: 1,
      "aria-label": label,
    });
    this.slider.addEventListener("input", () => this.slid());
    this.slider.addEventListener("change", () => this.slid());
    this.slider.addEventListener("keydown", (event) => this.nudge(event));
    return [this.slider, this.input];
  }

  slid() {
    const value = this.slide.value(Number(this.slider.value));
    this.input.value = String(value);
    this.sendPaced(value);
  }

  nudge(event) {
    const direction = {
      ArrowUp: 1,
      ArrowDown: -1,
      ...(event.target === this.slider && { ArrowRight: 1, ArrowLeft: -1 }),
    }[event.key];
    if (!direction || !this.slide) return;
    event.preventDefault();
    this.step(direction);
  }

  step(direction) {
    this.typing = false;
    const next = this.slide.beside(asNumber(this.value), direction);
    this.value = next;
    this.show();
    this.sendPaced(next);
    return next;
  }

  entered() {
    const { input, about } = this;
    this.typing = false;
    if (about.kind === "bool") return this.set(input.checked);
    if (about.kind === "choice") return this.set(input.value);
    const text = input.value.trim().toLowerCase();
    // What is no number is refused in words.
    const value = text === "" || Number.isNaN(Number(text)) ? text : Number(text);
    if (value !== this.value) this.set(value);
  }

  accept() {
    this.input.removeAttribute("aria-invalid");
  }

  refuse() {
    this.known = null;
    this.input.setAttribute("aria-invalid", "true");
  }

  addSweep() {
    const bounds = ["low", "high", "points"].map((name) => {
      const label = `${spaced(this.about.name)}, sweep: ${name}`;
      const input = make("input", {
        type: "text",
        inputMode: "decimal",
        "aria-label": label,
        autocomplete: "off",
      });
      input.addEventListener("change", () => this.sweep());
      return input;
    });
    [this.low, this.high, this.points] = bounds;
    this.sweeping = button(
      "range",
      `Sweep ${spaced(this.about.name)} in the copied spec`,
      () => this.toggleSweep(),
      "",
      {
        className: "quiet sweeps",
        "aria-pressed": "false",
      },
    );
    this.line.append(this.sweeping);
    const words = ["from", "to", "points"].flatMap((
      word,
      i,
    ) => (word === "points" ? [bounds[i], word] : [word, bounds[i]]));
    this.bounds = make(
      "div",
      { className: "bounds", hidden: true },
      make("span", { textContent: "sweep" }),
      ...words,
    );
    this.element.append(this.bounds);
  }

  toggleSweep() {
    const { name } = this.about;
    if (this.sweeping.getAttribute("aria-pressed") === "true") {
      return this.send({ type: "sweep", name, off: true });
    }
    this.known = null;
    const { low, high } = this.slide;
    return this.send({ type: "sweep", name, low, high, points: SWEEP_POINTS });
  }

  sweep() {
    this.known = null;
    const [low, high, points] = [this.low, this.high, this.points].map((input) =>
      Number(input.value)
    );
    this.send({ type: "sweep", name: this.about.name, low, high, points });
  }

  update(value, changed, sweep) {
    const known = JSON.stringify([value, changed, sweep]);
    if (known === this.known) return;
    Object.assign(this, { known, value });
    this.element.classList.toggle("changed", changed);
    this.back.hidden = !changed;
    this.show();
    if (!this.slide) return;
    this.sweeping.setAttribute("aria-pressed", String(Boolean(sweep)));
    this.bounds.hidden = !sweep;
    const entries = sweep
      ? [[this.low, sweep.low], [this.high, sweep.high], [this.points, sweep.points]]
      : [];
    for (const [input, bound] of entries) {
      if (!input.matches(":focus")) input.value = String(bound);
    }
  }

  show() {
    const { input, value, slider } = this;
    if (this.about.kind === "bool") input.checked = value;
    else if (!this.typing && input.value !== String(value)) input.value = String(value);
    if (!slider) return;
    if (!slider.matches(":active")) {
      slider.value = String(this.slide.notch(asNumber(value)));
    }
    slider.style.setProperty("--part", `${slider.value / (NOTCHES / 100)}%`);
    slider.setAttribute("aria-valuetext", `${value} ${this.about.unit}`.trim());
  }

  freeze(frozen) {
    if (this.input.disabled === frozen) return;
    for (const one of this.element.querySelectorAll("input, select, button")) {
      one.disabled = frozen;
    }
  }
}

// What a setting is, beside the one under the pointer or in focus.
export class Tip {
  constructor(root) {
    this.root = root;
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
    this.field = null;
  }

  show(field) {
    this.field = field;
    const { name, text, allowed, default: preset } = field.about;
    this.name.textContent = name;
    this.text.textContent = text;
    const usual = preset === undefined
      ? ""
      : `preset: ${typeof preset === "number" ? short(preset, 6) : preset}`;
    this.facts.textContent = [unitText(allowed), usual].filter(Boolean).join(" · ");
    this.element.hidden = false;
    this.place(field.element.getBoundingClientRect());
  }

  place(beside) {
    const [space, own] = [
      this.root.getBoundingClientRect(),
      this.element.getBoundingClientRect(),
    ];
    // What is said there may be read too.
    const floor = this.root.querySelector("footer").getBoundingClientRect().top;
    const left = beside.left - own.width - 10 > space.left
      ? beside.left - own.width - 10
      : beside.right + 10;
    const inside = left + own.width <= space.right;
    const top = inside ? beside.top : beside.bottom + 4;
    this.element.style.left = `${(inside ? left : beside.left) - space.left}px`;
    this.element.style.top = `${Math.min(top, floor - own.height - 6) - space.top}px`;
  }

  hide(field) {
    if (this.field === field) this.element.hidden = true;
  }
}
