"""Arguments of `sweep plot`: studies and kinds of figures, by name."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from sweep.errors import ChoiceError
from sweep.figures.kinds import KINDS
from sweep.own_code import SUFFIX
from sweep.spec import PLAN, Column
from sweep.store import Location, stored_names
from sweep.tables import JoinedStudies, Refusals, Results, StoredStudy, keep_apart
from sweep.text import similar, unknown


class PlotArguments(NamedTuple):
    """One study or several joined studies, and names of kinds and files with kinds."""

    study: Results
    kinds: list[str]


def plot_arguments(
    names: Sequence[str], results: Location, where: Iterable[str]
) -> PlotArguments:
    """Sort the arguments of `sweep plot` into studies and kinds of figures.

    Parameters
    ----------
    names : sequence of str
        Names of studies, of kinds and of files with kinds; the first name is a study.
        The name of a kind means the kind; with a slash at the end the name means a
        study. A colon and a condition may follow the name of a study.
    results : Location
        Folder of stored studies.
    where : iterable of str
        Conditions that select points of each study.

    Raises
    ------
    ChoiceError
        If a name is neither a study nor a kind, or a condition selects nothing. All
        mistakes are reported together.
    """
    refusals = Refusals()
    first, *further_names = names
    chosen = [_chosen(first)]
    kinds = list[str]()
    for name in further_names:
        plain, own = _chosen(name)
        if name in KINDS or plain.endswith(SUFFIX):
            kinds.append(name)
        elif (results / plain / PLAN).exists():
            chosen.append((plain, own))
        else:
            with refusals.noted():
                raise ChoiceError(
                    f"{unknown('kind', name, KINDS)}; and {results} has no study of"
                    f" that name{similar(plain, stored_names(results))}"
                )
    conditions = tuple(where)
    studies = list[StoredStudy]()
    for name, own in chosen:
        stored = keep_apart(StoredStudy(name, results))
        with refusals.noted():
            studies.append(stored.where(*conditions, *own))
    refusals.check()
    return PlotArguments(
        studies[0] if len(studies) == 1 else JoinedStudies(studies), kinds
    )


def _chosen(text: str) -> tuple[str, tuple[str, ...]]:
    """Return the name of a study, and the condition after a colon, if there is one."""
    name, colon, condition = text.partition(":")
    return name.rstrip("/"), (condition,) if colon else ()


def check_shared(study: Results, metrics: Iterable[str]) -> None:
    """Raise ChoiceError for each metric that joined studies do not share."""
    refusals = Refusals()
    left_out = study.left_out
    for name in (Column.read(text.rstrip("+-")).metric for text in metrics):
        with refusals.noted():
            if name in left_out:
                raise ChoiceError(f"{name} {left_out[name]}", study.name)
    refusals.check()
