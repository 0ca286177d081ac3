// Headings as colours: hues of one lightness, which stand out on a light ground and on
// a dark one, and a wheel that tells them.

import { short } from "./dom.js";

/** @import { Frame } from "./frames.js" */
/** @import { Pen, Stage } from "./stage.js" */

const STEPS = 256; // headings are bytes
// Of OKLCH: a contrast of 3 to 1 on both grounds.
const LIGHTNESS = 0.58;
const CHROMA = 0.14;
const OUTER = 28; // CSS pixels
const INNER = 19;
const ASIDE = 14;
const LETTER = 6.6;
const ABOVE = 48; // the button about boids outside is below

// A colour of OKLCH in sRGB (Ottosson 2020).
/** @param {number} hue in radians */
function hued(hue) {
  const [a, b] = [CHROMA * Math.cos(hue), CHROMA * Math.sin(hue)];
  const l = (LIGHTNESS + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (LIGHTNESS - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (LIGHTNESS - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const linear = [
    4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
    -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
    -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
  ];
  const parts = linear.map((part) => {
    const within = Math.min(Math.max(part, 0), 1);
    const encoded = within <= 0.0031308
      ? 12.92 * within
      : 1.055 * within ** (1 / 2.4) - 0.055;
    return Math.round(255 * encoded);
  });
  return `rgb(${parts.join(", ")})`;
}

// The colour of each heading, from 0 all the way round.
export const WHEEL = Array.from(
  { length: STEPS },
  (_, heading) => hued((2 * Math.PI * heading) / STEPS),
);

/** @param {number} heading */
const angleOf = (heading) => (2 * Math.PI * heading) / STEPS;

// The mean of the unit vectors of all boids; its length is the polarization.
/** @param {Frame} frame */
function meanHeading({ heading, n }) {
  let [x, y] = [0, 0];
  for (let i = 0; i < n; i++) {
    x += Math.cos(angleOf(heading[i]));
    y += Math.sin(angleOf(heading[i]));
  }
  return { x: x / Math.max(1, n), y: y / Math.max(1, n) };
}

// Draws the ring of all colours, each in the direction of its heading. `upright` is -1
// where y grows upwards.
/**
 * @param {Pen} context
 * @param {{ x: number, y: number }} at the middle
 * @param {[inner: number, outer: number]} radii
 * @param {number} upright
 */
export function drawRing(context, at, [inner, outer], upright) {
  const step = (2 * Math.PI) / STEPS;
  context.lineWidth = outer - inner;
  for (let heading = 0; heading < STEPS; heading += 4) {
    const from = angleOf(heading) * upright;
    const [first, last] = [from, from + 4.5 * step * upright].toSorted((a, b) => a - b);
    context.strokeStyle = WHEEL[heading];
    context.beginPath();
    context.arc(at.x, at.y, (outer + inner) / 2, first, last);
    context.stroke();
  }
}

// Draws the wheel at the lower right, with the mean heading as an arrow: as long as the
// inner circle if all boids go one way.
/** @param {Stage} stage @param {Frame} frame */
export function drawWheel(stage, frame) {
  const { context, colours, upright, width, height } = stage;
  const at = { x: width - ASIDE - OUTER, y: height - ABOVE - OUTER };
  drawRing(context, at, [INNER, OUTER], upright);
  const mean = meanHeading(frame);
  const [dx, dy] = [mean.x * INNER, mean.y * INNER * upright];
  context.strokeStyle = context.fillStyle = colours.ink;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(at.x, at.y);
  context.lineTo(at.x + dx, at.y + dy);
  context.stroke();
  context.beginPath();
  context.arc(at.x + dx, at.y + dy, 3, 0, 2 * Math.PI);
  context.fill();
  context.font = "12px system-ui, sans-serif";
  const text = short(Math.hypot(mean.x, mean.y), 2);
  context.fillText(text, at.x - (text.length * LETTER) / 2, at.y + OUTER + 14);
}
