// The table of points of a study, in the words of sweep table.

import { make, spaced, unitText } from "./dom.js";
import { ask } from "./ask.js";
import { PagedTable } from "./rows.js";

/** @import { Choice, Points } from "./explorer.d.ts" */

export class PointTable {
  page = 0;
  /** @type {Points | null} */
  points = null;
  revision = "";
  shown = ""; // what was asked for, at which revision

  /**
   * @param {(change: Partial<Choice>) => void} go
   * @param {(command: string) => HTMLElement} command
   */
  constructor(go, command) {
    this.go = go;
    this.command = command;
    /** @type {Choice | null} */
    this.choice = null;
    this.table = new PagedTable(
      "points",
      (page) => this.turn(page),
      (column) => this.sortBy(column),
    );
    this.caption = make("p", { className: "facts said" });
    this.line = make("div");
    const save = make("button", {
      type: "button",
      textContent: "csv",
      on: { click: () => this.save() },
    });
    this.element = make(
      "section",
      { className: "card", "aria-label": "points" },
      make(
        "div",
        { className: "row spread" },
        make("h2", { textContent: "Points" }),
        save,
      ),
      this.table.element,
      this.caption,
      this.line,
    );
  }

  get asked() {
    const { study = "", where = "", sort = "", half = "", metric = "" } = this.choice ??
      {};
    return {
      study,
      where,
      sort,
      half,
      metric: metric.split(" ").map((one) => one.replace(/[+-]$/, "")),
    };
  }

  /** @param {Choice} choice @param {string} [revision] */
  async show(choice, revision = this.revision) {
    const before = JSON.stringify(this.asked);
    this.choice = choice;
    this.revision = revision;
    if (JSON.stringify(this.asked) !== before) this.page = 0;
    const page = this.page ? String(this.page) : "";
    const asked = JSON.stringify(this.asked);
    const wanted = [revision, page, asked].join(" ");
    if (wanted === this.shown) return this.draw(); // only other points are chosen
    /** @type {Points} */
    const points = await ask("points", { ...this.asked, page });
    if (asked !== JSON.stringify(this.asked)) return;
    this.points = points;
    this.shown = wanted;
    this.draw();
  }

  draw() {
    const { points, choice } = this;
    if (!points || !choice) return;
    const { headings, metrics, units, cells, caption, command } = points;
    const chosen = new Set(choice.point.split(" "));
    const rows = cells.map((row, i) => ({
      cells: row.length ? row : ["-"],
      chosen: chosen.has(points.points[i]),
      choose: () => this.go({ point: points.points[i] }),
    }));
    const names = [...headings, ...metrics].map((name) => ({
      text: spaced(name) + (units[name] ? ` (${unitText(units[name])})` : ""),
      sort: name,
      isNumber: metrics.includes(name) ||
        points.rows.every((row) => typeof row[name] === "number"),
    }));
    this.table.show({ ...points, headings: names, rows, what: "points" }, choice.sort);
    this.caption.textContent = caption;
    this.line.replaceChildren(this.command(command));
  }

  /** @param {number} page */
  turn(page) {
    this.page = page;
    if (this.choice) this.show(this.choice);
  }

  /** @param {string} column */
  sortBy(column) {
    const sort = this.choice?.sort;
    const next = sort === column ? `${column}:desc` : column;
    this.go({ sort: sort === `${column}:desc` ? "" : next });
  }

  async save() {
    /** @type {{ csv: string }} */
    const { csv } = await ask("points", { ...this.asked, csv: "yes" });
    const name = `${this.asked.study.replaceAll("/", "-")}.csv`;
    const { download } = await import("./files.js");
    download(name, "text/csv", new TextEncoder().encode(csv));
  }
}
