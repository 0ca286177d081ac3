"""One table of a study as one file for other programs, with its units, where it comes
from, and a checksum.
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
from sweep.spec.recorded import columns_of
from sweep.store.origin import PROVENANCE
from sweep.store.parquet import table_writer
from sweep.tables.choosing import as_names
from sweep.tables.netcdf import check_netcdf, write_netcdf
from sweep.tables.outputs import check_output, unfinished, write_checksum
from sweep.tables.safe_csv import without_formulas
from sweep.tables.stored_study import TABLES, StoredStudy
from sweep.tables.stored_trials import origins
from sweep.text import unknown

ROWS_AT_A_TIME = 1000
BESIDE = ".json"
"""What is added to the name of a CSV file for that with its units and provenance."""


KEYS = ("trial_id", "frame", "rows", "columns")
"""Columns that say what a row is of: a file has those of its table, whatever is asked
for.
"""


@dataclass(frozen=True)
class Exported:
    """What was written: rows of the file, its sha256, and all files."""

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
    """Write a table of `study`, the trials of its spec in their order, to a file.

    Parquet and Arrow files have the table as it is stored; CSV files have one row a
    boid or pixel where a stored row has many; netCDF files have arrays by trial, see
    sweep.tables.netcdf. Values come back with the same bits from all. The checksum is
    in `<path>.sha256`.

    Parameters
    ----------
    study : StoredStudy
        The study; after `where`, the trials that it has chosen.
    path : Path
        The file, in the format that its name ends in: .parquet, .csv, .nc or .arrow.
    table : str
        The table: trials, series, heatmaps or trajectories.
    trials : str or sequence of str
        Ids of trials, or their beginnings; all of the study where none is named.
    columns : str or sequence of str
        Columns, all where none is named. `varied` are the settings that differ between
        points, `metrics` the values of recorded metrics. The file has beside them
        which trial a row is of, and which frame and boid.
    force : bool
        Whether a file that exists is replaced.

    Returns
    -------
    Exported
        The rows of the file, its sha256, and all files that were written.

    Raises
    ------
    ChoiceError
        Before any work where it can be known, for an unknown table, trial, column or
        ending, for a file that exists without `force`, and where there is nothing to
        export.
    """
    _check_table(study, table)
    check_output(path, WRITERS, force=force)
    beside = [about_of(path)] if path.suffix == ".csv" else []
    beside.append(path.with_name(path.name + ".sha256"))
    for other in beside:
        check_output(other, [other.suffix], force=force)
    if path.suffix == ".nc":
        check_netcdf()
    rows = ordered_rows(study, table, as_names(trials))
    if columns:
        rows = rows.select(_columns(study, rows.column_names, as_names(columns)))
    with unfinished(path) as file:
        count = WRITERS[path.suffix](rows, file, study)
        if path.suffix == ".csv":
            write_about(path, rows.schema)
    return Exported(count, write_checksum(path), (path, *beside))


def write_rows(study: StoredStudy, table: str, ending: str, file: Any) -> None:
    """Write a table of `study` to an open file, in the format of this ending."""
    WRITERS[ending](ordered_rows(study, table), file, study)


def about_of(path: Path) -> Path:
    """The file beside a CSV file with the units and provenance of its columns."""
    return path.with_name(path.name + BESIDE)


def write_about(path: Path, schema: pa.Schema) -> Path:
    """Write that file, and return it."""
    place = about_of(path)
    with unfinished(place) as file:
        file.write(json.dumps(_about(schema), indent=2).encode())
    return place


def _check_table(study: StoredStudy, name: str) -> None:
    if name not in TABLES:
        raise ChoiceError(unknown("table", name, TABLES), study.name)


def _columns(study: StoredStudy, there: list[str], wanted: list[str]) -> list[str]:
    """The columns that a file gets of those that are there. Raises ChoiceError."""
    groups = {"varied": study.varied, "metrics": columns_of(study.metrics)}
    found = [name for name in KEYS if name in there]
    for name in wanted:
        chosen = [name] if name in there else groups.get(name)
        if chosen is None:
            raise ChoiceError(unknown("column", name, [*there, *groups]), study.name)
        if lost := [one for one in chosen if one not in there]:
            said = f"{name} are columns of trials; this table has no {lost[0]}"
            raise ChoiceError(said, study.name)
        found += chosen
    return list(dict.fromkeys(found))


def _listed(study: StoredStudy, trials: Sequence[str]) -> pa.Array:
    """The ids of the trials of a study in their order, or of some of them. Raises
    ChoiceError for what is none of them.
    """
    listed = study.plan["trial_id"].combine_chunks()
    if not trials:
        return listed
    wanted = pa.array([study.trial_id(one) for one in trials], pa.string())
    found = listed.filter(pc.is_in(listed, value_set=wanted))
    for given, trial in zip(trials, wanted, strict=True):
        if not pc.is_in(trial, value_set=found).as_py():
            where = "at the points that were chosen" if study.restricted else "now"
            said = f"trial {given} is stored, and the spec does not ask for it {where}"
            raise ChoiceError(said, study.name)
    return found


def ordered_rows(study: StoredStudy, name: str, trials: Sequence[str] = ()) -> pa.Table:
    """A table of the spec's trials in the order of the plan, or of some of them, with
    the provenance of the study and of its parts. Raises ChoiceError for an unknown
    table or trial, and where it has no rows.
    """
    _check_table(study, name)
    listed = _listed(study, trials)
    table = study.read(name, listed)
    if table.num_rows == 0:
        asked = (
            ""
            if name == "trials"
            else f"; record: {{{name}: ...}} in the spec keeps some"
        )
        raise ChoiceError(f"no {name} of it are stored{asked}", study.name)
    order = np.argsort(
        pc.index_in(table["trial_id"], value_set=listed).to_numpy(), kind="stable"
    )
    about = study.provenance | {
        "table": name,
        "origins": origins_of(study, listed.to_pylist()),
    }
    return table.take(pa.array(order)).replace_schema_metadata(
        {PROVENANCE: json.dumps(about, sort_keys=True)}
    )


def origins_of(study: StoredStudy, trial_ids: list[str]) -> list[dict[str, Any]]:
    """What the trials come from, launch by launch; of a changed working tree only that
    it was changed.
    """
    return list(_origins(study, trial_ids))


def _origins(study: StoredStudy, trial_ids: list[str]) -> Iterator[dict[str, Any]]:
    for about, count in origins(study.store, trial_ids):
        machine: dict[str, Any] = {
            name: about[name]
            for name in ("kernels_sha", "versions", "platform", "cpu", "device")
            if name in about
        }
        git = {
            "commit": about["git"].get("commit", ""),
            "modified": bool(about["git"].get("diff")),
        }
        yield {"trials": count, "git": git, **machine}


def _about(schema: pa.Schema) -> dict[str, Any]:
    """The units and the provenance of a table, ready for JSON."""
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
    """Writes tables as CSV, one row a boid or pixel where a row of a table has many;
    `rows` counts them.
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
    """What writes tables of this schema into a CSV file."""
    from pyarrow import csv

    flat = _flat(schema.empty_table().combine_chunks()).schema
    with csv.CSVWriter(file, flat) as writer:
        yield CsvWriter(writer)


def _flat(table: pa.Table) -> pa.Table:
    return without_formulas(_long(table))


def _long(table: pa.Table) -> pa.Table:
    """The table without lists: a row a boid of trajectories, a pixel of heatmaps."""
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
"""What writes a table in each format, and counts the rows of the file."""
