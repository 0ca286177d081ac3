"""A stranger's store: rows that no launch writes, in parts that are sealed as a launch
does.
"""

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from sweep.store.manifest import MANIFEST, write_manifest
from sweep.store.origin import PROVENANCE


def give(study: Path, table: str = "trials", **columns: Any) -> None:
    """Put one value into all rows of some columns of a
    table, in every part of a study.
    """
    for part in sorted((study / "parts").iterdir()):
        path = part / f"{table}.parquet"
        pq.write_table(_given(pq.read_table(path), columns), path)
        (part / MANIFEST).unlink()
        write_manifest(part)


def give_plan(study: Path, about: dict[str, Any] | None = None, **columns: Any) -> None:
    """The same in the plan of a study, of which `about` changes the provenance too."""
    plan = _given(pq.read_table(study / "plan.parquet"), columns)
    provenance = json.loads(plan.schema.metadata[PROVENANCE]) | (about or {})
    metadata = {PROVENANCE: json.dumps(provenance).encode()}
    pq.write_table(plan.replace_schema_metadata(metadata), study / "plan.parquet")


def _given(table: pa.Table, columns: dict[str, Any]) -> pa.Table:
    for name, value in columns.items():
        values = value if isinstance(value, list) else [value] * table.num_rows
        if isinstance(value, pa.Array):
            column = value
        elif name in table.column_names and not isinstance(value, str):
            column = pa.array(values, table.schema.field(name).type)
        else:
            column = pa.array(values)
        if name in table.column_names:
            index = table.column_names.index(name)
            table = table.set_column(index, name, column)
        else:
            table = table.append_column(name, column)
    return table
