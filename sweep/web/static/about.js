// What is shown, for those who see it for the first time: the document behind the
// model, and what its preset stands for.

import { make } from "./dom.js";

/** @import { Controls } from "./protocol.d.ts" */

const DOI = /https:\/\/doi\.org\/[^\s,;]+/;

// The text of a source, in which a DOI is a link.
/** @param {string} source */
export function linked(source) {
  const [address] = DOI.exec(source) ?? [];
  if (!address) return [source];
  const [before, after] = source.split(address, 2);
  const link = make("a", {
    href: address,
    textContent: address,
    target: "_blank",
    rel: "noreferrer",
  });
  return [before, link, after];
}

export class About {
  element = make("section", {
    className: "about-model",
    "aria-label": "about the model",
  });

  /** @param {Controls} controls */
  offer({ models, model, preset }) {
    const known = models.find((one) => one.name === model);
    if (!known) return;
    const words = known.texts[preset];
    this.element.replaceChildren(
      make("p", { className: "facts" }, ...linked(known.source)),
      ...(words
        ? [make("p", {}, make("b", { textContent: preset }), `: ${words}`)]
        : []),
    );
  }
}
