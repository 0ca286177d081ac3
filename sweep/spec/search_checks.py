"""What the parts of a search section must fulfil together.

All functions raise SpecError, with file and line, where they do not.
"""

from importlib.util import find_spec

from sweep.spec.document import Document, Entry
from sweep.spec.limits import MOST_SEARCHED
from sweep.spec.search import Search

POPULATIONS = ("nsga2", "nsga3")


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
    """Raise SpecError where the search, with its repetitions, has too many trials."""
    most = search.most_trials(repetitions)
    if most > MOST_SEARCHED:
        held_out = search.held_out_trials(repetitions)
        again = f" and its {repetitions:,} repetitions" if repetitions else ""
        raise document.error(
            ("search", "budget"),
            f"the search{again} could come to {most:,} trials, of which {held_out:,} on"
            f" held-out seeds; at most {MOST_SEARCHED:,} are allowed: lower budget,"
            " held_out or the number of scenarios",
        )


def _check_sampler(entry: Entry, search: Search) -> None:
    def refused(reason: str) -> None:
        raise (entry.get("sampler") or entry.child("objectives")).error(
            f"sampler {search.sampler} {reason}"
        )

    if search.sampler == "cmaes":
        if len(search.objectives) > 1:
            refused("has one objective: use nsga2, nsga3, tpe or random")
        if search.constraints:
            refused("knows no constraints: use tpe, nsga2 or nsga3")
        if any(parameter.form == "choice" for parameter in search.parameters):
            refused("needs numbers, and no choice: use tpe")
        if (
            sum(len(set(parameter.arguments)) > 1 for parameter in search.parameters)
            < 2
        ):
            refused("needs two parameters or more: use tpe")
    if search.sampler == "nsga3" and len(search.objectives) < 2:
        refused("is for several objectives: use nsga2 or tpe")
    if search.sampler in POPULATIONS and search.batch < 2:
        refused("needs a batch, which is its population, of 2 or more")
    if search.sampler == "gp" and find_spec("torch") is None:
        refused("needs torch: pip install torch")
