"""A table of a study as an xarray.Dataset.

The dimensions are the axes of the study, `replicate`, and the dimensions of the table:
`frame`, `boid`, `row` and `column`. An axis of one parameter has the name of the
parameter. If the points are no full product of the axes, such as with `when`, one
dimension `point` replaces the axes. Parameters are coordinates along their dimension; a
parameter that does not vary is a scalar coordinate. Values of trials that are not
stored are NaN, and strings are "".
"""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables.exporting import check_arrays, ordered_rows
from sweep.tables.netcdf import check_xarray, dataset, room
from sweep.tables.stored_study import StoredStudy

if TYPE_CHECKING:
    import xarray as xr

TRIAL = "trial"
POINT = "point"
REPLICATE = "replicate"


class Dimension(NamedTuple):
    """A dimension of the P points.

    `settings` are the parameters along the dimension; `places` has the index of each
    point on the dimension, (P,), from 0.
    """

    name: str
    settings: list[str]
    places: NDArray[Any]

    @property
    def size(self) -> int:
        """The number of indices along the dimension."""
        return int(self.places.max()) + 1


class Layout(NamedTuple):
    """The names and sizes of dimensions, and the indices of T trials along each."""

    names: tuple[str, ...]
    sizes: tuple[int, ...]
    places: tuple[NDArray[Any], ...]


def to_arrays(study: StoredStudy, table: str = "trials") -> "xr.Dataset":
    """Return a table as arrays with units, see the module.

    Raises ChoiceError if the table is unknown or has no stored row, and if xarray is
    not installed.
    """
    check_xarray()
    check_arrays(study, table)
    import xarray as xr

    by_trial = dataset(ordered_rows(study, table), study)
    points = study.points
    taken = [str(name) for name in by_trial.variables]
    dimensions = _dimensions(study, points, taken)
    names = tuple(dimension.name for dimension in dimensions)
    sizes = tuple(dimension.size for dimension in dimensions)
    indices = tuple(dimension.places for dimension in dimensions)
    of_points = Layout(names, sizes, indices)
    place = points.index.get_indexer(pd.Index(by_trial[POINT].values))
    replicate, numbers = pd.factorize(by_trial[REPLICATE].values, sort=True)
    of_trials = Layout(
        (*names, REPLICATE),
        (*sizes, len(numbers)),
        (*(index[place] for index in indices), replicate),
    )
    coordinates: dict[str, Any] = {
        REPLICATE: (REPLICATE, numbers, by_trial[REPLICATE].attrs)
    }
    for name, column in points.assign(**{POINT: points.index}).items():
        values = _coordinate(str(name), column, dimensions, of_points)
        coordinates[str(name)] = (*values, _attributes(by_trial, str(name)))
    for name in study.settings:
        if name in by_trial.variables and name not in coordinates:
            fixed = by_trial[name].values[0]
            coordinates[name] = ((), fixed, _attributes(by_trial, name))
    variables = _placed(by_trial, of_trials, set(coordinates))
    return xr.Dataset(variables, coordinates, by_trial.attrs)


def _dimensions(
    study: StoredStudy, points: pd.DataFrame, taken: list[str]
) -> list[Dimension]:
    """Return one dimension per axis that varies, or one dimension of all points.

    The dimensions are axes if the points are the full product of the axes. `taken` are
    names that an axis of several parameters may not have.
    """
    dimensions: list[Dimension] = []
    for name, axis in (study.about.axes or {}).items():
        settings = [
            setting
            for setting in axis.settings
            if setting in points and points[setting].nunique(dropna=False) > 1
        ]
        if settings:
            places = points.groupby(settings, sort=False, dropna=False).ngroup()
            own = settings[0] if len(settings) == 1 else name
            free = own if own in settings or own not in taken else f"{own}_axis"
            dimensions.append(Dimension(free, settings, places.to_numpy()))
    order = [str(name) for name in points.columns]
    dimensions.sort(key=lambda dimension: order.index(dimension.settings[0]))
    indices = [dimension.places for dimension in dimensions]
    distinct = {tuple(place) for place in zip(*indices, strict=True)}
    size = math.prod(dimension.size for dimension in dimensions)
    if size == len(points) and len(distinct or {()}) == len(points):
        return dimensions
    every = np.arange(len(points))
    return [Dimension(POINT, [POINT, *map(str, points.columns)], every)]


def _placed(
    by_trial: "xr.Dataset", layout: Layout, coordinates: set[str]
) -> dict[str, Any]:
    """Return all variables but the coordinates; the id of a trial is `trial_id`.

    Variables by trial become arrays over the dimensions of the layout.
    """
    variables: dict[str, Any] = {}
    for name, column in by_trial.variables.items():
        if TRIAL not in column.dims:
            variables[str(name)] = column
        elif name not in coordinates:
            dims = (*layout.names, *column.dims[1:])
            values = _at_places(column.values, layout)
            written = "trial_id" if name == TRIAL else str(name)
            variables[written] = (dims, values, column.attrs)
    return variables


def _coordinate(
    name: str,
    column: "pd.Series[Any]",
    dimensions: list[Dimension],
    of_points: Layout,
) -> tuple[tuple[str, ...], NDArray[Any]]:
    """Return the dimensions and values of a parameter of all points.

    The values run along the dimension of the parameter if there is one, else along all
    dimensions.
    """
    kind = object if pd.api.types.is_string_dtype(column) else None
    values = column.to_numpy(kind)
    for dimension in dimensions:
        if name in dimension.settings:
            first = np.unique(dimension.places, return_index=True)[1]
            return (dimension.name,), values[first]
    return of_points.names, _at_places(values, of_points)


def _at_places(values: NDArray[Any], layout: Layout) -> NDArray[Any]:
    """Return values by trial or point, (T, ...), as an array over a layout.

    Integers and booleans become float64 if an element of the layout is empty.
    """
    full = math.prod(layout.sizes) == len(values)
    missing = "" if values.dtype == object else np.nan
    lacking = values.dtype.kind in "iub" and not full
    kind = np.float64 if lacking else values.dtype
    placed = room((*layout.sizes, *values.shape[1:]), 0 if full else missing, kind)
    placed[layout.places] = values
    return placed


def _attributes(by_trial: "xr.Dataset", name: str) -> Mapping[Any, Any]:
    return by_trial[name].attrs if name in by_trial.variables else {}
