// How the search of the site orders pages. Sphinx asks `Scorer` for the score of each
// page that it found; the numbers are those of Sphinx, save that a page for readers of
// the code comes after the pages for researchers.
const scorer = {
  /**
   * The score of a result: page, title, place, description, score of Sphinx.
   * @param {[string, string, string, string?, number]} result
   */
  score: (result) => {
    const [page, , , , score] = result;
    const forDevelopers = /^(decisions\/|changes$|developing$|contributing$|words$)/;
    const introduces = /^(guide\/|start$|install$|glossary$|faq$|troubleshooting$)/;
    if (forDevelopers.test(page)) return score / 4;
    return introduces.test(page) ? score : score / 2;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
Object.assign(globalThis, { Scorer: scorer });
