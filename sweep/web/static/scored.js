// The scorecard: what is claimed, what came out, the figure that shows it, and the
// trials that test it.

import { make } from "./dom.js";
import { ask, Refused } from "./ask.js";
import { ALL, Player, TrialTable } from "./behind.js";
import { PagedTable } from "./rows.js";

/** @import { Choice, Claim, Scorecard, Tested } from "./explorer.d.ts" */

const TITLES = [
  "claim",
  "published",
  "our estimate, 95 % confidence interval",
  "trials",
  "verdict",
  "says",
];

/** @param {Claim} claim */
const nameOf = ({ study, id }) => `${study} ${id}`;

export class ScorecardView {
  /** @type {Scorecard | null} */
  scorecard = null;
  /** @type {Map<string, PagedTable>} */
  listed = new Map();
  // The claim whose figure and trials are shown.
  open = "";

  /**
   * @param {(change: Partial<Choice>) => void} go
   * @param {(command: string) => HTMLElement} command
   */
  constructor(go, command) {
    this.go = go;
    this.command = command;
    this.scales = make("p", { className: "facts" });
    this.verdict = make("select", {
      id: "verdict",
      on: { change: () => this.go({ verdict: this.verdict.value }) },
    });
    const filter = make(
      "div",
      { className: "choices-of-figure" },
      make(
        "div",
        {},
        make("label", { htmlFor: this.verdict.id, textContent: "verdict" }),
        this.verdict,
      ),
    );
    this.tables = make("div");
    this.line = make("div");
    this.claim = make("section", { className: "card", "aria-label": "claim" });
    this.sides = make("div");
    this.player = new Player(go);
    this.element = make(
      "div",
      { className: "study", hidden: true },
      make(
        "section",
        { className: "card seen", "aria-label": "scorecard" },
        this.scales,
        filter,
        this.tables,
        this.line,
      ),
      make(
        "div",
        { className: "behind" },
        this.player.element,
        this.claim,
        this.sides,
      ),
    );
  }

  // Asks for the scorecard, unless it is the one that is shown already.
  /** @param {Choice} choice @param {boolean} all whether something else was chosen */
  async show(choice, all) {
    const scale = choice.scorecard;
    const seen = this.scorecard?.scale === scale ? this.scorecard.revision : "";
    /** @type {Scorecard | { revision: string }} */
    const answer = await ask("scorecard", { scale, seen });
    if ("rows" in answer) {
      this.scorecard = answer;
      this.list(answer);
      this.open = "";
    } else if (!all) return;
    if (!this.scorecard) return;
    this.mark(this.scorecard, choice);
    const claim = this.scorecard.rows.find((one) => nameOf(one) === choice.claim);
    this.claim.hidden = !claim;
    this.sides.hidden = !claim;
    if (claim) await this.unfold(claim, choice);
    const side = claim?.behind[Number(choice.side)];
    this.player.show({ ...choice, study: side?.study ?? "" });
  }

  // A table for each document, those refuted and confirmed in the order of the claims.
  /** @param {Scorecard} scorecard */
  list({ scale, scales, documents, rows, command }) {
    const others = scales.filter((one) => one !== scale).map((one) =>
      make("a", {
        href: `#${new URLSearchParams({ scorecard: one })}`,
        textContent: `the ${one} scale`,
      })
    );
    this.scales.replaceChildren(`Claims judged at the ${scale} scale `, ...others);
    const judged = new Set(rows.map((row) => row.study));
    const names = Object.keys(documents).filter((study) => judged.has(study));
    this.listed = new Map(
      names.map((study) => [study, new PagedTable(`claims of ${study}`, () => {})]),
    );
    const tables = [...this.listed].flatMap(([study, table]) => [
      make("h2", { textContent: documents[study] }),
      table.element,
    ]);
    this.tables.replaceChildren(...tables);
    this.line.replaceChildren(this.command(command));
  }

  // The claims of each document with the verdict that is asked for; the one that was
  // chosen stands out.
  /** @param {Scorecard} scorecard @param {Choice} choice */
  mark({ rows }, choice) {
    const known = rows.some(({ status }) => status === choice.verdict);
    const verdict = known ? choice.verdict : "";
    this.offer(rows, verdict);
    for (const [study, table] of this.listed) {
      const own = rows.filter((row) =>
        row.study === study && (!verdict || row.status === verdict)
      );
      this.fill(table, own, choice);
      const heading = table.element.previousElementSibling;
      for (const part of [heading, table.element]) {
        part?.toggleAttribute("hidden", own.length === 0);
      }
    }
  }

  // The verdicts that there are, with the number of claims of each.
  /** @param {Claim[]} rows @param {string} verdict */
  offer(rows, verdict) {
    const groups = [...Map.groupBy(rows, ({ status }) => status)].map((
      [status, own],
    ) => ({
      value: status,
      textContent: `${own[0].mark} ${status} (${own.length})`,
    }));
    const all = { value: "", textContent: `all (${rows.length})` };
    this.verdict.replaceChildren(...[all, ...groups].map((one) => make("option", one)));
    this.verdict.value = verdict;
  }

  /** @param {PagedTable} table @param {Claim[]} claims @param {Choice} choice */
  fill(table, claims, choice) {
    table.show({
      headings: TITLES.map((text) => ({ text, isNumber: text === "trials" })),
      rows: claims.map((claim) => ({
        cells: [
          claim.id,
          claim.published,
          claim.ours,
          claim.trials ? claim.trials.toLocaleString("en") : "",
          `${claim.mark} ${claim.status}`,
          claim.says,
        ],
        chosen: nameOf(claim) === choice.claim,
        choose: () => this.go({ claim: nameOf(claim), trial: "", side: "" }),
        note: claim.reason,
      })),
      total: claims.length,
      page: 0,
      size: claims.length,
      what: "claims",
    });
  }

  // What the claim says, its figure, and a table of trials for each side.
  /** @param {Claim} claim @param {Choice} choice */
  async unfold(claim, choice) {
    if (this.open !== nameOf(claim)) {
      this.open = nameOf(claim);
      this.trials = claim.behind.map((_, i) =>
        new TrialTable(
          (change) => this.go({ ...change, side: String(i) }),
          claim.behind.length > 1 ? `trials of side ${i + 1}` : "trials",
        )
      );
      this.sides.replaceChildren(...this.trials.map((table) => table.element));
      this.claim.replaceChildren(...this.about(claim));
      this.draw(claim, choice);
    }
    await Promise.all(
      claim.behind.map((side, i) =>
        this.trials?.[i].show({
          ...choice,
          ...chosen(side),
          trial: Number(choice.side) === i ? choice.trial : "",
        })
      ),
    );
  }

  /** @param {Claim} claim */
  about({ id, where, says, reason, status, behind, trials }) {
    const links = behind.map((side) =>
      make("a", {
        href: `#${new URLSearchParams(chosen(side))}`,
        textContent: `figure and points of ${side.study}${
          side.where && ` where ${side.where}`
        }`,
      })
    );
    const nothing = "no trials are named; sweep reproduce names them since 0.14";
    return [
      make("h2", { textContent: `${id}: ${status}` }),
      make("p", { textContent: `${says} (${where})` }),
      make("p", { className: "facts", textContent: reason }),
      ...links.map((link) => make("p", {}, link)),
      trials && !links.length
        ? make("p", { className: "facts", textContent: nothing })
        : "",
    ];
  }

  /** @param {Claim} claim @param {Choice} choice */
  async draw(claim, { scorecard: scale }) {
    if (!claim.picture) return;
    try {
      const { study, id } = claim;
      /** @type {{ png: string }} */
      const { png } = await ask("picture", { study, claim: id, scale });
      if (this.open !== nameOf(claim)) return;
      const alt = `the figure that shows ${id}`;
      this.claim.append(
        make("img", { src: `data:image/png;base64,${png}`, alt, className: "shown" }),
      );
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      this.claim.append(make("p", { className: "facts", textContent: error.message }));
    }
  }
}

// The choice of the page that shows all these trials.
/** @param {Tested} side */
const chosen = ({ study, metric, half, where }) => ({
  study,
  metric,
  half,
  where,
  point: ALL,
});
