"""Parts, plans and claims that somebody has made up: one
sentence each, or set aside.
"""

import errno
import json
import os
import pickle
import re
import secrets
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from sweep.campaigns.launching import launch
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import StoreError, UnreachableError, UnreadableError
from sweep.methods.search.strategy import search
from sweep.spec.study import parse_spec
from sweep.store import bounds, manifest, regular
from sweep.store.bounds import FREE_ROWS, excess_rows
from sweep.store.manifest import MANIFEST, damage
from sweep.store.origin import ALONE, COMPUTED, LATER, PART, PLAN, PROVENANCE
from sweep.store.parquet import opened
from sweep.store.store import Store
from sweep.tables.cleaning import find_waste
from sweep.tables.stored_study import StoredStudy
from sweep.tables.trial_rows import origins, stored_trials
from sweep.workers.executors import Serial
from tests.attacks.hostile import give
from tests.cases import slow_but
from tests.commands import sweep
from tests.searches import TINY
from tests.studies import SMALL, relaunch

SMALL_FILE = 1_000_000
"""Bytes; the provenance of an edited checkout has its diff, of up to 200,000 signs."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results with one small study, and one whose part has been merged."""
    results = tmp_path_factory.mktemp("whole") / "results"
    relaunch(SMALL, results)
    relaunch(SMALL.replace("study: small", "study: merged"), results)
    store = Store(results / "merged")
    store.merge(store.all_parts(), {})
    return results


@pytest.fixture
def results(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "results"))


def part_of(results: Path, study: str = "small") -> Path:
    return next((results / study / "parts").iterdir())


def resealed(part: Path, trials: int = 6) -> None:
    """The manifest says what the files are now."""
    contents = {
        file.name: file.read_bytes() for file in part.iterdir() if file.name != MANIFEST
    }
    files = {
        name: {"bytes": len(content), "crc32": zlib.crc32(content)}
        for name, content in contents.items()
    }
    (part / MANIFEST).write_text(json.dumps({"trials": trials, "files": files}))


def set_aside(results: Path, study: str = "small") -> bool:
    """Whether a launch sets the one part aside, and runs its trials again."""
    before = part_of(results, study).name
    spec = SMALL.replace("study: small", f"study: {study}")
    new = relaunch(spec, results).statuses.total()
    assert StoredStudy(study, results).statuses() == {"done": 6}
    return new == 6 and (results / study / "damaged" / before).exists()


def packed(path: Path, table: pa.Table, rows: int) -> None:
    """Write so many rows like the first of a table, which takes next to nothing."""
    one = table.slice(0, 1)
    columns = [pa.repeat(column[0], 1_000_000) for column in one.columns]
    block = pa.Table.from_arrays(columns, schema=one.schema)
    with pq.ParquetWriter(path, one.schema, compression="zstd") as writer:
        for start in range(0, rows, 1_000_000):
            writer.write_table(block.slice(0, min(1_000_000, rows - start)))


@pytest.fixture
def unread(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever reads the content of a table fails."""

    def read(*_arguments: Any, **_options: Any) -> None:
        raise AssertionError("a table was read")

    for name in ("read", "read_row_group", "iter_batches"):
        monkeypatch.setattr(pq.ParquetFile, name, read)


@pytest.mark.usefixtures("unread")
def test_a_small_plan_with_many_rows_is_not_read(results: Path) -> None:
    file = results / "small" / "plan.parquet"
    with pytest.MonkeyPatch.context() as patch:
        patch.undo()
        schema = pq.read_schema(file)
    row = pa.table(
        {
            name: pa.array([None], kind)
            for name, kind in zip(schema.names, schema.types, strict=True)
        }
    )
    packed(file, row.cast(schema), 3_000_000)
    assert file.stat().st_size < SMALL_FILE
    with pytest.raises(
        StoreError,
        match=(
            r"plan.parquet: cannot be read \(3,000,000 rows with an id each cannot fit"
        ),
    ):
        StoredStudy("small", results)


@pytest.mark.parametrize("sealed", [True, False])
def test_a_small_part_with_many_rows_counts_as_damaged(
    results: Path, sealed: bool
) -> None:
    file = part_of(results) / "trials.parquet"
    packed(file, pq.read_table(file).select(["trial_id", "status"]), 2_000_000)
    (
        resealed(part_of(results), 2_000_000)
        if sealed
        else (part_of(results) / MANIFEST).unlink()
    )
    with pytest.raises(
        StoreError, match="2,000,000 rows with an id each cannot fit in"
    ):
        Store(results / "small").trial_ids()
    assert set_aside(results)


def test_what_unpacks_to_more_than_the_machine_has_is_not_read(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = part_of(results) / "series.parquet"
    packed(file, pq.read_table(file), 3_000_000)
    assert file.stat().st_size < SMALL_FILE
    monkeypatch.setattr(bounds, "_memory", lambda: 60_000_000)
    words = (
        r"unpacks to 72,000,000 bytes; this machine has 60,000,000 bytes; use a"
        r" machine with more memory"
    )
    with pytest.raises(StoreError, match=words):
        _ = StoredStudy("small", results).series


def test_what_this_machine_cannot_hold_is_no_damage(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bounds, "_memory", lambda: 1000)
    with pytest.raises(StoreError, match="use a machine with more memory"):
        relaunch(SMALL, results)
    monkeypatch.undo()
    assert relaunch(SMALL, results).statuses.total() == 0


@pytest.mark.parametrize("name", ["._trials.parquet", "out.parquet", "notes.txt"])
def test_what_else_lies_in_a_part_costs_nothing(results: Path, name: str) -> None:
    """As macOS leaves beside files of a share, or a user who writes there."""
    relaunch(SMALL.replace("[0.5, 1]", "[2]"), results)
    for part in (results / "small" / "parts").iterdir():
        (part / name).write_text("mine")
    assert (
        relaunch(SMALL.replace("[0.5, 1]", "[0.5, 1, 2]"), results).statuses.total()
        == 0
    )
    assert StoredStudy("small", results).statuses() == {"done": 9}


@pytest.mark.parametrize("error", [errno.EMFILE, errno.EACCES, errno.ESTALE])
@pytest.mark.parametrize("name", ["manifest.json", "trials.parquet"])
def test_what_cannot_be_read_now_is_no_damage(
    results: Path, monkeypatch: pytest.MonkeyPatch, name: str, error: int
) -> None:
    open_regular = regular.open_regular

    def opened_badly(path: Path, *flags: int) -> Any:
        if path.name == name:
            raise OSError(error, os.strerror(error))
        return open_regular(path, *flags)

    monkeypatch.setattr(regular, "open_regular", opened_badly)
    with pytest.raises(
        StoreError, match=rf"{name}: cannot be read .*; nothing was set aside"
    ):
        relaunch(SMALL, results)
    monkeypatch.undo()
    assert relaunch(SMALL, results).statuses.total() == 0


UNTIL = "replicates: {until: {metric: speed, half_width: 1.0e-9}, min: 3, max: 4}"


@pytest.mark.parametrize(
    ("spec", "run", "metric"),
    [
        (TINY.replace("budget: 30", "budget: 4"), search, "flock_radius"),
        (SMALL.replace("replicates: 3", UNTIL), launch, "speed"),
    ],
    ids=["search", "until"],
)
def test_texts_in_the_place_of_numbers_are_one_sentence_for_those_who_go_on(
    tmp_path: Path, spec: str, run: Callable[..., object], metric: str
) -> None:
    """A search knows its trials by their numbers, and a rule adds trials by them."""
    study = parse_spec(spec)
    run(study, tmp_path, Serial())
    give(tmp_path / study.name, **{metric: "evil"})
    with pytest.raises(
        StoreError,
        match=f'the stored trials are not what a launch writes: column "{metric}"',
    ):
        run(study, tmp_path, Serial())


def test_an_honest_plan_of_any_size_is_read(tmp_path: Path) -> None:
    """Ids of trials take twelve bytes each, however well they are packed."""
    ids = [secrets.token_hex(12) for _ in range(2 * FREE_ROWS)]
    store = Store(tmp_path / "study")
    plan = pa.table({"trial_id": ids, "point": ["p"] * len(ids)})
    store.write_plan(plan.to_reader())
    assert store.read_plan().num_rows == len(ids)
    file = tmp_path / "study" / "plan.parquet"
    assert file.stat().st_size > 12 * len(ids)
    with opened(file) as content:
        assert (
            excess_rows("plan.parquet", content.metadata, 8 * (len(ids) - FREE_ROWS))
            == ""
        )
        assert excess_rows(
            "plan.parquet", content.metadata, 8 * (len(ids) - FREE_ROWS) - 8
        )


def test_a_small_plan_with_long_lists_is_not_read(tmp_path: Path) -> None:
    store, rows = Store(tmp_path / "study"), 2_000_000
    kind = pa.list_(pa.struct([("row", pa.int64())]))
    lists = pa.array([[{"row": 0}] * 1000], kind)
    file = tmp_path / "study" / "plan.parquet"
    file.parent.mkdir()
    long = pa.ListArray.from_arrays(
        pa.array([0, rows], pa.int32()), pa.concat_arrays([lists.flatten()] * 2000)
    )
    plan = pa.table({"trial_id": ["a"], "asked for": long})
    pq.write_table(plan, file, compression="zstd")
    assert file.stat().st_size < SMALL_FILE
    with pytest.raises(StoreError, match="2,000,000 values of lists cannot fit in"):
        store.read_asked()


def test_ids_are_what_the_bound_takes_them_for() -> None:
    study = parse_spec(SMALL)
    ids = Jobs(study, expand(study)).table()["trial_id"].to_pylist()
    assert {len(trial) for trial in ids} == {24}
    assert all(set(trial) <= set("0123456789abcdef") for trial in ids)


def changed(file: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """The file, with its provenance changed: in place, or to what `change` returns."""
    table = pq.read_table(file)
    about = json.loads(table.schema.metadata[PROVENANCE])
    new = change(about)
    about = about if new is None else new
    text = about if isinstance(about, bytes) else json.dumps(about).encode()
    pq.write_table(table.replace_schema_metadata({PROVENANCE: text}), file)


def less(name: str) -> Callable[[dict[str, Any]], object]:
    return lambda about: about.pop(name) and None


def other(name: str) -> Callable[[dict[str, Any]], object]:
    return lambda about: about.update(
        {name: 5 if name != "versions" else {"python": 5}}
    )


WRONG: dict[str, Callable[[dict[str, Any]], object]] = {
    "empty": lambda _about: b"",
    "no text": lambda _about: b"\xff\xfe",
    "a number": lambda _about: b"5",
    "a list": lambda _about: b"[]",
    "nothing": lambda _about: b"{}",
    "deep": lambda _about: b"[" * 100_000,
}
OF_PARTS = (
    WRONG
    | {f"no {name}": less(name) for name in PART}
    | {f"other {name}": other(name) for name in PART | COMPUTED}
)
OF_PLANS = OF_PARTS | {f"no {name}": less(name) for name in PLAN | LATER}
OF_PLANS |= {f"other {name}": other(name) for name in PLAN | LATER | ALONE}


def no_metadata(file: Path) -> None:
    pq.write_table(pq.read_table(file).replace_schema_metadata(None), file)


@pytest.mark.parametrize("how", OF_PLANS)
def test_a_plan_that_does_not_say_where_it_comes_from_is_one_sentence(
    results: Path, how: str
) -> None:
    changed(results / "small" / "plan.parquet", OF_PLANS[how])
    with pytest.raises(
        StoreError,
        match=r"plan.parquet: has no valid provenance.*; delete it and launch",
    ):
        StoredStudy("small", results)


@pytest.mark.parametrize("how", slow_but(["deep", "no git", "other code"], OF_PARTS))
def test_a_part_that_does_not_say_where_it_comes_from_is_set_aside(
    results: Path, how: str
) -> None:
    part = part_of(results)
    changed(part / "trials.parquet", OF_PARTS[how])
    resealed(part)
    study = StoredStudy("small", results)
    ids = study.plan["trial_id"].to_pylist()
    for look in (
        find_waste,
        lambda one: origins(one.store, ids),
        lambda one: stored_trials(one.store, ids),
    ):
        with pytest.raises(
            StoreError,
            match=r"trials.parquet: has no valid provenance in its metadata",
        ):
            look(study)
    assert set_aside(results)


def test_without_any_metadata_it_is_the_same(results: Path) -> None:
    no_metadata(part_of(results) / "trials.parquet")
    resealed(part_of(results))
    with pytest.raises(StoreError, match="has no valid provenance"):
        find_waste(StoredStudy("small", results))
    assert set_aside(results)
    no_metadata(results / "small" / "plan.parquet")
    done = sweep(results.parent, "status", "small")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)


@pytest.mark.parametrize("name", ["trial_id", "point", "separation_weight"])
def test_a_plan_without_a_column_that_it_speaks_of_is_one_sentence(
    results: Path, name: str
) -> None:
    file = results / "small" / "plan.parquet"
    pq.write_table(pq.read_table(file).drop_columns([name]), file)
    with pytest.raises(
        StoreError, match=f"plan.parquet: has no column {name}; delete it"
    ):
        StoredStudy("small", results)


@pytest.mark.parametrize("name", ["trial_id", "status"])
@pytest.mark.parametrize("gone", [True, False])
def test_a_part_without_ids_or_statuses_is_set_aside(
    results: Path, name: str, gone: bool
) -> None:
    file = part_of(results) / "trials.parquet"
    table = pq.read_table(file)
    left = table.drop_columns([name])
    pq.write_table(left if gone else left.append_column(name, pa.repeat(1, 6)), file)
    resealed(file.parent)
    assert damage(file.parent) == f"trials.parquet has no column {name} of strings"
    assert set_aside(results)


@pytest.mark.parametrize("name", ["point", "separation_weight", "speed"])
def test_trials_without_a_column_of_the_plan_are_one_sentence(
    results: Path, name: str
) -> None:
    file = part_of(results) / "trials.parquet"
    pq.write_table(pq.read_table(file).drop_columns([name]), file)
    resealed(file.parent)
    done = sweep(results.parent, "table", "small")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert re.match(f'study small: .* no column "?{name}"?', done.stderr)


def test_what_is_wrong_with_a_part_is_said_whole(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With every sign of it, and without the remedy."""
    file, fault = part_of(results) / "trials.parquet", "says: this; and that"
    error = UnreadableError(file, fault, "launch the study again")
    assert str(error) == f"{file}: {fault}; launch the study again"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)

    def refused(*_: object) -> None:
        raise error

    monkeypatch.setattr(manifest, "part_provenance", refused)
    assert damage(part_of(results)) == f"trials.parquet: {fault}"


def test_a_server_that_does_not_answer_is_no_damage(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (part_of(results) / MANIFEST).unlink()  # as in parts of 0.2.0

    def unreachable(*_: object) -> None:
        raise UnreachableError("no answer", None)

    monkeypatch.setattr(manifest, "load_table", unreachable)
    with pytest.raises(UnreachableError):
        damage(part_of(results))


MANIFESTS = [
    "",
    "5",
    "[]",
    "{}",
    "[" * 60_000,
    '{"trials": 6}',
    '{"trials": "6", "files": {}}',
]
MANIFESTS += [
    '{"trials": 6, "files": []}',
    '{"trials": 6, "files": {"trials.parquet": 5}}',
]
MANIFESTS += ['{"trials": 6, "files": {"trials.parquet": {"bytes": "5", "crc32": 5}}}']
MANIFESTS += [
    '{"trials": 6, "files": {"../plan.parquet": {"bytes": 5, "crc32": 5}}}',
    " " * 2**17,
]


@pytest.mark.parametrize("text", MANIFESTS, ids=range(len(MANIFESTS)))
def test_a_manifest_that_is_none_counts_as_damaged(results: Path, text: str) -> None:
    (part_of(results) / MANIFEST).write_text(text)
    assert damage(part_of(results)).startswith(f"{MANIFEST} cannot be read")
    assert set_aside(results)


@pytest.mark.parametrize("trials", [-1, 0, 7, True])
def test_a_manifest_with_another_number_of_trials_counts_as_damaged(
    results: Path, trials: int
) -> None:
    file = part_of(results) / MANIFEST
    file.write_text(json.dumps(json.loads(file.read_text()) | {"trials": trials}))
    assert set_aside(results)


LISTS = ["5", "null", '"x"', "{}", "[5]", '[["x"]]', "[" * 60_000, "", "\xff"]


@pytest.mark.parametrize("text", LISTS, ids=range(len(LISTS)))
def test_a_list_of_replaced_parts_that_is_none_counts_as_damaged(
    results: Path, text: str
) -> None:
    part = part_of(results, "merged")
    (part / "replaces.json").write_text(text, encoding="latin-1")
    resealed(part)
    with pytest.raises(StoreError, match=r"replaces.json: cannot be read"):
        Store(results / "merged").trial_ids()
    assert damage(part).startswith("replaces.json: cannot be read (")
    assert set_aside(results, "merged")


CLAIMS = [
    "5",
    "[]",
    '"x"',
    "[" * 60_000,
    '{"share": 5}',
    '{"process": "x"}',
    '{"who": ["x"]}',
    '{"state": {}}',
]
CLAIMS += [
    '{"process": 1e400}',
    f'{{"process": {"9" * 400}}}',
    '{"machine": 5, "started": 7}',
    "\xff",
    "",
]


@pytest.mark.parametrize("text", CLAIMS, ids=range(len(CLAIMS)))
def test_a_claim_that_is_none_is_that_of_somebody(results: Path, text: str) -> None:
    """As one that was lost with a power cut: it is believed while it may be alive."""
    (results / "small" / "lock").mkdir()
    (results / "small" / "lock" / "0.json").write_text(text, encoding="latin-1")
    with pytest.raises(StoreError, match="this study is being launched by somebody"):
        relaunch(SMALL, results)


@pytest.mark.parametrize(
    "name",
    ["x~1~y", "\x1b[2J~1~y", "99999999999999999999-ab", "x", "00000000000000000001-AB"],
)
def test_a_folder_with_another_name_than_parts_have_is_left_alone(
    results: Path, name: str
) -> None:
    """Even where it is a part otherwise."""
    part = part_of(results)
    shutil.copytree(part, part.with_name(name))
    relaunch(SMALL.replace("replicates: 3", "replicates: 4"), results)
    assert StoredStudy("small", results).statuses() == {"done": 8}
    assert part.with_name(name).exists()
    assert not (results / "small" / "damaged").exists()


def test_after_a_part_of_the_far_future_nothing_is_stored_and_that_is_said(
    results: Path,
) -> None:
    """The next would sort before it, and count for less."""
    part = part_of(results)
    part.rename(part.with_name("0" + "9" * 19 + "-ab"))
    with pytest.raises(
        StoreError,
        match="has a part of the year 2286, which blocks later parts; delete the part",
    ):
        relaunch(SMALL.replace("replicates: 3", "replicates: 4"), results)
