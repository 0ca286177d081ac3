"""Parquet store of a study.

Results appear as a whole or not at all. The stored trials are the record of finished
work.

    parts/<part id>/   trials.parquet, series.parquet, ...: tables of some trials
    plan.parquet       the trials of the last launched spec, and requests of a search

    asked.parquet      the requests of a search, up to version 0.18
    code-<sha>.json    custom code that computed trials
    lock/              claims of launches
    damaged/           parts that cannot be read

A study is in a folder or below a prefix of an object store: see `places.py`. Part ids
sort by age. If several parts have a trial, only the latest part counts, in every table.

A merged part has a file with the names of the parts that it replaces. As soon as the
merged part exists, replaced parts are ignored. So a process that is killed before the
deletion of replaced parts loses no trial and doubles no trial.

Schemas, with metadata, come from the caller and do not change. Launches of different
shards may append to a study at the same time, because their trials differ.
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
"""Remedy if the requests of a search cannot be read."""
LAST_ID = 10**19
"""Limit of the numbers of parts, whose names sort by age up to 19 digits."""


class Store:
    """Parts of a study in `folder`, which need not exist before the first write.

    While `shared`, further processes append parts. Then this store merges only parts
    that it has appended.

    Parameters
    ----------
    folder : Location
        Location of the study.
    results : Location, optional
        Folder that the user has named, by default the parent of `folder`. The store
        does not write through links below this folder.
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
        """Store a part and return its location.

        After a StoreError no file of the part is visible. `trials` has at least one
        row; each row has a distinct `trial_id` and a `status`, two strings. Further
        tables have only a `trial_id` that is in `trials`. Raises ValueError for tables
        that violate a requirement.
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
        """Merge the parts that this store has appended, if many are small."""
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

        Columns are united by name and filled with nulls, with widened types. The
        metadata come from the newest part with rows in the result.

        Parameters
        ----------
        table : str
            Name of the table. A table that no part has is returned without rows.
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
        chosen = (
            None
            if columns is None
            else list(dict.fromkeys(["trial_id", *columns, *optional]))
        )
        union = self.steadily(
            lambda parts: united(_current(parts, table, chosen, trial_ids), chosen)
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
        """Return the row numbers of some trials, as an argument of `columns`.

        Raises StoreError for a damaged part.
        """
        return self.steadily(lambda parts: placed_trials(parts, trial_ids))

    def columns(self, placed: PlacedTrials, names: Sequence[str]) -> pa.Table:
        """Return ids and columns of placed trials, in the order of the request.

        Parameters
        ----------
        placed : PlacedTrials
        names : sequence of str
            Columns. A column that no part of the trials has is left out.

        Raises
        ------
        StoreError
            If a part is damaged, or if parts were merged or deleted since `placed` was
            computed: then compute `placed` again.
        """
        return patiently(lambda: in_order(placed, names))

    def schema(self, table: str) -> pa.Schema:
        """Return the united schema of a table in all parts, with the newest metadata.

        The call reads no rows. Raises StoreError for a damaged part.
        """
        return self.steadily(lambda parts: united(_empty(parts, table)).schema)

    def compact(self, rows: int = MERGED_ROWS) -> None:
        """Merge parts of fewer than `rows` trials with equal tables and schemas.

        Merged parts have about `rows` trials, or MAX_MERGED_BYTES. Superseded rows are
        dropped. Provenance is schema metadata, so rows of different provenance are not
        merged. While the store is shared, only parts that this store has appended are
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

        A part is deleted only if a merged part names the part. A part that a listing
        lacks may be new.
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
        """Replace the plan and the requests of a search in one step.

        Parameters
        ----------
        plan : RecordBatchReader
            Batches of rows, with schema metadata.
        requests : Table, optional
            Trials that a search has requested, with schema metadata, see `with_asked`.
        """
        if requests is not None:
            plan = with_asked(plan.read_all(), requests).to_reader()
        with self.staging(f"plan-{secrets.token_hex(6)}") as staging:
            _write_rows(staging / PLAN, plan)
            # Up to version 0.18 requests had a separate file, which a reader uses if
            # the plan has no column of requests. Before a plan without the column is
            # written, the file is deleted. Before a plan with the column the file
            # stays, because the earlier plan may still need the file.
            if requests is None:
                self.place.remove(ASKED)
            self.place.put(staging / PLAN)
        if requests is not None:
            self.place.remove(ASKED)

    def write_spec(self, text: str) -> None:
        """Replace the last launched spec in one step."""
        with self.staging(f"spec-{secrets.token_hex(6)}") as staging:
            with create(staging / SPEC) as file:
                file.write(text.encode())
            self.place.put(staging / SPEC)

    def write_code(self, sha: str, content: bytes) -> None:
        """Store custom code in a file, unless a file has this content already.

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
        """Return the last written plan.

        Raises StoreError if there is no plan.
        """

        def trials(file: Any) -> pa.Table:
            names = file.schema_arrow.names
            return file.read([name for name in names if name != ASKED_FOR])

        remedy = "delete it and launch the study again"
        plan = patiently(lambda: _read_if_there(self._plan, remedy, trials))
        if plan is None and self.all_parts():
            lost = "trials are stored here, but there is no plan.parquet"
            raise StoreError(
                f"{self.folder}: {lost}; run the study again to write the plan"
            )
        if plan is None:
            raise no_study(self.folder, self.results)
        return plan

    def read_asked(self) -> pa.Table | None:
        """Return the requests of a search; None if the study is not a search."""

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
        """Return all parts, oldest first, including replaced parts."""
        return self.place.parts()

    def steadily(self, read: Callable[[list[Location]], T]) -> T:
        """Return the result of `read` on the current parts.

        The call repeats `read` if another process merged or deleted parts meanwhile.
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
        """Return an id that sorts after the ids of all present parts.

        The order is correct even if the clock was set back.
        """
        if self._newest < 0:
            self._newest = max(
                (int(part.name[:20]) for part in self.all_parts()), default=0
            )
        self._newest = max(time.time_ns(), self._newest + 1)
        if self._newest >= LAST_ID:
            why = (
                "has a part of the year 2286, which blocks later parts; delete the part"
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
        """Merge parts into a new part, without some trials, and return the new part.

        Parameters
        ----------
        group : sequence of Location
            Parts with equal tables and schemas, oldest first.
        superseded : mapping of Location to array
            Ids of the trials of a part that are left out.
        """
        # The name follows the newest source, so that a part that another process has
        # stored meanwhile still counts as later.
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
        """Delete a part in one step."""
        self.place.discard(part)

    def _replaced_in(self, parts: list[Location]) -> set[str]:
        """Return the names of the parts that merged parts in `parts` replace."""
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
                # Another process deletes the part: the replaced parts are gone already.
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
    """Return whether a file exists and has this content."""
    try:
        return read_whole(path, len(content)) == content
    except OSError:  # the file is missing, not regular, or larger
        return False


def _read_if_there(
    path: Location, remedy: str, read: Callable[[Any], pa.Table | None]
) -> pa.Table | None:
    """Return the result of `read` on a parquet file; None if there is no such file."""
    if not path.exists():
        return None
    with opened(path, remedy) as file:
        return read(file)


def _steady(parts: list[Location], now: list[Location]) -> bool:
    """Return whether all listed parts still exist, and no merged part is new.

    A new merged part may contain trials of parts that the listing lacks.
    """
    before = {part.name for part in parts}
    names = {part.name for part in now}
    return before <= names and not any(MERGED_MARK in name for name in names - before)


def _current(
    parts: list[Location], name: str, columns: list[str] | None, only: pa.Array | None
) -> list[pa.Table]:
    """Return the current rows of a table for each part that has the table.

    `only` has the ids of the trials to read; None for all trials.
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
    """Return an empty table for each part that has the table `name`."""
    files = [part / f"{name}.parquet" for part in parts]
    schemas = each([file for file in files if file.exists()], stored_schema)
    return [schema.empty_table() for schema in schemas]
