"""The parquet store of one study: results appear whole or not at all, and what is present is the ledger.

    <study>/parts/<part id>/trials.parquet, series.parquet, ...   the tables of the same trials
    <study>/writing/<host>~<pid>~<name>/                          what a process is writing, or left behind
    <study>/plan.parquet                                          the trials of the spec as last launched
    <study>/asked.parquet                                         of a search: which candidate had which of them
    <study>/lock/, damaged/                                       who is launching it; parts that cannot be read

A part is written beside its place, flushed to the disk and moved there by one rename. Part ids sort by age,
and a trial stored in several parts counts from the latest one only, in every table. A merged part names in a
file the parts it replaces; from its rename on they are ignored, so that being killed before they are deleted
loses and doubles nothing. Schemas, with their metadata, are the caller's and are kept as given.
"""

import json
import os
import re
import secrets
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TypeVar

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sweep.manifest import seal
from sweep.parquet import (
    StoreError,
    check_part,
    load_table,
    load_trials,
    move_durably,
    new_file,
    opened,
    refuse_links,
    remedy_for,
    stored_schema,
)
from sweep.processes import host, started

T = TypeVar("T")

REPLACES = "replaces.json"
MERGED_MARK = "+"
OURS = re.compile(r"\d{20}-[0-9a-f]+(\+[0-9a-f]+)?|[^~]+~\d+~.+")  # a part's name, or one in writing/
MAX_MERGED_BYTES = 512 * 1024**2


class Store:
    """The parts of one study, in `folder`, which need not exist before the first write."""

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)
        self._parts = self.folder / "parts"
        self._writing = self.folder / "writing"
        self._plan = self.folder / "plan.parquet"
        self.asked = self.folder / "asked.parquet"

    def append(self, tables: Mapping[str, pa.Table]) -> Path:
        """Store one part and return its folder; after a StoreError nothing of it is visible.

        `trials` has at least one row, each with its own `trial_id` and a `status` (both strings); the other
        tables have a `trial_id` of those. Raises ValueError where that does not hold.
        """
        check_part(tables)
        part = self._parts / self._next_id()
        with self.staging(part.name) as staging:
            for name, table in tables.items():
                with new_file(staging / f"{name}.parquet", table.schema) as writer:
                    writer.write_table(table)
            seal(staging)
            move_durably(staging, part)
        return part

    def trial_ids(self) -> dict[str, str]:
        """The status of every stored trial by its id."""

        def statuses(parts: list[Path]) -> dict[str, str]:
            tables = [load_table(part, "trials", ["trial_id", "status"]) for part in parts]
            return {
                trial_id: status
                for table in tables
                for trial_id, status in zip(*(column.to_pylist() for column in table.columns), strict=True)
            }

        return self.steadily(statuses)

    def read(self, table: str, *, trial_ids: pa.Array | None = None, columns: Sequence[str] | None = None) -> pa.Table:
        """All current rows of a table, oldest part first, optionally only some trials and some columns.

        Columns are united by name and filled with nulls, types widened; metadata is the newest part's. A
        table that no part has comes back with no rows. Raises StoreError for a damaged part and for a
        column that the table has in no part.
        """
        wanted = None if columns is None else list(dict.fromkeys(["trial_id", *columns]))
        union = self.steadily(lambda parts: _union(_current(parts, table, wanted, trial_ids), wanted))
        if columns is None:
            return union
        if unknown := set(columns) - set(union.column_names):
            raise StoreError(f"{self.folder}: {table} has no column {', '.join(sorted(unknown))}")
        return union.select(columns)

    def compact(self, rows: int = 100_000) -> None:
        """Merge parts of fewer than `rows` trials, where their tables and schemas are the same.

        Merged parts have about `rows` trials, or MAX_MERGED_BYTES. Superseded rows are dropped. Provenance
        is schema metadata, so rows of different provenance stay apart.
        """
        self.tidy()
        parts = self.current_parts()
        superseded = superseded_rows(parts)
        for group in _mergeable(parts, rows):
            self.merge(group, superseded)

    def tidy(self) -> None:
        """Delete what dead processes left behind: replaced parts and unfinished folders of this host."""
        current = {part.name for part in self.current_parts()}
        for part in self.all_parts():
            if part.name not in current:
                self.discard(part)
        for folder in _folders(self._writing):
            name, pid = folder.name.split("~")[:2]
            if name == host() and started(int(pid)) is None:
                shutil.rmtree(folder, ignore_errors=True)

    def write_plan(self, plan: pa.Table, asked: pa.Table | None = None) -> None:
        """Replace the plan, and what a search has asked for, each with its schema metadata and in one step."""
        for path, table in ((self._plan, plan), (self.asked, asked)):
            if table is None:
                path.unlink(missing_ok=True)
                continue
            with self.staging(f"{path.stem}-{secrets.token_hex(6)}") as staging:
                with new_file(staging / path.name, table.schema) as writer:
                    writer.write_table(table)
                move_durably(staging / path.name, path)

    def write_spec(self, text: str) -> None:
        """Replace the spec as last launched in one step."""
        with self.staging(f"spec-{secrets.token_hex(6)}") as staging:
            (staging / "spec.yaml").write_text(text, encoding="utf-8")
            move_durably(staging / "spec.yaml", self.folder / "spec.yaml")

    def read_plan(self) -> pa.Table:
        """The plan as last written. Raises StoreError if there is none."""
        if not self._plan.exists():
            raise StoreError(f"{self.folder}: no study has been launched here (there is no plan.parquet)")
        with opened(self._plan, "delete it and launch the study again") as file:
            return file.read()

    def current_parts(self) -> list[Path]:
        """Folders of the parts that count, oldest first."""
        parts = self.all_parts()
        replaced = {name for part in parts for name in _replaced_by(part)}
        return [part for part in parts if part.name not in replaced]

    def all_parts(self) -> list[Path]:
        """Folders of all parts, oldest first, whether or not another one replaces them."""
        return _folders(self._parts)

    def steadily(self, look: Callable[[list[Path]], T]) -> T:
        """What `look` sees in the current parts; again if a compaction elsewhere took one away meanwhile."""
        while True:
            parts = self.current_parts()
            try:
                seen = look(parts)
            except StoreError:
                if set(parts) <= set(self.current_parts()):
                    raise
                continue
            if set(parts) <= set(self.current_parts()):
                return seen

    def _next_id(self) -> str:
        """An id that sorts after every present one, even if the clock has been set back."""
        newest = max((int(part.name[:20]) for part in self.all_parts()), default=0)
        return f"{max(time.time_ns(), newest + 1):020d}-{secrets.token_hex(6)}"

    @contextmanager
    def staging(self, name: str) -> Iterator[Path]:
        """A new folder under writing/ that is gone afterwards; failing to write is a StoreError."""
        staging = self._writing / f"{host()}~{os.getpid()}~{name}"
        refuse_links(self.folder)
        try:
            self._parts.mkdir(parents=True, exist_ok=True)
            staging.mkdir(parents=True)
            yield staging
        except OSError as error:
            raise StoreError(f"{self.folder}: cannot write ({error}); what was stored is intact") from error
        finally:
            shutil.rmtree(staging, ignore_errors=True)

    def merge(self, group: list[Path], without: Mapping[Path, pa.Array]) -> None:
        """Replace parts with the same tables and schemas, oldest first, by one, less some trials of each."""
        # Named after its newest source, so that a part stored elsewhere meanwhile is still the later one.
        newest = group[-1].name.partition(MERGED_MARK)[0]
        merged = self._parts / f"{newest}{MERGED_MARK}{secrets.token_hex(6)}"
        with self.staging(merged.name) as staging:
            for source in group[0].glob("*.parquet"):
                name = source.stem
                with new_file(staging / source.name, stored_schema(source)) as writer:
                    for part in group:
                        writer.write_table(_without(load_table(part, name), without.get(part)))
            (staging / REPLACES).write_text(json.dumps([part.name for part in group]))
            seal(staging)
            move_durably(staging, merged)
        for part in group:
            self.discard(part)

    def discard(self, part: Path) -> None:
        """Delete a part; it is gone at once and whole."""
        with self.staging(f"{part.name}-discarded") as staging, suppress(FileNotFoundError):
            part.rename(staging / part.name)


def _current(parts: list[Path], name: str, columns: list[str] | None, only: pa.Array | None) -> list[pa.Table]:
    """The current rows of one table, optionally only some trials, for each of the parts that have it."""
    superseded = superseded_rows(parts)
    holders = [part for part in parts if (part / f"{name}.parquet").exists()]
    return [_without(load_trials(part, name, columns, only), superseded.get(part)) for part in holders]


def superseded_rows(parts: list[Path]) -> dict[Path, pa.Array]:
    """For each part with such, the ids of its trials that a later part has too."""
    ids = [load_table(part, "trials", ["trial_id"])["trial_id"] for part in parts]
    chunks = [chunk for column in ids for chunk in column.chunks]
    position = np.repeat(np.arange(len(parts)), [len(column) for column in ids])
    rows = pa.table({"trial_id": pa.chunked_array(chunks, pa.string()), "part": position})
    latest = rows.group_by("trial_id").aggregate([("part", "max")])
    if len(latest) == len(rows):
        return {}
    stale = rows.join(latest, "trial_id").filter(pc.field("part") < pc.field("part_max"))
    return {
        parts[index]: stale.filter(pc.field("part") == index)["trial_id"].combine_chunks()
        for index in pc.unique(stale["part"]).to_pylist()
    }


def _without(table: pa.Table, trial_ids: pa.Array | None) -> pa.Table:
    if trial_ids is None:
        return table
    return table.filter(pc.invert(pc.is_in(table["trial_id"], value_set=trial_ids)))


def _union(tables: list[pa.Table], columns: list[str] | None) -> pa.Table:
    """Rows in the order given, metadata of the last table; `columns` are those of no table."""
    if not tables:
        empty = {name: pa.null() for name in columns or []} | {"trial_id": pa.string()}
        return pa.schema(empty).empty_table()
    newest = tables[-1].schema
    if all(table.schema.equals(newest, check_metadata=True) for table in tables):
        return pa.concat_tables(tables)
    schema = pa.unify_schemas([table.schema for table in reversed(tables)], promote_options="permissive")
    return pa.concat_tables([schema.empty_table(), *tables], promote_options="permissive")


def _mergeable(parts: list[Path], rows: int) -> Iterator[list[Path]]:
    """Groups of two or more small parts, oldest first, with the same tables and schemas."""
    groups: dict[bytes, tuple[list[Path], int, int]] = {}
    for part in parts:
        files = sorted(part.glob("*.parquet"))
        with opened(part / "trials.parquet") as file:
            size = file.metadata.num_rows
        if size >= rows:
            continue
        kind = b"".join(file.stem.encode() + stored_schema(file).serialize().to_pybytes() for file in files)
        group, held, held_bytes = groups.pop(kind, ([], 0, 0))
        group, held = [*group, part], held + size
        held_bytes += sum(file.stat().st_size for file in files)
        if held < rows and held_bytes < MAX_MERGED_BYTES:
            groups[kind] = group, held, held_bytes
        elif len(group) > 1:
            yield group
    yield from (group for group, _, _ in groups.values() if len(group) > 1)


def _folders(folder: Path) -> list[Path]:
    """Our own sub-folders, by name; anything else that lies there is left alone."""
    if not folder.is_dir():
        return []
    with os.scandir(folder) as entries:
        ours = [entry for entry in entries if OURS.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False)]
        return sorted(folder / entry.name for entry in ours)


def _replaced_by(part: Path) -> list[str]:
    if MERGED_MARK not in part.name:
        return []
    try:
        names: list[str] = json.loads((part / REPLACES).read_text())
    except FileNotFoundError:  # being deleted elsewhere, so all that it replaced is gone already
        return []
    except ValueError as error:
        raise StoreError(f"{part / REPLACES}: cannot be read ({error}); {remedy_for(part)}") from error
    return names
