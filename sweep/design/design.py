"""The design of experiments: from the axes of a study to its points."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from sweep.design.chains import Links, linked
from sweep.design.consistency import check_consistency
from sweep.design.order import Fineness, fineness_of
from sweep.design.points import Points, across, check_maps, fitted_to_map, united
from sweep.spec import (
    MOST_CELLS,
    MOST_OPERATIONS,
    MOST_POINTS,
    MOST_TRIALS,
    Axis,
    NotAllowedError,
    Study,
    Value,
    Values,
    beyond,
    by_design,
    sections,
)


@dataclass(frozen=True)
class Rejection:
    """Number of points that a condition under `require` rejected.

    A point counts for the first condition that rejects the point.
    """

    expression: str
    count: int


@dataclass(frozen=True, eq=False)
class Design:
    """The points of a study.

    Attributes
    ----------
    base : dict
        Parameters with one value at all points.
    columns : dict of arrays, shape (n_points,)
        Parameters that vary.
    n_points : int
    fineness : array of int, shape (n_points,)
        See `sweep.design.order`.
    rejected : tuple of Rejection
        Points that conditions under `require` rejected.
    duplicates : int
        Number of merged duplicates: rows of axes that equal an earlier row, and points
        of an earlier design.
    links : Links, optional
        Links between points, if an axis is continued.
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
        """Columns in which points differ: the direction of links, then `columns`."""
        return (self.links.columns() if self.links else {}) | self.columns

    def settings(self, point: int) -> dict[str, Value]:
        """Return all parameters of one point, as plain Python values."""
        return self.base | {
            name: column.item(point) for name, column in self.columns.items()
        }

    def values_of(self, name: str) -> list[Value]:
        """Return the distinct values of a parameter, in the order of points."""
        if name in self.columns:
            return [*dict.fromkeys(self.columns[name].tolist())]
        return [self.base[name]]

    def with_value(self, name: str, value: Value) -> "Design":
        """Return the design with one value of a parameter at all points.

        Parameters
        ----------
        name : str
            Name of the parameter.
        value : bool, int, float or str

        Returns
        -------
        Design
            The number and order of points do not change, even if some become equal.
        """
        columns = {key: column for key, column in self.columns.items() if key != name}
        return replace(self, base=self.base | {name: value}, columns=columns)

    def only(self, points: list[int]) -> "Design":
        """Return the design of some points, given by indices."""
        columns = {name: column[points] for name, column in self.columns.items()}
        return Design(self.base, columns, len(points), self.fineness[points])


def evenly(count: int, most: int) -> list[int]:
    """Return at most `most` evenly spread indices of `count` values.

    The first and the last index are included.
    """
    places = np.linspace(0, count - 1, min(count, most)).astype(int)
    chosen: list[int] = np.unique(places).tolist()
    return chosen


def expand(study: Study) -> Design:
    """Return the points of a study.

    The points are the product of the axes of each design, in which the last axis varies
    fastest. Rejected points, and points of an earlier design, are left out.

    Raises SpecError if there are no points or too many, or if a derived value is not
    allowed.
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
        rejected=rejected,
        duplicates=duplicates,
        links=links,
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
    """Raise SpecError for a design with too many points, cells or computations."""
    settings = len(
        {*(name for axis in study.axes for name in axis.columns), *study.derive}
    )
    parts = sum(expression.operations for expression in study.expressions)
    points = f"the study has {n_points:,} points"
    for count, most, size in (
        (n_points, MOST_POINTS, points),
        (
            n_points * settings,
            MOST_CELLS,
            f"{points} with {settings} parameters that vary,"
            f" {n_points * settings:,} cells",
        ),
        (
            n_points * parts,
            MOST_OPERATIONS,
            (
                f"{points} and expressions with {parts:,} parts per point,"
                f" {n_points * parts:,} operations"
            ),
        ),
    ):
        if count > most:
            raise study.document.error(("sweep",), beyond(size, most))


def _check_trials(study: Study, points: Points) -> None:
    """Raise SpecError for a plan with too many trials or cells."""
    trials = study.most_trials(points.count)
    settings = len(points.columns)
    size = f"the study has {trials:,} trials"
    place = ("replicates",) if study.seeds is None else ("seeds",)
    if trials > MOST_TRIALS:
        raise study.document.error(place, beyond(size, MOST_TRIALS))
    if trials * settings > MOST_CELLS:
        size += f" with {settings} parameters that vary, {trials * settings:,} cells"
        raise study.document.error(place, beyond(size, MOST_CELLS))
    for key, value in study.sections.items():
        sections()[key].check_points(study, value, points.count)


def _multiplied(study: Study, points: Points, axis: Axis) -> Points:
    """Return every point with every row of the axis.

    A point where the condition of the axis is false remains one point, with the base
    value.
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
    is_first = points.count == 1 and bool(applies[0])
    base = points.base
    varied = axis.columns
    if axis.named or not axis.ablated:  # else the presets define minimum_image
        implied = across(study, varied).items()
        varied = varied | {
            name: values for name, values in implied if any(values != base[name])
        }
    for name, values in varied.items():
        # The columns of the first axis are not copied: a copy would double a large
        # sample.
        columns[name] = values if is_first else values[row]
        columns[name][outside] = base[name]
    fineness = np.maximum(
        np.repeat(points.fineness, repeats),
        np.where(outside, 0, fineness_of(axis)[row]),
    )
    return Points(points.base, columns, count, fineness)


def _derived(study: Study, points: Points) -> tuple[Points, tuple[Rejection, ...]]:
    """Return the points that no condition rejects, with derived parameters.

    A condition is applied as soon as all parameters of the condition are known, so that
    no value is derived for a rejected point.
    """
    rejected = [0] * len(study.require)
    pending = list(range(len(study.require)))
    unknown = {*study.derive, *across(study, study.derive)}
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
