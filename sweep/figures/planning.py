"""What a kind of figure is: it plans its figures of a study, and is drawn later.

Each module of a figure has its kind, and `sweep.figures.kinds` gathers them.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from matplotlib.figure import Figure

from sweep.errors import ChoiceError, UserError
from sweep.figures.directions import direction, shown_metrics
from sweep.figures.marks import FigureMarks
from sweep.spec.recorded import Column
from sweep.tables.stored_study import StoredStudy


class Choices(NamedTuple):
    """What to draw: metrics and settings. A metric may have its direction, as
    `coverage+`.

    Without metrics all recorded ones are drawn, of a search its objectives. `half`
    takes their means over the last half of a trial.
    """

    metrics: tuple[str, ...] = ()
    by: str | None = None
    x: str | None = None
    y: str | None = None
    half: bool = False

    def columns(self, study: StoredStudy) -> list[str]:
        """The columns of the trials to draw, each with its direction as given. Raises
        ChoiceError for unknown ones.
        """
        named = [
            (direction(study, text).metric, text[len(text.rstrip("+-")) :])
            for text in self.metrics or shown_metrics(study)
        ]
        return [
            f"{Column(Column.read(metric).metric, True) if self.half else metric}{sign}"
            for metric, sign in named
        ]

    def plain(self, study: StoredStudy) -> list[str]:
        """The same without directions."""
        return [text.rstrip("+-") for text in self.columns(study)]


class Planned(NamedTuple):
    """A figure to be drawn: the metric in the name of its file, or "", and the function
    that draws it.
    """

    metric: str
    draw: Callable[[], Figure]


class FigureKind(NamedTuple):
    """A kind of figure: what it shows, which of by, x and y it takes, and its figures
    of a study.

    `plan` draws nothing and raises ChoiceError where the kind does not suit the study.
    `marks` has the same figure of one metric, or of two, as plain data, if it can.
    `of_search` says that it shows a whole search, `of_several` that it can show several
    studies together, see `sweep.tables.joined`, and `of_precision` that it shows how
    well numbers are known in place of the numbers.
    """

    text: str
    takes: tuple[str, ...]
    plan: Callable[[StoredStudy, Choices], list[Planned]]
    of_search: bool = False
    of_several: bool = False
    marks: Callable[[StoredStudy, Choices], FigureMarks] | None = None
    of_precision: bool = False

    def figures(self, study: StoredStudy, choices: Choices) -> list[Planned]:
        """Its figures of a study, or of several joined. Raises ChoiceError where the
        kind does not suit.
        """
        if len(study.parts) > 1 and not self.of_several:
            raise ChoiceError("shows one study at a time", study.name)
        return self.plan(study, choices)

    def suits(self, study: StoredStudy, choices: Choices) -> str:
        """Why this kind does not suit a study; "" where it does."""
        try:
            self.figures(study, choices)
        except UserError as error:
            return error.reason
        return ""


def search_kind(
    name: str,
    text: str,
    check: Callable[[StoredStudy], object],
    draw: Callable[[StoredStudy], Figure],
    marks: Callable[[StoredStudy], FigureMarks] | None = None,
) -> FigureKind:
    """The kind of a figure of a whole search.

    `check` raises ChoiceError for a study that the figure does not suit. `marks` has
    the figure as plain data, if it can.
    """

    def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
        check(study.whole)
        choice = {
            "metric": choices.metrics,
            "where": study.restricted,
            "over half": choices.half,
        }
        if given := [one for one, value in choice.items() if value]:
            what = "is of the whole search and its objectives"
            raise ChoiceError(f"{what}, and takes no {given[0]}", study.name, name)
        return [Planned("", partial(draw, study))]

    def planned_marks(study: StoredStudy, choices: Choices) -> FigureMarks:
        assert marks
        plan(study, choices)
        return marks(study)

    found = planned_marks if marks else None
    return FigureKind(text, (), plan, of_search=True, marks=found)
