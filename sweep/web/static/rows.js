// A table with pages: rows of texts, which a reader can sort and choose.

import { make } from "./dom.js";

/**
 * A row is chosen by its first cell, which may have another button after it.
 *
 * @typedef {{
 *   cells: string[],
 *   chosen: boolean,
 *   choose: () => void,
 *   note?: string,
 *   more?: { text: string, label: string, chosen: boolean, choose: () => void } | null,
 * }} Row
 * A column of numbers is aligned to the right.
 *
 * @typedef {{ text: string, sort?: string, isNumber?: boolean }} Heading
 * @typedef {{
 *   headings: Heading[],
 *   rows: Row[],
 *   total: number,
 *   page: number,
 *   size: number,
 *   what: string,
 * }} Content
 */

export class PagedTable {
  /**
   * @param {string} name
   * @param {(page: number) => void} turn
   * @param {(column: string) => void} [sort]
   */
  constructor(name, turn, sort) {
    this.sort = sort;
    this.page = 0;
    this.head = make("thead");
    this.body = make("tbody");
    this.table = make("table", { "aria-label": name }, this.head, this.body);
    this.before = make("button", {
      type: "button",
      textContent: "earlier",
      on: { click: () => turn(this.page - 1) },
    });
    this.after = make("button", {
      type: "button",
      textContent: "later",
      on: { click: () => turn(this.page + 1) },
    });
    this.words = make("span", { className: "facts" });
    this.pages = make(
      "div",
      { className: "row pages" },
      this.before,
      this.after,
      this.words,
    );
    const around = make("div", {
      className: "scrolls",
      tabIndex: 0,
      role: "region",
      "aria-label": `rows of ${name}`,
    }, this.table);
    this.element = make("div", { className: "paged" }, around, this.pages);
  }

  /** @param {Content} content @param {string} [sorted] */
  show({ headings, rows, total, page, size, what }, sorted = "") {
    this.page = page;
    const focused = this.placeOfFocus();
    const line = make("tr", {}, ...headings.map((one) => this.heading(one, sorted)));
    this.head.replaceChildren(line);
    this.body.replaceChildren(...rows.map((row) => rowOf(row, headings)));
    if (focused) this.focusAt(focused);
    const first = page * size;
    this.before.disabled = page === 0;
    this.after.disabled = first + size >= total;
    this.pages.classList.toggle("single", total <= size);
    this.words.textContent = total > size
      ? `${(first + 1).toLocaleString("en")} to ${
        Math.min(first + size, total).toLocaleString("en")
      } of ${total.toLocaleString("en")} ${what}`
      : `${total.toLocaleString("en")} ${what}`;
  }

  // The row and the button in it that have the focus: rows are made anew, and whoever
  // uses the keyboard stays where they are.
  /** @returns {[row: number, button: number] | null} */
  placeOfFocus() {
    const { activeElement: focus } = document;
    const row = focus?.closest("tr");
    if (!focus || !row || !this.element.contains(row)) return null;
    return [
      row.rowIndex,
      [...row.querySelectorAll("button")].findIndex((one) => one === focus),
    ];
  }

  /** @param {[row: number, button: number]} place */
  focusAt([row, button]) {
    const { rows } = this.table;
    const line = rows[Math.min(row, rows.length - 1)];
    line?.querySelectorAll("button")[button]?.focus({ preventScroll: true });
  }

  /** @param {Heading} heading @param {string} sorted */
  heading({ text, sort, isNumber }, sorted) {
    const [name, way] = sorted.split(":");
    const order = name === sort && sort
      ? (way === "desc" ? "descending" : "ascending")
      : "none";
    const className = classOf(isNumber);
    const cell = make("th", { scope: "col", "aria-sort": order, className });
    const act = () => sort && this.sort?.(sort);
    const arrow = { ascending: " ↑", descending: " ↓", none: "" }[order];
    if (sort && this.sort) {
      cell.append(
        make("button", {
          type: "button",
          textContent: text + arrow,
          on: { click: act },
        }),
      );
    } else cell.textContent = text;
    return cell;
  }
}

const classOf = (isNumber = false) => (isNumber ? "number" : "");

/** @param {Row} row @param {Heading[]} headings */
function rowOf({ cells: [first, ...others], chosen, choose, note, more }, headings) {
  const classes = headings.map(({ isNumber }) => classOf(isNumber));
  const opener = make("button", {
    type: "button",
    textContent: first,
    "aria-pressed": String(chosen),
    on: { click: choose },
  });
  const second = more
    ? [make("button", {
      type: "button",
      textContent: more.text,
      "aria-label": more.label,
      "aria-pressed": String(more.chosen),
      on: { click: more.choose },
    })]
    : [];
  const line = make(
    "tr",
    { className: chosen ? "chosen" : "", title: note ?? "" },
    make("td", { className: classes[0] ?? "" }, opener, ...second),
    ...others.map((textContent, i) =>
      make("td", { textContent, className: classes[i + 1] ?? "" })
    ),
  );
  return line;
}
