"""A study is packed into one file, and loaded from it as it was."""

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import ZipFile

import duckdb
import pandas as pd
import pytest

import sweep as package
from sweep.errors import ChoiceError, OutputError, StoreError
from sweep.sharing.content import content_hash
from sweep.sharing.packed_file import Member, write_packed
from sweep.sharing.packing import pack
from sweep.sharing.unpacking import unpack
from sweep.spec.study_folder import launched_studies
from sweep.store.folders import Folder
from sweep.store.locations import Location
from sweep.store.lock import Lock
from sweep.store.lock_files import LockFiles
from sweep.store.store import Store
from sweep.store.whole_studies import rename_study
from sweep.tables.stored_study import StoredStudy
from tests.cases import slow_but
from tests.commands import sweep
from tests.faults.crash_states import NOBODY
from tests.store.test_whole_studies import (
    Crashed,
    crashing,
    files,
    in_memory,
    studies,
    study_of,
)
from tests.studies import COVERING, OWN_SMALL, SMALL, launched, relaunch

EXTENDED = SMALL.replace("[0.5, 1]", "[0.5, 1, 2]")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results with three studies: one of several parts, of which some trials have left
    the spec; one of own code; one with heatmaps.
    """
    results = tmp_path_factory.mktemp("packed") / "results"
    relaunch(EXTENDED.replace("[0.5, 1, 2]", "[0.5, 3]"), results)
    relaunch(EXTENDED, results)
    relaunch(OWN_SMALL.replace("study: small", "study: own"), results)
    relaunch(COVERING, results)
    return results


@pytest.mark.parametrize(
    "study", slow_but(["small", "own"], ["small", "own", "covering"])
)
def test_a_round_trip_keeps_every_byte(
    study: str, results: Path, tmp_path: Path
) -> None:
    stored = StoredStudy(study, results)
    packed = pack(stored, tmp_path / "x.zip")
    done = unpack(packed.path, tmp_path / "other", "deep/er")
    assert (done.launched_as, done.own_code) == (study, study == "own")
    assert files(tmp_path / "other" / "deep" / "er") == files(results / study)
    again = StoredStudy("deep/er", tmp_path / "other")
    pd.testing.assert_frame_equal(
        again.trials.drop(columns="replay"), stored.trials.drop(columns="replay")
    )
    assert content_hash(again) == content_hash(stored)
    assert [path.name for path in (tmp_path / "other").iterdir()] == ["deep"]


def test_a_loaded_study_goes_on_under_its_name(results: Path, tmp_path: Path) -> None:
    pack(StoredStudy("own", results), tmp_path / "x.zip")
    assert unpack(tmp_path / "x.zip", tmp_path / "results").study == "own"
    for command in (("table", "own"), ("plot", "own", "curves"), ("status", "own")):
        assert sweep(tmp_path, *command).returncode == 0, command
    assert "same" in sweep(tmp_path, "verify", "own").stdout
    spec = OWN_SMALL.replace("study: small", "study: own")
    assert not relaunch(spec, tmp_path / "results").statuses
    assert (
        len(
            relaunch(
                spec.replace("replicates: 3", "replicates: 4"), tmp_path / "results"
            ).statuses
        )
        == 1
    )


def test_the_same_study_gives_the_same_bytes(results: Path, tmp_path: Path) -> None:
    one, other = (
        pack(StoredStudy("small", results), tmp_path / name)
        for name in ("a.zip", "b.zip")
    )
    assert one.sha256 == other.sha256
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    assert one.apart == 3
    assert pack(StoredStudy("own", results), tmp_path / "c.zip").apart == 0


def test_a_stranger_reads_it_without_the_program(results: Path, tmp_path: Path) -> None:
    study = StoredStudy("small", results)
    pack(study, tmp_path / "x.zip")
    with ZipFile(tmp_path / "x.zip") as archive:
        archive.extractall(tmp_path / "x")
    listed = (tmp_path / "x" / "SHA256SUMS").read_text().splitlines()
    there = {
        name.relative_to(tmp_path / "x").as_posix()
        for name in (tmp_path / "x").rglob("*")
        if name.is_file()
    }
    assert {line[66:] for line in listed} | {"SHA256SUMS"} == there
    check = ["sha256sum", "--quiet", "-c", "SHA256SUMS"]
    assert subprocess.run(check, cwd=tmp_path / "x", check=True).returncode == 0
    rows = pd.read_csv(tmp_path / "x" / "tables" / "trials.csv")
    assert rows["trial_id"].tolist() == study.trials["trial_id"].tolist()
    assert rows["speed"].tolist() == study.trials["speed"].tolist()
    about = pd.read_csv(
        tmp_path / "x" / "tables" / "columns.csv", keep_default_na=False
    )
    assert about.query("column == 'speed' and table == 'trials'")["unit"].tolist() == [
        "px/step"
    ]
    readme = (tmp_path / "x" / "README.md").read_text()
    query = readme.split("```sql\n")[1].split("```")[0]
    query = query.replace("'study/", f"'{tmp_path / 'x' / 'study'}/")
    found = duckdb.sql(query).df().set_index("trial_id")
    ids = study.trials["trial_id"]
    assert len(found) == len(ids) == 9
    assert found.loc[ids, "speed"].tolist() == study.trials["speed"].tolist()


def test_the_description_for_machines_is_whole(results: Path, tmp_path: Path) -> None:
    """What RO-Crate 1.2 asks of its metadata file and of the root data entity."""
    pack(StoredStudy("own", results), tmp_path / "x.zip")
    with ZipFile(tmp_path / "x.zip") as archive:
        crate = json.loads(archive.read("ro-crate-metadata.json"))
        names = archive.namelist()
    by_id = {one["@id"]: one for one in crate["@graph"]}
    assert len(by_id) == len(crate["@graph"])
    assert crate["@context"] == "https://w3id.org/ro/crate/1.2/context"
    descriptor, root = by_id["ro-crate-metadata.json"], by_id["./"]
    assert descriptor["conformsTo"] == {"@id": "https://w3id.org/ro/crate/1.2"}
    assert descriptor["about"] == {"@id": "./"}
    assert all(root[key] for key in ("name", "description", "license"))
    assert len(root["datePublished"]) == len("2026-11-22")
    parts = [one["@id"] for one in root["hasPart"]]
    assert all(
        one in names or any(name.startswith(one) for name in names) for one in parts
    )
    inside = set(names) - {"ro-crate-metadata.json"}
    assert all(
        any(name.startswith(one) for one in parts) or name.startswith("study/code-")
        for name in inside
    )
    referred = [
        one["@id"]
        for entity in by_id.values()
        for value in entity.values()
        for one in (value if isinstance(value, list) else [value])
        if isinstance(one, dict)
    ]
    assert {one for one in referred if not one.startswith("https:")} <= by_id.keys()


def test_a_renamed_study_is_packed_under_its_present_name(tmp_path: Path) -> None:
    launched(SMALL, tmp_path / "results")
    rename_study("small", "other", tmp_path / "results")
    packed = package.pack("other", tmp_path / "x.zip", tmp_path / "results")
    done = unpack(packed, tmp_path / "new")
    assert (done.study, done.launched_as) == ("other", "small")


def test_equal_numbers_have_an_equal_hash(results: Path, tmp_path: Path) -> None:
    """Whatever the parts, the name and the wall times; other numbers have another."""
    known = content_hash(StoredStudy("small", results))
    fresh = launched(EXTENDED.replace("study: small", "study: other"), tmp_path)
    assert content_hash(fresh) == known
    assert content_hash(launched(SMALL, tmp_path)) != known
    seeded = EXTENDED.replace("study: small", "study: third")
    assert (
        content_hash(launched(seeded.replace("seed: 5", "seed: 6"), tmp_path)) != known
    )


def test_what_cannot_be_packed_is_said(results: Path, tmp_path: Path) -> None:
    study = StoredStudy("small", results)
    with pytest.raises(ChoiceError, match="only a whole study can be packed"):
        pack(study.where(separation_weight=1), tmp_path / "x.zip")
    with pytest.raises(OutputError, match=r'unknown kind of file ".tar"'):
        pack(study, tmp_path / "x.tar")
    (tmp_path / "x.zip").write_bytes(b"mine")
    with pytest.raises(OutputError, match="exists already; --force replaces it"):
        pack(study, tmp_path / "x.zip")
    planned = launched(SMALL, tmp_path)
    for part in planned.store.current_parts():
        planned.store.discard(part)
    with pytest.raises(ChoiceError, match="no trials are stored"):
        pack(StoredStudy("small", tmp_path), tmp_path / "y.zip")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["small", "x.zip"]


def test_a_part_that_is_merged_meanwhile_is_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The members that were written before are forgotten."""
    study = launched(SMALL, tmp_path)
    whole, parts, written = content_hash(study), study.store.all_parts(), list[int]()

    def merging(file: BinaryIO, members: Mapping[str, Member]) -> None:
        if not written:
            Store(study.store.folder).merge(parts, {})
        written.append(1)
        write_packed(file, members)

    monkeypatch.setattr("sweep.sharing.packing.write_packed", merging)
    pack(study, tmp_path / "x.zip")
    assert len(written) == 2
    unpack(tmp_path / "x.zip", tmp_path / "new")
    assert content_hash(StoredStudy("small", tmp_path / "new")) == whole


def test_it_is_packed_from_an_object_store_and_loaded_into_one(
    results: Path, tmp_path: Path
) -> None:
    _, place = in_memory(results)
    packed = pack(StoredStudy("own", place), tmp_path / "x.zip")
    assert packed.sha256 == pack(StoredStudy("own", results), tmp_path / "y.zip").sha256
    empty = tmp_path / "empty"
    empty.mkdir()
    memory, target = in_memory(empty)
    unpack(packed.path, target)
    prefix = "bucket/results/own/"
    stored = {key.removeprefix(prefix): value for key, value in memory.objects.items()}
    assert stored == files(results / "own")


@pytest.mark.parametrize(
    "last", slow_but(["plan.parquet"], ["parts", "spec.yaml", "plan.parquet"])
)
def test_what_is_loaded_counts_only_when_all_is_there(
    last: str, results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what was interrupted leaves nothing behind."""
    pack(StoredStudy("small", results), tmp_path / "x.zip")
    commit, put = Folder.commit, Folder.put

    def committed(place: Folder, staged: Path, name: str) -> Location:
        if last == "parts":
            raise Crashed
        return commit(place, staged, name)

    def stored(place: Folder, staged: Path) -> None:
        assert launched_studies(tmp_path / "results") == []
        if staged.name == last:
            raise Crashed
        put(place, staged)

    with monkeypatch.context() as patch:
        patch.setattr(Folder, "commit", committed)
        patch.setattr(Folder, "put", stored)
        with pytest.raises(Crashed):
            unpack(tmp_path / "x.zip", tmp_path / "results")
    assert [*(tmp_path / "results").rglob("*")] == []
    unpack(tmp_path / "x.zip", tmp_path / "results")
    assert launched_studies(tmp_path / "results") == ["small"]


@contextmanager
def killed(after: int) -> Iterator[None]:
    """Inside, a process that is no more stores so many parts and files in a folder,
    and is killed: nothing is tidied up.
    """
    number = count()

    def ending(original: Callable[..., Any]) -> Callable[..., Any]:
        def store(*arguments: Any) -> Any:
            if next(number) >= after:
                raise Crashed
            return original(*arguments)

        return store

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("os.getpid", lambda: NOBODY)
        for name in ("commit", "put"):
            patch.setattr(Folder, name, ending(getattr(Folder, name)))
        for owner, name in (
            *((Folder, "delete"), (Folder, "left"), (LockFiles, "withdraw")),
            (shutil, "rmtree"),
        ):
            patch.setattr(owner, name, lambda *_, **__: None)
        yield


def test_loading_goes_on_wherever_it_was_killed(results: Path, tmp_path: Path) -> None:
    pack(StoredStudy("small", results), tmp_path / "x.zip")
    place, whole = tmp_path / "results", files(results / "small")
    for after in range(len(whole)):
        try:
            with killed(after):
                unpack(tmp_path / "x.zip", place)
            break
        except Crashed:
            assert launched_studies(place) == []
            assert [*(place / "small" / "writing").iterdir()] != []
        with suppress(Crashed), killed(after):  # the next process, too
            unpack(tmp_path / "x.zip", place)
        if not launched_studies(place):
            unpack(tmp_path / "x.zip", place)
        Store(place / "small").tidy()
        shutil.rmtree(place / "small" / "lock", ignore_errors=True)
        assert files(place / "small") == whole
        shutil.rmtree(place)
    assert after >= 4


@pytest.mark.slow
def test_loading_goes_on_after_any_request_to_an_object_store(
    results: Path, tmp_path: Path
) -> None:
    pack(StoredStudy("own", results), tmp_path / "x.zip")
    (tmp_path / "empty").mkdir()
    for after in count():
        memory, place = in_memory(tmp_path / "empty")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("os.getpid", lambda: NOBODY)
            over = crashing(memory, after, partial(unpack, tmp_path / "x.zip", place))
        if over:
            break
        if not studies(memory):
            unpack(tmp_path / "x.zip", place)
        assert study_of(memory, "own") == files(results / "own")
    assert after > 8


@pytest.mark.parametrize("what", ["parts", "spec.yaml", "figures/drawn.svg"])
def test_loading_goes_on_over_nothing_else(
    what: str, results: Path, tmp_path: Path
) -> None:
    """What is left of another study may have been computed by somebody."""
    pack(StoredStudy("small", results), tmp_path / "x.zip")
    place = tmp_path / "results"
    if what == "parts":
        relaunch(SMALL.replace("seed: 5", "seed: 6"), place)
        (place / "small" / "plan.parquet").unlink()
    else:
        (place / "small" / what).parent.mkdir(parents=True)
        (place / "small" / what).write_text("mine")
    before = files(place)
    with pytest.raises(StoreError, match=r'without a plan; "sweep rm small" deletes'):
        unpack(tmp_path / "x.zip", place)
    assert files(place) == before


def test_a_place_that_is_taken_or_launched_into_stays(
    results: Path, tmp_path: Path
) -> None:
    pack(StoredStudy("small", results), tmp_path / "x.zip")
    before = files(results)
    with pytest.raises(StoreError, match="small: exists already; --as NAME loads"):
        unpack(tmp_path / "x.zip", results)
    with pytest.raises(ChoiceError, match=r"is not allowed.*; --as NAME loads the"):
        unpack(tmp_path / "x.zip", results, "../other")
    with (
        Lock(Store(results / "new", results).place),
        pytest.raises(StoreError, match="this study is being launched by"),
    ):
        unpack(tmp_path / "x.zip", results, "new")
    assert files(results) == before


def test_the_commands_pack_and_load(results: Path, tmp_path: Path) -> None:
    there = f"--results={results}"
    done = sweep(tmp_path, "pack", "small", there)
    assert done.returncode == 0
    assert done.stdout.endswith("  small.zip\n")
    assert "the file also has 3 trials that are not in the last" in done.stderr
    loaded = sweep(tmp_path, "load", "small.zip", "--as", "my/own")
    assert (loaded.returncode, loaded.stdout) == (0, "results/my/own\n")
    assert loaded.stderr == (
        "to resume the study, copy results/my/own/spec.yaml and change the line"
        ' "study: small" of the copy to "study: my/own"; without the change a launch'
        " starts study small\n"
    )
    stored = (tmp_path / "results/my/own/spec.yaml").read_text(encoding="utf-8")
    copy = stored.replace("study: small", "study: my/own")
    (tmp_path / "copy.yaml").write_text(copy, encoding="utf-8")
    assert "nothing was missing" in sweep(tmp_path, "launch", "copy.yaml").stderr
    again = sweep(tmp_path, "load", "small.zip", "--as", "my/own")
    assert again.returncode == 2
    assert again.stderr.startswith("results/my/own: exists already; --as NAME")
    assert sweep(tmp_path, "load", "small.zip").stderr == ""
    launched_on = sweep(tmp_path, "launch", "results/small/spec.yaml")
    assert "nothing was missing" in launched_on.stderr
    for given, said in (("none.zip", "no such file"), ("results", "not an ordinary")):
        lost = sweep(tmp_path, "load", given)
        assert (lost.returncode, lost.stdout) == (2, "")
        assert said in lost.stderr
        assert len(lost.stderr.splitlines()) == 1
    sweep(tmp_path, "pack", "own", there)
    assert "runs only with --trust" in sweep(tmp_path, "load", "own.zip").stderr
    lacking = sweep(tmp_path, "launch", "results/own/spec.yaml")
    assert (lacking.returncode, lacking.stderr.count("\n")) == (2, 1)
    assert "`sweep code STUDY --to FOLDER` writes spec and code of" in lacking.stderr


def test_a_notebook_packs_and_unpacks(results: Path, tmp_path: Path) -> None:
    study = package.load("small", results)
    file = package.pack(study, tmp_path / "x.zip")
    again = package.unpack(file, "again", results=tmp_path)
    assert again.name == "again"
    assert len(again.trials) == len(study.trials)
