// Colours of numbers: viridis, whose lightness grows evenly.

const RAMP = [
  [68, 1, 84],
  [72, 40, 120],
  [62, 74, 137],
  [49, 104, 142],
  [38, 130, 142],
  [31, 158, 137],
  [53, 183, 121],
  [109, 205, 89],
  [180, 222, 44],
  [253, 231, 37],
];

/** @param {number} part from 0 to 1 */
export function ramp(part) {
  const place = Math.min(Math.max(part, 0), 1) * (RAMP.length - 1);
  const low = Math.min(Math.floor(place), RAMP.length - 2);
  const mixed = RAMP[low].map((one, i) =>
    one + (place - low) * (RAMP[low + 1][i] - one)
  );
  return `rgb(${mixed.map(Math.round).join(" ")})`;
}
