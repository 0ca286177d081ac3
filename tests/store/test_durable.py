"""A folder that is new is flushed into its parent; one that is there costs nothing."""

import errno
import os
import stat
from pathlib import Path

import pytest

from sweep.errors import StoreError
from sweep.store.durable import SAID, make_folders
from sweep.store.new_files import replacing
from sweep.store.store import Store
from sweep.store.writer import Writer
from tests.studies import SMALL, relaunch


@pytest.fixture
def flushed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of what is flushed in the folder of a test, in their order."""
    names, fsync = list[str](), os.fsync

    def noting(descriptor: int) -> None:
        path = Path(f"/proc/self/fd/{descriptor}").readlink()
        if path.is_relative_to(tmp_path):
            names.append(path.name)
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", noting)
    return names


def test_new_folders_are_flushed_one_by_one(tmp_path: Path, flushed: list[str]) -> None:
    """And once more the last that was there: who made it may have been killed."""
    (tmp_path / "there").mkdir()
    make_folders(tmp_path / "there" / "one" / "two")
    assert flushed == [tmp_path.name, "there", "one"]


def test_a_folder_that_is_there_costs_nothing(
    tmp_path: Path, flushed: list[str]
) -> None:
    make_folders(tmp_path)
    assert flushed == []


def test_a_place_that_cannot_be_flushed_is_no_hindrance(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a folder of somebody else's that may not be read."""

    def refused(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", refused)
    make_folders(tmp_path / "one" / "two")
    assert (tmp_path / "one" / "two").is_dir()


def test_how_often_a_launch_flushes_does_not_depend_on_its_trials(
    tmp_path: Path, flushed: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only on its parts, of which these launches have one each."""
    monkeypatch.setitem(Writer.__init__.__kwdefaults__, "seconds", 1e9)
    counts = []
    for replicates in (1, 30):
        spec = SMALL.replace("steps: 9", "steps: 2").replace("[0.5, 1]", "[1]")
        spec = spec.replace("replicates: 3", f"replicates: {replicates}")
        del flushed[:]
        relaunch(spec, tmp_path / str(replicates))
        counts.append(len(flushed))
    assert counts[0] == counts[1]


def folders_fail(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    """Flushing a folder fails with this error; files are flushed."""
    fsync = os.fsync

    def refusing(descriptor: int) -> None:
        if stat.S_ISDIR(os.fstat(descriptor).st_mode):
            raise OSError(number, os.strerror(number))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", refusing)
    monkeypatch.setenv(SAID, "")
    monkeypatch.delenv(SAID)


@pytest.mark.parametrize("number", [errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_that_flushes_no_folders_is_used_and_named_once(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    number: int,
) -> None:
    folders_fail(monkeypatch, number)
    relaunch(SMALL.replace("replicates: 3", "replicates: 2"), tmp_path)
    relaunch(SMALL, tmp_path)
    with replacing(tmp_path / "figure.svg") as file:
        file.write(b"drawn")
    assert len(Store(tmp_path / "small").trial_ids()) == 6
    said = [record.getMessage() for record in caplog.records if record.levelno > 20]
    assert len(said) == 1
    assert f"cannot flush a folder to the disk ({os.strerror(number)}): a" in said[0]


@pytest.mark.parametrize("number", [errno.EIO, errno.ENOSPC, errno.EROFS])
def test_a_folder_whose_flush_fails_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """What was written may be lost already."""
    folders_fail(monkeypatch, number)
    with pytest.raises(StoreError, match="cannot write"):
        relaunch(SMALL, tmp_path)


def test_a_file_that_cannot_be_flushed_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refusing(_descriptor: int) -> None:
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))

    monkeypatch.setattr(os, "fsync", refusing)
    with pytest.raises(OSError, match="Invalid argument"), replacing(tmp_path / "one"):
        """Nothing is written."""
    assert list(tmp_path.iterdir()) == []
