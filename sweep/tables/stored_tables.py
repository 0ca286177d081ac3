"""Checks of stored tables, which may be untrusted.

A table passes if a launch can have written it. The checks cover everything that arrays
depend on: types of columns, empty cells, and lengths of lists.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Literal

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from kernels.catalogue import Catalogue
from kernels.settings import MOST_PIXELS
from sweep.design import TRIAL_ID
from sweep.errors import StoreError
from sweep.spec import LAST_FLOCKS, settings_of
from sweep.store import (
    ABOUT_EVENT,
    ABOUT_LINK,
    ABOUT_TRIAL,
    ARROW,
    AT,
    FLIGHT,
    HEADINGS,
    Location,
)
from sweep.text import shortened

NAME = re.compile("[A-Za-z_][A-Za-z0-9_]*")
FULL = {
    "trials": ("trial_id", "point", "model", "preset", "status"),
    "series": ("trial_id", "frame"),
    "heatmaps": ("trial_id", "rows", "columns", "visits"),
    "profiles": ("trial_id",),
    "trajectories": ("trial_id", "frame", *FLIGHT),
    LAST_FLOCKS: ("trial_id", *FLIGHT, *HEADINGS),
}
"""Columns of each table that must exist and have no empty cell."""


def checked(
    study: str,
    name: str,
    table: pa.Table,
    catalogue: Catalogue,
    columns: Iterable[str] = (),
) -> pa.Table:
    """Return rows of a stored table after all checks.

    Trials get 0 for spreads that a launch did not name, and current replay commands.

    Parameters
    ----------
    study : str
        The study, for errors and commands.
    name : str
        The name of the table.
    table : pyarrow.Table
        Rows of the table from one or more parts.
    catalogue : Catalogue
        The models that the trials may have.
    columns : iterable of str, optional
        Further columns that the table must have.

    Raises
    ------
    StoreError
        If no launch writes such a table. The error has the study, the table and the
        column.
    """
    if table.num_rows == 0:
        return table
    for column in (*FULL[name], *columns):
        if column not in table.column_names:
            raise StoreError(
                f"the stored {name} have no column {column}; launch the study again",
                study,
            )
    try:
        _check_names(table)
        table = _without_others(table, FULL[name])
        _check_full(table, FULL[name])
        CHECKS[name](table, catalogue)
    except ValueError as error:
        raise StoreError(
            f"the stored {name} are not what a launch writes: {error}", study
        ) from None
    if name == "trials":
        table = _with_spreads(table, catalogue)
    return _with_commands(table, study) if "replay" in table.column_names else table


def _with_spreads(table: pa.Table, catalogue: Catalogue) -> pa.Table:
    """Return trials with 0 for spreads that only some trials have."""
    for name in settings_of(table["model"][0].as_py(), catalogue).spreads:
        if name in table.column_names:
            index = table.column_names.index(name)
            filled = table[name].fill_null(0.0)
            table = table.set_column(index, table.schema.field(index), filled)
    return table


def command(verb: Literal["replay", "view"], study: str, trial: object) -> str:
    """Return the command that shows a stored trial.

    The command consists of checked names. A stored command is never used, because the
    study may have a new name.

    Parameters
    ----------
    verb : {"replay", "view"}
    study : str
    trial : object
        The id of the trial, unchecked.
    """
    if not TRIAL_ID.fullmatch(str(trial)):
        return "no command: the id of this trial is not 24 hexadecimal digits"
    return f"sweep {verb} {study} {trial}"


def _with_commands(table: pa.Table, study: str) -> pa.Table:
    """Return trials of `study` with the commands that replay them now."""
    ids = table["trial_id"].to_pylist()
    commands = pa.array([command("replay", study, trial) for trial in ids], pa.string())
    index = table.column_names.index("replay")
    return table.set_column(index, table.schema.field(index), commands)


def _without_others(table: pa.Table, required: Iterable[str]) -> pa.Table:
    """Return the table without lists that only trials of earlier launches have.

    The model of an earlier launch may have had different rows of state.
    """
    return table.drop_columns(
        [
            field.name
            for field in table.schema
            if pa.types.is_list(field.type)
            and field.name not in required
            and table[field.name].null_count == table.num_rows
        ]
    )


def checked_numbers(
    folder: Location, table: pa.Table, columns: Iterable[str]
) -> pa.Table:
    """Return trials of any launches into a folder after a check of types.

    Parameters
    ----------
    folder : Location
        The folder, for errors.
    table : pyarrow.Table
        Trials. Ids and statuses must be strings.
    columns : iterable of str
        Columns that must be numbers.

    Raises
    ------
    StoreError
        If a column has a wrong type.
    """
    kinds = dict.fromkeys(columns, pa.float64()) | {
        "trial_id": pa.string(),
        "status": pa.string(),
    }
    try:
        _check_present(table, kinds)
    except ValueError as error:
        raise StoreError(
            f"{folder}: the stored trials are not what a launch writes: {error}"
        ) from None
    return table


def _check_names(table: pa.Table) -> None:
    columns = table.column_names
    for name in columns:
        if not NAME.fullmatch(name):
            raise ValueError(f"no column can have the name {shortened(ascii(name))}")
    if len(columns) > len(set(columns)):
        raise ValueError("a column appears twice")


def _check_trials(table: pa.Table, catalogue: Catalogue) -> None:
    columns = (*ABOUT_TRIAL, *ABOUT_LINK, *ABOUT_EVENT)
    identity = {name: kind for name, kind, *_ in columns}
    _check_present(table, identity)
    models = pc.unique(table["model"]).to_pylist()
    if len(models) > 1 or models[0] not in catalogue.models:
        raise ValueError(f"needs one known model, not {', '.join(models[:5])}")
    settings = settings_of(models[0], catalogue)
    every = settings | settings.spreads
    _check_present(table, {name: ARROW[every[name].kind] for name in every})
    metrics = set(table.column_names) - identity.keys() - every.keys()
    _check_numbers(table, metrics)


def _check_series(table: pa.Table, _catalogue: Catalogue) -> None:
    _check_types(table, {"trial_id": pa.string(), "frame": pa.int64()})
    _check_numbers(table, set(table.column_names) - {"trial_id", "frame"})


def _check_heatmaps(table: pa.Table, _catalogue: Catalogue) -> None:
    _check_types(
        table, {"trial_id": pa.string(), "rows": pa.int32(), "columns": pa.int32()}
    )
    pixels = _lengths(table, "visits", pa.int32())
    rows = _integers(table, "rows")
    columns = _integers(table, "columns")
    agree = (rows > 0) & (columns > 0) & (rows * columns == pixels)
    if not (agree & (pixels <= MOST_PIXELS)).all():
        raise ValueError("the number of visits is not rows times columns")


def _check_profiles(table: pa.Table, catalogue: Catalogue) -> None:
    _check_types(table, {"trial_id": pa.string()})
    columns = table.column_names
    for name in (name for name in columns if f"{name}{AT}" in columns):
        if name not in catalogue.profiles:
            raise ValueError(f"there is no profile {shortened(name)}")
        rows = table.filter(pc.is_valid(table[name]))
        values = _lengths(rows, name, pa.float64())
        positions = _lengths(rows, f"{name}{AT}", pa.float64())
        if (values != positions).any() or (values < 1).any():
            raise ValueError(f"{name} has another number of values than of positions")
        flat = pc.list_flatten(rows[f"{name}{AT}"]).to_numpy()
        ends = np.cumsum(positions)[:-1]
        rises = np.delete(np.diff(flat), ends - 1) > 0.0
        if not (np.isfinite(flat).all() and rises.all()):
            raise ValueError(f"the positions of {name} are not in ascending order")
        if np.isinf(pc.list_flatten(rows[name]).to_numpy()).any():
            raise ValueError(f"{name} has an infinite value")


def _check_trajectories(table: pa.Table, catalogue: Catalogue) -> None:
    _check_types(table, {"trial_id": pa.string(), "frame": pa.int64()})
    columns = [name for name in table.column_names if name not in ("trial_id", "frame")]
    _check_full(table, columns)
    recorded = any(model.events for model in catalogue.models.values())
    boids = _check_boids(table, columns, absent=recorded)
    frames = _integers(table, "frame")
    ids = table["trial_id"].combine_chunks()
    trials = ids.dictionary_encode().indices.to_numpy()
    same = trials[1:] == trials[:-1]
    if (
        int((~same).sum()) + 1 != len(np.unique(trials))
        or not (np.diff(frames)[same] > 0).all()
    ):
        raise ValueError("frames are not in ascending order")
    if not (np.diff(boids)[same] == 0).all():
        raise ValueError("the number of boids changes between frames")


def _check_last_flocks(table: pa.Table, _catalogue: Catalogue) -> None:
    _check_types(table, {"trial_id": pa.string()})
    columns = [name for name in table.column_names if name != "trial_id"]
    _check_full(table, columns)
    _check_boids(table, columns)


def _check_boids(
    table: pa.Table, columns: Sequence[str], absent: bool = False
) -> NDArray[np.int64]:
    """Return the number of boids in each row, on which all columns must agree.

    With `absent` a boid may have NaN, as an individual of a recording without a
    position.
    """
    boids = _lengths(table, "x", pa.float64())
    numbers = sorted(set(columns) - {"kind"})
    lengths = {name: _lengths(table, name, pa.float64()) for name in numbers}
    if "kind" in columns:
        lengths["kind"] = _lengths(table, "kind", pa.int64())
    if boids.min() < 1 or any((length != boids).any() for length in lengths.values()):
        raise ValueError(f"{', '.join(columns)} have different numbers of boids")
    for name in columns:
        values = pc.list_flatten(table[name])
        allowed = pc.is_finite(values)
        if absent and pa.types.is_floating(values.type):
            allowed = pc.or_(allowed, pc.is_nan(values))
        if not pc.all(allowed).as_py():
            raise ValueError(f"{name} has values that are not finite")
    return boids


def _check_full(table: pa.Table, columns: Iterable[str]) -> None:
    for name in columns:
        if table[name].null_count:
            raise ValueError(f'column "{name}" has empty cells')


def _check_present(table: pa.Table, kinds: dict[str, pa.DataType]) -> None:
    """Raise ValueError if the table has any of these columns with a wrong type."""
    columns = table.column_names
    _check_types(table, {name: kind for name, kind in kinds.items() if name in columns})


def _check_types(table: pa.Table, kinds: dict[str, pa.DataType]) -> None:
    for name, kind in kinds.items():
        stored = table.schema.field(name).type
        if stored not in (kind, pa.null()):
            raise ValueError(f'column "{name}" holds {stored}, not {kind}')


def _check_numbers(table: pa.Table, columns: Iterable[str]) -> None:
    _check_types(table, dict.fromkeys(sorted(columns), pa.float64()))


def _integers(table: pa.Table, name: str) -> NDArray[np.int64]:
    integers: NDArray[np.int64] = table[name].to_numpy().astype(np.int64)
    return integers


def _lengths(table: pa.Table, name: str, kind: pa.DataType) -> NDArray[np.int64]:
    """Return the lengths of the lists of a column."""
    stored = table.schema.field(name).type
    if not pa.types.is_list(stored) or stored.value_type != kind:
        raise ValueError(f'column "{name}" holds {stored}, not lists of {kind}')
    if pc.list_flatten(table[name]).null_count:
        raise ValueError(f'column "{name}" has lists with empty elements')
    lengths: NDArray[np.int64] = (
        pc.list_value_length(table[name]).to_numpy().astype(np.int64)
    )
    return lengths


CHECKS: dict[str, Callable[[pa.Table, Catalogue], None]] = {
    "trials": _check_trials,
    "series": _check_series,
    "heatmaps": _check_heatmaps,
    "profiles": _check_profiles,
    "trajectories": _check_trajectories,
    LAST_FLOCKS: _check_last_flocks,
}
