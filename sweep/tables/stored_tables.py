"""Stored tables hold what a launch writes into them, or they are refused: they may come
from anyone.

What is checked is what arrays are made of: the types of columns, that no cell is empty
where none ever is, and that lists are as long as they say.
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
from sweep.design.trial_ids import TRIAL_ID
from sweep.errors import StoreError
from sweep.spec.settings import settings_of
from sweep.spec.study import LAST_FLOCKS
from sweep.store.locations import Location
from sweep.store.rows import ABOUT_LINK, ABOUT_TRIAL, ARROW, FLIGHT, HEADINGS
from sweep.text import shortened

NAME = re.compile("[A-Za-z_][A-Za-z0-9_]*")
FULL = {
    "trials": ("trial_id", "point", "model", "preset", "status"),
    "series": ("trial_id", "frame"),
    "heatmaps": ("trial_id", "rows", "columns", "visits"),
    "trajectories": ("trial_id", "frame", *FLIGHT),
    LAST_FLOCKS: ("trial_id", *FLIGHT, *HEADINGS),
}
"""Columns that each table has, and in which no cell is empty."""


def checked(
    study: str,
    name: str,
    table: pa.Table,
    known: Catalogue,
    columns: Iterable[str] = (),
) -> pa.Table:
    """`table`, the rows of one or more parts in a table of `study`, which has these
    columns too; `known` are the models that may have flown.

    Raises StoreError, which names the study, the table and the column, where no launch
    writes it.
    """
    if table.num_rows == 0:
        return table
    for column in (*FULL[name], *columns):
        if column not in table.column_names:
            raise StoreError(
                f"its stored {name} have no column {column}; launch it again", study
            )
    try:
        _check_names(table)
        table = _without_others(table, FULL[name])
        _check_full(table, FULL[name])
        CHECKS[name](table, known)
    except ValueError as error:
        raise StoreError(
            f"the stored {name} are not what a launch writes: {error}", study
        ) from None
    if name == "trials":
        table = _with_spreads(table, known)
    return _with_commands(table, study) if "replay" in table.column_names else table


def _with_spreads(table: pa.Table, known: Catalogue) -> pa.Table:
    """Trials with all spreads that some of them have: 0 where a launch named none."""
    for name in settings_of(table["model"][0].as_py(), known).spreads:
        if name in table.column_names:
            index = table.column_names.index(name)
            filled = table[name].fill_null(0.0)
            table = table.set_column(index, table.schema.field(index), filled)
    return table


def command(verb: Literal["replay", "view"], study: str, trial: object) -> str:
    """The command that shows a stored trial. It is made from checked names; the stored
    text of a command is never used: the study may have another name by now.
    """
    if not TRIAL_ID.fullmatch(str(trial)):
        return "no command: the id of this trial is not 24 hexadecimal digits"
    return f"sweep {verb} {study} {trial}"


def _with_commands(table: pa.Table, study: str) -> pa.Table:
    """Trials of `study` with the commands that replay them now."""
    ids = table["trial_id"].to_pylist()
    commands = pa.array([command("replay", study, one) for one in ids], pa.string())
    index = table.column_names.index("replay")
    return table.set_column(index, table.schema.field(index), commands)


def _without_others(table: pa.Table, kept: Iterable[str]) -> pa.Table:
    """The table less the lists that only other trials have: the model of an earlier
    launch may have had other rows of state.
    """
    return table.drop_columns(
        [
            field.name
            for field in table.schema
            if pa.types.is_list(field.type)
            and field.name not in kept
            and table[field.name].null_count == table.num_rows
        ]
    )


def checked_numbers(
    folder: Location, table: pa.Table, columns: Iterable[str]
) -> pa.Table:
    """`table`, trials of whichever launches into `folder`: ids and statuses are texts,
    `columns` numbers.

    Raises StoreError where they are not.
    """
    kinds = dict.fromkeys(columns, pa.float64()) | {
        "trial_id": pa.string(),
        "status": pa.string(),
    }
    try:
        _check_types(
            table,
            {name: kind for name, kind in kinds.items() if name in table.column_names},
        )
    except ValueError as error:
        raise StoreError(
            f"{folder}: the stored trials are not what a launch writes: {error}"
        ) from None
    return table


def _check_names(table: pa.Table) -> None:
    names = table.column_names
    for name in names:
        if not NAME.fullmatch(name):
            raise ValueError(f"no column is called {shortened(ascii(name))}")
    if len(names) > len(set(names)):
        raise ValueError("a column stands twice")


def _check_trials(table: pa.Table, known: Catalogue) -> None:
    about = {name: kind for name, kind, *_ in (*ABOUT_TRIAL, *ABOUT_LINK)}
    there = {name: kind for name, kind in about.items() if name in table.column_names}
    _check_types(table, there)
    models = pc.unique(table["model"]).to_pylist()
    if len(models) > 1 or models[0] not in known.models:
        raise ValueError(f"they are of the models {', '.join(models[:5])}")
    settings = settings_of(models[0], known)
    every = settings | settings.spreads
    kinds = {name: ARROW[one.kind] for name, one in every.items()}
    there = {name: kinds[name] for name in kinds if name in table.column_names}
    _check_types(table, there)
    named = {*about, *every}
    _check_numbers(table, set(table.column_names) - named)


def _check_series(table: pa.Table, _known: Catalogue) -> None:
    _check_types(table, {"trial_id": pa.string(), "frame": pa.int64()})
    _check_numbers(table, set(table.column_names) - {"trial_id", "frame"})


def _check_heatmaps(table: pa.Table, _known: Catalogue) -> None:
    _check_types(
        table, {"trial_id": pa.string(), "rows": pa.int32(), "columns": pa.int32()}
    )
    found, rows, columns = (
        _lengths(table, "visits", pa.int32()),
        *map(_whole(table), ("rows", "columns")),
    )
    if not (
        (rows > 0) & (columns > 0) & (rows * columns == found) & (found <= MOST_PIXELS)
    ).all():
        raise ValueError("visits are not as many as rows times columns")


def _check_trajectories(table: pa.Table, _known: Catalogue) -> None:
    _check_types(table, {"trial_id": pa.string(), "frame": pa.int64()})
    names = [name for name in table.column_names if name not in ("trial_id", "frame")]
    _check_full(table, names)
    boids = _check_boids(table, names)
    frames, trials = (
        _whole(table)("frame"),
        table["trial_id"].combine_chunks().dictionary_encode().indices.to_numpy(),
    )
    same = trials[1:] == trials[:-1]
    if (
        int((~same).sum()) + 1 != len(np.unique(trials))
        or not (np.diff(frames)[same] > 0).all()
    ):
        raise ValueError("frames are not in their order")
    if not (np.diff(boids)[same] == 0).all():
        raise ValueError("the number of boids changes from one frame to another")


def _check_last_flocks(table: pa.Table, _known: Catalogue) -> None:
    _check_types(table, {"trial_id": pa.string()})
    names = [name for name in table.column_names if name != "trial_id"]
    _check_full(table, names)
    _check_boids(table, names)


def _check_boids(table: pa.Table, names: Sequence[str]) -> NDArray[np.int64]:
    """How many boids each row has, which all of these columns of lists must have."""
    boids, numbers = _lengths(table, "x", pa.float64()), set(names) - {"kind"}
    lengths = {name: _lengths(table, name, pa.float64()) for name in sorted(numbers)}
    if "kind" in names:
        lengths["kind"] = _lengths(table, "kind", pa.int64())
    if boids.min() < 1 or any((found != boids).any() for found in lengths.values()):
        raise ValueError(f"{', '.join(names)} are not of the same boids")
    for name in names:
        if not pc.all(pc.is_finite(pc.list_flatten(table[name]))).as_py():
            raise ValueError(f"{name} has values that are not finite")
    return boids


def _check_full(table: pa.Table, names: Iterable[str]) -> None:
    for name in names:
        if table[name].null_count:
            raise ValueError(f'column "{name}" has empty cells')


def _check_types(table: pa.Table, kinds: dict[str, pa.DataType]) -> None:
    for name, kind in kinds.items():
        found = table.schema.field(name).type
        if found not in (kind, pa.null()):
            raise ValueError(f'column "{name}" holds {found}, not {kind}')


def _check_numbers(table: pa.Table, names: Iterable[str]) -> None:
    _check_types(table, dict.fromkeys(sorted(names), pa.float64()))


def _whole(table: pa.Table) -> Callable[[str], NDArray[np.int64]]:
    return lambda name: table[name].to_numpy().astype(np.int64)


def _lengths(table: pa.Table, name: str, kind: pa.DataType) -> NDArray[np.int64]:
    """How long the lists of a column are."""
    found = table.schema.field(name).type
    if not pa.types.is_list(found) or found.value_type != kind:
        raise ValueError(f'column "{name}" holds {found}, not lists of {kind}')
    if pc.list_flatten(table[name]).null_count:
        raise ValueError(f'column "{name}" has lists with empty places')
    lengths: NDArray[np.int64] = (
        pc.list_value_length(table[name]).to_numpy().astype(np.int64)
    )
    return lengths


CHECKS: dict[str, Callable[[pa.Table, Catalogue], None]] = {
    "trials": _check_trials,
    "series": _check_series,
    "heatmaps": _check_heatmaps,
    "trajectories": _check_trajectories,
    LAST_FLOCKS: _check_last_flocks,
}
