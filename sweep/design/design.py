"""The design of experiments: from the axes of a study to its points."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from sweep.design.chains import Links, linked
from sweep.design.consistency import check_consistency
from sweep.design.order import Fineness, fineness_of
from sweep.design.points import Points, across, check_maps, fitted_to_map, united
from sweep.spec.axes import Axis, by_design
from sweep.spec.limits import (
    MOST_CELLS,
    MOST_OPERATIONS,
    MOST_POINTS,
    MOST_TRIALS,
    beyond,
)
from sweep.spec.settings import NotAllowedError, Value, Values
from sweep.spec.study import Study, sections


@dataclass(frozen=True)
class Rejection:
    """How many points a condition under `require` rejected; each counts for the first
    that rejects it.
    """

    expression: str
    count: int


@dataclass(frozen=True, eq=False)
class Design:
    """The points of a study: `columns` has the settings that vary, shape (n_points,)
    each, `base` the others.

    `fineness` (n_points,) is that of `sweep.design.order`.
    `rejected` tells what `require` left out; `duplicates` counts the rows of axes that
    repeated an earlier one, and the points of a design that an earlier one has: they
    were merged with it. Where an axis is continued, `links` says how points are linked.
    """

    base: dict[str, Value]
    columns: dict[str, Values]
    n_points: int
    fineness: Fineness
    rejected: tuple[Rejection, ...] = ()
    duplicates: int = 0
    links: Links | None = None

    @property
    def told_apart(self) -> dict[str, Values]:
        """The columns that tell points apart: the settings that vary, and before them
        the direction of links.
        """
        return (self.links.columns() if self.links else {}) | self.columns

    def settings(self, point: int) -> dict[str, Value]:
        """All settings of one point, as plain Python values."""
        return self.base | {
            name: column.item(point) for name, column in self.columns.items()
        }

    def values_of(self, name: str) -> list[Value]:
        """The values that a setting has at some point, each once, in their order."""
        if name in self.columns:
            return [*dict.fromkeys(self.columns[name].tolist())]
        return [self.base[name]]

    def with_value(self, name: str, value: Value) -> "Design":
        """The design with one value of a setting at all points, in the same order."""
        columns = {key: one for key, one in self.columns.items() if key != name}
        return replace(self, base=self.base | {name: value}, columns=columns)

    def only(self, points: list[int]) -> "Design":
        """The design of these points alone."""
        columns = {name: column[points] for name, column in self.columns.items()}
        return Design(self.base, columns, len(points), self.fineness[points])


def evenly(count: int, most: int) -> list[int]:
    """At most so many of the places 0 to `count` - 1, with the first and the last."""
    places = np.linspace(0, count - 1, min(count, most)).astype(int)
    chosen: list[int] = np.unique(places).tolist()
    return chosen


def expand(study: Study) -> Design:
    """The points of `study`: the product of the axes of each design, the last one
    fastest, without those that an earlier design has, or that are rejected.

    Raises SpecError where there are none or too many of them, and where a value
    computed from others is not allowed.
    """
    designs = by_design(study.axes)
    _check_size(study, sum(map(_least_points, designs)))
    base = study.preset_settings | study.fixed | across(study, study.fixed)
    products = [_product(replace(study, axes=axes), base) for axes in designs]
    _check_size(study, sum(points.count for points in products))
    points, repeated = united(products)
    points, rejected = _derived(study, points)
    check_maps(study, points)
    check_consistency(study, points)
    links = None
    if axis := study.continued:
        points, links = linked(study, axis, points)
    _check_trials(study, points)
    duplicates = repeated + sum(axis.merged for axis in study.axes)
    return Design(
        points.base,
        points.columns,
        points.count,
        points.fineness,
        rejected,
        duplicates,
        links,
    )


def _least_points(axes: Iterable[Axis]) -> int:
    return math.prod(len(axis) for axis in axes if axis.when is None)


def _product(study: Study, base: dict[str, Value]) -> Points:
    points = fitted_to_map(study, Points(base, {}, 1, np.zeros(1, np.int32)))
    for axis in study.axes:
        points = _multiplied(study, points, axis)
        if "map" in axis.columns:
            points = fitted_to_map(study, points)
    return points


def _check_size(study: Study, n_points: int) -> None:
    """Raise SpecError for a design of too many points, cells or computations."""
    settings = len(
        {*(name for axis in study.axes for name in axis.columns), *study.derive}
    )
    parts = sum(expression.operations for expression in study.expressions)
    points = f"the study has {n_points:,} points"
    for count, most, asked in (
        (n_points, MOST_POINTS, points),
        (
            n_points * settings,
            MOST_CELLS,
            f"{points} with {settings} settings that vary,"
            f" {n_points * settings:,} cells",
        ),
        (
            n_points * parts,
            MOST_OPERATIONS,
            (
                f"{points}, and its expressions {parts:,} parts that are computed at"
                f" each, {n_points * parts:,} operations"
            ),
        ),
    ):
        if count > most:
            raise study.document.error(("sweep",), beyond(asked, most))


def _check_trials(study: Study, points: Points) -> None:
    """Raise SpecError for a plan of too many trials or cells."""
    trials, settings = study.most_trials(points.count), len(points.columns)
    asked = f"the study has {trials:,} trials"
    place = ("replicates",) if study.seeds is None else ("seeds",)
    if trials > MOST_TRIALS:
        raise study.document.error(place, beyond(asked, MOST_TRIALS))
    if trials * settings > MOST_CELLS:
        asked += f" with {settings} settings that vary, {trials * settings:,} cells"
        raise study.document.error(place, beyond(asked, MOST_CELLS))
    for key, value in study.sections.items():
        sections()[key].check_points(study, value, points.count)


def _multiplied(study: Study, points: Points, axis: Axis) -> Points:
    """Every point with every row of the axis. A point where the condition of the axis
    is false stays one point, with the base value.
    """
    applies = np.ones(points.count, dtype=np.bool_)
    if axis.when:
        applies = points.evaluate(study, axis.when, (*axis.place, "when"))
    repeats = np.where(applies, len(axis), 1)
    count = int(repeats.sum())
    _check_size(study, count)
    columns = {
        name: np.repeat(column, repeats) for name, column in points.columns.items()
    }
    row = np.arange(count) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    outside = np.repeat(~applies, repeats)
    whole, base = points.count == 1 and bool(applies[0]), points.base
    varied = axis.columns
    if axis.named or not axis.ablated:  # from preset to preset it is as these say
        brought = across(study, varied).items()
        varied = varied | {name: one for name, one in brought if any(one != base[name])}
    for name, values in varied.items():
        # The columns of the first axis are used as they are: a copy would double a
        # large sample.
        columns[name] = values if whole else values[row]
        columns[name][outside] = base[name]
    fineness = np.maximum(
        np.repeat(points.fineness, repeats),
        np.where(outside, 0, fineness_of(axis)[row]),
    )
    return Points(points.base, columns, count, fineness)


def _derived(study: Study, points: Points) -> tuple[Points, tuple[Rejection, ...]]:
    """The points with their derived settings, less the rejected ones.

    A condition is applied as soon as what it needs is known, so that nothing is derived
    for a rejected point.
    """
    rejected = [0] * len(study.require)
    pending, unknown = list(range(len(study.require))), set(study.derive)
    unknown |= {*across(study, study.derive)}
    for name in (None, *study.derive):
        if name is not None:
            points = _with_derived(study, points, name)
            unknown -= {name, *across(study, {name: ""})}
        for index in [
            index for index in pending if not study.require[index].names & unknown
        ]:
            keep = points.evaluate(study, study.require[index], ("require", index))
            rejected[index] = points.count - int(keep.sum())
            points = points.kept(keep)
            pending.remove(index)
    rejections = tuple(
        Rejection(condition.text, count)
        for condition, count in zip(study.require, rejected, strict=True)
    )
    if points.count == 0:
        reasons = ", ".join(
            f'"{rejection.expression}" rejects {rejection.count:,}'
            for rejection in rejections
        )
        raise study.document.error(("require",), f"no point is left: {reasons}")
    return points, rejections


def _with_derived(study: Study, points: Points, name: str) -> Points:
    expression = study.derive[name]
    values = points.evaluate(study, expression, ("derive", name))
    try:
        column = study.settings[name].column(values)
    except NotAllowedError as error:
        where = points.describe(error.index, expression.names)
        raise study.document.error(
            ("derive", name), f'"{expression.text}": {error}{where}'
        ) from None
    columns = points.columns | {name: column}
    return replace(points, columns=columns | across(study, {name: column}))
