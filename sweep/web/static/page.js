// The page of the simulator, as it is served.

import { hashOf, openingIn, stateIn } from "./address.js";
import { LaunchCard } from "./launch.js";
import { mount } from "./mount.js";
import { PAGE, pageId, Socket } from "./socket.js";

/** @import { Opening } from "./address.js" */
/** @import { Kept } from "./protocol.d.ts" */

const [KEPT, OPENED] = ["boidsweep-kept", "boidsweep-opened"];
const ONE = ["yaml", "point", "replicate"];
const STORED = ["kept_study", "kept_trial"];
const NAMES = [...ONE, ...ONE.map((name) => `${name}_beside`), ...STORED];
const MOST_KEPT = 500_000; // characters, far less than a message may have

// A window that comes to another address begins anew there. Whether it has.
function beginsAnew() {
  if ((sessionStorage.getItem(OPENED) ?? "") === location.hash) return false;
  for (const name of [PAGE, KEPT]) sessionStorage.removeItem(name);
  sessionStorage.setItem(OPENED, location.hash);
  return true;
}

// Outlives the server, as long as the window is open.
const memory = {
  /** @returns {Kept | null} */
  read: () =>
    JSON.parse(sessionStorage.getItem(KEPT) ?? "null") ?? stateIn(location.hash),
  // The address of what is shown.
  /** @param {Partial<Opening>} opening */
  address(opening) {
    const kept = memory.read() ?? { yaml: "", point: "", replicate: 0 };
    return location.href.split("#")[0] + hashOf(kept, opening);
  },
  /** @param {Kept} kept */
  write(kept) {
    const text = JSON.stringify(kept, NAMES);
    if (text.length > MOST_KEPT) sessionStorage.removeItem(KEPT);
    else sessionStorage.setItem(KEPT, text);
  },
};
/** @param {string} words */
const entitle = (words) => (document.title = `${words} · boidsweep`);

const main = document.querySelector("main");
if (main) {
  const socket = new Socket();
  const opening = beginsAnew() ? openingIn(location.hash) : undefined;
  const mounted = mount(main, socket, {
    page: pageId(),
    shortcuts: document,
    memory,
    entitle,
    opening,
    demos: "start.html",
    launches: new LaunchCard({ explorer: "show.html" }),
  });
  addEventListener("hashchange", () => location.reload());
  window.boidsweep = Object.assign(mounted, { socket });
}
