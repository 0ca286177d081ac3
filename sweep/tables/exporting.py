"""A table of a study as a file for other programs.

The file comes with units, provenance and a checksum.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sweep.errors import ChoiceError
from sweep.spec import columns_of
from sweep.store import AT, PROVENANCE, table_writer
from sweep.tables.choosing import as_names
from sweep.tables.netcdf import check_netcdf, write_netcdf
from sweep.tables.outputs import check_output, unfinished, write_checksum
from sweep.tables.safe_csv import without_formulas
from sweep.tables.stored_study import TABLES, StoredStudy
from sweep.tables.trial_rows import origins
from sweep.text import unknown

ROWS_AT_A_TIME = 1000
BESIDE = ".json"
"""Suffix of the name of a CSV file for the file with its units and provenance."""


KEYS = ("trial_id", "frame", "rows", "columns")
"""Columns that identify a row. A file always has these columns of its table."""


@dataclass(frozen=True)
class Exported:
    """The result of an export: number of rows, sha256, and paths of all files."""

    rows: int
    sha256: str
    files: tuple[Path, ...]


def export(
    study: StoredStudy,
    path: Path,
    table: str = "trials",
    *,
    trials: str | Sequence[str] = (),
    columns: str | Sequence[str] = (),
    force: bool = False,
) -> Exported:
    """Write a table of `study` to a file, with trials in the order of the spec.

    Parquet and Arrow files have the table as stored, and profiles with a row per value.
    CSV files have one row per boid or pixel if a stored row has many. NetCDF files have
    arrays by trial, see sweep.tables.netcdf. In each format, values that are read are
    bitwise identical. The checksum is in `<path>.sha256`.

    Parameters
    ----------
    study : StoredStudy
        A study restricted by `where` has only the chosen trials.
    path : Path
        The file. Its ending is the format: .parquet, .csv, .nc or .arrow.
    table : str, default "trials"
        "trials", "series", "heatmaps", "profiles" or "trajectories".
    trials : str or sequence of str, optional
        Ids of trials, or their beginnings; by default all trials of the study.
    columns : str or sequence of str, optional
        Columns; by default all. "varied" means the parameters that differ between
        points, "metrics" the values of recorded metrics. The file also has the columns
        that identify a row, see `KEYS`.
    force : bool, default False
        Replace a file that exists.

    Returns
    -------
    Exported

    Raises
    ------
    ChoiceError
        If the table, a trial or a column is unknown, if there is nothing to export, or
        if the packages that write netCDF are missing.
    OutputError
        If the ending is unknown, a file exists and `force` is not set, or a file cannot
        be written.
    """
    _check_table(study, table)
    check_output(path, WRITERS, force=force)
    companions = [about_of(path)] if path.suffix == ".csv" else []
    companions.append(path.with_name(path.name + ".sha256"))
    for companion in companions:
        check_output(companion, [companion.suffix], force=force)
    if path.suffix == ".nc":
        check_netcdf()
        check_arrays(study, table)
    rows = ordered_rows(study, table, as_names(trials))
    if columns:
        rows = rows.select(_columns(study, rows.column_names, as_names(columns)))
    with unfinished(path) as file:
        count = WRITERS[path.suffix](rows, file, study)
        if path.suffix == ".csv":
            write_about(path, rows.schema)
    return Exported(count, write_checksum(path), (path, *companions))


def write_rows(study: StoredStudy, table: str, ending: str, file: Any) -> None:
    """Write a table of a study to an open file.

    Parameters
    ----------
    study : StoredStudy
    table : str
        "trials", "series", "heatmaps", "profiles" or "trajectories".
    ending : {".parquet", ".csv", ".nc", ".arrow"}
        The format.
    file : binary file
    """
    WRITERS[ending](ordered_rows(study, table), file, study)


def about_of(path: Path) -> Path:
    """Return the path for the units and provenance of the columns of a CSV file."""
    return path.with_name(path.name + BESIDE)


def write_about(path: Path, schema: pa.Schema) -> Path:
    """Write the units and provenance of a CSV file, and return the path."""
    companion = about_of(path)
    with unfinished(companion) as file:
        file.write(json.dumps(_about(schema), indent=2).encode())
    return companion


def _check_table(study: StoredStudy, name: str) -> None:
    if name not in TABLES:
        raise ChoiceError(unknown("table", name, TABLES), study.name)


def _columns(
    study: StoredStudy, available: list[str], requested: list[str]
) -> list[str]:
    """Return the columns of a file: keys and requested ones. Raises ChoiceError."""
    groups = {"varied": study.varied, "metrics": columns_of(study.metrics)}
    columns = [name for name in KEYS if name in available]
    for name in requested:
        chosen = [name] if name in available else groups.get(name)
        if chosen is None:
            wrong = unknown("column", name, [*available, *groups])
            raise ChoiceError(wrong, study.name)
        if lost := [column for column in chosen if column not in available]:
            wrong = f"{name} are columns of trials; this table has no {lost[0]}"
            raise ChoiceError(wrong, study.name)
        columns += chosen
    return list(dict.fromkeys(columns))


def _listed(study: StoredStudy, trials: Sequence[str]) -> pa.Array:
    """Return the ids of all or some trials of a study, in the order of the plan.

    Raises ChoiceError for a trial that the plan does not have.
    """
    listed = study.plan["trial_id"].combine_chunks()
    if not trials:
        return listed
    ids = pa.array([study.trial_id(beginning) for beginning in trials], pa.string())
    chosen = listed.filter(pc.is_in(listed, value_set=ids))
    for beginning, trial in zip(trials, ids, strict=True):
        if not pc.is_in(trial, value_set=chosen).as_py():
            where = "at the chosen points" if study.restricted else "now"
            raise ChoiceError(
                f"trial {beginning} is stored, but is not a trial of the spec {where}",
                study.name,
            )
    return chosen


def ordered_rows(study: StoredStudy, name: str, trials: Sequence[str] = ()) -> pa.Table:
    """Return a table of trials of the spec in the order of the plan.

    The table has the provenance of the study and of all parts of the store.

    Parameters
    ----------
    study : StoredStudy
    name : str
        "trials", "series", "heatmaps", "profiles" or "trajectories".
    trials : sequence of str, optional
        Ids of trials, or their beginnings; by default all trials of the study.

    Raises
    ------
    ChoiceError
        If the table or a trial is unknown, or the table has no rows.
    """
    _check_table(study, name)
    listed = _listed(study, trials)
    table = study.read(name, listed)
    if table.num_rows == 0:
        remedy = (
            ""
            if name == "trials"
            else f"; record: {{{name}: ...}} in the spec stores some rows"
        )
        raise ChoiceError(f"no {name} are stored{remedy}", study.name)
    order = np.argsort(
        pc.index_in(table["trial_id"], value_set=listed).to_numpy(), kind="stable"
    )
    provenance = study.provenance | {
        "table": name,
        "origins": origins_of(study, listed.to_pylist()),
    }
    rows = table.take(pa.array(order))
    return (_by_value(rows) if name == "profiles" else rows).replace_schema_metadata(
        {PROVENANCE: json.dumps(provenance, sort_keys=True)}
    )


def _by_value(profiles: pa.Table) -> pa.Table:
    """Return a table of profiles with one row per value."""
    names = profiles.column_names
    parts = [_values_of(profiles, name) for name in names[1:] if f"{name}{AT}" in names]
    return pa.concat_tables(parts)


def _values_of(profiles: pa.Table, name: str) -> pa.Table:
    lengths = pc.list_value_length(profiles[name]).fill_null(0).to_numpy()
    trials = np.repeat(np.arange(len(lengths)), lengths)
    fields = [profiles.schema.field(column) for column in (name, f"{name}{AT}")]
    of_value, of_position = (field.metadata or {} for field in fields)
    texts = {
        "profile": name,
        "axis": _decoded(of_position.get(b"text", b"")),
        "axis_unit": _decoded(of_position.get(b"unit", b"")),
        "unit": _decoded(of_value.get(b"unit", b"")),
    }
    same = {
        column: pa.array([text], pa.string()).take(pa.array(np.zeros_like(trials)))
        for column, text in texts.items()
    }
    numbers = {
        "at": pc.list_flatten(profiles[f"{name}{AT}"]),
        "value": pc.list_flatten(profiles[name]),
    }
    ids = profiles["trial_id"].take(pa.array(trials))
    return pa.table({"trial_id": ids, **same, **numbers})


def check_arrays(study: StoredStudy, table: str) -> None:
    """Raise ChoiceError for a table that has no form as arrays by trial."""
    if table == "profiles":
        raise ChoiceError(
            "profiles have different axes: write .csv, .parquet or .arrow",
            study.name,
        )


def origins_of(study: StoredStudy, trial_ids: list[str]) -> list[dict[str, Any]]:
    """Return the code and machines that computed trials, launch by launch.

    A changed working tree is reported without its changes.
    """
    return list(_origins(study, trial_ids))


def _origins(study: StoredStudy, trial_ids: list[str]) -> Iterator[dict[str, Any]]:
    for origin, count in origins(study.store, trial_ids):
        machine: dict[str, Any] = {
            name: origin[name]
            for name in ("kernels_sha", "versions", "platform", "cpu", "device")
            if name in origin
        }
        git = {
            "commit": origin["git"].get("commit", ""),
            "modified": bool(origin["git"].get("diff")),
        }
        yield {"trials": count, "git": git, **machine}


def _about(schema: pa.Schema) -> dict[str, Any]:
    """Return the units and the provenance of a table, ready for JSON."""
    columns = {
        field.name: {
            _decoded(key): _decoded(text)
            for key, text in (field.metadata or {}).items()
        }
        for field in schema
    }
    return {
        "columns": columns,
        "provenance": json.loads(schema.metadata[PROVENANCE]),
    }


def _decoded(text: bytes) -> str:
    return text.decode(errors="replace")


def _write_parquet(table: pa.Table, file: BinaryIO, _study: StoredStudy) -> int:
    with table_writer(file, table.schema) as writer:
        writer.write_table(table)
    return int(table.num_rows)


def _write_arrow(table: pa.Table, file: BinaryIO, _study: StoredStudy) -> int:
    with pa.ipc.new_file(file, table.schema) as writer:
        writer.write_table(table)
    return int(table.num_rows)


def _write_netcdf(table: pa.Table, file: BinaryIO, study: StoredStudy) -> int:
    write_netcdf(table, file, study)
    return int(table.num_rows)


def _write_csv(table: pa.Table, file: BinaryIO, _study: StoredStudy) -> int:
    with csv_writer(file, table.schema) as writer:
        for batch in table.to_batches(max_chunksize=ROWS_AT_A_TIME):
            writer.write_table(pa.Table.from_batches([batch]))
    return writer.rows


class CsvWriter:
    """Writer of tables as CSV, which counts the rows of the file in `rows`.

    If a row of a table has many boids or pixels, the file has one row per boid or
    pixel.
    """

    def __init__(self, writer: Any) -> None:
        self._writer = writer
        self.rows = 0

    def write_table(self, table: pa.Table) -> None:
        """Write the rows of a table."""
        flat = _flat(table)
        self._writer.write_table(flat)
        self.rows += int(flat.num_rows)


@contextmanager
def csv_writer(file: BinaryIO, schema: pa.Schema) -> Iterator[CsvWriter]:
    """Open a writer of tables with a common schema into a CSV file."""
    from pyarrow import csv

    flat = _flat(schema.empty_table().combine_chunks()).schema
    with csv.CSVWriter(file, flat) as writer:
        yield CsvWriter(writer)


def _flat(table: pa.Table) -> pa.Table:
    return without_formulas(_long(table))


def _long(table: pa.Table) -> pa.Table:
    """Return a table without lists: one row per boid or per pixel."""
    lists = [field.name for field in table.schema if pa.types.is_list(field.type)]
    if not lists:
        return table
    lengths = pc.list_value_length(table[lists[0]]).to_numpy()
    repeated = table.drop_columns(lists).take(
        pa.array(np.repeat(np.arange(len(lengths)), lengths))
    )
    starts = np.cumsum(lengths) - lengths
    repeated = repeated.append_column(
        "index", pa.array(np.arange(lengths.sum()) - np.repeat(starts, lengths))
    )
    for name in lists:
        repeated = repeated.append_column(name, pc.list_flatten(table[name]))
    return (
        _pixels(repeated)
        if "rows" in table.column_names
        else repeated.rename_columns({"index": "boid"})
    )


def _pixels(table: pa.Table) -> pa.Table:
    row, column = np.divmod(table["index"].to_numpy(), table["columns"].to_numpy())
    names = {
        "trial_id": table["trial_id"],
        "row": row,
        "column": column,
        "visits": table["visits"],
    }
    return pa.table(names)


WRITERS: dict[str, Callable[[pa.Table, BinaryIO, StoredStudy], int]] = {
    ".parquet": _write_parquet,
    ".csv": _write_csv,
    ".nc": _write_netcdf,
    ".arrow": _write_arrow,
}
"""Functions that write a table by format and return the number of rows."""
