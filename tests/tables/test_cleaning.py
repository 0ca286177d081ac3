"""Cleaning removes what left the spec and nothing else, whenever it is killed."""

import os
import pty
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import StringIO
from itertools import product
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from sweep.errors import StoreError
from sweep.store.lock import Lock
from sweep.store.store import Store
from sweep.tables.cleaning import Waste, clean, find_waste
from sweep.tables.stored_study import StoredStudy
from tests import ROOT
from tests.cases import slow_but
from tests.commands import sweep
from tests.studies import COVERING, SMALL, launched, relaunch

SPEC = SMALL.replace("steps: 9", "steps: 3")
CALLS = ("replace", "rename", "fsync", "unlink", "rmdir", "mkdir")
TABLES = ("trials", "series")


class Killed(BaseException):
    """The process has ended here; whatever it still tries to do fails too."""


@contextmanager
def killed_after(calls: int) -> Iterator[list[str]]:
    """Inside, so many calls to the file system succeed; the next, and all that follow,
    do not happen.
    """
    done: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        for name in CALLS:
            patch.setattr(os, name, counting(getattr(os, name), name, calls, done))
        yield done


def counting(
    original: Callable[..., Any], name: str, calls: int, done: list[str]
) -> Callable[..., Any]:
    def call(*arguments: Any, **options: Any) -> Any:
        if len(done) >= calls:
            raise Killed(name)
        done.append(name)
        return original(*arguments, **options)

    return call


@pytest.fixture(scope="module")
def dirty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results with a part of which some trials have left, one of which all have, one of
    other code, and reruns.
    """
    results = tmp_path_factory.mktemp("dirty")
    relaunch(SPEC, results)
    relaunch(SPEC.replace("[0.5, 1]", "[3]"), results)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("kernels.identity._flight_stamp", lambda: "other code")
        patch.setattr("sweep.store.provenance.kernels_sha", lambda: "f" * 64)
        relaunch(SPEC, results)
    relaunch(SPEC.replace("[0.5, 1]", "[1, 2]"), results)
    study = StoredStudy("small", results)
    first = study.plan["trial_id"][:1].combine_chunks()
    study.store.append(
        {name: study.store.read(name, trial_ids=first) for name in TABLES}
    )
    return results


@pytest.fixture
def study(dirty: Path, tmp_path: Path) -> StoredStudy:
    shutil.copytree(dirty, tmp_path / "results")
    return StoredStudy("small", tmp_path / "results")


def kept(study: StoredStudy) -> list[pa.Table]:
    """The rows of the spec in every table, sorted."""
    ids = study.plan["trial_id"].combine_chunks()
    tables = [study.store.read(name, trial_ids=ids) for name in TABLES]
    return [
        table.sort_by(
            [
                (name, "ascending")
                for name in ("trial_id", "frame")
                if name in table.column_names
            ]
        )
        for table in tables
    ]


def same(one: list[pa.Table], other: list[pa.Table]) -> bool:
    return all(first.equals(second) for first, second in zip(one, other, strict=True))


def test_it_says_exactly_what_would_go(study: StoredStudy) -> None:
    waste = find_waste(study)
    assert waste.trials == {"": 6, f"other code, {'f' * 16}": 6}
    assert waste.repeated == 1
    assert not waste.exact
    text = waste.as_text(study)
    assert "go         6 trials that have left the spec: about" in text
    assert f"go         6 trials that were computed by other code, {'f' * 16}" in text
    assert "go         1 repeated rows, of trials that were run again since" in text


def test_what_goes_is_gone_and_what_stays_is_the_same(study: StoredStudy) -> None:
    before, stored = kept(study), study.store.trial_ids()
    assert len(stored) == 18
    freed = clean(study, find_waste(study))
    assert same(kept(study), before)
    assert set(study.store.trial_ids()) == set(study.plan["trial_id"].to_pylist())
    assert freed > 0
    after = find_waste(study)
    assert (after.rows, after.repeated) == ({}, 0)
    assert "go         nothing" in after.as_text(study)
    assert clean(study, after) == 0


def test_bytes_are_exact_where_whole_parts_go(tmp_path: Path) -> None:
    relaunch(SPEC, tmp_path)
    relaunch(SPEC.replace("[0.5, 1]", "[3]"), tmp_path)
    study = StoredStudy("small", tmp_path)
    waste = find_waste(study)
    assert waste.exact
    assert waste.size_bytes.total() == clean(study, waste)


@pytest.mark.parametrize("stride", slow_but([25], [25, 1]))
def test_being_killed_at_any_step_loses_no_trial_that_stays(
    dirty: Path, tmp_path: Path, stride: int
) -> None:
    """After every crash the spec's trials are all there once, and cleaning again comes
    to the same end.
    """
    reference = kept(StoredStudy("small", dirty))
    crashes = 0
    gone = subprocess.Popen(["true"])
    gone.wait()
    for calls in range(0, 400, stride):
        results = tmp_path / str(calls)
        shutil.copytree(dirty, results)
        study = StoredStudy("small", results)
        waste = find_waste(study)
        with killed_after(calls) as done:
            try:
                clean(study, waste)
            except Killed:
                crashes += 1
        assert same(kept(study), reference), done
        if len(done) < calls:
            break
        ours_no_longer(results / "small", gone.pid)
        clean(study, find_waste(study))
        assert same(kept(study), reference), done
        assert not list((results / "small" / "writing").iterdir())
        assert len(study.store.trial_ids()) == 6
        shutil.rmtree(results)
    assert crashes > 20 / stride
    assert len(done) < calls


def ours_no_longer(folder: Path, pid: int) -> None:
    """What this process has left behind becomes that of another one, and its lock is
    gone.
    """
    for left in (folder / "writing").iterdir():
        left.rename(left.with_name(left.name.replace(f"~{os.getpid()}~", f"~{pid}~")))
    shutil.rmtree(folder / "lock", ignore_errors=True)


KILLED = """
import os, pathlib, signal, sys
from sweep.tables.cleaning import Waste, clean, find_waste
from sweep.tables.stored_study import StoredStudy

study = StoredStudy("small", pathlib.Path({results!r}))
waste = find_waste(study)
original, calls = os.{call}, []
def fatal(*arguments, **options):
    calls.append(1)
    if len(calls) > {after}:
        os.kill(os.getpid(), signal.SIGKILL)
    return original(*arguments, **options)
os.{call} = fatal
clean(study, waste)
"""


@pytest.mark.slow
@pytest.mark.parametrize(("call", "after"), [*product(("replace", "rename"), (0, 1))])
def test_a_real_kill_loses_no_trial_that_stays(
    study: StoredStudy, call: str, after: int
) -> None:
    before = kept(study)
    script = KILLED.format(
        results=str(study.store.folder.parent), call=call, after=after
    )
    done = subprocess.run([sys.executable, "-c", script], check=False, cwd=ROOT)
    assert done.returncode == -signal.SIGKILL
    assert same(kept(study), before)
    clean(study, find_waste(study))
    assert same(kept(study), before)
    assert not list((study.store.folder / "writing").iterdir())


def test_a_launch_in_between_stops_it(study: StoredStudy) -> None:
    waste, results = find_waste(study), study.store.folder.parent
    relaunch(SPEC, results)
    before = StoredStudy("small", results).store.trial_ids()
    with pytest.raises(StoreError, match="was launched meanwhile: nothing was removed"):
        clean(study, waste)
    assert StoredStudy("small", results).store.trial_ids() == before


def test_a_launch_at_the_same_time_keeps_it_out(study: StoredStudy) -> None:
    waste, before = find_waste(study), study.store.trial_ids()
    with Lock(study.store.place), pytest.raises(StoreError, match="lock"):
        clean(study, waste)
    assert study.store.trial_ids() == before


def test_a_part_that_another_process_took_stops_it(study: StoredStudy) -> None:
    waste, before = find_waste(study), kept(study)
    study.store.merge([next(iter(waste.rows))], {})
    with pytest.raises(StoreError, match="another process has changed the store"):
        clean(study, waste)
    assert same(kept(study), before)


def test_trials_of_the_very_spec_stay_though_the_plan_lacks_them(
    tmp_path: Path,
) -> None:
    """As those of a search or of sequential stopping that was interrupted."""
    study = launched(COVERING.replace("heatmaps: true", "every: 10"), tmp_path)
    study.store.write_plan(study.plan.slice(0, 3).to_reader())
    shorter = StoredStudy("covering", tmp_path)
    waste = find_waste(shorter)
    assert (waste.rows, waste.unlisted) == ({}, 1)
    assert (
        "stay       1 trial of this spec, stored but not in the plan"
        in waste.as_text(shorter)
    )
    clean(shorter, waste)
    assert len(study.store.trial_ids()) == 4


def test_it_warns_where_the_plan_grows_as_the_study_runs(tmp_path: Path) -> None:
    until = "replicates: {until: {metric: speed, half_width: 1000}, min: 3, max: 5}"
    relaunch(SPEC, tmp_path)
    study = launched(
        SPEC.replace("replicates: 3", until).replace("[0.5, 1]", "[1]"), tmp_path
    )
    assert "this study grows during the run" in find_waste(study).as_text(study)


def test_links_are_neither_followed_nor_removed(
    study: StoredStudy, tmp_path: Path
) -> None:
    elsewhere = tmp_path / "elsewhere"
    shutil.copytree(study.store.current_parts()[0], elsewhere)
    (study.store.folder / "parts" / f"{1:020d}-abc").symlink_to(elsewhere)
    with pytest.raises(
        StoreError, match="is a symbolic link; nothing is read or written outside"
    ):
        find_waste(study)
    with pytest.raises(StoreError, match="is a symbolic link"):
        clean(study, Waste())
    assert (elsewhere / "trials.parquet").exists()


def test_the_command_asks_and_without_a_terminal_refuses(
    study: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = study.store.current_parts()
    folder = study.store.folder.parent.parent
    shown = sweep(folder, "gc", "small", "--dry-run")
    monkeypatch.setattr("sys.stdin", StringIO())
    refused = sweep(folder, "gc", "small")
    assert (shown.returncode, refused.returncode) == (0, 2)
    assert shown.stdout == refused.stdout
    assert "6 trials that have left the spec" in shown.stdout
    assert (
        "nothing was removed: there is no terminal for the question; use --yes"
        in refused.stderr
    )
    assert study.store.current_parts() == parts
    done = sweep(folder, "gc", "small", "--yes")
    assert done.returncode == 0, done.stderr
    assert "freed" in done.stdout
    assert len(study.store.trial_ids()) == 6


@pytest.mark.parametrize(("answer", "left"), [("\n", 18), ("n\n", 18), ("y\n", 6)])
def test_in_a_terminal_the_default_is_no(
    study: StoredStudy, answer: str, left: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    controller, terminal = pty.openpty()
    try:
        os.write(controller, answer.encode())
        with os.fdopen(terminal) as stdin:
            monkeypatch.setattr(sys, "stdin", stdin)
            done = sweep(study.store.folder.parent.parent, "gc", "small")
    finally:
        os.close(controller)
    assert "Remove these data? The removal cannot be undone. [y/N]" in done.stderr
    assert done.returncode == (0 if left == 6 else 1)
    assert "Traceback" not in done.stderr
    assert len(Store(study.store.folder).trial_ids()) == left
