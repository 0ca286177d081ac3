// What an address says of the state that it opens, after its #. That is sent to no
// server.

/** @import { Kept } from "./protocol.d.ts" */

/**
 * How a state is shown at first: after how many steps, at how many steps a second, with
 * which overlays, plots and selected boid, with which other preset beside it, or "",
 * and whether it runs at once. What is null is as it would be without an address.
 *
 * @typedef {{
 *   step: number,
 *   speed: number | null,
 *   overlays: string[],
 *   plots: string[] | null,
 *   boid: number | null,
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
  /** @param {string} name */
  const number = (name) => {
    const value = Number(told.get(name) || NaN);
    return Number.isFinite(value) ? value : null;
  };
  /** @param {string} name */
  const names = (name) => told.get(name)?.split(",").filter(Boolean);
  return {
    step: number("step") ?? 0,
    speed: number("speed"),
    overlays: names("overlays") ?? [],
    plots: names("plots") ?? null,
    boid: number("boid"),
    beside: told.get("beside") ?? "",
    run: told.has("run"),
  };
}

// The part of an address that names a state, and how it is shown.
/** @param {Kept} kept @param {Partial<Opening>} opening */
export function hashOf(kept, opening) {
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
  tellOpening(told, opening);
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
/** @param {string} yaml @param {Partial<Opening>} opening */
export function hashOfRun(yaml, opening) {
  const told = new URLSearchParams({ spec: yaml });
  tellOpening(told, { ...opening, run: true });
  return `#${told}`;
}

/** @param {URLSearchParams} told @param {Partial<Opening>} opening */
function tellOpening(told, opening) {
  const { step, speed, overlays = [], plots, boid, beside, run } = opening;
  const numbers = { step: step || null, speed, boid };
  for (const [name, value] of Object.entries(numbers)) {
    if (typeof value === "number") told.set(name, String(value));
  }
  if (overlays.length) told.set("overlays", overlays.join(","));
  if (plots) told.set("plots", plots.join(","));
  if (beside) told.set("beside", beside);
  if (run) told.set("run", "");
}
