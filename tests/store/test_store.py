"""The parquet store: parts are whole or absent, the latest row counts, and no crash
loses or doubles one.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweep.errors import StoreError
from sweep.store import merging, parquet, placed
from sweep.store import store as store_module
from sweep.store import writer as writer_module
from sweep.store.folders import LEFTOVER_SECONDS
from sweep.store.processes import here
from sweep.store.store import Store
from sweep.store.writer import Writer
from tests import ROOT
from tests.cases import slow_but
from tests.studies import ORIGIN

PROVENANCE = ORIGIN | {"spec": "study: test", "kernels_sha": "abc"}


def trials(
    rows: Mapping[str, str], provenance: Mapping[str, str] = PROVENANCE, **columns: Any
) -> pa.Table:
    """A trials table from statuses by trial id, `speed` being a column with a unit."""
    schema = pa.schema(
        [
            pa.field("trial_id", pa.string()),
            pa.field("status", pa.string()),
            pa.field("speed", pa.float64(), metadata={"units": "m/s"}),
        ],
        metadata=dict(provenance),
    )
    speed = pa.array(np.arange(len(rows), dtype=float))
    table = pa.Table.from_arrays(
        [pa.array(rows.keys()), pa.array(rows.values()), speed], schema=schema
    )
    for name, values in columns.items():
        table = table.append_column(name, pa.array(values))
    return table


def series(rows: Mapping[str, str], n_frames: int = 2) -> pa.Table:
    """`n_frames` rows for each trial; their `value` is the trial's status."""
    ids = [trial_id for trial_id in rows for _ in range(n_frames)]
    frames = pa.array(list(range(n_frames)) * len(rows), pa.int32())
    values = [rows[trial_id] for trial_id in ids]
    return pa.table({"trial_id": ids, "frame": frames, "value": values})


def append(store: Store, rows: Mapping[str, str]) -> Path:
    return store.append({"trials": trials(rows), "series": series(rows)})


def part_names(store: Store) -> set[str]:
    return {part.name for part in (store.folder / "parts").iterdir()}


def sorted_tables(store: Store) -> list[pa.Table]:
    return [store.read(name).sort_by("trial_id") for name in ("trials", "series")]


def nothing_unfinished(store: Store) -> bool:
    return not list((store.folder / "writing").iterdir())


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "model" / "study")


def test_a_store_that_does_not_exist_is_empty(store: Store) -> None:
    assert store.trial_ids() == {}
    assert store.read("trials").num_rows == 0
    assert store.read(
        "series", columns=["frame"], trial_ids=pa.array(["a"])
    ).column_names == ["frame"]
    store.tidy()
    store.compact()
    assert not store.folder.exists()


def test_round_trip_keeps_values_types_and_metadata(store: Store) -> None:
    tensor = pa.fixed_shape_tensor(pa.float32(), (2, 2))
    heat = pa.FixedSizeListArray.from_arrays(
        pa.array(np.arange(8, dtype=np.float32)), 4
    )
    schema = pa.schema(
        [
            pa.field("trial_id", pa.string()),
            pa.field("heatmap", tensor, metadata={"units": "visits"}),
            pa.field("path", pa.list_(pa.float64(), 2)),
            pa.field("curve", pa.list_(pa.float64())),
            pa.field("kind", pa.dictionary(pa.int32(), pa.string())),
        ],
        metadata={"colour": "grey"},
    )
    columns = [
        pa.array(["a", "b"]),
        pa.ExtensionArray.from_storage(tensor, heat),
        pa.array([[1.0, 2.0], [3.0, float("nan")]], schema.field("path").type),
        pa.array([[0.1], [0.2, 0.3]]),
        pa.array(["x", "y"]).dictionary_encode(),
    ]
    tables = {
        "trials": trials({"a": "ok", "b": "diverged"}),
        "heatmaps": pa.Table.from_arrays(columns, schema=schema),
    }
    for _ in range(2):
        store.append(tables)
    for _ in range(2):
        for name, table in tables.items():
            read = store.read(name)
            assert read.schema.equals(table.schema, check_metadata=True)
            assert str(read.to_pylist()) == str(table.to_pylist())
        store.compact()


def test_floats_are_split_by_byte_and_strings_are_dictionaries(store: Store) -> None:
    part = append(store, {"a": "ok"})
    columns = pq.ParquetFile(part / "trials.parquet").metadata.row_group(0)
    encodings = {
        columns.column(i).path_in_schema: columns.column(i).encodings for i in range(3)
    }
    assert "BYTE_STREAM_SPLIT" in encodings["speed"]
    assert "RLE_DICTIONARY" in encodings["status"]
    assert columns.column(0).compression == "ZSTD"


def test_the_latest_part_of_a_trial_counts_in_every_table(store: Store) -> None:
    append(store, {"a": "failed", "b": "ok"})
    store.append({"trials": trials({"a": "ok"})})
    assert store.trial_ids() == {"a": "ok", "b": "ok"}
    assert sorted(store.read("trials")["trial_id"].to_pylist()) == ["a", "b"]
    assert store.read("series")["trial_id"].to_pylist() == ["b", "b"]


def test_the_latest_counts_though_the_clock_was_set_back(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    append(store, {"a": "failed"})
    monkeypatch.setattr(store_module.time, "time_ns", lambda: 5)
    append(store, {"a": "retried"})
    append(store, {"a": "ok"})
    assert store.trial_ids() == {"a": "ok"}


def test_read_selects_trials_and_columns(store: Store) -> None:
    append(store, {"a": "1", "b": "2"})
    append(store, {"c": "3"})
    read = store.read("series", trial_ids=pa.array(["c", "a", "z"]), columns=["value"])
    assert read.column_names == ["value"]
    assert read["value"].to_pylist() == ["1", "1", "3", "3"]
    with pytest.raises(StoreError, match="series has no column valeu"):
        store.read("series", columns=["valeu"])


def test_a_part_without_a_wanted_trial_is_not_read(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    append(store, {"a": "1"})
    append(store, {"b": "2"})
    load, read = placed.load_table, []

    def noted(part: Path, name: str, *columns: Any) -> pa.Table:
        read.append(name)
        return load(part, name, *columns)

    monkeypatch.setattr(placed, "load_table", noted)
    assert store.read("series", trial_ids=pa.array(["b"]))["value"].to_pylist() == [
        "2",
        "2",
    ]
    assert read.count("series") == 1
    nothing = store.read("series", trial_ids=pa.array(["z"]), columns=["value"])
    assert (nothing.column_names, nothing.num_rows) == (["value"], 0)
    assert read.count("series") == 1


def test_optional_columns_are_read_where_a_part_has_them(store: Store) -> None:
    append(store, {"a": "ok"})
    columns = ["trial_id", "status"]
    table = store.read("trials", columns=columns, optional=["size", "weight"])
    assert table.column_names == columns
    one = pa.table({"trial_id": ["b"], "status": ["ok"], "size": [1.0]})
    store.append({"trials": one})
    table = store.read("trials", columns=columns, optional=["size", "weight"])
    assert table.column_names == [*columns, "size"]
    assert table["size"].to_pylist() == [None, 1.0]


def test_parts_with_different_columns_are_united_by_name(store: Store) -> None:
    store.append({"trials": trials({"a": "ok"}, n=[1])})
    store.append(
        {"trials": trials({"b": "ok"}, {"spec": "new"}, n=[2.5], map=["empty"])}
    )
    read = store.read("trials")
    assert read["n"].to_pylist() == [1.0, 2.5]
    assert read["map"].to_pylist() == [None, "empty"]
    assert read.schema.metadata == {b"spec": b"new"}
    assert read.schema.field("speed").metadata == {b"units": b"m/s"}
    assert store.read("trials", columns=["map"])["map"].to_pylist() == [None, "empty"]


def test_what_columns_say_is_that_of_the_newest_part_with_such_rows(
    store: Store,
) -> None:
    for name, unit in (("a", "m"), ("b", "s")):
        table = trials({name: "ok"})
        field = pa.field("gain", pa.float64(), metadata={"unit": unit})
        store.append({"trials": table.append_column(field, pa.array([1.0]))})
    units = [
        store.read("trials", trial_ids=pa.array(ids)).schema.field("gain").metadata
        for ids in (["a"], ["b"], ["a", "b"], ["c"])
    ]
    assert units == [{b"unit": b"m"}, *[{b"unit": b"s"}] * 3]


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"series": series({"a": "1"})}, "needs a `trials` table"),
        ({"trials": trials({})}, "at least one row"),
        ({"trials": pa.concat_tables([trials({"a": "1"})] * 2)}, "same trial_id twice"),
        (
            {"trials": trials({"a": "1"}), "series": series({"b": "1"})},
            "series of trials that are not in",
        ),
        ({"trials": pa.table({"trial_id": [1]})}, "`trial_id` column of strings"),
    ],
)
def test_a_part_that_breaks_the_rules_is_refused(
    store: Store, tables: dict[str, pa.Table], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        store.append(tables)
    assert not store.folder.exists()


@contextmanager
def full_disk(
    monkeypatch: pytest.MonkeyPatch, call: str, after: int = 0
) -> Iterator[None]:
    """Inside, `os.<call>` succeeds `after` times and then fails."""
    original, calls = getattr(os, call), []

    def refuse(*arguments: Any, **options: Any) -> Any:
        calls.append(call)
        if len(calls) > after:
            raise OSError(28, "No space left on device")
        return original(*arguments, **options)

    with monkeypatch.context() as broken:
        broken.setattr(os, call, refuse)
        yield


@pytest.mark.parametrize("call", ["replace", "fsync", "mkdir"])
def test_an_append_that_fails_leaves_everything_as_it_was(
    store: Store, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    append(store, {"a": "ok"})
    before = store.read("trials"), part_names(store)
    with full_disk(monkeypatch, call), pytest.raises(StoreError, match="No space left"):
        append(store, {"a": "new", "b": "new"})
    assert (store.read("trials"), part_names(store)) == before
    assert nothing_unfinished(store)


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "study").write_text("in the way")
    with pytest.raises(StoreError, match="study: cannot write"):
        append(Store(tmp_path / "study"), {"a": "ok"})


@pytest.mark.parametrize("damage", ["truncated", "flipped", "missing"])
def test_a_damaged_part_is_named_with_the_way_out(store: Store, damage: str) -> None:
    append(store, {"a": "ok"})
    part = append(store, {"b": "ok"})
    file = part / "trials.parquet"
    content = bytearray(file.read_bytes())
    content[20] ^= 255
    if damage == "missing":
        file.unlink()
    else:
        file.write_bytes(content if damage == "flipped" else content[:50])
    with pytest.raises(
        StoreError, match=rf"{part.name}/trials.parquet.*launch the study again"
    ):
        store.read("trials")
    shutil.rmtree(part)
    assert store.trial_ids() == {"a": "ok"}


def test_compaction_merges_what_has_the_same_schemas(store: Store) -> None:
    for index in range(7):
        append(store, {f"a{index}": "ok"})
    store.append({"trials": trials({"b": "ok"}, {"spec": "other"})})
    rows = sorted_tables(store)
    store.compact(rows=3)
    assert len(part_names(store)) == 4
    assert sorted_tables(store) == rows
    assert nothing_unfinished(store)
    store.compact()
    assert len(part_names(store)) == 2


def test_compaction_respects_parts_that_stay_between_the_merged_ones(
    store: Store,
) -> None:
    append(store, {"a": "1", "b": "1"})
    store.append({"trials": trials({"a": "2", "c": "2"}, {"spec": "other"})})
    append(store, {"c": "3"})
    store.compact()
    assert len(part_names(store)) == 2
    assert store.trial_ids() == {"a": "2", "b": "1", "c": "3"}
    append(store, {"c": "4"})
    assert store.trial_ids()["c"] == "4"


def test_small_parts_are_merged_on_the_way_each_row_a_few_times(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 240 parts never more than three of a level are there, and a row is written
    again once a level.
    """
    monkeypatch.setattr(merging, "MOST_GATHERED", 4)
    write, written, most = pq.ParquetWriter.write_table, [0], 0

    def counted(writer: pq.ParquetWriter, table: pa.Table, *options: Any) -> None:
        written[0] += len(table)
        write(writer, table, *options)

    monkeypatch.setattr(pq.ParquetWriter, "write_table", counted)
    with Writer(store, build, rows=2) as writer:
        for index in range(120):
            writer.add([f"{index}-{row}" for row in range(2)])
            most = max(most, len(part_names(store)))
    assert most <= 3 * 4
    assert written[0] <= 240 * 5
    assert len(store.trial_ids()) == 240
    assert nothing_unfinished(store)


def test_what_is_large_enough_is_not_merged_again(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(merging, "MERGED_ROWS", 6)
    with Writer(store, build, rows=2) as writer:
        for index in range(9):
            writer.add([f"{index}-{row}" for row in range(2)])
    assert len(part_names(store)) == 3
    assert len(store.trial_ids()) == 18


def test_on_the_way_too_the_latest_row_counts(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(merging, "MOST_GATHERED", 3)
    for index in range(10):
        append(store, {"a": str(index), f"b{index}": "ok"})
        store.gather()
        assert store.trial_ids() == {"a": str(index)} | {
            f"b{number}": "ok" for number in range(index + 1)
        }
        assert store.read("trials").num_rows == index + 2
    assert len(part_names(store)) == 2


def test_only_parts_of_this_launch_are_merged_on_the_way(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(merging, "MOST_GATHERED", 2)
    old = [append(Store(store.folder), {f"old{index}": "ok"}) for index in range(5)]
    for index in range(2):
        append(store, {f"new{index}": "ok"})
        store.gather()
    assert {part.name for part in old} < part_names(store)
    assert len(part_names(store)) == 6


def test_a_listing_that_missed_a_merged_part_is_made_again(store: Store) -> None:
    """As of a folder that is changed while it is read: neither the merged part nor
    those that it replaced are in it.
    """
    for index in range(3):
        append(store, {f"a{index}": "ok"})
    last, listings = append(store, {"b": "ok"}), iter([1])
    store.merge(store.all_parts()[:3], {})
    parts = store.all_parts
    store.all_parts = lambda: [last] if next(listings, None) else parts()  # type: ignore[method-assign]
    assert len(store.trial_ids()) == 4


def test_a_folder_that_is_a_link_is_not_written_through(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "study").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match="study: is a symbolic link"):
        append(Store(tmp_path / "study"), {"a": "ok"})
    assert list((tmp_path / "elsewhere").iterdir()) == []


@pytest.mark.parametrize(
    ("call", "after"), [("replace", 0), ("rename", 0), ("rename", 2), ("fsync", 3)]
)
def test_failing_during_compaction_loses_and_doubles_nothing(
    store: Store, monkeypatch: pytest.MonkeyPatch, call: str, after: int
) -> None:
    for index in range(4):
        append(store, {"a": str(index), f"b{index}": "ok"})
    rows = sorted_tables(store)
    with (
        full_disk(monkeypatch, call, after),
        pytest.raises(StoreError, match="No space left"),
    ):
        store.compact()
    assert len(part_names(store)) > 1
    assert sorted_tables(store) == rows
    store.compact()
    assert len(part_names(store)) == 1
    assert sorted_tables(store) == rows


KILLED = """
import os, pathlib, signal, sys
sys.path[:0] = [{root!r}]
from tests.store import test_store
from sweep.store.store import Store

store = Store(pathlib.Path({folder!r}))
setattr(os, {call!r}, lambda *_, **__: os.kill(os.getpid(), signal.SIGKILL))
test_store.append(store, {{"a": "new"}}) if {action!r} == "append" else store.compact()
"""


@pytest.mark.parametrize(
    ("action", "call"),
    slow_but([("compact", "rename")], [("append", "replace"), ("compact", "rename")]),
)
def test_being_killed_loses_and_doubles_nothing(
    store: Store, action: str, call: str
) -> None:
    """Killed before a new part appears, and between the merged part's appearance and
    the first deletion.
    """
    for index in range(3):
        append(store, {"a": str(index), f"b{index}": "ok"})
    rows = sorted_tables(store)
    script = KILLED.format(
        root=str(ROOT),
        folder=str(store.folder),
        call=call,
        action=action,
    )
    killed = subprocess.run([sys.executable, "-c", script], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert sorted_tables(store) == rows
    assert not nothing_unfinished(store)
    assert len(part_names(store)) == (3 if action == "append" else 4)
    store.tidy()
    assert sorted_tables(store) == rows
    assert nothing_unfinished(store)
    assert len(part_names(store)) == (3 if action == "append" else 1)


def test_reading_survives_a_compaction_elsewhere(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    for index in range(4):
        append(store, {f"a{index}": "ok"})
    load, calls = store_module.load_table, []

    def load_and_compact(*arguments: Any) -> pa.Table:
        calls.append(arguments)
        if len(calls) == 3:
            monkeypatch.setattr(store_module, "load_table", load)
            Store(store.folder).compact()
        return load(*arguments)

    monkeypatch.setattr(store_module, "load_table", load_and_compact)
    assert len(store.trial_ids()) == 4
    assert len(calls) == 3


@pytest.mark.parametrize("shared", [False, True])
def test_only_what_dead_processes_left_is_tidied_away(
    store: Store, shared: bool
) -> None:
    """Of another machine, or of this one before a restart, only what is old, and only
    if nobody else is at work.
    """
    append(store, {"a": "ok"})
    store.shared = shared
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    others, old = (
        {"elsewhere", f"{socket.gethostname()}-00000000"},
        time.time() - 2 * LEFTOVER_SECONDS,
    )
    young = {f"{here()}~{os.getpid()}~plan-1", f"{here()}~1~plan-1", "notes"}
    young |= {f"{other}~{gone.pid}~plan-1" for other in others}
    dead = {f"{here()}~{gone.pid}~plan-1"}
    for name in young | dead:
        (store.folder / "writing" / name).mkdir()
    for name in (left := {f"{other}~{gone.pid}~plan-2" for other in others}):
        (store.folder / "writing" / name).mkdir()
        os.utime(store.folder / "writing" / name, (old, old))
    store.tidy()
    names = {folder.name for folder in (store.folder / "writing").iterdir()}
    assert names == (young | left if shared else young)


def test_arrow_opens_local_files_itself(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An object of Python's in a thread of its pool aborts one process in twenty at its
    end.
    """
    append(store, {"a": "ok"})
    open_parquet, sources = pq.ParquetFile, []

    def opened(source: Any, **options: Any) -> pq.ParquetFile:
        sources.append(source)
        return open_parquet(source, **options)

    monkeypatch.setattr(pq, "ParquetFile", opened)
    store.read("trials")
    assert sources
    assert all(isinstance(source, Path) for source in sources)


def test_many_parts_are_read_as_one_table(store: Store) -> None:
    for index in range(60):
        store.append({"trials": trials({f"{index}-{row}": "ok" for row in range(20)})})
    assert store.read("trials").num_rows == len(store.trial_ids()) == 1200
    store.compact(rows=500)
    assert store.read("trials").num_rows == 1200
    assert len(part_names(store)) == 3


def test_a_part_that_is_gone_is_said_to_be_so(store: Store) -> None:
    """It is not promised that a launch sets it aside, as there is nothing left."""
    part = append(store, {"a": "ok"})
    shutil.rmtree(part)
    with pytest.raises(
        StoreError, match=f"{part.name}.*has been removed: launch the study again"
    ):
        parquet.load_table(part, "trials")


def test_a_plan_that_is_gone_is_told_from_a_study_never_launched(store: Store) -> None:
    append(store, {"a": "ok"})
    with pytest.raises(
        StoreError,
        match=(
            r"trials are stored here, but there is no plan.parquet; run the study again"
        ),
    ):
        store.read_plan()


def test_the_plan_is_replaced_whole(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(StoreError, match="model: no such folder of results"):
        store.read_plan()
    store.folder.parent.mkdir()
    with pytest.raises(StoreError, match="no study has been launched here"):
        store.read_plan()
    first = pa.table({"trial_id": ["b", "a"], "point": [0, 1]}).replace_schema_metadata(
        PROVENANCE
    )
    store.write_plan(first.to_reader())
    assert store.read_plan().equals(first, check_metadata=True)
    with full_disk(monkeypatch, "replace"), pytest.raises(StoreError):
        store.write_plan(first.slice(1).to_reader())
    assert store.read_plan().equals(first, check_metadata=True)
    store.write_plan(first.slice(1).to_reader())
    assert store.read_plan().num_rows == 1
    (store.folder / "plan.parquet").write_bytes(b"PAR1")
    with pytest.raises(
        StoreError, match=r"plan.parquet: cannot be read .*launch the study again"
    ):
        store.read_plan()


def build(results: list[str]) -> dict[str, pa.Table]:
    return {"trials": trials(dict.fromkeys(results, "ok"))}


def test_what_a_search_has_asked_for_is_in_its_plan(tmp_path: Path) -> None:
    """In its order, with its metadata; trials may be in it several times, or never."""
    store = Store(tmp_path / "study")
    plan = pa.table({"trial_id": ["b", "c", "a"], "point": [0, 1, 2]})
    plan = plan.replace_schema_metadata(PROVENANCE)
    asked = pa.table(
        {
            "run": ["x", "y", "x", "x"],
            "trial_id": ["a", "b", "a", "b"],
            "block": [*"1234"],
        }
    ).replace_schema_metadata({b"search": b"{}"})
    store.write_plan(plan.to_reader(), asked)
    assert [file.name for file in store.folder.glob("*.parquet")] == ["plan.parquet"]
    assert store.read_plan().equals(plan, check_metadata=True)
    found = store.read_asked()
    assert found is not None
    assert found.select(asked.column_names).equals(asked)
    assert found.schema.metadata == asked.schema.metadata
    store.write_plan(plan.to_reader(), asked.slice(0, 0))
    empty = store.read_asked()
    assert empty is not None
    assert empty.num_rows == 0
    with pytest.raises(ValueError, match="request only trials of the plan"):
        store.write_plan(plan.slice(1).to_reader(), asked)
    store.write_plan(plan.to_reader())
    assert store.read_asked() is None


def test_what_searches_up_to_0_18_have_asked_for_is_read(tmp_path: Path) -> None:
    """It was a file of its own, which goes when the next plan is stored."""
    store = Store(tmp_path / "study")
    plan = pa.table({"trial_id": ["a"]})
    store.write_plan(plan.to_reader())
    asked = plan.append_column("block", pa.array([1]))
    pq.write_table(asked, store.folder / "asked.parquet")
    found = store.read_asked()
    assert found is not None
    assert found.equals(asked)
    store.write_plan(plan.to_reader(), asked)
    assert not (store.folder / "asked.parquet").exists()
    assert store.read_asked() is not None


@pytest.mark.parametrize(
    "column",
    [
        pa.array([1]),
        pa.array([[1]]),
        pa.array([[{"block": 1}]]),
        pa.array([[{"row": 0, "trial_id": "b"}]]),
    ],
)
def test_what_no_search_has_asked_for_is_refused(
    tmp_path: Path, column: pa.Array
) -> None:
    store = Store(tmp_path / "study")
    plan = pa.table({"trial_id": ["a"], "asked for": column})
    store.write_plan(plan.to_reader())
    with pytest.raises(
        StoreError, match="no lists under asked for; delete it and search again"
    ):
        store.read_asked()


def test_a_writer_stores_a_part_when_it_is_full_or_late_and_at_the_end(
    store: Store,
) -> None:
    now = 0.0
    with Writer(store, build, rows=3, seconds=5.0, clock=lambda: now) as writer:
        writer.add(["a", "b"])
        assert store.trial_ids() == {}
        writer.add(["c"])
        assert len(store.trial_ids()) == 3
        now = 4.9
        writer.add(["d"])
        assert len(store.trial_ids()) == 3
        now = 5.0
        writer.add([])
        assert len(store.trial_ids()) == 4
        writer.add(["e"])
        now = 9.9
        writer.add(["f"])
        assert len(store.trial_ids()) == 4
    assert len(store.trial_ids()) == 6
    assert len(part_names(store)) == 3


def test_a_writer_stores_a_part_when_its_results_are_large(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer_module, "MOST_BYTES", 10)
    with Writer(store, build, size=len, clock=lambda: 0.0) as writer:
        writer.add(["four", "five5"])
        assert store.trial_ids() == {}
        writer.add(["six"])
        assert len(store.trial_ids()) == 3


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_writer_keeps_what_is_done_when_something_is_raised(
    store: Store, error: type[BaseException]
) -> None:
    def interrupted() -> None:
        with Writer(store, build) as writer:
            writer.add(["a"])
            raise error

    with pytest.raises(error):
        interrupted()
    assert store.trial_ids() == {"a": "ok"}


def test_a_writer_holds_on_to_what_could_not_be_stored(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Writer(store, build, rows=2) as writer:
        with full_disk(monkeypatch, "replace"), pytest.raises(StoreError):
            writer.add(["a", "b"])
        writer.add(["c"])
    assert set(store.trial_ids()) == {"a", "b", "c"}
    assert len(part_names(store)) == 1


STEPS = st.one_of(
    st.tuples(
        st.just("append"),
        st.dictionaries(st.sampled_from("abcdef"), st.sampled_from("xyz"), min_size=1),
    ),
    st.tuples(
        st.just("other"),
        st.dictionaries(st.sampled_from("abcdef"), st.just("o"), min_size=1),
    ),
    st.tuples(st.just("compact"), st.integers(1, 8)),
)


@settings(max_examples=25, deadline=None)
@given(steps=st.lists(STEPS, max_size=7))
def test_any_history_reads_like_a_dictionary(
    tmp_path_factory: pytest.TempPathFactory, steps: list[tuple[str, Any]]
) -> None:
    """`other` appends a part of another provenance and without series."""
    folder = tmp_path_factory.mktemp("history")
    model: dict[str, str] = {}
    with_series: dict[str, str] = {}
    for step, value in steps:
        store = Store(folder)
        if step == "compact":
            store.compact(value)
            continue
        model |= value
        if step == "append":
            append(store, value)
            with_series |= value
        else:
            store.append({"trials": trials(value, {"spec": "other"})})
            with_series = {
                key: status for key, status in with_series.items() if key not in value
            }
    store = Store(folder)
    assert store.trial_ids() == model
    assert sorted(store.read("trials")["trial_id"].to_pylist()) == sorted(model)
    frames = store.read("series", columns=["trial_id", "value"]).sort_by("trial_id")
    rows = list(zip(*(column.to_pylist() for column in frames.columns), strict=True))
    assert rows == [pair for pair in sorted(with_series.items()) for _ in range(2)]
