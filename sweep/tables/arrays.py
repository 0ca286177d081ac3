"""A table of a study as an xarray.Dataset whose dimensions are the axes of the study,
`replicate`, and those of the table: `frame`, `boid`, `row` and `column`.

An axis of one setting has the name of the setting. Where the points are no full product
of the axes, as with `when`, there is one dimension `point` in place of them. Settings
are coordinates: along the dimension that they belong to, and without one where they do
not vary. What a trial that is not stored would have is NaN, and of texts "".
"""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables.exporting import ordered_rows
from sweep.tables.netcdf import check_xarray, dataset, room
from sweep.tables.stored_study import StoredStudy

if TYPE_CHECKING:
    import xarray as xr

TRIAL, POINT, REPLICATE = "trial", "point", "replicate"


class Dimension(NamedTuple):
    """A dimension of the points: its name, the settings along it, and the place of each
    point on it, (P,), from 0.
    """

    name: str
    settings: list[str]
    places: NDArray[Any]

    @property
    def size(self) -> int:
        """How many places it has."""
        return int(self.places.max()) + 1


class Layout(NamedTuple):
    """Where T trials stand: the names of the dimensions, their sizes, and the places of
    the trials along each.
    """

    names: tuple[str, ...]
    sizes: tuple[int, ...]
    places: tuple[NDArray[Any], ...]


def to_arrays(study: StoredStudy, table: str = "trials") -> "xr.Dataset":
    """A table as arrays with units, see the module. Raises ChoiceError for an unknown
    table, where none of its rows are stored, and where xarray is not installed.
    """
    check_xarray()
    import xarray as xr

    by_trial = dataset(ordered_rows(study, table), study)
    points, taken = study.points, [str(name) for name in by_trial.variables]
    dimensions = _dimensions(study, points, taken)
    names = tuple(one.name for one in dimensions)
    sizes = tuple(one.size for one in dimensions)
    of_points = Layout(names, sizes, tuple(one.places for one in dimensions))
    place = points.index.get_indexer(pd.Index(by_trial[POINT].values))
    replicate, numbers = pd.factorize(by_trial[REPLICATE].values, sort=True)
    of_trials = Layout(
        (*names, REPLICATE),
        (*sizes, len(numbers)),
        (*(one.places[place] for one in dimensions), replicate),
    )
    coordinates: dict[str, Any] = {
        REPLICATE: (REPLICATE, numbers, by_trial[REPLICATE].attrs)
    }
    for name, column in points.assign(**{POINT: points.index}).items():
        values = _coordinate(str(name), column, dimensions, of_points)
        coordinates[str(name)] = (*values, _about(by_trial, str(name)))
    for name in study.settings:
        if name in by_trial.variables and name not in coordinates:
            same = by_trial[name].values[0]
            coordinates[name] = ((), same, _about(by_trial, name))
    variables = _placed(by_trial, of_trials, set(coordinates))
    return xr.Dataset(variables, coordinates, by_trial.attrs)


def _dimensions(
    study: StoredStudy, points: pd.DataFrame, taken: list[str]
) -> list[Dimension]:
    """One dimension an axis that varies, where the points are their full product; else
    one of all points.
    """
    found: list[Dimension] = []
    for name, axis in (study.about.axes or {}).items():
        settings = [one for one in axis.settings if one in points]
        settings = [one for one in settings if points[one].nunique(dropna=False) > 1]
        if settings:
            places = points.groupby(settings, sort=False, dropna=False).ngroup()
            own = settings[0] if len(settings) == 1 else name
            free = own if own in settings or own not in taken else f"{own}_axis"
            found.append(Dimension(free, settings, places.to_numpy()))
    order = [str(name) for name in points.columns]
    found.sort(key=lambda one: order.index(one.settings[0]))
    apart = {tuple(place) for place in zip(*(one.places for one in found), strict=True)}
    sizes = math.prod(one.size for one in found)
    if sizes == len(points) and len(apart or {()}) == len(points):
        return found
    every = np.arange(len(points))
    return [Dimension(POINT, [POINT, *map(str, points.columns)], every)]


def _placed(
    by_trial: "xr.Dataset", layout: Layout, coordinates: set[str]
) -> dict[str, Any]:
    """All variables but the coordinates, those of trials at their places; the id of a
    trial is `trial_id`.
    """
    variables: dict[str, Any] = {}
    for name, column in by_trial.variables.items():
        if TRIAL not in column.dims:
            variables[str(name)] = column
        elif name not in coordinates:
            dims = (*layout.names, *column.dims[1:])
            values = _at_places(column.values, layout)
            called = "trial_id" if name == TRIAL else str(name)
            variables[called] = (dims, values, column.attrs)
    return variables


def _coordinate(
    name: str,
    column: "pd.Series[Any]",
    dimensions: list[Dimension],
    of_points: Layout,
) -> tuple[tuple[str, ...], NDArray[Any]]:
    """The dimensions and values of a setting of all points: along the one dimension
    that it belongs to, else along all.
    """
    kind = object if pd.api.types.is_string_dtype(column) else None
    values = column.to_numpy(kind)
    for one in dimensions:
        if name in one.settings:
            first = np.unique(one.places, return_index=True)[1]
            return (one.name,), values[first]
    return of_points.names, _at_places(values, of_points)


def _at_places(values: NDArray[Any], layout: Layout) -> NDArray[Any]:
    """An array whose first dimensions are those of a layout, of one whose first is that
    of what stands there. Whole numbers and truth values become float64 where a place is
    empty.
    """
    full = math.prod(layout.sizes) == len(values)
    missing = "" if values.dtype == object else np.nan
    lacking = values.dtype.kind in "iub" and not full
    kind = np.float64 if lacking else values.dtype
    placed = room((*layout.sizes, *values.shape[1:]), 0 if full else missing, kind)
    placed[layout.places] = values
    return placed


def _about(by_trial: "xr.Dataset", name: str) -> Mapping[Any, Any]:
    return by_trial[name].attrs if name in by_trial.variables else {}
