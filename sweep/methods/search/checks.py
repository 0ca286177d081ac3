"""Joint checks of the parts of a search section.

All functions raise SpecError, with file and line, if parts are not compatible.
"""

from sweep.methods.search.known_samplers import SEARCH_SAMPLERS
from sweep.methods.search.section_keys import Search
from sweep.spec import MOST_SEARCHED, Document, Entry


def check_search(entry: Entry, search: Search) -> None:
    """Raise SpecError unless budget, held-out trials and sampler suit the section."""
    _check_budget(entry, search)
    check_trials(entry.document, search, repetitions=0)
    _check_sampler(entry, search)


def _check_budget(entry: Entry, search: Search) -> None:
    least = search.batch * search.scenarios
    if search.budget < least:
        each = f" in {search.scenarios} scenarios each" if search.scenarios > 1 else ""
        raise entry.child("budget").error(
            f"a budget of {search.budget} trials is less than one batch of"
            f" {search.batch} candidates{each}: at least {least}, or a smaller batch"
        )


def check_trials(document: Document, search: Search, repetitions: int) -> None:
    """Raise SpecError if a search with its repetitions has too many trials.

    Parameters
    ----------
    document : Document
        Document of the spec, for the line of the budget.
    search : Search
    repetitions : int
        Number of repetitions of the search.
    """
    most = search.most_trials(repetitions)
    if most > MOST_SEARCHED:
        held_out = search.held_out_trials(repetitions)
        again = f" and its {repetitions:,} repetitions" if repetitions else ""
        raise document.error(
            ("search", "budget"),
            f"the search{again} may need {most:,} trials, of which {held_out:,} on"
            f" held-out seeds; at most {MOST_SEARCHED:,} are allowed: reduce budget,"
            " held_out or the number of scenarios",
        )


def _check_sampler(entry: Entry, search: Search) -> None:
    for need in SEARCH_SAMPLERS[search.sampler].needs:
        if not need.holds(search):
            raise (entry.get("sampler") or entry.child("objectives")).error(
                f"sampler {search.sampler} {need.message}"
            )
