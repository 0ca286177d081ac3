// What an address says of the state that it opens, after its #. That is sent to no
// server.

/** @import { Kept } from "./protocol.d.ts" */

/**
 * How a state is shown at first: at how many steps a second, with which overlays, and
 * whether it runs at once.
 *
 * @typedef {{ speed: number | null, overlays: string[], run: boolean }} Opening
 */

/** @param {string} hash @returns {Kept | null} */
export function stateIn(hash) {
  const told = new URLSearchParams(hash.slice(1));
  const [yaml, replicate] = [told.get("spec"), Number(told.get("replicate"))];
  if (!yaml || !Number.isSafeInteger(replicate) || replicate < 0) return null;
  return { yaml, point: told.get("point") ?? "", replicate };
}

/** @param {string} hash @returns {Opening} */
export function openingIn(hash) {
  const told = new URLSearchParams(hash.slice(1));
  const speed = told.get("speed");
  return {
    speed: speed === null ? null : Number(speed),
    overlays: told.get("overlays")?.split(",") ?? [],
    run: told.has("run"),
  };
}

// The part of an address that names a state.
/** @param {Kept} kept */
export function hashOf({ yaml, point, replicate }) {
  const told = { spec: yaml, point, replicate: String(replicate) };
  return `#${new URLSearchParams(told)}`;
}

// The part of an address that opens a spec, and lets it run.
/** @param {string} yaml @param {number} speed @param {string[]} overlays */
export function hashOfRun(yaml, speed, overlays) {
  const told = {
    spec: yaml,
    speed: String(speed),
    overlays: overlays.join(","),
    run: "",
  };
  return `#${new URLSearchParams(told)}`;
}
