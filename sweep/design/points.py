"""Points while a design is built.

Maps and borders determine further parameters: the size of the world, the unit of
length, and `minimum_image` of a torus.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.design.order import Fineness
from sweep.spec import (
    TORUS,
    Expression,
    ExpressionError,
    Place,
    Study,
    Value,
    Values,
    distinct_rows,
)

SIDES = ("width", "height")


@dataclass(frozen=True)
class Points:
    """Points while a design is built.

    Attributes
    ----------
    base : dict
        Parameters with one value at all points.
    columns : dict of arrays, shape (count,)
        Parameters that vary.
    count : int
        Number of points.
    fineness : array of int, shape (count,)
        See `sweep.design.order`.
    """

    base: dict[str, Value]
    columns: dict[str, Values]
    count: int
    fineness: Fineness

    def column(self, name: str) -> Values:
        """Return the values of any parameter, shape (count,)."""
        if name in self.columns:
            return self.columns[name]
        value = self.base[name]
        return np.full(self.count, value, object if isinstance(value, str) else None)

    def evaluate(self, study: Study, expression: Expression, place: Place) -> Values:
        """Return the values of an expression at every point.

        Parameters
        ----------
        study : Study
        expression : Expression
        place : Place
            Key of the spec for errors.

        Returns
        -------
        array, shape (count,)

        Raises
        ------
        SpecError
            If the expression has no value at a point. The error names the first point.
        """
        try:
            return expression.evaluate({**self.base, **self.columns}, self.count)
        except ExpressionError as error:
            where = self.describe(error.point, expression.names)
            raise study.document.error(place, f"{error}{where}") from None

    def describe(self, point: int, names: Iterable[str]) -> str:
        """Return the values of parameters at a point as a clause for an error.

        Parameters
        ----------
        point : int
            Index of the point.
        names : iterable of str
            Names of the parameters.

        Returns
        -------
        str
            For example " where map = empty, n = 50"; "" without names.
        """
        values = {
            name: (
                self.columns[name].item(point)
                if name in self.columns
                else self.base[name]
            )
            for name in names
        }
        return (
            " where " + ", ".join(f"{name} = {values[name]}" for name in sorted(values))
            if values
            else ""
        )

    def kept(self, keep: NDArray[np.bool_]) -> "Points":
        """Return the points where the mask `keep` is true."""
        if keep.all():
            return self
        columns = {name: column[keep] for name, column in self.columns.items()}
        return Points(self.base, columns, int(keep.sum()), self.fineness[keep])

    def times(self, count: int) -> "Points":
        """Return `count` copies of all points, one after the other."""
        if count == 1:
            return self
        columns = {
            name: np.tile(column, count) for name, column in self.columns.items()
        }
        fineness = np.tile(self.fineness, count)
        return Points(self.base, columns, self.count * count, fineness)


def united(designs: Sequence[Points]) -> tuple[Points, int]:
    """Return the distinct points of several designs, and the number of duplicates."""
    first = designs[0]
    if len(designs) == 1:
        return first, 0
    names = [name for design in designs for name in design.columns]
    for name in first.base:
        if len({design.base[name] for design in designs}) > 1:
            names.append(name)
    columns = {
        name: np.concatenate([design.column(name) for design in designs])
        for name in dict.fromkeys(names)
    }
    fineness = np.concatenate([design.fineness for design in designs])
    every = Points(first.base, columns, len(fineness), fineness)
    distinct, _ = distinct_rows([*columns.values()])
    keep = np.zeros(every.count, np.bool_)
    keep[distinct] = True
    return every.kept(keep), every.count - len(distinct)


def fitted_to_map(study: Study, points: Points) -> Points:
    """Return the points with the width and height of the maps.

    A map without a size does not change a point. A width or height of the study is not
    replaced.
    """
    base = dict(points.base)
    columns = dict(points.columns)
    for side, name in enumerate(SIDES):
        if study.place_of(name):
            continue
        sizes = {
            map_name: size[side] for map_name, size in _sizes(study, points).items()
        }
        if "map" not in columns:
            base[name] = next(iter(sizes.values()), base[name])
        elif any(size != base[name] for size in sizes.values()):
            columns[name] = np.full(points.count, base[name])
            for map_name, size in sizes.items():
                columns[name][columns["map"] == map_name] = size
    return replace(points, base=base, columns=columns)


def across(study: Study, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the `minimum_image` that the borders among parameter values imply.

    A torus is periodic. If the study defines `minimum_image`, no value is implied. The
    values belong to one point, or are arrays with the values of many points.
    """
    if "borders" not in values or study.place_of("minimum_image"):
        return {}
    return {"minimum_image": values["borders"] == TORUS}


def check_maps(study: Study, points: Points) -> None:
    """Raise SpecError if a map does not fit the model or the size in the study.

    The map must have the unit of length of the model. A width and a height of the study
    must equal the size of the map.
    """
    length = study.catalogue.models[study.model].length
    maps = study.catalogue.maps
    for name in _maps(points):
        if name in maps and maps[name].unit not in ("", length):
            fitting = ", ".join(
                other for other, map_ in maps.items() if map_.unit in ("", length)
            )
            raise study.document.error(
                study.place_of("map") or ("model",),
                f"map {name} is measured in {maps[name].unit}, but {study.model} in"
                f" {length}; "
                f'maps in {length}: {fitting}; or define custom shapes under "maps"',
            )
    values = {**points.base, **points.columns}
    for side, name in enumerate(SIDES):
        place = study.place_of(name)
        if place is None:
            continue
        for map_name, size in _sizes(study, points).items():
            if np.any((values["map"] == map_name) & (values[name] != size[side])):
                shown = " x ".join(f"{length:g}" for length in size)
                raise study.document.error(
                    place,
                    f"map {map_name} is {shown} {length}: leave width and height out",
                )


def _maps(points: Points) -> list[str]:
    return (
        sorted(set(points.columns["map"].tolist()))
        if "map" in points.columns
        else [str(points.base["map"])]
    )


def _sizes(study: Study, points: Points) -> dict[str, tuple[float, float]]:
    """Return width and height of the maps with a size at some points."""
    sizes = {name: study.map_size(name) for name in _maps(points)}
    return {name: size for name, size in sizes.items() if size is not None}
