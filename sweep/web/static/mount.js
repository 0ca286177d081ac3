// Shows what comes over a transport: one run, or two of them side by side.

import { secondOf } from "./address.js";
import { Differences } from "./differences.js";
import { button, make, short, spaced, write } from "./dom.js";
import { View } from "./view.js";

/** @import { Bytes, Heard, Message, State, Transport } from "./protocol.d.ts" */
/** @import { Options } from "./view.js" */

const PAIR = 0x32465342; // "BSF2"
const HEAD = 8; // bytes
const LETTERS = ["A", "B"];
const MOST_NAMES = 4;
const OF_THE_FIRST = ["hello", "ready"];
const OF_BOTH = "keep";
const REGIONS = ":is(section, aside)[aria-label]";

// The two frames in a message that has two, or null.
/**
 * @param {Bytes} data
 * @returns {[DataView<ArrayBuffer>, DataView<ArrayBuffer>] | null}
 */
function bothOf(data) {
  const view = data instanceof ArrayBuffer ? new DataView(data) : data;
  if (view.getUint32(0, true) !== PAIR) return null;
  const size = view.getUint32(4, true);
  const from = view.byteOffset + HEAD;
  const rest = view.byteLength - HEAD - size;
  return [
    new DataView(view.buffer, from, size),
    new DataView(view.buffer, from + size, rest),
  ];
}

// In which settings two runs differ, first those that were changed here.
/** @param {State} one @param {State} other */
function differing(one, other) {
  const changed = new Set([...one.changed, ...other.changed]);
  const names = Object.keys({ ...one.settings, ...other.settings });
  const found = names.filter((name) => one.settings[name] !== other.settings[name]);
  if (JSON.stringify(one.shapes) !== JSON.stringify(other.shapes)) {
    found.push("obstacles");
  }
  if (one.replay?.replicate !== other.replay?.replicate) found.push("replicate");
  const sorted = [
    ...found.filter((name) => changed.has(name)),
    ...found.filter((name) => !changed.has(name)),
  ];
  return one.seed === other.seed ? sorted : ["seed", ...sorted];
}

/** @param {State} state @param {string[]} names */
function valuesOf({ settings, seed, shapes, replay }, names) {
  /** @type {Record<string, string | number | boolean>} */
  const others = {
    seed,
    obstacles: shapes ? shapes.length : "as in the map",
    replicate: replay?.replicate ?? 0,
  };
  const words = names.map((name) =>
    `${spaced(name)} ${short(settings[name] ?? others[name], 6)}`
  );
  const more = words.length - MOST_NAMES;
  const few = words.slice(0, MOST_NAMES).join(", ");
  return [more > 0 ? `${few} and ${more} more` : few, words.join("\n")];
}

// The head of one of two runs: which one it is, and what differs from the other.
class SideHead {
  /** @param {number} side @param {() => void} keep */
  constructor(side, keep) {
    this.letter = LETTERS[side];
    this.name = make("b", { className: "name" });
    this.differs = make("span", { className: "differing" });
    this.ended = make("span", { className: "ended", role: "status" });
    const letter = make("b", { className: "letter", textContent: this.letter });
    const only = button(
      "world",
      `Show only ${this.letter}`,
      keep,
      `Only ${this.letter}`,
    );
    this.element = make(
      "header",
      { className: "head-of-side" },
      letter,
      this.name,
      this.differs,
      this.ended,
      only,
    );
  }

  /** @param {State} mine @param {State} other */
  show(mine, other) {
    const { replay } = mine;
    const trial = replay?.trial.slice(0, 8);
    const { model, preset } = mine;
    write(
      this.name,
      replay ? `${replay.study}, trial ${trial}` : `${model}, ${preset}`,
    );
    this.name.title = replay?.which ?? "";
    const names = differing(mine, other);
    const [few, all] = valuesOf(mine, names);
    write(this.differs, names.length ? few : "equal parameters");
    this.differs.title = all;
    const ended = mine.ended && !mine.running ? mine.ended : "";
    write(this.ended, ended && `${ended}: both runs stop here`);
  }
}

// Names the regions of a view, which are those of a run if it has a letter.
/** @param {View} view @param {string} letter */
function nameRegions({ root }, letter) {
  for (const region of root.querySelectorAll(REGIONS)) {
    const [name] = (region.getAttribute("aria-label") ?? "").split(" of run ");
    region.setAttribute("aria-label", letter ? `${name} of run ${letter}` : name);
  }
}

// What the first run's view keeps of the second, whose view writes nothing itself.
/** @param {View} first @returns {View["memory"]} */
const ofSecond = ({ memory }) =>
  memory && {
    read: () => secondOf(memory.read()),
    write: () => {},
    address: (opening) => memory.address(opening),
  };

// Two runs in one window.
class Pair {
  /**
   * @param {View} first
   * @param {Transport} channel
   * @param {(side: number) => void} keep
   */
  constructor(first, channel, keep) {
    this.home = first.root.parentElement;
    this.heads = LETTERS.map((_, side) => new SideHead(side, () => keep(side)));
    const [one, other] = this.heads.map(({ element, letter }) =>
      make("section", { className: "side", "aria-label": `run ${letter}` }, element)
    );
    this.root = make("div", { className: "boidsweep twins" });
    this.home?.append(this.root);
    const both = make("div", { className: "pair" }, one, other);
    this.root.append(both);
    one.append(first.root);
    this.views = [first, new View(other, channel, { memory: ofSecond(first) })];
    this.views[1].stage.overlays = new Set(first.stage.overlays);
    this.views[1].run.element.remove(); // that of the first one drives both
    this.views.forEach((view, side) => nameRegions(view, LETTERS[side]));
    this.differences = new Differences(this.views);
    this.root.append(this.differences.element, first.run.element);
  }

  show() {
    const [one, other] = this.views.map((view) => view.state);
    if (!one || !other) return;
    this.heads[0].show(one, other);
    this.heads[1].show(other, one);
    this.differences.show();
  }

  leave() {
    const [first, second] = this.views;
    this.differences.leave();
    nameRegions(first, "");
    first.settle();
    first.forget();
    this.home?.append(first.root);
    second.unmount();
    this.root.remove();
  }
}

export class Window {
  /** @type {Pair | null} */
  pair = null;

  /** @param {Element} element @param {Transport} transport @param {Options} options */
  constructor(element, transport, options) {
    this.transport = transport;
    this.playing = options.playing;
    transport.onmessage = (heard) => this.receive(heard);
    transport.onopen = () => {
      this.alone();
      this.first.onopen?.();
    };
    transport.onclose = (words) => this.each((one) => one.onclose?.(words));
    transport.onend = (words) => this.each((one) => one.onend?.(words));
    /** @type {Transport} */
    this.first = {
      send: (message) => transport.send(message),
      close: () => transport.close(),
    };
    if (transport.start) this.first.start = () => transport.start?.();
    this.keep = options.alone ??
      ((/** @type {number} */ side) => transport.send({ type: "alone", side }));
    /** @type {Transport} */
    this.second = {
      send: (message) => this.sendOfSecond(message),
      close: () => {},
    };
    this.view = new View(element, this.first, options);
  }

  /** @param {Message} message */
  sendOfSecond(message) {
    if (OF_THE_FIRST.includes(message.type)) return;
    this.transport.send(message.type === OF_BOTH ? message : { ...message, side: 1 });
  }

  /** @param {(one: Transport) => void} act */
  each(act) {
    act(this.first);
    if (this.pair) act(this.second);
  }

  /** @param {Heard} heard */
  receive(heard) {
    if (heard instanceof ArrayBuffer || heard instanceof DataView) {
      const both = bothOf(heard);
      this.first.onmessage?.(both ? both[0] : heard);
      if (both && this.pair) this.second.onmessage?.(both[1]);
      // After both frames, which are drawn first.
      requestAnimationFrame(() => this.pair?.differences.draw());
      return;
    }
    if (heard.type === "anew") return this.alone();
    if (heard.side === 1 && heard.type === "controls") {
      this.pair ??= new Pair(this.view, this.second, this.keep);
    }
    const side = heard.side === 1 && this.pair ? this.second : this.first;
    side.onmessage?.(heard);
    if (heard.type !== "state") return;
    this.pair?.show();
    if (heard.replay) this.playing?.(heard.side ?? 0, heard.replay.trial);
  }

  alone() {
    this.pair?.leave();
    this.pair = null;
  }
}

/** @param {Element} element @param {Transport} transport @param {Options} options */
export function mount(element, transport, options = {}) {
  const shown = new Window(element, transport, options);
  return {
    view: shown.view,
    unmount: () => {
      shown.alone();
      shown.view.unmount();
    },
    get second() {
      return shown.pair?.views[1] ?? null;
    },
  };
}
