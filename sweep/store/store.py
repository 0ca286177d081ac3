"""Parquet store of one study.

Results appear whole or not at all, and the stored trials say what has been run.

    parts/<part id>/   trials.parquet, series.parquet, ...: tables of the same trials
    plan.parquet       the trials of the spec as last launched; of a search, also which
                       candidate had which of them
    asked.parquet      the latter, up to version 0.18
    code-<sha>.json    custom code that computed some of them
    lock/              who is launching it
    damaged/           parts that cannot be read

A study is in a folder or below a prefix of an object store: `places.py` tells how a
part comes to be there at once. Part ids sort by age, and a trial stored in several
parts counts from the latest one only, in every table. A merged part has a file that
names the parts it replaces. As soon as the merged part exists they are ignored, so a
process that is killed before it deletes them loses and doubles nothing. Schemas, with
their metadata, come from the caller and are kept as given. Launches of different shards
may append to one study at the same time: their trials are different ones.
"""

import json
import secrets
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import pyarrow as pa

from sweep.errors import StoreError
from sweep.spec import ASKED, PLAN, SPEC, code_file
from sweep.store.asked_lists import ASKED_FOR, asked_in, with_asked
from sweep.store.finding import no_study
from sweep.store.locations import Location, patiently
from sweep.store.manifest import (
    MERGED_MARK,
    REPLACES,
    replaced_by,
    table_names,
    write_manifest,
)
from sweep.store.merging import (
    MERGED_ROWS,
    Gathered,
    Gathering,
    mergeable,
    superseded_rows,
    without,
)
from sweep.store.new_files import create
from sweep.store.parquet import (
    check_part,
    each,
    load_table,
    opened,
    pieces,
    stored_schema,
    table_writer,
)
from sweep.store.placed import PlacedTrials, in_order, load_each, placed_trials
from sweep.store.places import place_of
from sweep.store.regular import read_whole
from sweep.store.uniting import united

T = TypeVar("T")

SEARCH_AGAIN = "delete it and search again"
"""Remedy if it is not known what a search has asked for."""
LAST_ID = 10**19
"""Limit of the numbers of parts, whose names sort by age up to 19 digits."""


class Store:
    """Parts of one study, in `folder`, which need not exist before the first write.

    While `shared`, others append parts of their own: then only what this one has
    appended is merged.

    Parameters
    ----------
    folder : Location
        Place of the study.
    results : Location, optional
        Folder that the user has named, by default that above `folder`. Nothing is
        written
        through links below it.
    """

    def __init__(self, folder: Location, results: Location | None = None) -> None:
        self.folder = folder
        self.results = results or folder.parent
        self.place = place_of(folder, self.results)
        self.shared = False
        self._plan = folder / PLAN
        self._gathering = Gathering()
        self._newest = -1
        self._replaced = dict[str, list[str]]()

    def append(self, tables: Mapping[str, pa.Table]) -> Location:
        """Store one part and return its place.

        After a StoreError nothing of it is visible. `trials` has at least one row, each
        with its own `trial_id` and a `status` (both strings); the other tables have a
        `trial_id` of those. Raises ValueError if that does not hold.
        """
        check_part(tables)
        name = self._next_id()
        with self.staging(name) as staging:
            for table_name, table in tables.items():
                _write_table(staging / f"{table_name}.parquet", table)
            write_manifest(staging)
            size = sum(file.stat().st_size for file in staging.iterdir())
            part = self.place.commit(staging, name)
        self._gathering.add(Gathered(part, tables["trials"].num_rows, size))
        return part

    def gather(self) -> None:
        """Merge what this store has appended, once there are many small parts."""
        while due := self._gathering.due():
            generation, held = due
            parts = [gathered.part for gathered in held]
            merged = self.merge(parts, patiently(lambda: superseded_rows(parts)))  # noqa: B023
            rows = sum(gathered.rows for gathered in held)
            size = sum(gathered.size for gathered in held)
            self._gathering.replace(generation, Gathered(merged, rows, size))

    def trial_ids(self) -> dict[str, str]:
        """Return the status of every stored trial by its id."""

        def statuses(parts: list[Location]) -> dict[str, str]:
            tables = each(
                parts, lambda part: load_table(part, "trials", ["trial_id", "status"])
            )
            return {
                trial_id: status
                for table in tables
                for trial_id, status in zip(
                    *(column.to_pylist() for column in table.columns), strict=True
                )
            }

        return self.steadily(statuses)

    def read(
        self,
        table: str,
        *,
        trial_ids: pa.Array | None = None,
        columns: Sequence[str] | None = None,
        optional: Sequence[str] = (),
    ) -> pa.Table:
        """Return all current rows of a table, oldest part first.

        Columns are united by name and filled with nulls, types widened. Metadata is
        that of the newest part that has such rows.

        Parameters
        ----------
        table : str
            Name of the table. A table that no part has comes back with no rows.
        trial_ids : array of str, optional
            Trials whose rows are read; by default all.
        columns : sequence of str, optional
            By default all columns.
        optional : sequence of str, default ()
            Columns that are read in addition to `columns` if any part has them.

        Raises
        ------
        StoreError
            If a part is damaged, or one of `columns` is in the table of no part.
        """
        names = (
            None
            if columns is None
            else list(dict.fromkeys(["trial_id", *columns, *optional]))
        )
        union = self.steadily(
            lambda parts: united(_current(parts, table, names, trial_ids), names)
        )
        if columns is None:
            return union
        if unknown := set(columns) - set(union.column_names):
            raise StoreError(
                f"{self.folder}: {table} has no column {', '.join(sorted(unknown))}"
            )
        present = [name for name in optional if name in union.column_names]
        return union.select([*columns, *present])

    def placed(self, trial_ids: pa.Array) -> PlacedTrials:
        """Return the numbers of the rows of these trials, for `columns`.

        Raises StoreError for a damaged part.
        """
        return self.steadily(lambda parts: placed_trials(parts, trial_ids))

    def columns(self, placed: PlacedTrials, names: Sequence[str]) -> pa.Table:
        """Return ids and columns of trials that were placed, in the order asked for.

        Parameters
        ----------
        placed : PlacedTrials
        names : sequence of str
            Columns. Those that no part of these trials has are left out.

        Raises
        ------
        StoreError
            If a part is damaged, or parts were merged or deleted since: then place the
            trials
            again.
        """
        return patiently(lambda: in_order(placed, names))

    def schema(self, table: str) -> pa.Schema:
        """Return the columns of a table that any part has, with metadata of the newest.

        No row is read. Raises StoreError for a damaged part.
        """
        return self.steadily(lambda parts: united(_empty(parts, table)).schema)

    def compact(self, rows: int = MERGED_ROWS) -> None:
        """Merge parts of fewer than `rows` trials with the same tables and schemas.

        Merged parts have about `rows` trials, or MAX_MERGED_BYTES. Superseded rows are
        dropped. Provenance is schema metadata, so rows of different provenance stay
        apart. While the store is shared, only parts that it has appended itself are
        merged.
        """
        self.tidy()
        parts = self._gathering.parts() if self.shared else self.current_parts()
        superseded = patiently(lambda: superseded_rows(parts))
        for group in patiently(lambda: [*mergeable(parts, rows)]):
            self.merge(group, superseded)
        self._gathering = Gathering()

    def tidy(self) -> None:
        """Delete replaced parts, and the unfinished files of dead processes.

        Only a part that a merged part names is deleted: a part that a listing lacks may
        have been stored since.
        """
        parts = self.all_parts()
        replaced = self._replaced_in(parts)
        for part in parts:
            if part.name in replaced:
                self.discard(part)
        self.place.tidy(alone=not self.shared)

    def write_plan(
        self, plan: pa.RecordBatchReader, requests: pa.Table | None = None
    ) -> None:
        """Replace the plan, with what a search has asked for, in one step.

        Parameters
        ----------
        plan : RecordBatchReader
            Some rows at a time, with its schema metadata.
        requests : Table, optional
            Trials that a search has asked for, with its schema metadata, see
            `with_asked`.
        """
        if requests is not None:
            plan = with_asked(plan.read_all(), requests).to_reader()
        with self.staging(f"plan-{secrets.token_hex(6)}") as staging:
            _write_rows(staging / PLAN, plan)
            # Up to version 0.18 requests were a file, which counts for a plan without a
            # column of them. It goes before such a plan is there. Before a plan with
            # the column it stays, since the earlier plan may still need it.
            if requests is None:
                self.place.remove(ASKED)
            self.place.put(staging / PLAN)
        if requests is not None:
            self.place.remove(ASKED)

    def write_spec(self, text: str) -> None:
        """Replace the spec as last launched, in one step."""
        with self.staging(f"spec-{secrets.token_hex(6)}") as staging:
            with create(staging / SPEC) as file:
                file.write(text.encode())
            self.place.put(staging / SPEC)

    def write_code(self, sha: str, content: bytes) -> None:
        """Keep custom code in a file, unless it is there with the same content.

        Parameters
        ----------
        sha : str
            The sha256 of the code, for the name of the file.
        content : bytes
            Content of the file.
        """
        name = code_file(sha)
        if patiently(lambda: _holds(self.folder / name, content)):
            return
        with self.staging(f"code-{secrets.token_hex(6)}") as staging:
            with create(staging / name) as file:
                file.write(content)
            self.place.put(staging / name)

    def read_plan(self) -> pa.Table:
        """Return the plan as last written.

        Raises StoreError if there is none.
        """

        def trials(file: Any) -> pa.Table:
            names = file.schema_arrow.names
            return file.read([name for name in names if name != ASKED_FOR])

        remedy = "delete it and launch the study again"
        plan = patiently(lambda: _read_if_there(self._plan, remedy, trials))
        if plan is None and self.all_parts():
            lost = "trials are stored here, but there is no plan.parquet"
            raise StoreError(
                f"{self.folder}: {lost}; run the study again, which writes it anew"
            )
        if plan is None:
            raise no_study(self.folder, self.results)
        return plan

    def read_asked(self) -> pa.Table | None:
        """Return what a search has asked for; None if the study is no search."""

        def from_plan(file: Any) -> pa.Table | None:
            if ASKED_FOR not in file.schema_arrow.names:
                return None
            plan = file.read(["trial_id", ASKED_FOR])
            return asked_in(plan, self._plan, SEARCH_AGAIN)

        def from_own_file(file: Any) -> pa.Table:
            return file.read()

        for path, read in (
            (self._plan, from_plan),
            (self.folder / ASKED, from_own_file),
        ):
            requests = patiently(partial(_read_if_there, path, SEARCH_AGAIN, read))
            if requests is not None:
                return requests
        return None

    def current_parts(self) -> list[Location]:
        """Return the parts that count, oldest first."""
        parts = self.all_parts()
        replaced = self._replaced_in(parts)
        return [part for part in parts if part.name not in replaced]

    def all_parts(self) -> list[Location]:
        """Return all parts, oldest first, whether or not another one replaces them."""
        return self.place.parts()

    def steadily(self, read: Callable[[list[Location]], T]) -> T:
        """Return the result of `read` on the current parts.

        It reads again if parts were merged, or deleted, elsewhere meanwhile.
        """
        while True:
            parts = self.current_parts()
            try:
                result = patiently(lambda: read(parts))  # noqa: B023
            except (StoreError, FileNotFoundError):
                if _steady(parts, self.current_parts()):
                    raise
                continue
            if _steady(parts, self.current_parts()):
                return result

    def _next_id(self) -> str:
        """Return an id that sorts after all present ones.

        That holds even if the clock was set back.
        """
        if self._newest < 0:
            self._newest = max(
                (int(part.name[:20]) for part in self.all_parts()), default=0
            )
        self._newest = max(time.time_ns(), self._newest + 1)
        if self._newest >= LAST_ID:
            why = (
                "has a part of the year 2286; nothing can be stored after it: delete it"
            )
            raise StoreError(f"{self.folder}: {why}")
        return f"{self._newest:020d}-{secrets.token_hex(6)}"

    def staging(self, name: str) -> AbstractContextManager[Path]:
        """Make a new local folder, which is deleted afterwards.

        Raises StoreError if writing fails.
        """
        return self.place.staging(name)

    def merge(
        self, group: Sequence[Location], superseded: Mapping[Location, pa.Array]
    ) -> Location:
        """Replace parts by one, less some trials of each, and return the merged part.

        Parameters
        ----------
        group : sequence of Location
            Parts with the same tables and schemas, oldest first.
        superseded : mapping of Location to array
            Ids of the trials of a part that are left out.
        """
        # Named after its newest source, so that a part stored elsewhere meanwhile is
        # still the later one.
        newest = group[-1].name.partition(MERGED_MARK)[0]
        name = f"{newest}{MERGED_MARK}{secrets.token_hex(6)}"
        with self.place.fetched([*group]) as sources, self.staging(name) as staging:
            for kind in table_names(sources[0]):
                file_name = f"{kind}.parquet"
                schema = stored_schema(sources[0] / file_name)
                with (
                    create(staging / file_name) as file,
                    table_writer(file, schema) as writer,
                ):
                    for part, here in zip(group, sources, strict=True):
                        for table in pieces(here, kind):
                            writer.write_table(without(table, superseded.get(part)))
            with create(staging / REPLACES) as file:
                file.write(json.dumps([part.name for part in group]).encode())
            write_manifest(staging)
            merged = self.place.commit(staging, name)
        for part in group:
            self.discard(part)
        return merged

    def discard(self, part: Location) -> None:
        """Delete a part; it is gone at once and whole."""
        self.place.discard(part)

    def _replaced_in(self, parts: list[Location]) -> set[str]:
        """Return the names of the parts that merged ones of `parts` replace."""
        merged = [part for part in parts if MERGED_MARK in part.name]
        return {
            name
            for names in patiently(lambda: each(merged, self._replaced_by))
            for name in names
        }

    def _replaced_by(self, part: Location) -> list[str]:
        if part.name not in self._replaced:
            try:
                self._replaced[part.name] = replaced_by(part)
            except FileNotFoundError:
                # The part is being deleted elsewhere: what it replaced is gone already.
                return []
        return self._replaced[part.name]


def _write_table(path: Path, table: pa.Table) -> None:
    with create(path) as file, table_writer(file, table.schema) as writer:
        writer.write_table(table)


def _write_rows(path: Path, rows: pa.RecordBatchReader) -> None:
    with create(path) as file, table_writer(file, rows.schema) as writer:
        for batch in rows:
            writer.write_batch(batch)


def _holds(path: Location, content: bytes) -> bool:
    """Return whether a file exists, and has this content."""
    try:
        return read_whole(path, len(content)) == content
    except OSError:  # it is none of ours, or larger
        return False


def _read_if_there(
    path: Location, remedy: str, read: Callable[[Any], pa.Table | None]
) -> pa.Table | None:
    """Return what `read` takes of a parquet file; None if there is no such file."""
    if not path.exists():
        return None
    with opened(path, remedy) as file:
        return read(file)


def _steady(parts: list[Location], now: list[Location]) -> bool:
    """Return whether parts that were listed still exist, and no merged part is new.

    The trials of a new merged part may be in none of the parts that were listed before.
    """
    before = {part.name for part in parts}
    names = {part.name for part in now}
    return before <= names and not any(MERGED_MARK in name for name in names - before)


def _current(
    parts: list[Location], name: str, columns: list[str] | None, only: pa.Array | None
) -> list[pa.Table]:
    """Return the current rows of one table for each of the parts that have it.

    `only` are the ids of the trials whose rows are read; None for all.
    """
    holders = [part for part in parts if (part / f"{name}.parquet").exists()]
    if not holders:
        return []
    if only is not None:
        rows = [
            part_rows
            for part_rows in placed_trials(parts, only).parts
            if part_rows.part in {*holders}
        ]
        return load_each(rows, name, columns)
    superseded = superseded_rows(parts)
    tables = each(holders, lambda part: load_table(part, name, columns))
    return [
        without(table, superseded.get(part))
        for part, table in zip(holders, tables, strict=True)
    ]


def _empty(parts: list[Location], name: str) -> list[pa.Table]:
    """Return a table of each of the parts that have it, without rows."""
    files = [part / f"{name}.parquet" for part in parts]
    schemas = each([file for file in files if file.exists()], stored_schema)
    return [schema.empty_table() for schema in schemas]
