// What is wrong with the page for those who see, hear or point otherwise: lists that
// should be empty.

/** @import { Colours } from "../../sweep/web/static/stage.js" */

/** @param {string[]} wanted */
export function troubles(wanted) {
  /** @param {Element} one */
  const box = (one) => one.getBoundingClientRect();
  /** @param {Element} one */
  const shown = (one) =>
    one.checkVisibility({ visibilityProperty: true }) && box(one).width > 0;
  /** @param {string} selector */
  const all = (selector) =>
    [...document.querySelectorAll(selector)].filter((one) =>
      one instanceof HTMLElement
    );
  const controls = all(
    "button, input, select, textarea, summary, canvas[tabindex='0']",
  ).filter(shown);
  /** @param {Element} one */
  const short = (one) => one.outerHTML.slice(0, 160);

  const probe = document.createElement("canvas").getContext("2d", {
    willReadFrequently: true,
  });
  /** @param {string} colour */
  const parse = (colour) => {
    if (!probe) throw new Error("no canvas");
    probe.clearRect(0, 0, 1, 1);
    probe.fillStyle = colour;
    probe.fillRect(0, 0, 1, 1);
    return [...probe.getImageData(0, 0, 1, 1).data];
  };
  /** @param {number} value */
  const linear = (value) =>
    value / 255 <= 0.04045
      ? value / 255 / 12.92
      : ((value / 255 + 0.055) / 1.055) ** 2.4;
  /** @param {number[]} colour */
  const luminance = ([red, green, blue]) =>
    0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue);
  /** @param {number[]} first @param {number[]} second */
  const contrast = (first, second) => {
    const [low, high] = [luminance(first), luminance(second)].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  };
  /** @param {Element} one @returns {number[]} */
  const behind = (one) => {
    const colour = parse(getComputedStyle(one).backgroundColor);
    if (colour[3] === 255) return colour;
    if (!one.parentElement) throw new Error("nothing is behind the page");
    return behind(one.parentElement);
  };

  /** @type {Record<string, () => string[]>} */
  const checks = {
    nameless() {
      /** @param {HTMLElement} one */
      const label = (one) =>
        "labels" in one && one.labels instanceof NodeList
          ? one.labels[0]?.textContent
          : "";
      /** @param {HTMLElement} one */
      const name = (one) =>
        one.getAttribute("aria-label") || label(one) || one.textContent;
      const named = [...controls, ...all("[role=img], aside, dialog")];
      return named.filter((one) => !name(one).trim()).map(short);
    },
    doubled() {
      const ids = all("[id]").map((one) => one.id);
      return ids.filter((id, i) => ids.indexOf(id) !== i);
    },
    disordered: () => all("[tabindex]").filter((one) => one.tabIndex > 0).map(short),
    unmarked() {
      /** @param {HTMLElement} one */
      const plain = (one) => {
        one.focus({ focusVisible: true });
        const { outlineStyle, outlineWidth } = getComputedStyle(one);
        return outlineStyle === "none" || parseFloat(outlineWidth) < 2;
      };
      return controls.filter((one) => !one.matches(":disabled") && plain(one)).map(
        short,
      );
    },
    faint() {
      const found = [];
      for (const one of all("main, main *")) {
        const texts = [...one.childNodes].filter((child) => child instanceof Text);
        if (!texts.some((text) => text.data.trim())) continue;
        if (one.closest(":disabled") || !one.checkVisibility()) continue;
        const ratio = contrast(parse(getComputedStyle(one).color), behind(one));
        if (ratio < 4.5) found.push(`${ratio.toFixed(2)} ${short(one)}`);
      }
      return found;
    },
    faintly_drawn() {
      const { colours } = boidsweep.view.stage;
      /** @type {[front: keyof Colours, back: keyof Colours, least: number][]} */
      const pairs = [
        ["boid", "ground", 3],
        ["boid", "stage", 3],
        ["chosen", "ground", 3],
        ["goal", "ground", 3],
        ["muted", "stage", 4.5],
      ];
      return pairs.flatMap(([front, back, least]) => {
        const ratio = contrast(parse(colours[front]), parse(colours[back]));
        return ratio < least ? [`${front} on ${back} ${ratio}`] : [];
      });
    },
    overflowing() {
      /** @param {Element} one */
      const wide = (one) =>
        one.scrollWidth > one.clientWidth + 1 &&
        getComputedStyle(one).overflowX !== "visible";
      const places = [
        document.documentElement,
        ...all(".boidsweep, .layout > *, dialog[open]"),
      ];
      return places.filter(wide).map((one) =>
        `${one.className || one.tagName}: ${one.scrollWidth} in ${one.clientWidth}`
      );
    },
    // What cannot be brought to where a pointer reaches it.
    hidden_away() {
      return controls.filter((one) => {
        if (one.matches(":disabled") || one.closest(".picture")) return false;
        one.scrollIntoView({ block: "center", inline: "nearest" });
        const { left, top, width, height } = box(one);
        const met = document.elementFromPoint(left + width / 2, top + height / 2);
        return !(met && (one.contains(met) || met.closest("label")?.contains(one)));
      }).map(short);
    },
    small() {
      /** @param {HTMLElement} one */
      const target = (one) => {
        const around = one.closest("label") ?? one.closest(".field") ?? one;
        return box(one.matches("[type=checkbox]") ? around : one);
      };
      return controls.flatMap((one) => {
        const { width, height } = target(one);
        return Math.min(width, height) < 43.5
          ? [`${width} x ${height} ${short(one)}`]
          : [];
      });
    },
  };
  const found = wanted.map((name) => ({ name, those: checks[name]() }));
  const wrong = found.filter(({ those }) => those.length);
  return Object.fromEntries(wrong.map(({ name, those }) => [name, those]));
}
