"""Selection of the trials that a figure shows, and roles of the parameters.

Parameters that vary become axes, colours and panels. A figure averages over replicates
only. If no room is left for a parameter that varies, the user must choose fewer points.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from sweep.analysis import percent
from sweep.errors import ChoiceError
from sweep.figures.drawing import named, span, words
from sweep.spec import Column
from sweep.tables import Results, few_skewed, keep_apart, spelled, untried
from sweep.text import unknown

MOST_PANELS = 12
MOST_COLOURS = 7
FARTHEST = 1e150
"""Largest position on an axis; the square is finite, with a margin for matplotlib."""
MOST_NAMED = 30
"""The most values of a parameter without a scale that have room on an axis."""
MOST_BY_DEFAULT = 3
"""The most values that become colours by default; more values become panels."""


class Facet(NamedTuple):
    """A panel of a figure: common parameters of the points in words, and point ids."""

    title: str
    points: "pd.Index[str]"


@dataclass(frozen=True, eq=False)
class Selection:
    """The trials of a study that a figure shows.

    Attributes
    ----------
    study : Results
        A study with only these trials.
    points : DataFrame
        A row per point with a stored trial, by point id. The columns are the parameters
        that differ between these points.
    designed : DataFrame
        Rows for all points of the spec, with the columns of `points`. The rows decide
        the roles of parameters, so that the form of a figure is constant while trials
        run.
    sampled : list of str
        Parameters that an axis of the spec samples.
    listed : list of str
        Parameters with listed values, fewest values first. A parameter that follows
        from listed values, such as the width of a map, is in neither list.
    """

    study: Results
    points: pd.DataFrame
    designed: pd.DataFrame
    sampled: list[str]
    listed: list[str]

    @property
    def trials(self) -> pd.DataFrame:
        """The stored trials."""
        return self.study.trials

    @property
    def planned(self) -> int:
        """The number of planned trials."""
        return int(self.study.plan.num_rows)

    @property
    def not_done(self) -> int:
        """The number of trials not done: not run, failed, diverged or timed out."""
        return self.planned - int(self.study.done.sum())

    def table(self, metrics: Sequence[str]) -> pd.DataFrame:
        """Return the parameters and the means of metrics of each point, by point id.

        Each metric has the columns mean, _low, _high, _n and _undefined; `not_done` is
        a further column. The confidence interval depends on the distribution of the
        metric. A metric that decided the number of trials of a point has the repeated
        confidence interval.
        """
        means = self.study.means(metrics, ["point"]).set_index("point")
        return self.points.join(means, how="left")

    def values(self, name: str) -> list[object]:
        """Return the values of a parameter: ascending numbers, or the spec's order."""
        values = list(dict.fromkeys(self.points[name].tolist()))
        return sorted(values) if is_number(self.points[name]) else values

    def setting(self, name: str) -> str:
        """Return the name of a parameter, or raise ChoiceError if it does not vary."""
        if name in self.points:
            return name
        if name in self.study.headings and (gap := untried(self.study)):
            why = f"{name} has one value at all points with a trial; {gap}"
        else:
            why = unknown("varied parameter", name, self.points.columns)
        raise ChoiceError(why, self.study.name)

    def axis(self, name: str, kind: str) -> str:
        """Return the name of a parameter that can have an axis.

        Parameters
        ----------
        name : str
        kind : str
            Kind of the figure, for the error.

        Raises
        ------
        ChoiceError
            If the values have no scale and are too many to be named.
        """
        number = len(self.values(name))
        if number > MOST_NAMED and not has_scale(self.points[name]):
            raise ChoiceError(
                f"cannot place the {number:,} values of {name}, some of which are"
                f" beyond {FARTHEST:g}; choose with where, {self.example([name])}",
                self.study.name,
                kind,
            )
        return name

    def apart(self, shown: Sequence[str]) -> list[str]:
        """Return the listed parameters to show next to `shown`, to keep points apart.

        The parameters that the study always keeps apart are first, also if the points
        differ in further parameters.
        """
        chosen = [
            name
            for name in self.study.kept_apart
            if name in self.listed and name not in shown
        ]
        groups = self._groups([*shown, *chosen])
        for name in self.listed:
            if (
                name not in (*shown, *chosen)
                and (finer := self._groups([*shown, *chosen, name])) > groups
            ):
                chosen.append(name)
                groups = finer
        return chosen

    @property
    def derived(self) -> list[str]:
        """The parameters that follow from others, such as the height of a square."""
        free = {*self.sampled, *self.apart([]), *self.study.kept_apart}
        return [str(name) for name in self.points if name not in free]

    def mixed(self, shown: Sequence[str]) -> list[str]:
        """Return the parameters in which points differ that agree in all of `shown`."""
        if not len(self.points.columns):
            return []
        groups = (
            self.points.groupby(list(shown), sort=False)
            if shown
            else self.points.groupby(lambda _: 0)
        )
        counts = (
            groups[[name for name in self.points if name not in shown]].nunique().max()
        )
        mixed = [str(name) for name in counts.index[counts > 1]]
        return [
            name for name in mixed if name in (*self.sampled, *self.listed)
        ] or mixed

    def facets(self, names: Sequence[str]) -> list[Facet]:
        """Return a panel per combination of values of these parameters, in order."""
        if not names:
            return [Facet("", self.points.index)]
        order = {
            name: {value: place for place, value in enumerate(self.values(name))}
            for name in names
        }
        parts = [
            (key, Facet(named(zip(names, key, strict=True)), part.index))
            for key, part in self.points.groupby(list(names), sort=False)
        ]
        parts.sort(
            key=lambda part: [
                order[name][value] for name, value in zip(names, part[0], strict=True)
            ]
        )
        return [facet for _, facet in parts]

    def colour(
        self, by: str | None, available: Sequence[str], shown: Sequence[str]
    ) -> str | None:
        """Return the parameter of the colours, if any.

        Parameters
        ----------
        by : str or None
            Parameter that the user has chosen; by default the first available parameter
            with few values.
        available : sequence of str
            Parameters that may become colours.
        shown : sequence of str
            Parameters on axes.

        Raises
        ------
        ChoiceError
            If `by` does not vary, is shown, or has too many values.
        """
        if by is None:
            few = [
                name for name in available if len(self.values(name)) <= MOST_BY_DEFAULT
            ]
            return few[0] if few else None
        if self.setting(by) in shown:
            raise ChoiceError(
                f"by {by}, which is on an axis already{self._offer(available)}",
                self.study.name,
            )
        if (number := len(self.values(by))) > MOST_COLOURS:
            raise ChoiceError(
                f"by {by}, which has {number:,} values;"
                f" allowed: up to {MOST_COLOURS}{self._offer(available)}",
                self.study.name,
            )
        return by

    def panels(self, names: Sequence[str], kind: str) -> list[Facet]:
        """Return `facets`, unless there are too many panels.

        Parameters
        ----------
        names : sequence of str
            Parameters of the panels.
        kind : str
            Kind of the figure, for the error.

        Raises
        ------
        ChoiceError
            If there are more than twelve panels.
        """
        facets = self.facets(names)
        self.allow(len(facets), names, kind)
        return facets

    def allow(
        self, panels: int, names: Sequence[str], kind: str, remedy: str = ""
    ) -> None:
        """Raise ChoiceError for more than twelve panels.

        Parameters
        ----------
        panels : int
            Number of panels.
        names : sequence of str
            Parameters of the panels.
        kind : str
            Kind of the figure.
        remedy : str, default ""
            Advice for fewer panels; by default an example of `where`.
        """
        if panels > MOST_PANELS:
            numbers = " and ".join(
                f"{name} ({len(self.values(name)):,} values)" for name in names
            )
            raise ChoiceError(
                f"has {panels:,}"
                f" panels{f', by {numbers}' if names else ''}; allowed: up to"
                f" {MOST_PANELS};"
                f" {remedy or f'choose with where, {self.example(names)}'}",
                self.study.name,
                kind,
            )

    def example(self, names: Sequence[str]) -> str:
        """Return an example of a condition on the first of these parameters, if any."""
        listed = [
            f"{name}={spelled(value)}"
            for name in names[:1]
            for value in self.values(name)[:1]
        ]
        return f"for example {listed[0]}" if listed else "or fewer metrics"

    def note(
        self,
        text: str,
        counts: Iterable[int],
        interval: str = "",
        metrics: Sequence[str] = (),
        shown: Sequence[str] = (),
    ) -> str:
        """Return the note of a figure.

        The note states the study, the conditions of `where`, and `text`. The note
        counts trials that are not done and points without a trial. For several studies,
        the note lists the fixed parameters that differ. The note also reports the
        fraction of done trials without a value of a metric, and metrics with few skewed
        values.

        Parameters
        ----------
        text : str
            Text about trials, in which {n} becomes the span of `counts`.
        counts : iterable of int
            Numbers of trials.
        interval : str, default ""
            The kind of interval that is drawn. If no count is above one, the note
            states that there is no interval.
        metrics : sequence of str, default ()
            Metrics with this interval. The note names metrics that decided the number
            of trials of a point, because the intervals of such metrics are repeated
            confidence intervals.
        shown : sequence of str, default ()
            Further metrics in the figure.
        """
        numbers = [int(count) for count in counts]
        if max(numbers, default=0) < 2:
            text = text.replace("{n} trials", "{n} trial")
            interval = "no interval" if interval else ""
        elif (
            interval
            and (looks := self.study.looks)
            and (chosen := [name for name in metrics if name in self.study.repeated])
        ):
            interval += (
                f"; {', '.join(chosen)} decided the number of trials:"
                f" repeated {100 * looks.confidence:g} % confidence interval"
            )
        text += f", {interval}" if interval else ""
        settings = [named([setting]) for setting in self.study.chosen.items()]
        where = ", ".join([*settings, *self.study.conditions])
        place = f", {where}" if where else ""
        missing = (
            f"; {self.not_done:,} of {self.planned:,} trials not done"
            if self.not_done
            else ""
        )
        missing += f"; {gap}" if (gap := untried(self.study)) else ""
        undefined = "".join(
            f"; {metric} undefined in {percent(share)} of trials"
            for metric in dict.fromkeys([*metrics, *shown])
            if metric in self.trials and (share := self._undefined(metric))
        )
        apart = ", ".join(
            f"{name.replace('_', ' ')} ({'; '.join(map(words, values))})"
            for name, values in self.study.differ.items()
        )
        drawn = [
            name for name in (*metrics, *shown) if interval and name in self.trials
        ]
        few = few_skewed(self.study, dict.fromkeys(drawn, numbers))
        differ = f"; the studies differ in {apart}" if apart else ""
        facts = f"{text.format(n=span(numbers))}{missing}{undefined}{differ}"
        apart_notes = "; ".join(self.study.apart_notes)
        lines = [f"{self.study.name}{place}: {facts}", apart_notes, few]
        return "\n".join(filter(None, lines))

    def _undefined(self, metric: str) -> float:
        """Return the fraction of the done trials that have no value of a metric."""
        done = self.study.done
        return float(self.trials.loc[done, metric].isna().mean()) if done.any() else 0.0

    def _groups(self, settings: Sequence[str]) -> int:
        together = (
            self.designed.groupby(list(settings), sort=False) if settings else None
        )
        return int(together.ngroups) if together else 1

    def _offer(self, available: Sequence[str]) -> str:
        few = [name for name in available if len(self.values(name)) <= MOST_COLOURS]
        return f"; choose one of {', '.join(few)}" if few else ""


def select(study: Results) -> Selection:
    """Return the points of a study with a stored trial, and the parameters.

    Parts that are never averaged, such as phases of a search, are kept apart. Raises
    ChoiceError if no trial is done.
    """
    study = keep_apart(study)
    if not study.done.any():
        selected = " in the selection" if study.restricted else ""
        raise ChoiceError(
            f"no trial is done{selected}, so there is nothing to draw", study.name
        )
    designed = study.points[study.headings]
    points = designed[study.tried]
    points = points.loc[:, points.nunique(dropna=False) > 1]
    return Selection(study, points, designed[points.columns], *_kinds(study, points))


def among(trials: pd.DataFrame, points: "pd.Index[str]") -> pd.DataFrame:
    """Return the rows of `trials` that belong to these points."""
    ids = set(points)
    return trials[
        np.fromiter((point in ids for point in trials["point"]), np.bool_, len(trials))
    ]


def recorded(study: Results, metric: str) -> str:
    """Return a column of the trials, or raise ChoiceError for an unknown metric.

    The column `<metric>_mean` is the mean over the second half of a trial.
    """
    study.check_metric(Column.read(metric).metric)
    return metric


def is_number(column: "pd.Series[float]") -> bool:
    """Return True for a parameter with numbers, not with strings or booleans."""
    return pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_bool_dtype(
        column
    )


def has_scale(column: "pd.Series[float]") -> bool:
    """Return True for a parameter with numbers that an axis can place.

    Numbers that are too large, such as an infinite range, are named like strings.
    """
    return is_number(column) and bool((column.abs() <= FARTHEST).all())


def _kinds(study: Results, points: pd.DataFrame) -> tuple[list[str], list[str]]:
    """Return the sampled parameters, and the listed parameters, fewest values first."""
    axes = study.axes.values()
    drawn = {setting for axis in axes if axis.sampler for setting in axis.settings}
    listed = {setting for axis in axes if not axis.sampler for setting in axis.settings}
    listed |= {name for name in points.columns if name not in study.varied}
    return (
        [name for name in points.columns if name in drawn],
        sorted(
            (name for name in points.columns if name in listed),
            key=lambda name: points[name].nunique(),
        ),
    )
