"""Tables as netCDF 4: arrays by trial, frame, boid or pixel, with units.

    trials        every column by `trial`
    series        every metric by `trial` and `frame`
    trajectories  x, y, vx and vy by `trial`, `frame` and `boid`
    heatmaps      visits by `trial`, `row` and `column`

A value is NaN where a trial lacks the frame or the boid. Visits are -1 in obstacles and
-2 outside of a smaller map. The dimension `trial` has the ids of trials. The point, the
replicate, the seed and the varying parameters of a trial are coordinates along `trial`.
"""

import math
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.errors import ChoiceError
from sweep.store import PROVENANCE
from sweep.tables.outputs import by_path
from sweep.tables.stored_study import StoredStudy
from sweep.text import installing

if TYPE_CHECKING:
    import xarray as xr

OUTSIDE = -2
MOST_PLACES = 2**31
"""Maximum number of elements of an array in memory."""
Variables = dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, str]]]


def check_netcdf() -> None:
    """Raise ChoiceError unless the packages that write netCDF are installed."""
    if not (find_spec("xarray") and find_spec("netCDF4")):
        raise ChoiceError(
            "netCDF files are written by xarray and netCDF4,"
            f" which are not installed: {installing('netcdf')}"
        )


def check_xarray() -> None:
    """Raise ChoiceError unless xarray is installed."""
    if not find_spec("xarray"):
        raise ChoiceError(
            f"arrays need xarray, which is not installed: {installing('netcdf')}"
        )


def write_netcdf(table: pa.Table, file: BinaryIO, study: StoredStudy) -> None:
    """Write a table with the provenance as netCDF; the arrays are in memory.

    Parameters
    ----------
    table : pyarrow.Table
        Rows of one table, with provenance in the metadata of the schema.
    file : binary file
    study : StoredStudy
        The study of the table.

    Notes
    -----
    The provenance is JSON in the variable `provenance`.
    """
    arrays = dataset(table, study)
    by_path(lambda path: arrays.to_netcdf(path, engine="netcdf4"), file)


def dataset(table: pa.Table, study: StoredStudy) -> "xr.Dataset":
    """Return a table as an xarray.Dataset, in the order of the trials."""
    import xarray as xr

    ids = pc.unique(table["trial_id"])
    coordinates: Variables = {"trial": (("trial",), _texts(ids), {})} | _coordinates(
        study, ids
    )
    if "visits" in table.column_names:
        variables = _maps(table)
    elif "frame" in table.column_names:
        coordinates["frame"] = (
            ("frame",),
            np.unique(table["frame"].to_numpy()),
            _attributes(table, "frame"),
        )
        variables = _frames(table, ids)
    else:
        names = [
            name
            for name in table.column_names
            if name != "trial_id" and name not in coordinates
        ]
        variables = {
            name: (("trial",), _values(table[name]), _attributes(table, name))
            for name in names
        }
    provenance = table.schema.metadata[PROVENANCE].decode()
    variables["provenance"] = (
        (),
        np.array(provenance, dtype=object),
        {"text": "provenance of the table, as JSON"},
    )
    return xr.Dataset(variables, coordinates, {"title": f"boidsweep: {study.name}"})


def _coordinates(study: StoredStudy, ids: pa.Array) -> Variables:
    columns = ["point", "replicate", "seed", *study.varied]
    trials = study.store.read("trials", trial_ids=ids, columns=["trial_id", *columns])
    trials = trials.take(
        pc.index_in(ids, value_set=trials["trial_id"].combine_chunks())
    )
    return {
        name: (("trial",), _values(trials[name]), _attributes(trials, name))
        for name in columns
    }


def _frames(table: pa.Table, ids: pa.Array) -> Variables:
    """Return the columns of a table of frames as arrays by trial and frame.

    Columns of lists become arrays by trial, frame and boid.
    """
    steps = table["frame"].to_numpy()
    place = (
        pc.index_in(table["trial_id"], value_set=ids).to_numpy(),
        np.searchsorted(np.unique(steps), steps),
    )
    shape = len(ids), len(np.unique(steps))
    variables: Variables = {}
    for name in table.column_names:
        column = table[name].combine_chunks()
        attributes = _attributes(table, name)
        if pa.types.is_list(column.type):
            variables[name] = (
                ("trial", "frame", "boid"),
                _by_boid(column, place, shape),
                attributes,
            )
        elif name not in ("trial_id", "frame"):
            values = room(shape, np.nan, np.float64)
            values[place] = column.to_numpy(zero_copy_only=False)
            variables[name] = (("trial", "frame"), values, attributes)
    return variables


def _by_boid(
    column: pa.Array, place: tuple[NDArray[Any], ...], shape: tuple[int, ...]
) -> NDArray[np.float64]:
    lengths = pc.list_value_length(column).to_numpy()
    starts = np.cumsum(lengths) - lengths
    boid = np.arange(lengths.sum()) - np.repeat(starts, lengths)
    values = room((*shape, int(lengths.max())), np.nan, np.float64)
    values[(*(np.repeat(index, lengths) for index in place), boid)] = pc.list_flatten(
        column
    ).to_numpy()
    return values


def _maps(table: pa.Table) -> Variables:
    rows, columns = (table[name].to_numpy() for name in ("rows", "columns"))
    visits = room(
        (table.num_rows, int(rows.max()), int(columns.max())), OUTSIDE, np.int32
    )
    for index, flat in enumerate(table["visits"]):
        size = int(rows[index]), int(columns[index])
        visits[index, : size[0], : size[1]] = flat.values.to_numpy().reshape(size)
    attributes = _attributes(table, "visits") | {
        "text": "visits per pixel, -1 in obstacles, -2 outside of the map"
    }
    return {"visits": (("trial", "row", "column"), visits, attributes)}


def room(shape: tuple[int, ...], value: float | str, kind: Any) -> NDArray[Any]:
    """Return an array full of `value`.

    Parameters
    ----------
    shape : tuple of int
    value : float or str
    kind : dtype

    Raises
    ------
    ChoiceError
        If the array would have more than `MOST_PLACES` elements.
    """
    if math.prod(shape) > MOST_PLACES:
        size = " x ".join(f"{side:,}" for side in shape)
        raise ChoiceError(
            f"an array of all trials would have {size} elements; at most"
            f" {MOST_PLACES:,} are allowed: write .parquet instead"
        )
    return np.full(shape, value, kind)


def _values(column: pa.ChunkedArray) -> NDArray[Any]:
    return (
        _texts(column)
        if pa.types.is_string(column.type)
        else np.asarray(column.to_numpy())
    )


def _texts(column: pa.ChunkedArray | pa.Array) -> NDArray[Any]:
    return np.array(pc.fill_null(column, "").to_pylist(), dtype=object)


def _attributes(table: pa.Table, name: str) -> dict[str, str]:
    """Return the unit and the text of a column, by the names of the CF conventions."""
    stored = table.schema.field(name).metadata or {}
    named = {"units": stored.get(b"unit", b""), "long_name": stored.get(b"text", b"")}
    return {key: text.decode(errors="replace") for key, text in named.items() if text}
