// What an address says of the state that it opens, after its #. That is sent to no
// server.

/** @import { Kept } from "./protocol.d.ts" */

/**
 * How a state is shown at first: at how many steps a second, with which overlays, with
 * which other preset beside it, or "", and whether it runs at once.
 *
 * @typedef {{
 *   speed: number | null,
 *   overlays: string[],
 *   beside: string,
 *   run: boolean,
 * }} Opening
 */

const BESIDE = "_beside";

/** @param {string} hash @returns {Kept | null} */
export function stateIn(hash) {
  const told = new URLSearchParams(hash.slice(1));
  const [first, second] = ["", BESIDE].map((end) => keptIn(told, end));
  if (!first || !second) return first;
  const { yaml, point, replicate } = second;
  const beside = {
    yaml_beside: yaml,
    point_beside: point,
    replicate_beside: replicate,
  };
  return { ...first, ...beside };
}

// What is said of one run, by the end of the names.
/** @param {URLSearchParams} told @param {string} end */
function keptIn(told, end) {
  const yaml = told.get(`spec${end}`);
  const replicate = Number(told.get(`replicate${end}`));
  if (!yaml || !Number.isSafeInteger(replicate) || replicate < 0) return null;
  return { yaml, point: told.get(`point${end}`) ?? "", replicate };
}

/** @param {string} hash @returns {Opening} */
export function openingIn(hash) {
  const told = new URLSearchParams(hash.slice(1));
  const speed = told.get("speed");
  return {
    speed: speed === null ? null : Number(speed),
    overlays: told.get("overlays")?.split(",") ?? [],
    beside: told.get("beside") ?? "",
    run: told.has("run"),
  };
}

// The part of an address that names a state.
/** @param {Kept} kept */
export function hashOf(kept) {
  const told = new URLSearchParams();
  /** @param {string} end @param {Kept} one */
  const tell = (end, { yaml, point, replicate }) => {
    told.set(`spec${end}`, yaml);
    told.set(`point${end}`, point);
    told.set(`replicate${end}`, String(replicate));
  };
  tell("", kept);
  const second = secondOf(kept);
  if (second) tell(BESIDE, second);
  return `#${told}`;
}

// What is kept of the second of two runs.
/** @param {Kept | null} kept @returns {Kept | null} */
export const secondOf = (kept) =>
  kept?.yaml_beside
    ? {
      yaml: kept.yaml_beside,
      point: kept.point_beside ?? "",
      replicate: kept.replicate_beside ?? 0,
    }
    : null;

// The part of an address that opens a spec, and lets it run.
/** @param {string} yaml @param {Omit<Opening, "run">} opening */
export function hashOfRun(yaml, { speed, overlays, beside }) {
  const told = {
    spec: yaml,
    speed: String(speed),
    overlays: overlays.join(","),
    ...(beside && { beside }),
    run: "",
  };
  return `#${new URLSearchParams(told)}`;
}
