// Notes over the page of what went wrong. Each stays until it is closed.

import { button, make } from "./dom.js";

const MOST = 4;

export class Toasts {
  element = make("div", { className: "toasts" });

  /** @param {string} words */
  say(words) {
    for (const one of this.element.children) {
      if (one.firstChild?.textContent === words) one.remove();
    }
    const toast = make("div", { className: "toast" }, make("span", {}, words));
    toast.setAttribute("role", "alert");
    toast.append(button("remove", "Close", () => toast.remove(), "", {
      className: "quiet",
    }));
    this.element.append(toast);
    if (this.element.children.length > MOST) this.element.firstChild?.remove();
  }
}
