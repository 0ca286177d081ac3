"""A whole study is renamed and removed: it is never half there."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from sweep.errors import ChoiceError, StoreError, UserError
from sweep.spec.study_folder import launched_studies
from sweep.store import folders
from sweep.store.buckets import Bucket
from sweep.store.locations import Location, ObjectPath, ObjectServer
from sweep.store.lock import Lock
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.store.whole_studies import remove_study, rename_study
from sweep.tables.stored_study import StoredStudy
from tests.object_stores import Crashed, Memory
from tests.studies import OWN_SMALL, SMALL, launched, relaunch


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results with a study of own code that has two parts."""
    results = tmp_path_factory.mktemp("whole")
    relaunch(OWN_SMALL.replace("replicates: 3", "replicates: 2"), results)
    relaunch(OWN_SMALL, results)
    return results


@pytest.fixture
def results(whole: Path, tmp_path: Path) -> Path:
    shutil.copytree(whole, tmp_path / "results")
    (tmp_path / "results" / "small" / "figures").mkdir()
    (tmp_path / "results" / "small" / "figures" / "curves.png").write_bytes(b"drawn")
    return tmp_path / "results"


def files(folder: Path) -> dict[str, bytes]:
    """All below a folder by its path."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def in_memory(folder: Path) -> tuple[Memory, ObjectPath]:
    """The same results in an object store, and where they are."""
    server, memory = ObjectServer(), Memory()
    server.__dict__["files"] = memory
    named = files(folder).items()
    memory.objects = {f"bucket/results/{name}": content for name, content in named}
    return memory, ObjectPath(server, "bucket/results")


def test_a_renamed_study_is_the_same_to_the_byte(results: Path) -> None:
    before, old = files(results / "small"), StoredStudy("small", results)
    trials, series, code = old.trials, old.series, [*old.own_code]
    assert rename_study("small", "group/other", results) == results / "group" / "other"
    assert files(results / "group" / "other") == before
    assert [path.name for path in results.iterdir()] == ["group"]
    new = StoredStudy("group/other", results)
    assert new.series.equals(series)
    columns = ["replay", "seconds"]
    assert new.trials.drop(columns=columns).equals(trials.drop(columns=columns))
    trial = new.trials["trial_id"].iloc[0]
    assert new.trials["replay"].iloc[0] == f"sweep replay group/other {trial}"
    assert [*new.own_code] == code
    assert rename_study("group/other", "small", results) == results / "small"
    assert [path.name for path in results.iterdir()] == ["small"]


def test_a_launch_under_the_new_name_finds_all_stored(results: Path) -> None:
    rename_study("small", "other", results)
    progress = relaunch(OWN_SMALL.replace("study: small", "study: other"), results)
    assert (progress.statuses.total(), progress.apart) == (0, 0)
    assert launched_studies(results) == ["other"]


@pytest.mark.parametrize(
    ("study", "name", "error", "words"),
    [
        ("none", "other", StoreError, "none: no study has been launched here"),
        ("../small", "other", ChoiceError, "is not allowed: names of letters"),
        ("small", "../other", ChoiceError, "is not allowed: names of letters"),
        ("small", "a/plan.parquet", ChoiceError, "is reserved for files of results"),
        ("small", "x" * 300, ChoiceError, "is not allowed: names of letters"),
        ("small", "small", StoreError, "small: exists already; choose another"),
        ("small", "taken", StoreError, "taken: exists already; choose another"),
        ("small", "small/inner", StoreError, "inner: is inside .*; choose another"),
        ("outer", "other", StoreError, "inner: is another study, .*rename that study"),
    ],
)
def test_what_cannot_be_renamed_stays(
    results: Path, study: str, name: str, error: type[UserError], words: str
) -> None:
    (results / "taken").mkdir()
    shutil.copytree(results / "small", results / "outer")
    shutil.copytree(results / "small", results / "outer" / "inner")
    before = files(results)
    with pytest.raises(error, match=words):
        rename_study(study, name, results)
    assert files(results) == before


def test_what_a_killed_launch_was_writing_is_no_study(results: Path) -> None:
    """Its plan was written and not renamed; or a study was loaded."""
    plan = results / "small" / "plan.parquet"
    unfinished = (
        results / "small" / "writing" / "host-1a2b~7~plan-3c" / plan.name,
        results / "writing" / "host-1a2b~7~packed" / plan.name,
        results / "small" / "writing" / "host-1a2b~7~packed" / "study" / plan.name,
    )
    for path in unfinished:
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(plan, path)
    assert launched_studies(results) == ["small"]
    with pytest.raises(StoreError, match=r'did you mean "small"\? Stored: small$'):
        StoredStudy("smal", results)
    rename_study("small", "other", results)
    assert launched_studies(results) == ["other"]


@pytest.mark.parametrize("share", [None, Share(1, 2)])
@pytest.mark.parametrize(
    "act",
    [
        lambda place: rename_study("small", "other", place),
        lambda place: remove_study("small", place),
    ],
    ids=["rename", "remove"],
)
@pytest.mark.parametrize("store", ["folder", "bucket"])
def test_nothing_is_done_while_a_launch_holds_the_study(
    results: Path, act: Callable[[Location], object], store: str, share: Share | None
) -> None:
    before = files(results)
    memory, bucket = in_memory(results)
    place: Location = results if store == "folder" else bucket
    with (
        Lock(Store(place / "small", place).place, share),
        pytest.raises(StoreError, match="is being launched by"),
    ):
        act(place)
    assert files(results) == before
    assert len(memory.objects) == len(before)


def test_links_are_not_followed(results: Path, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "mine").write_text("precious")
    (results / "group").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match="group: is a symbolic link"):
        rename_study("small", "group/small", results)
    shutil.rmtree(results / "small" / "figures")
    (results / "small" / "figures").symlink_to(tmp_path / "elsewhere")
    assert remove_study("small", results) == []
    (results / "linked").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match="no study has been launched here"):
        remove_study("linked", results)
    assert files(tmp_path / "elsewhere") == {"mine": b"precious"}


def test_all_of_a_study_is_removed_and_nothing_else(results: Path) -> None:
    relaunch(SMALL.replace("study: small", "study: small/inner"), results)
    inner = files(results / "small" / "inner")
    (results / "small" / "notes.txt").write_text("mine")
    assert remove_study("small", results) == ["inner", "notes.txt"]
    assert files(results / "small") == {"notes.txt": b"mine"} | {
        f"inner/{name}": content for name, content in inner.items()
    }
    assert remove_study("small/inner", results) == []
    (results / "small" / "notes.txt").unlink()
    with pytest.raises(StoreError, match="no study has been launched here"):
        remove_study("small", results)


def test_a_removed_study_takes_the_empty_folders_above_it_along(tmp_path: Path) -> None:
    relaunch(SMALL.replace("study: small", "study: a/b/c"), tmp_path / "results")
    assert remove_study("a/b/c", tmp_path / "results") == []
    assert [*(tmp_path / "results").iterdir()] == []


def test_a_damaged_study_can_be_removed(results: Path) -> None:
    (results / "small" / "plan.parquet").write_bytes(b"no parquet")
    next(results.glob("small/parts/*/trials.parquet")).unlink()
    assert remove_study("small", results) == []
    assert [*results.iterdir()] == []


def test_what_cannot_be_deleted_is_said_and_removed_the_next_time(
    results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path, **options: bool) -> None:
        if not options:
            raise PermissionError(1, "Operation not permitted", path)

    with monkeypatch.context() as patch:
        patch.setattr("sweep.store.folders.shutil.rmtree", refuse)
        with pytest.raises(StoreError, match=r"cannot be deleted .Operation"):
            remove_study("small", results)
    assert launched_studies(results) == []
    assert remove_study("small", results) == []


def crashing(memory: Memory, after: int, act: Callable[[], object]) -> bool:
    """Whether `act` ends by itself within so many requests."""
    memory.requests, memory.allowed = 0, after
    try:
        act()
    except Crashed:
        return False
    finally:
        memory.allowed = 10**9
    return True


def studies(memory: Memory) -> list[str]:
    """What has a plan."""
    plans = (key for key in memory.objects if key.endswith("/plan.parquet"))
    return sorted(key.removeprefix("bucket/results/").split("/")[0] for key in plans)


def study_of(memory: Memory, name: str) -> dict[str, bytes]:
    """The objects of a study without its lock."""
    prefix = f"bucket/results/{name}/"
    return {
        key.removeprefix(prefix): content
        for key, content in memory.objects.items()
        if key.startswith(prefix) and not key.startswith(f"{prefix}lock/")
    }


def test_after_a_crash_at_any_request_a_whole_study_is_there_and_renaming_goes_on(
    results: Path,
) -> None:
    whole, states, after, over = files(results / "small"), set(), 0, False
    while not over:
        memory, place = in_memory(results)

        def act(place: ObjectPath = place) -> object:
            return Bucket(place / "small").rename(place / "other")

        over = crashing(memory, after, act)
        there = studies(memory)
        states.add(tuple(there))
        assert there
        for name in there:
            assert study_of(memory, name) == whole
        if "small" in there:
            act()
        assert study_of(memory, "other") == whole
        after += 1
    assert states == {("small",), ("other", "small"), ("other",)}


def test_after_a_crash_at_any_request_removing_goes_on(results: Path) -> None:
    whole, after, over = files(results / "small"), 0, False
    while not over:
        memory, place = in_memory(results)

        def act(place: ObjectPath = place) -> object:
            return Bucket(place / "small").delete()

        over = crashing(memory, after, act)
        left = study_of(memory, "small")
        assert over or "plan.parquet" not in left or left == whole
        for part in Store(place / "small", place).all_parts():
            tables = {name for name in whole if name.startswith(f"parts/{part.name}/")}
            assert tables <= left.keys()
        if study_of(memory, "small"):
            act()
        assert study_of(memory, "small") == {}
        after += 1
    assert after > 10


def test_another_study_in_an_object_store_is_not_overwritten(results: Path) -> None:
    relaunch(SMALL.replace("study: small", "study: other"), results)
    memory, place = in_memory(results)
    before = dict(memory.objects)
    with pytest.raises(StoreError, match=r"s3://.*/other: exists already"):
        rename_study("small", "other", place)
    assert memory.objects == before


def test_a_study_without_a_trial_is_not_overwritten_either(results: Path) -> None:
    """Its plan has the name of ours, and another size."""
    memory, place = in_memory(results)
    memory.objects["bucket/results/other/plan.parquet"] = b"of somebody else"
    before = dict(memory.objects)
    with pytest.raises(StoreError, match=r"s3://.*/other: exists already"):
        rename_study("small", "other", place)
    assert memory.objects == before


@pytest.mark.parametrize("moment", ["make_folders", "rename"])
def test_a_folder_that_cannot_be_renamed_stays_where_it_is(
    results: Path, moment: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = files(results)

    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        if moment == "make_folders":
            real = folders.make_folders
            patch.setattr(
                folders,
                "make_folders",
                lambda path: refuse() if path.name == "group" else real(path),
            )
        else:
            patch.setattr(os, "rename", refuse)
            patch.setattr(Path, "rename", refuse)
        with pytest.raises(StoreError, match="No space left on device"):
            rename_study("small", "group/other", results)
    assert files(results) == before
    assert launched(OWN_SMALL, results).statuses() == {"done": 6}


def test_what_is_not_in_an_object_store_is_said_with_what_is(results: Path) -> None:
    _, bucket = in_memory(results)
    said = (
        "s3://bucket/results/smal: no study has been launched here; did you mean"
        ' "small"? Stored: small'
    )
    for act in (
        StoredStudy,
        remove_study,
        lambda *of: rename_study(*of[:1], "x", of[1]),
    ):
        with pytest.raises(StoreError) as raised:
            act("smal", bucket)
        assert str(raised.value) == said
