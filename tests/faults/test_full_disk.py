"""Whatever write fails, a launch ends with one clear line, and once there is room the
same command completes it.
"""

import os
import re
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from sweep.errors import StoreError
from sweep.store import writer as writer_module
from tests import ROOT
from tests.commands import SWEEP, sweep
from tests.faults.campaign import tables
from tests.patience import PATIENCE
from tests.studies import OWN_SMALL, SMALL, relaunch

WRITES = [
    (os, "mkdir"),
    (os, "rename"),
    (os, "replace"),
    (os, "fsync"),
    (pq.ParquetWriter, "write_table"),
]
WRITES += [(pq.ParquetWriter, "__init__"), (os, "open")]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return undisturbed(SMALL, tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def own_whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return undisturbed(OWN_SMALL, tmp_path_factory.mktemp("whole"))


def undisturbed(spec: str, results: Path) -> dict[str, str]:
    relaunch(spec, results)
    return tables(results / "small")


@contextmanager
def full_after(writes: int) -> Iterator[list[int]]:
    """Inside, that many writes succeed and all later ones fail; the list holds how many
    have failed.
    """
    numbers, failed = count(), [0]

    def failing(original: Callable[..., Any]) -> Callable[..., Any]:
        def write(*arguments: Any, **options: Any) -> Any:
            reads = original.__name__ == "open" and not arguments[1] & os.O_CREAT
            if reads or next(numbers) < writes:
                return original(*arguments, **options)
            failed[0] += 1
            raise OSError(28, "No space left on device")

        return write

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            writer_module.Writer.__init__, "__kwdefaults__", {**KEYWORDS, "rows": 2}
        )
        for owner, name in WRITES:
            patch.setattr(owner, name, failing(getattr(owner, name)))
        yield failed


KEYWORDS: dict[str, Any] = writer_module.Writer.__init__.__kwdefaults__ or {}


def complete(results: Path, whole: dict[str, str], spec: str = SMALL) -> None:
    """Assert that a launch with room enough makes the study whole, and leaves nothing
    behind.
    """
    relaunch(spec, results)
    assert tables(results / "small") == whole
    assert list((results / "small" / "writing").iterdir()) == []
    assert not (results / "small" / "lock").exists()


def survives(
    results: Path, writes: int, whole: dict[str, str], spec: str = SMALL
) -> bool:
    """Whether a launch needs no more than that many writes; one that does ends with one
    line, and can be completed.
    """
    with full_after(writes) as failed:
        try:
            relaunch(spec, results)
            said = ""
        except StoreError as error:
            said = str(error)
    assert (failed[0] > 0) == bool(said)
    if said:
        assert re.search(r"cannot write \(\[Errno 28\] No space left on device\)", said)
        assert "\n" not in said
    complete(results, whole, spec)
    return not said


@pytest.mark.parametrize("writes", [0, 5, 13, 22, 34])
def test_a_disk_that_is_full_costs_nothing(
    tmp_path: Path, whole: dict[str, str], writes: int
) -> None:
    assert not survives(tmp_path, writes, whole)


@pytest.mark.parametrize("writes", [0, 5, 9, 13, 22, 34])
def test_a_disk_that_is_full_costs_nothing_of_a_study_with_own_code(
    tmp_path: Path, own_whole: dict[str, str], writes: int
) -> None:
    assert not survives(tmp_path, writes, own_whole, OWN_SMALL)


@pytest.mark.slow
def test_a_disk_that_is_full_from_the_kth_write_on_costs_nothing_for_any_k(
    tmp_path: Path, whole: dict[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    needed = next(
        writes for writes in count() if survives(tmp_path / str(writes), writes, whole)
    )
    assert needed > 34
    with capsys.disabled():
        print(f"\nfull disk: a launch survives each of its {needed} writes failing")


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of its own, if this user may mount one."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", place], capture_output=True
    )
    if mounted.returncode:
        pytest.skip("this user may not mount a file system")
    yield place
    subprocess.run(["umount", place], check=True)


def remount(place: Path, option: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{option}", place], check=True)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_a_real_disk_that_is_full(
    small_disk: Path, tmp_path: Path, whole: dict[str, str], share: float
) -> None:
    """It has that share of the room which the study takes; how much that is depends on
    what is said of its origin.
    """
    relaunch(SMALL, tmp_path / "measured")
    needed = sum(
        file.stat().st_size
        for file in (tmp_path / "measured").rglob("*")
        if file.is_file()
    )
    remount(small_disk, f"size={round(share * needed / 1024)}k")
    with pytest.raises(StoreError, match=r"cannot write .*No space left on device"):
        relaunch(SMALL, small_disk)
    remount(small_disk, "size=10m")
    complete(small_disk, whole)


def test_results_that_may_only_be_read(small_disk: Path, whole: dict[str, str]) -> None:
    relaunch(SMALL.replace("replicates: 3", "replicates: 2"), small_disk)
    remount(small_disk, "ro")
    with pytest.raises(StoreError, match=r"cannot write .*Read-only file system"):
        relaunch(SMALL, small_disk)
    assert tables(small_disk / "small")["trials"].count("trial_id") == 4
    remount(small_disk, "rw")
    complete(small_disk, whole)


def said_of_small_files(done: subprocess.CompletedProcess[str]) -> None:
    """Assert that a launch has said in one line that its files may not grow."""
    assert done.returncode == 2
    *_, last = done.stderr.splitlines()
    assert re.fullmatch(
        r"results/small: cannot write \(.*File too large\); what was stored is intact",
        last,
    )
    assert "Traceback" not in done.stderr


def test_a_launch_says_in_one_line_that_files_may_not_grow(
    whole: dict[str, str], tmp_path: Path
) -> None:
    """For as long as no file of this process may have more than 8 kB."""
    (tmp_path / "spec.yaml").write_text(SMALL)
    limit, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, most))
    try:
        done = sweep(tmp_path, "launch", "spec.yaml")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, most))
    said_of_small_files(done)
    complete(tmp_path / "results", whole)


@pytest.mark.slow
def test_the_command_says_so_in_one_line_where_files_may_not_grow(
    tmp_path: Path, whole: dict[str, str]
) -> None:
    (tmp_path / "spec.yaml").write_text(SMALL)
    launch = (
        f"ulimit -f 8; exec {sys.executable} -B -c 'from sweep.cli import main; main()'"
    )
    command = ["bash", "-c", f"{launch} launch spec.yaml --workers 1"]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE
    )
    said_of_small_files(done)
    complete(tmp_path / "results", whole)


@pytest.mark.slow
def test_trials_run_where_no_compiled_kernel_can_be_kept(
    small_disk: Path, tmp_path: Path, whole: dict[str, str]
) -> None:
    """Each process compiles anew, and one line says so; the results are the same."""
    remount(small_disk, "size=32k")
    (tmp_path / "spec.yaml").write_text(SMALL)
    done = subprocess.run(
        [*SWEEP, "launch", "spec.yaml", "--workers", "2"],
        cwd=tmp_path,
        env=os.environ | {"NUMBA_CACHE_DIR": str(small_disk), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    said = r"kernels cannot be stored \(No space left on device\), so each process"
    assert len(re.findall(said, done.stderr)) == 1
    assert tables(tmp_path / "results" / "small") == whole
