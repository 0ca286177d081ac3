"""What `sweep plot` is asked for: studies and kinds of figures, by their names."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from sweep.errors import ChoiceError
from sweep.figures.kinds import KINDS
from sweep.own_code.sources import SUFFIX
from sweep.spec.recorded import Column
from sweep.spec.study_folder import PLAN
from sweep.store.finding import stored_names
from sweep.store.locations import Location
from sweep.tables.choosing import Refusals
from sweep.tables.joined import JoinedStudies
from sweep.tables.search_phases import by_phase
from sweep.tables.stored_study import StoredStudy
from sweep.text import similar, unknown


class Asked(NamedTuple):
    """One study, or several joined, and the names of kinds and of files with kinds."""

    study: StoredStudy
    kinds: list[str]


def as_asked(names: Sequence[str], results: Location, where: Iterable[str]) -> Asked:
    """The studies and kinds that `names` say, the first of which is a study.

    A name of a kind is the kind; with a slash at its end it is a study. `where` chooses
    among the points of each study. Raises ChoiceError for what is neither, and for what
    `where` cannot choose: all together.
    """
    first, *others = names
    refusals, studies, kinds = Refusals(), [first.rstrip("/")], list[str]()
    for name in others:
        plain = name.rstrip("/")
        if name in KINDS or name.partition(":")[0].endswith(SUFFIX):
            kinds.append(name)
        elif (results / plain / PLAN).exists():
            studies.append(plain)
        else:
            with refusals.noted():
                raise ChoiceError(
                    f"{unknown('kind', name, KINDS)}; and {results} has no study of"
                    f" that name{similar(plain, stored_names(results))}"
                )
    found, texts = list[StoredStudy](), tuple(where)
    for name in studies:
        stored = by_phase(StoredStudy(name, results))
        with refusals.noted():
            found.append(stored.where(*texts))
    refusals.check()
    return Asked(found[0] if len(found) == 1 else JoinedStudies(found), kinds)


def check_shared(study: StoredStudy, metrics: Iterable[str]) -> None:
    """Raise ChoiceError for each metric that joined studies do not share."""
    refusals, left_out = Refusals(), study.left_out
    for name in (Column.read(text.rstrip("+-")).metric for text in metrics):
        with refusals.noted():
            if name in left_out:
                raise ChoiceError(f"{name} {left_out[name]}", study.name)
    refusals.check()
