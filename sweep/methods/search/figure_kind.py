"""The kinds of figures of a whole search."""

from collections.abc import Callable
from functools import partial

from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures import Choices, FigureKind, FigureMarks, Planned
from sweep.tables import StoredStudy


def search_kind(
    name: str,
    text: str,
    check: Callable[[StoredStudy], object],
    draw: Callable[[StoredStudy], Figure],
    marks: Callable[[StoredStudy], FigureMarks] | None = None,
) -> FigureKind:
    """Return the kind of a figure of a whole search.

    Parameters
    ----------
    name : str
        Name of the kind.
    text : str
        The contents of the figure, for help.
    check : callable
        Raises ChoiceError for a study that the figure does not suit.
    draw : callable
        Draws the figure of a study.
    marks : callable, optional
        Returns the figure of a study as plain data.
    """

    def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
        check(study.whole)
        choice = {
            "metric": choices.metrics,
            "where": study.restricted,
            "over half": choices.half,
        }
        if chosen := [option for option, value in choice.items() if value]:
            raise ChoiceError(
                f"shows the whole search and its objectives, and takes no {chosen[0]}",
                study.name,
                name,
            )
        return [Planned("", partial(draw, study))]

    def planned_marks(study: StoredStudy, choices: Choices) -> FigureMarks:
        assert marks
        plan(study, choices)
        return marks(study)

    return FigureKind(
        text, (), plan, of_search=True, marks=planned_marks if marks else None
    )
