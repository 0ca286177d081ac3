"""Points while a design is being built, and what follows from their maps and borders: a
size of the world, a unit of length, and whether a torus is periodic.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.design.order import Fineness
from sweep.spec.axes import distinct_rows
from sweep.spec.document import Place
from sweep.spec.evaluation import ExpressionError
from sweep.spec.expressions import Expression
from sweep.spec.settings import TORUS, Value, Values
from sweep.spec.study import Study

SIDES = ("width", "height")


@dataclass(frozen=True)
class Points:
    """Points while a design is being built. `columns` has the settings that vary, shape
    (count,) each, `base` the values of the others. `fineness` (count,) is that of
    `sweep.design.order`.
    """

    base: dict[str, Value]
    columns: dict[str, Values]
    count: int
    fineness: Fineness

    def column(self, name: str) -> Values:
        """The values of any setting, shape (count,)."""
        if name in self.columns:
            return self.columns[name]
        value = self.base[name]
        return np.full(self.count, value, object if isinstance(value, str) else None)

    def evaluate(self, study: Study, expression: Expression, place: Place) -> Values:
        """The expression at every point.

        Raises SpecError, which names the first point where it has no value.
        """
        try:
            return expression.evaluate({**self.base, **self.columns}, self.count)
        except ExpressionError as error:
            where = self.describe(error.point, expression.names)
            raise study.document.error(place, f"{error}{where}") from None

    def describe(self, point: int, names: Iterable[str]) -> str:
        """The values of the named settings at a point, as ` where n = 50, map =
        empty`.
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
        """The points where `keep` is true."""
        if keep.all():
            return self
        columns = {name: column[keep] for name, column in self.columns.items()}
        return Points(self.base, columns, int(keep.sum()), self.fineness[keep])

    def times(self, count: int) -> "Points":
        """So many copies of all points, one after the other."""
        if count == 1:
            return self
        columns = {
            name: np.tile(column, count) for name, column in self.columns.items()
        }
        fineness = np.tile(self.fineness, count)
        return Points(self.base, columns, self.count * count, fineness)


def united(designs: Sequence[Points]) -> tuple[Points, int]:
    """The points of several designs, each once, and how many were there already."""
    first = designs[0]
    if len(designs) == 1:
        return first, 0
    names = [
        *dict.fromkeys(name for one in designs for name in one.columns),
        *(name for name in first.base if len({one.base[name] for one in designs}) > 1),
    ]
    columns = {
        name: np.concatenate([one.column(name) for one in designs])
        for name in dict.fromkeys(names)
    }
    fineness = np.concatenate([one.fineness for one in designs])
    every = Points(first.base, columns, len(fineness), fineness)
    once, _ = distinct_rows([*columns.values()])
    keep = np.zeros(every.count, np.bool_)
    keep[once] = True
    return every.kept(keep), every.count - len(once)


def fitted_to_map(study: Study, points: Points) -> Points:
    """The points with width and height of the map where it has its own and the study
    leaves them out.
    """
    base, columns = dict(points.base), dict(points.columns)
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
    """The `minimum_image` that goes with the borders among some values of settings, of
    one point or of many, where the study leaves it out: a torus is periodic.
    """
    if "borders" not in values or study.place_of("minimum_image"):
        return {}
    return {"minimum_image": values["borders"] == TORUS}


def check_maps(study: Study, points: Points) -> None:
    """Raise SpecError for a map in another unit than the model's, and for a width or
    height that is not the map's.
    """
    length, maps = study.known.models[study.model].length, study.known.maps
    for name in _maps(points):
        if name in maps and maps[name].unit not in ("", length):
            fitting = ", ".join(
                other for other, map_ in maps.items() if map_.unit in ("", length)
            )
            raise study.document.error(
                study.place_of("map") or ("model",),
                f"map {name} is measured in {maps[name].unit}, and {study.model} in"
                f" {length}; "
                f'maps in {length}: {fitting}; or give shapes of your own under "maps"',
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
    """Width and height of those maps of the points that have their own."""
    sizes = {name: study.map_size(name) for name in _maps(points)}
    return {name: size for name, size in sizes.items() if size is not None}
