// The report of a search: what was chosen, judged on seeds that the search has not
// seen, and the trials behind each row.

import { make } from "./dom.js";
import { ask } from "./ask.js";
import { PagedTable } from "./rows.js";

/** @import { Choice, Searched, StudyState, Told } from "./explorer.d.ts" */

export class SearchPanel {
  /**
   * @param {(change: Partial<Choice>) => void} go
   * @param {(command: string) => HTMLElement} command
   */
  constructor(go, command) {
    this.go = go;
    this.command = command;
    this.parts = make("div");
    this.element = make(
      "section",
      { className: "card search", "aria-label": "search", hidden: true },
      make("h2", { textContent: "Search" }),
      this.parts,
    );
  }

  /** @param {Choice} choice @param {StudyState} state */
  async show(choice, state) {
    this.element.hidden = !state.search;
    if (!state.search) return;
    /** @type {Searched} */
    const report = await ask("search", { study: choice.study });
    if (state.study !== choice.study) return;
    this.parts.replaceChildren(
      make("pre", { textContent: report.searched }),
      make("ul", {}, ...report.notes.map((text) => make("li", { textContent: text }))),
      ...report.tables.flatMap((table) => this.table(table, choice)),
      ...report.said.map((text) => make("p", { className: "said", textContent: text })),
      make("pre", { textContent: report.best }),
      this.command(report.command),
    );
  }

  /** @param {Told} table @param {Choice} choice */
  table({ titles, rows, note, points }, choice) {
    const table = new PagedTable(titles[1], () => {});
    table.show({
      headings: titles.map((text) => ({ text })),
      rows: rows.map((cells, i) => ({
        cells,
        chosen: choice.point === points[i],
        choose: () => this.go({ point: points[i], trial: "" }),
      })),
      total: rows.length,
      page: 0,
      size: rows.length,
      what: "rows",
    });
    return [table.element, make("p", { className: "facts said", textContent: note })];
  }
}
