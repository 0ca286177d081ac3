"""Trials of own code on workers that do not have its files, in shares, and with results
in an object store: the same numbers.
"""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from sweep.campaigns.launching import launch
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.store.shares import Share
from sweep.store.stored_code import kept_code
from sweep.tables.stored_study import StoredStudy
from sweep.workers import worker
from sweep.workers.cluster import Dask
from sweep.workers.executors import ExecutorFactory, Loky
from tests.cluster.started import TESTS, cluster
from tests.commands import sweep
from tests.object_stores import object_store
from tests.own_models import OTHER_RULE, OTHER_WORDS, edited, written
from tests.studies import launched, read, relaunch, same


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    """The study after one launch in this process."""
    folder = tmp_path_factory.mktemp("whole")
    return launched(written(folder), folder / "results")


def without_files(spec: Path, results: Path, engine: ExecutorFactory) -> StoredStudy:
    """The study after a launch in whose beginning its files were deleted."""
    study = read(spec)
    shutil.rmtree(spec.parent)
    launch(study, results, engine)
    return StoredStudy(study.name, results)


@pytest.fixture
def engines() -> Iterator[list[ExecutorFactory]]:
    """Engines that a test has made; all are stopped."""
    made: list[ExecutorFactory] = []
    yield made
    for engine in made:
        engine.stop()


@pytest.mark.slow
def test_workers_need_no_file_of_the_study(
    whole: StoredStudy, tmp_path: Path, engines: list[ExecutorFactory]
) -> None:
    engines.append(Loky(2))
    spec = written(tmp_path / "here")
    assert same(without_files(spec, tmp_path / "results", engines[0]), whole)


@pytest.mark.slow
def test_workers_of_a_cluster_run_one_version_after_the_other(
    whole: StoredStudy, tmp_path: Path, engines: list[ExecutorFactory]
) -> None:
    """In a folder without the files; an edit reaches workers that have run the model
    before.
    """
    (tmp_path / "there").mkdir()
    spec = written(tmp_path / "other", OTHER_RULE)
    turned = launched(spec, tmp_path / "turned")
    with cluster(tmp_path / "there", 1, **TESTS) as made:
        engines.append(Dask(made.address))
        first = written(tmp_path / "first")
        one = without_files(first, tmp_path / "one", engines[0])
        other = without_files(spec, tmp_path / "two", engines[0])
    assert same(one, whole)
    assert same(other, turned)
    assert not same(one, other)


def test_a_worker_of_a_cluster_compiles_each_version_before_its_trials(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else the compilation would count as time of a trial."""
    warmed = []
    monkeypatch.setattr("sweep.trial.warm", warmed.append)
    monkeypatch.setattr(worker, "_compiled", set())
    jobs = []
    for name, changes in (("first", ()), ("second", (OTHER_RULE,))):
        study = read(written(tmp_path / name, *changes))
        jobs.append(Jobs(study, expand(study))[0])
    worker.compile_ahead([*jobs, *jobs])
    assert warmed == jobs


@pytest.mark.parametrize("shared", [True, False], ids=["one place", "own places"])
def test_shares_in_folders_of_their_own_add_up_to_one_launch(
    whole: StoredStudy, tmp_path: Path, shared: bool
) -> None:
    """Each with its own copy of the spec and the files, of which one has other words;
    the results lie in one place, or are copied into one. There are as many shares, at
    least three, as it takes that two have trials: the code of a share without is that
    of no trial.
    """
    results, ids = tmp_path / "results", whole.plan["trial_id"].to_pylist()
    filled: list[int] = []
    of = 2
    while len(filled) < 2:
        of += 1
        shares = range(1, of + 1)
        filled = [number for number in shares if Share(number, of).has(ids).any()]
    for number in shares:
        folder = tmp_path / f"folder-{number}"
        written(folder, *(OTHER_WORDS if number == filled[-1] else ()))
        place = results if shared else folder / "results"
        asked = f"--shard={number}/{of}"
        done = sweep(folder, "launch", "drawn.yaml", asked, f"--results={place}")
        assert done.returncode == 0, done.stderr
        if not shared:
            shutil.copytree(place, results, dirs_exist_ok=True)
    found = StoredStudy("drawn", results)
    assert found.statuses() == {"done": 6}
    assert same(found, whole)
    done = sweep(tmp_path / "folder-1", "launch", "drawn.yaml", f"--results={results}")
    assert "nothing was missing" in done.stderr
    options = ("drawn", "--fraction=1", f"--results={results}")
    assert "6 of 6 bitwise identical" in sweep(tmp_path, "verify", *options).stdout
    assert (
        "go         nothing"
        in sweep(tmp_path, "gc", "drawn", "--dry-run", f"--results={results}").stdout
    )


@pytest.mark.slow
def test_an_object_store_keeps_the_code_too(whole: StoredStudy, tmp_path: Path) -> None:
    """Damage is mended, and what computed nothing goes, as in a folder."""
    spec = written(tmp_path)
    with object_store() as server:
        place, results = server.url("own"), server.results("own")
        option = f"--results={place}"

        def said(*arguments: str) -> str:
            done = sweep(tmp_path, *arguments, option)
            assert done.returncode == 0, done.stderr
            return done.stdout + done.stderr

        assert "6 done" in said("launch", "drawn.yaml")
        stored = StoredStudy("drawn", results)
        assert same(stored, whole)
        assert "rightwards" in said("table", "drawn")
        trial = stored.plan["trial_id"][0].as_py()
        assert "identical to the stored values" in said("replay", "drawn", trial)
        [sha] = kept_code(stored.store)
        stored.store.place.remove(f"code-{sha}.json")
        assert sweep(tmp_path, "table", "drawn", option).returncode == 2
        assert "nothing was missing" in said("launch", "drawn.yaml")
        assert "rightwards" in said("table", "drawn")
        edited(tmp_path, *OTHER_RULE)
        assert relaunch(spec, results).statuses.total() == 6
        assert len(kept_code(stored.store)) == 2
        assert "1 versions of custom code" in said("gc", "drawn", "--yes")
        assert len(kept_code(stored.store)) == 1
        assert sha not in kept_code(stored.store)
        assert "6 of 6 bitwise identical" in said("verify", "drawn", "--fraction=1")
