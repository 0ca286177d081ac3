"""Which trials of a study a figure shows, and which of the settings that vary become
its axes, colours and panels.

A figure averages over replicates only. Where no room is left for a setting that varies,
the user is asked to choose fewer points.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from sweep.analysis.notation import percent
from sweep.errors import ChoiceError
from sweep.figures.drawing import named, span, words
from sweep.spec.recorded import Column
from sweep.tables.choosing import spelled
from sweep.tables.overview import few_skewed, untried
from sweep.tables.search_phases import by_phase, phases_said
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

MOST_PANELS = 12
MOST_COLOURS = 7
FARTHEST = 1e150
"""Squares of such places are still finite; matplotlib needs some room, too."""
MOST_NAMED = 30
"""So many values of a setting without a scale have room on an axis."""
MOST_BY_DEFAULT = 3
"""So many values become colours of one panel unless asked for; more become panels."""


class Facet(NamedTuple):
    """A panel of a figure: what its points have in common, in words, and their ids."""

    title: str
    points: "pd.Index[str]"


@dataclass(frozen=True, eq=False)
class Selection:
    """The trials of a study that a figure shows.

    `study` has these trials only. `points` has one row a point with a stored trial, by
    its id, and as columns the settings that differ between them; `designed` has the
    same columns of all points of the spec, by which settings are shared out: a figure
    keeps its form while a launch goes on. `sampled` are the settings that an axis
    samples, `listed` those that are listed, the ones with the fewest values first; what
    follows from them, like the width of a map, is in neither.
    """

    study: StoredStudy
    points: pd.DataFrame
    designed: pd.DataFrame
    sampled: list[str]
    listed: list[str]

    @property
    def trials(self) -> pd.DataFrame:
        """The stored ones."""
        return self.study.trials

    @property
    def planned(self) -> int:
        """How many there are in the spec."""
        return int(self.study.plan.num_rows)

    @property
    def not_done(self) -> int:
        """How many trials have no result: not run, failed, diverged or out of time."""
        return self.planned - int(self.study.done.sum())

    def table(self, metrics: Sequence[str]) -> pd.DataFrame:
        """The settings of every point, by its id, and of each metric mean, _low, _high,
        _n and _undefined; `not_done`.

        The interval is that of the distribution of the metric. The interval of a metric
        that decided how many trials a point has is the repeated one.
        """
        means = self.study.means(metrics, ["point"]).set_index("point")
        return self.points.join(means, how="left")

    def values(self, name: str) -> list[object]:
        """The values of a setting: numbers ascending, others as in the spec."""
        found = list(dict.fromkeys(self.points[name].tolist()))
        return sorted(found) if is_number(self.points[name]) else found

    def setting(self, name: str) -> str:
        """`name`, if it differs between points. Raises ChoiceError."""
        if name in self.points:
            return name
        if name in self.study.headings and (gap := untried(self.study)):
            why = f"{name} has one value at all points with a trial; {gap}"
        else:
            why = unknown("varied setting", name, self.points.columns)
        raise ChoiceError(why, self.study.name)

    def axis(self, name: str, what: str) -> str:
        """`name`, if a figure of this kind can have an axis of the setting. Raises
        ChoiceError for numbers that have no scale and are too many to be named.
        """
        number = len(self.values(name))
        if number > MOST_NAMED and not has_scale(self.points[name]):
            raise ChoiceError(
                f"cannot place the {number:,} values of {name}, some of which are"
                f" beyond {FARTHEST:g}; choose with where, {self.example([name])}",
                self.study.name,
                what,
            )
        return name

    def apart(self, shown: Sequence[str]) -> list[str]:
        """The listed settings that must be shown beside those in `shown`, so that
        points which differ are apart; first what the study keeps apart, whether or not
        its points differ in others.
        """
        kept = self.study.kept_apart
        chosen = [name for name in kept if name in self.listed and name not in shown]
        groups = self._groups([*shown, *chosen])
        for name in self.listed:
            if (
                name not in (*shown, *chosen)
                and (finer := self._groups([*shown, *chosen, name])) > groups
            ):
                chosen.append(name)
                groups = finer
        return chosen

    def mixed(self, shown: Sequence[str]) -> list[str]:
        """The settings in which points differ that agree in all of `shown`."""
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
        """The panels of all values of these settings together, in their order."""
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
        self, by: str | None, others: Sequence[str], shown: Sequence[str]
    ) -> str | None:
        """The setting whose values become colours: `by`, or else the first of the
        `others` that has few values.

        Raises ChoiceError for a setting that does not vary or is `shown` already, and
        for too many values.
        """
        if by is None:
            few = [name for name in others if len(self.values(name)) <= MOST_BY_DEFAULT]
            return few[0] if few else None
        if self.setting(by) in shown:
            raise ChoiceError(
                f"by {by}, which is on an axis already{self._offer(others)}",
                self.study.name,
            )
        if (number := len(self.values(by))) > MOST_COLOURS:
            raise ChoiceError(
                f"by {by}, which has {number:,} values;"
                f" allowed: up to {MOST_COLOURS}{self._offer(others)}",
                self.study.name,
            )
        return by

    def panels(self, names: Sequence[str], what: str) -> list[Facet]:
        """`facets`. Raises ChoiceError, saying what to choose, for more than twelve."""
        facets = self.facets(names)
        self.allow(len(facets), names, what)
        return facets

    def allow(
        self, panels: int, names: Sequence[str], what: str, remedy: str = ""
    ) -> None:
        """Raise ChoiceError for more than twelve panels of these settings. The error
        says what to choose.
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
                what,
            )

    def example(self, names: Sequence[str]) -> str:
        """How to say which points to show, for one of these settings."""
        listed = [
            f"{name}={spelled(value)}"
            for name in names[:1]
            for value in self.values(name)[:1]
        ]
        return f"for example {listed[0]}" if listed else "or fewer metrics"

    def about(
        self,
        text: str,
        counts: Iterable[int],
        interval: str = "",
        metrics: Sequence[str] = (),
        shown: Sequence[str] = (),
    ) -> str:
        """The note of a figure: the study, what `where` has chosen, `text`, how many
        trials are not done, how many points have none, and in which fixed settings
        several studies differ.

        In `text`, {n} becomes the span of `counts`, which are numbers of trials.
        `interval` says which interval is drawn; where no count is above one, the note
        says that there is none. `metrics` are those that have this interval. A metric
        that decided how many trials a point has is named, because its interval is
        another. The note says of `metrics` and of others `shown` which share of the
        done trials has no value, and which of them rest on few skewed values.
        """
        known = [int(count) for count in counts]
        if max(known, default=0) < 2:
            text, interval = (
                text.replace("{n} trials", "{n} trial"),
                "no interval" if interval else "",
            )
        elif (
            interval
            and (looks := self.study.looks)
            and (chosen := [name for name in metrics if name in self.study.repeated])
        ):
            interval += (
                f"; that of {', '.join(chosen)}, which chose the trials:"
                f" repeated {100 * looks.confidence:g} %"
            )
        text += f", {interval}" if interval else ""
        settings = [named([one]) for one in self.study.chosen.items()]
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
        few = few_skewed(self.study, dict.fromkeys(drawn, known))
        differ = f"; they differ in {apart}" if apart else ""
        said = f"{text.format(n=span(known))}{missing}{undefined}{differ}"
        phases = phases_said(self.study)
        lines = [f"{self.study.name}{place}: {said}", phases, few]
        return "\n".join(filter(None, lines))

    def _undefined(self, metric: str) -> float:
        """The share of the done trials that have no value of a metric."""
        done = self.study.done
        return float(self.trials.loc[done, metric].isna().mean()) if done.any() else 0.0

    def _groups(self, names: Sequence[str]) -> int:
        together = self.designed.groupby(list(names), sort=False) if names else None
        return int(together.ngroups) if together else 1

    def _offer(self, others: Sequence[str]) -> str:
        few = [name for name in others if len(self.values(name)) <= MOST_COLOURS]
        return f"; choose one of {', '.join(few)}" if few else ""


def select(study: StoredStudy) -> Selection:
    """The points of `study` that a figure shows, those with a stored trial, and what
    differs between them. The phases of a search are apart. Raises ChoiceError where no
    trial is done.
    """
    study = by_phase(study)
    if not study.done.any():
        there = " there" if study.restricted else ""
        raise ChoiceError(
            f"no trial is done{there}, so there is nothing to draw", study.name
        )
    designed = study.points[study.headings]
    points = designed[study.tried]
    points = points.loc[:, points.nunique(dropna=False) > 1]
    return Selection(study, points, designed[points.columns], *_kinds(study, points))


def among(trials: pd.DataFrame, points: "pd.Index[str]") -> pd.DataFrame:
    """The rows of `trials` that are of one of these points."""
    wanted = set(points)
    return trials[
        np.fromiter(
            (point in wanted for point in trials["point"]), np.bool_, len(trials)
        )
    ]


def recorded(study: StoredStudy, metric: str) -> str:
    """`metric`, or with `_mean` its mean over the last half, if the study has it.
    Raises ChoiceError.
    """
    study.check_metric(Column.read(metric).metric)
    return metric


def is_number(column: "pd.Series[float]") -> bool:
    """Whether a setting is a number and not a text or a truth value."""
    return pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_bool_dtype(
        column
    )


def has_scale(column: "pd.Series[float]") -> bool:
    """Whether a setting is a number that an axis can place. Numbers too far out for
    that, such as an endless range, are named like texts.
    """
    return is_number(column) and bool((column.abs() <= FARTHEST).all())


def _kinds(study: StoredStudy, points: pd.DataFrame) -> tuple[list[str], list[str]]:
    """The settings that an axis samples, and those that are listed, the ones with the
    fewest values first.
    """
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
