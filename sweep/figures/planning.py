"""Parts of a kind of figure, which plans and later draws figures of a study.

The module of each figure defines the kind, and `sweep.figures.kinds` lists all kinds.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from sweep.errors import ChoiceError, UserError
from sweep.figures.directions import direction, shown_metrics
from sweep.figures.marks import FigureMarks
from sweep.spec import Column
from sweep.tables import Results, StoredStudy


class Choices(NamedTuple):
    """The metrics and parameters to draw.

    Attributes
    ----------
    metrics : tuple of str, default ()
        Metrics, each optionally with a direction, such as `coverage+`. If empty, the
        objectives of a search are drawn, or else all recorded metrics.
    by : str, optional
        Parameter of the lines or colours.
    x, y : str, optional
        Parameters of the axes.
    half : bool, default False
        Use the mean over the second half of each trial in place of the last frame.
    trials : bool, default False
        Draw the value of each trial behind the means.
    """

    metrics: tuple[str, ...] = ()
    by: str | None = None
    x: str | None = None
    y: str | None = None
    half: bool = False
    trials: bool = False

    def columns(self, study: Results) -> list[str]:
        """Return the columns of the trials to draw, with directions, if chosen.

        Parameters
        ----------
        study : Results

        Returns
        -------
        list of str
            Columns such as `coverage+` or `coverage_mean`.

        Raises
        ------
        ChoiceError
            If a metric is unknown.
        """
        named = [
            (direction(study, text).metric, text[len(text.rstrip("+-")) :])
            for text in self.metrics or shown_metrics(study)
        ]
        return [
            f"{Column(Column.read(metric).metric, True) if self.half else metric}{sign}"
            for metric, sign in named
        ]

    def plain(self, study: Results) -> list[str]:
        """Return the columns of the trials to draw, without directions.

        Parameters
        ----------
        study : Results

        Returns
        -------
        list of str
            Columns such as `coverage` or `coverage_mean`.

        Raises
        ------
        ChoiceError
            If a metric is unknown.
        """
        return [text.rstrip("+-") for text in self.columns(study)]


class Planned(NamedTuple):
    """A figure to draw later.

    Attributes
    ----------
    metric : str
        The metric in the name of the file of the figure, or "".
    draw : callable
        Function without arguments that returns a Figure.
    """

    metric: str
    draw: Callable[[], Figure]


class FigureKind(NamedTuple):
    """A kind of figure.

    Attributes
    ----------
    text : str
        Contents of the figures, for help.
    takes : tuple of str
        Choices that the kind takes: some of "by", "x", "y" and "trials".
    plan : callable
        Function that plans the figures of a study, without drawing. The function raises
        ChoiceError if the kind does not suit the study. The argument is a
        `StoredStudy`, or any `Results` if the kind is `of_several`.
    of_search : bool, default False
        True if a figure shows a whole search.
    of_several : bool, default False
        True if a figure can show several joined studies, see `sweep.tables.joined`.
    marks : callable, optional
        Function that returns the figure of one or two metrics as plain data.
    of_precision : bool, default False
        True if a figure shows the precision of numbers in place of the numbers.
    lacks : callable
        Function that returns what to install before a figure can be drawn, in words, or
        "". Marks need no such package.
    """

    text: str
    takes: tuple[str, ...]
    plan: Callable[[Any, Choices], list[Planned]]
    of_search: bool = False
    of_several: bool = False
    marks: Callable[[StoredStudy, Choices], FigureMarks] | None = None
    of_precision: bool = False
    lacks: Callable[[], str] = str

    def figures(self, study: Results, choices: Choices) -> list[Planned]:
        """Plan the figures of a study.

        Parameters
        ----------
        study : Results
            One study, or several joined.
        choices : Choices

        Returns
        -------
        list of Planned

        Raises
        ------
        ChoiceError
            If the kind does not suit the study.
        """
        lacking = self.lacks()
        if lacking:
            raise ChoiceError(lacking, study.name)
        return self._planned(study, choices)

    def _planned(self, study: Results, choices: Choices) -> list[Planned]:
        if not (self.of_several or isinstance(study, StoredStudy)):
            raise ChoiceError("shows one study at a time", study.name)
        return self.plan(study, choices)

    def suits(self, study: Results, choices: Choices, *, as_marks: bool = False) -> str:
        """Return why this kind does not suit a study, or "" if the kind suits.

        Parameters
        ----------
        study : Results
        choices : Choices
        as_marks : bool, default False
            Whether marks are wanted, which need no package that draws.

        Returns
        -------
        str
            The reason, or "".
        """
        try:
            if as_marks:
                self._planned(study, choices)
            else:
                self.figures(study, choices)
        except UserError as error:
            return error.reason
        return ""
