// A recorded run as a page that opens from disk: what it is, the run, its settings, and
// how to cite it. An address that ends in ?embed shows the picture and its bar alone.

import { button, make, short, spaced, unitText } from "./dom.js";
import { framesOf } from "./packed.js";
import { Player } from "./player.js";

/** @import { FrontMatter, Recording, RecordedPage, Setting } from "./protocol.d.ts" */

/** @param {FrontMatter} front @param {() => void} copy */
const above = ({ title, caption }, copy) =>
  make(
    "header",
    { className: "front" },
    make("h1", { textContent: title }),
    make("p", { textContent: caption }),
    button("copy", "Copy as spec", copy, "Copy as spec"),
  );

/** @param {FrontMatter} front @param {Recording} recording */
const below = ({ cite, licence }, { about }) =>
  make(
    "footer",
    { className: "front" },
    make("h2", { textContent: "How to cite" }),
    make("ul", {}, ...cite.map((textContent) => make("li", { textContent }))),
    make("h2", { textContent: "Licence" }),
    make("p", { textContent: `Of these data: ${licence}.` }),
    make("h2", { textContent: "Origin" }),
    make("p", {
      className: "facts",
      textContent: Object.entries(about).map(([key, value]) => `${key}: ${value}`)
        .join("; "),
    }),
  );

// All settings with their values; those that differ from the preset are marked.
/** @param {Recording} recording */
function settings({ groups, state }) {
  /** @param {Setting} setting */
  const row = ({ name, text, unit }) =>
    make(
      "div",
      { className: state.changed.includes(name) ? "changed" : "" },
      make("dt", { textContent: spaced(name), title: text }),
      make("dd", {
        textContent: `${short(state.settings[name], 6)} ${unitText(unit)}`.trim(),
      }),
    );
  const rows = groups.flatMap(({ fields }) => fields.map(row));
  return make(
    "details",
    { className: "group values" },
    make("summary", {}, make("span", { textContent: "parameters" })),
    make("dl", {}, ...rows),
  );
}

// On paper colours are those of a light page, and everything is open.
/** @param {HTMLElement} root @param {Player} player */
function print(root, player) {
  /** @param {string} scheme */
  const dress = (scheme) => {
    root.style.colorScheme = scheme;
    document.documentElement.style.colorScheme = scheme;
    player.stage.readColours();
    player.stage.draw();
    player.charts.draw(player.step);
  };
  addEventListener("beforeprint", () => {
    dress("light");
    for (const one of root.querySelectorAll("details")) one.open = true;
  });
  addEventListener("afterprint", () => dress(""));
}

/** @param {HTMLElement} main @param {RecordedPage} page */
async function show(main, { front, recording: packed }) {
  const { frames, steps } = packed;
  const recording = { ...packed, frames: await framesOf(frames, steps.length) };
  const embedded = new URLSearchParams(location.search).has("embed");
  const root = make("div", { className: "boidsweep recorded" });
  const room = make("div");
  main.append(root);
  root.classList.toggle("embedded", embedded);
  root.append(room);
  const player = new Player(root, room);
  player.play(recording);
  document.addEventListener("keydown", (event) => player.key(event));
  if (embedded) return;
  room.before(above(front, () => player.copySpec()));
  room.after(settings(recording), below(front, recording));
  print(root, player);
}

const main = document.querySelector("main");
const content = document.getElementById("data")?.textContent;
if (main && content) show(main, JSON.parse(content));
