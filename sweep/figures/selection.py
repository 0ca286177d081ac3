"""Which trials of a study a figure shows, and how the settings that vary among them are
shared out.

A figure averages over replicates only. What else varies is an axis, a colour, a panel,
or a reason to ask for less.
"""

import copy
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.analysis import agrees, by_point
from sweep.errors import ChoiceError
from sweep.figures.pieces import named, span, words
from sweep.spec.recorded import Column
from sweep.tables.sides import BOOLEANS
from sweep.tables.stored_study import StoredStudy, details
from sweep.text import unknown

MOST_PANELS = 12
MOST_COLOURS = 7
MOST_BY_DEFAULT = 3
"""So many values become colours of one panel unless asked for; more become panels."""
FEW_LISTED = 8


class Facet(NamedTuple):
    """A panel of a figure: what its points have in common, in words, and their ids."""

    title: str
    points: "pd.Index[str]"


@dataclass(frozen=True, eq=False)
class Selection:
    """The trials of a study that a figure shows.

    `points` has one row a point, by its id, and as columns the settings that differ
    between them; `trials` are those stored, `planned` is the number of those of the
    spec. `sampled` are the settings that an axis samples, `listed` those that are
    listed, the ones with the fewest values first; what follows from them, like the
    width of a map, is in neither.
    """

    study: StoredStudy
    where: Mapping[str, object]
    points: pd.DataFrame
    trials: pd.DataFrame
    planned: int
    sampled: list[str]
    listed: list[str]

    @property
    def not_done(self) -> int:
        """How many trials have no result: not run, failed, diverged or out of time."""
        return self.planned - int((self.trials["status"] == "done").sum())

    @cached_property
    def restricted(self) -> StoredStudy:
        """The study as if its spec had these trials only."""
        part = copy.copy(self.study)
        part.__dict__ = {
            name: value
            for name, value in part.__dict__.items()
            if name not in ("series", "trajectories")
        }
        part.plan = self.study.plan.filter(
            pc.is_in(
                self.study.plan["point"],
                value_set=pa.array(self.points.index, pa.string()),
            )
        )
        part.trials = self.trials
        return part

    def table(self, metrics: Sequence[str]) -> pd.DataFrame:
        """The settings of every point, by its id, and of each metric mean, _low, _high
        and _n; `not_done`.

        The interval of a metric that decided how many trials a point has is the
        repeated one.
        """
        means = by_point(
            self.trials, ["point"], metrics, repeated=self.study.repeated
        ).set_index("point")
        return self.points.join(means, how="left")

    def values(self, name: str) -> list[object]:
        """The values of a setting: numbers ascending, others as in the spec."""
        found = list(dict.fromkeys(self.points[name].tolist()))
        return sorted(found) if is_number(self.points[name]) else found

    def setting(self, name: str) -> str:
        """`name`, if it differs between points. Raises ChoiceError."""
        if name not in self.points:
            raise ChoiceError(
                f"study {self.study.name}:"
                f" {unknown('varied setting', name, self.points.columns)}"
            )
        return name

    def apart(self, shown: Sequence[str]) -> list[str]:
        """The listed settings beside those `shown` that tell points apart which these
        leave together.
        """
        chosen: list[str] = []
        groups = self._groups(shown)
        for name in self.listed:
            if (
                name not in shown
                and (finer := self._groups([*shown, *chosen, name])) > groups
            ):
                chosen.append(name)
                groups = finer
        return chosen

    def mixed(self, shown: Sequence[str]) -> list[str]:
        """The settings that differ between points which agree in those `shown`."""
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
        """The setting whose values become colours: `by`, or that of the `others` with
        the fewest, if these are few.

        Raises ChoiceError for a setting that does not vary or is `shown` already, and
        for too many values.
        """
        if by is None:
            few = [name for name in others if len(self.values(name)) <= MOST_BY_DEFAULT]
            return few[0] if few else None
        if self.setting(by) in shown:
            raise ChoiceError(
                f"study {self.study.name}: by {by}, which is on an axis"
                f" already{self._offer(others)}"
            )
        if (number := len(self.values(by))) > MOST_COLOURS:
            raise ChoiceError(
                f"study {self.study.name}: by {by}, which has {number:,} values;"
                f" allowed: up to {MOST_COLOURS}{self._offer(others)}"
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
        """Raise ChoiceError for more than twelve panels of these settings; it says what
        to choose.
        """
        if panels > MOST_PANELS:
            numbers = " and ".join(
                f"{name} ({len(self.values(name)):,} values)" for name in names
            )
            raise ChoiceError(
                f"study {self.study.name}: {what} has {panels:,}"
                f" panels{f', by {numbers}' if names else ''}; allowed: up to"
                f" {MOST_PANELS};"
                f" {remedy or f'choose with where, {self.example(names)}'}"
            )

    def example(self, names: Sequence[str]) -> str:
        """How to say which points to show, for one of these settings."""
        listed = [
            f"{name}={_spelled(value)}"
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
    ) -> str:
        """What a figure rests on: the study, where, `text` with {n}, the span of
        `counts` of trials; what is not done.

        `interval` says which is drawn; there is none where no count is above one. Of
        the `metrics` whose interval it is, one that decided how many trials a point has
        is named, as its interval is another.
        """
        known = [int(count) for count in counts]
        if max(known, default=0) < 2:
            text, interval = (
                text.replace("{n} trials", "{n} trial"),
                "no interval" if interval else "",
            )
        elif interval and (
            chosen := [metric for metric in metrics if metric in self.study.repeated]
        ):
            confidence = self.study.rule["confidence"]
            interval += (
                f"; that of {chosen[0]}, which chose the trials:"
                f" repeated {100 * confidence:g} %"
            )
        text += f", {interval}" if interval else ""
        place = f", {named(self.where.items())}" if self.where else ""
        missing = (
            f"; {self.not_done:,} of {self.planned:,} trials not done"
            if self.not_done
            else ""
        )
        return f"{self.study.name}{place}: {text.format(n=span(known))}{missing}"

    def _groups(self, names: Sequence[str]) -> int:
        return int(self.points.groupby(list(names), sort=False).ngroups) if names else 1

    def _offer(self, others: Sequence[str]) -> str:
        few = [name for name in others if len(self.values(name)) <= MOST_COLOURS]
        return f"; choose one of {', '.join(few)}" if few else ""


def select(study: StoredStudy, where: Mapping[str, object] | None = None) -> Selection:
    """The trials of `study` whose settings are those of `where`; all that were ablated
    together are one, `detail`.

    Raises ChoiceError for a setting that does not vary, for a value that no point has,
    and where no trial is done.
    """
    plan = study.plan.to_pandas()
    trials, varied = study.trials, list(study.varied)
    for preset, ablated in study.about.ablated.items():
        name = "detail" if len(study.about.ablated) == 1 else f"detail_{preset}"
        label = dict(zip(trials["point"], details(study, preset), strict=True))
        plan[name] = plan["point"].map(label)
        switched = {one for group in ablated for one in group}
        varied = [*(one for one in varied if one not in switched), name]
    points = plan.drop_duplicates("point").set_index("point")[varied]
    for name, value in (where or {}).items():
        points = points[_having(study, points, name, value)]
    planned = len(among(plan, points.index))
    trials = among(trials, points.index)
    if not (trials["status"] == "done").any():
        raise ChoiceError(
            f"study {study.name}: no trial is done{' there' if where else ''},"
            " so there is nothing to draw"
        )
    points = points.loc[:, points.nunique(dropna=False) > 1]
    sampled, listed = _kinds(study, points)
    return Selection(study, where or {}, points, trials, planned, sampled, listed)


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
    if Column.read(metric).metric not in study.metrics:
        raise ChoiceError(
            f"study {study.name}: {unknown('metric', metric, study.metrics)}"
        )
    return metric


def where_of(study: StoredStudy, texts: Sequence[str]) -> dict[str, object]:
    """What `select` wants from texts such as n=50 and map=cafeteria,fov=90. Raises
    ChoiceError for another form.
    """
    found: dict[str, object] = {}
    for text in ",".join(texts).split(",") if texts else []:
        name, equals, value = text.partition("=")
        if not equals:
            raise ChoiceError(
                f'study {study.name}: where "{text}"; allowed: SETTING=VALUE,'
                " for example n=50"
            )
        if name in found:
            raise ChoiceError(
                f"study {study.name}: where has {name} twice;"
                " allowed: one value of a setting"
            )
        found[name] = _value(value)
    return found


def is_number(column: "pd.Series[float]") -> bool:
    """Whether a setting is a number and not a text or a truth value."""
    return pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_bool_dtype(
        column
    )


def _value(text: str) -> object:
    try:
        return float(text)
    except ValueError:
        return BOOLEANS.get(text.lower(), text)


def _having(
    study: StoredStudy, points: pd.DataFrame, name: str, value: object
) -> NDArray[np.bool_]:
    """Which points have that value of a setting. Raises ChoiceError if none has."""
    if name not in points:
        raise ChoiceError(
            f"study {study.name}: where {name}:"
            f" {unknown('varied setting', name, points.columns)}"
        )
    column = points[name]
    found = agrees(column.to_numpy(), value)
    if not found.any():
        values = [_spelled(one) for one in dict.fromkeys(column)]
        if isinstance(value, str):
            raise ChoiceError(
                f"study {study.name}: where {name}: {unknown('value', value, values)}"
            )
        allowed = (
            ", ".join(values)
            if len(values) <= FEW_LISTED
            else f"{len(values):,} values"
        )
        raise ChoiceError(
            f"study {study.name}: where {name}:"
            f" no point has {_spelled(value)}; allowed: {allowed}"
        )
    return found


def _spelled(value: object) -> str:
    """A value as `--where` takes it."""
    return (
        str(value)
        if isinstance(value, str)
        else words(value).replace("unlimited", "inf")
    )


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
