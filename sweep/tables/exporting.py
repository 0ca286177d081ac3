"""One table of a study as one file for other programs, with its units, where it comes
from, and a checksum.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sweep.errors import ChoiceError
from sweep.store.origin import PROVENANCE
from sweep.store.parquet import table_writer
from sweep.tables.netcdf import check_netcdf, write_netcdf
from sweep.tables.outputs import check_output, unfinished, write_checksum
from sweep.tables.safe_csv import without_formulas
from sweep.tables.stored_study import TABLES, StoredStudy
from sweep.tables.stored_trials import origins
from sweep.text import unknown

ROWS_AT_A_TIME = 1000
BESIDE = ".json"
"""What is added to the name of a CSV file for that with its units and provenance."""


@dataclass(frozen=True)
class Exported:
    """What was written: rows of the table, the sha256 of the file, and all files."""

    rows: int
    sha256: str
    files: tuple[Path, ...]


def export(
    study: StoredStudy, path: Path, table: str = "trials", *, force: bool = False
) -> Exported:
    """Write a table of `study`, the trials of its spec in their order, to `path`, in
    the format that its name ends in.

    Parquet and Arrow files have the table as it is stored; CSV files have one row a
    boid or pixel where a stored row has many; netCDF files have arrays by trial, see
    sweep.tables.netcdf. Values come back with the same bits from all. The checksum is
    in `<path>.sha256`. Raises ChoiceError, before any work where it can be known, for
    an unknown table or ending, for a file that exists without `force`, and where there
    is nothing to export.
    """
    _check_table(study, table)
    check_output(path, WRITERS, force=force)
    beside = [path.with_name(path.name + ending) for ending in (BESIDE, ".sha256")]
    beside = beside if path.suffix == ".csv" else beside[1:]
    for other in beside:
        check_output(other, [other.suffix], force=force)
    if path.suffix == ".nc":
        check_netcdf()
    rows = ordered_rows(study, table)
    with unfinished(path) as file:
        WRITERS[path.suffix](rows, file, study)
        if path.suffix == ".csv":
            with unfinished(beside[0]) as about:
                about.write(json.dumps(_about(rows), indent=2).encode())
    return Exported(rows.num_rows, write_checksum(path), (path, *beside))


def write_rows(study: StoredStudy, table: str, ending: str, file: Any) -> None:
    """Write a table of `study` to an open file, in the format of this ending."""
    WRITERS[ending](ordered_rows(study, table), file, study)


def _check_table(study: StoredStudy, name: str) -> None:
    if name not in TABLES:
        raise ChoiceError(unknown("table", name, TABLES), study.name)


def ordered_rows(study: StoredStudy, name: str) -> pa.Table:
    """A table of the spec's trials in the order of the plan, with the provenance of the
    study and of its parts. Raises ChoiceError for an unknown table, and where it has no
    rows.
    """
    _check_table(study, name)
    listed = study.plan["trial_id"].combine_chunks()
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


def _about(table: pa.Table) -> dict[str, Any]:
    """The units and the provenance of a table, ready for JSON."""
    columns = {
        field.name: {
            _decoded(key): _decoded(text)
            for key, text in (field.metadata or {}).items()
        }
        for field in table.schema
    }
    return {
        "columns": columns,
        "provenance": json.loads(table.schema.metadata[PROVENANCE]),
    }


def _decoded(text: bytes) -> str:
    return text.decode(errors="replace")


def _write_parquet(table: pa.Table, file: BinaryIO, _study: StoredStudy) -> None:
    with table_writer(file, table.schema) as writer:
        writer.write_table(table)


def _write_arrow(table: pa.Table, file: BinaryIO, _study: StoredStudy) -> None:
    with pa.ipc.new_file(file, table.schema) as writer:
        writer.write_table(table)


def _write_csv(table: pa.Table, file: BinaryIO, _study: StoredStudy) -> None:
    from pyarrow import csv

    schema = _flat(table.schema.empty_table().combine_chunks()).schema
    with csv.CSVWriter(file, schema) as writer:
        for batch in table.to_batches(max_chunksize=ROWS_AT_A_TIME):
            writer.write_table(_flat(pa.Table.from_batches([batch])))


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


WRITERS: dict[str, Callable[[pa.Table, BinaryIO, StoredStudy], None]] = {
    ".parquet": _write_parquet,
    ".csv": _write_csv,
    ".nc": write_netcdf,
    ".arrow": _write_arrow,
}
