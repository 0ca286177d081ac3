// The menu of files: pictures as they are on the screen, pictures for print, and the
// run; and how far the file is that is being made.

import { button, make } from "./dom.js";
import { Menu } from "./dialogs.js";
import { download } from "./files.js";
import { labelled } from "./png.js";

/** @import { Message, OriginOf, Progress, State } from "./protocol.d.ts" */
/** @import { Stage } from "./stage.js" */

const INCH = 96; // CSS pixels
/** @type {[heading: string, files: [kind: string, name: string, hint: string][]][]} */
const FILES = [
  ["The image as shown", [
    ["2", "PNG", "twice as fine as a screen, 192 dpi"],
    ["4", "PNG", "four times as fine, 384 dpi"],
    ["lines", "SVG", "as lines"],
  ]],
  ["The image for print, with axes and units", [
    ["png", "PNG", "this frame as pixels, 89 mm wide, 300 dpi"],
    ["svg", "SVG", "this frame as lines, 89 mm wide"],
  ]],
  ["The run so far", [
    ["gif", "GIF", "plays anywhere"],
    ["mp4", "MP4", "as a video"],
    ["html", "HTML", "a page that plays from disk"],
  ]],
];

export class Exports {
  // What is done with the origin that was asked for, when it comes.
  /** @type {((origin: OriginOf) => void) | null} */
  use = null;

  /** @param {Stage} stage @param {(message: Message) => void} send */
  constructor(stage, send) {
    this.stage = stage;
    this.send = send;
    const files = FILES.flatMap(([, group]) => group);
    this.menu = new Menu(
      "Export",
      "save",
      files.map(([kind, name, hint]) => [name, hint, () => this.ask(kind)]),
    );
    this.items = new Map(files.map(([kind, , hint], place) => [
      kind,
      { item: this.menu.items[place], hint },
    ]));
    for (const [heading, [[first]]] of FILES) {
      const words = make("div", { className: "heading", textContent: heading });
      words.setAttribute("role", "presentation");
      this.items.get(first)?.item.before(words);
    }
    this.bar = make("progress", { max: 1, "aria-label": "progress of the file" });
    this.words = make("span");
    const stop = button("remove", "Stop", () => send({ type: "stop" }), "Stop");
    this.making = make(
      "div",
      { className: "making", hidden: true },
      this.words,
      this.bar,
      stop,
    );
    this.element = make("div", { className: "row" }, this.making, this.menu.element);
  }

  // What cannot be made is grey, and says why.
  /** @param {State} state */
  show({ files }) {
    for (const [kind, { item, hint }] of this.items) {
      const reason = files[kind];
      item.setAttribute("aria-disabled", String(Boolean(reason)));
      const words = item.querySelector("small");
      if (words) words.textContent = reason ?? hint;
    }
  }

  /** @param {string} kind */
  ask(kind) {
    if (kind === "lines") this.lines();
    else if (Number(kind)) this.pixels(Number(kind));
    else {
      this.tell({ kind, doing: "begun", share: 0 });
      this.send({ type: "export", kind });
    }
  }

  /** @param {number} finer */
  pixels(finer) {
    const canvas = this.stage.pixels(finer);
    this.origin(({ name, about }) =>
      canvas.toBlob(async (blob) => {
        const png = new Uint8Array(await (blob ?? new Blob()).arrayBuffer());
        const whole = new Blob(labelled(png, about, finer * INCH));
        download(`${name}-as-shown-${finer * INCH}dpi.png`, "image/png", whole);
      })
    );
  }

  lines() {
    const pen = this.stage.lines();
    this.origin(({ name, about }) => {
      const said = Object.entries(about).map(([key, text]) => `${key}: ${text}`);
      const svg = pen.document(name, said.join("\n"));
      download(`${name}-as-shown.svg`, "image/svg+xml", svg);
    });
  }

  // Asks what a file of this frame is called, and says of itself.
  /** @param {(origin: OriginOf) => void} use */
  origin(use) {
    this.use = use;
    this.send({ type: "origin" });
  }

  /** @param {OriginOf} origin */
  name(origin) {
    this.use?.(origin);
    this.use = null;
  }

  /** @param {Pick<Progress, "kind" | "doing" | "share">} progress */
  tell({ kind, doing, share }) {
    this.making.hidden = kind === null;
    this.words.textContent = kind === null
      ? ""
      : `${kind.toUpperCase()}: ${doing}, ${Math.round(100 * share)} %`;
    this.bar.value = share;
  }
}
