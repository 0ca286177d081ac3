"""Every file that is written comes to be in one way: see sweep/store/new_files.py. That
no module has a way of its own is a rule of tests/house/writing.py.
"""

import os
import stat
import subprocess
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from sweep.errors import ChoiceError, OutputError
from sweep.store.new_files import create, replacing
from sweep.tables import outputs
from sweep.tables.outputs import by_path, unfinished


def test_a_file_appears_whole_and_under_no_name_that_can_be_foreseen(
    tmp_path: Path,
) -> None:
    names = set()
    for _ in range(2):
        with replacing(tmp_path / "x.txt") as file:
            [beside] = set(tmp_path.iterdir()) - {tmp_path / "x.txt"}
            names.add(beside.name)
            file.write(b"new")
        assert [path.name for path in tmp_path.iterdir()] == ["x.txt"]
    assert len(names) == 2
    assert (tmp_path / "x.txt").read_text() == "new"


@pytest.mark.parametrize("error", [RuntimeError, OSError, KeyboardInterrupt])
def test_after_an_error_the_old_file_is_there_and_nothing_else(
    tmp_path: Path, error: type[BaseException]
) -> None:
    (tmp_path / "x.txt").write_text("old")

    def failing() -> None:
        with replacing(tmp_path / "x.txt") as file:
            file.write(b"new")
            raise error

    with pytest.raises(error):
        failing()
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]


def test_what_lies_under_the_temporary_name_is_not_written_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Even where somebody knew the name."""
    (tmp_path / "mine").write_text("precious")
    monkeypatch.setattr("secrets.token_hex", lambda _bytes: "known")
    (tmp_path / "x.txt-known.unfinished").symlink_to(tmp_path / "mine")
    with pytest.raises(FileExistsError), replacing(tmp_path / "x.txt"):
        pass
    with pytest.raises(FileExistsError):
        create(tmp_path / "x.txt-known.unfinished")
    assert (tmp_path / "mine").read_text() == "precious"


def test_a_folder_that_is_swapped_for_a_link_meanwhile_makes_no_difference(
    tmp_path: Path,
) -> None:
    (tmp_path / "results" / "study").mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir()
    with replacing(
        tmp_path / "results" / "study" / "x.txt", tmp_path / "results"
    ) as file:
        (tmp_path / "results" / "study").rename(tmp_path / "results" / "was")
        (tmp_path / "results" / "study").symlink_to(tmp_path / "elsewhere")
        file.write(b"new")
    assert list((tmp_path / "elsewhere").iterdir()) == []
    assert (tmp_path / "results" / "was" / "x.txt").read_text() == "new"


@pytest.mark.parametrize("link", ["a", "a/b"])
def test_between_the_named_folder_and_the_file_no_folder_is_a_link(
    tmp_path: Path, link: str
) -> None:
    """The named folder itself may be one: that is what its user wants."""
    (tmp_path / "real").mkdir()
    (tmp_path / "elsewhere" / "b").mkdir(parents=True)
    (tmp_path / "results").symlink_to(tmp_path / "real")
    results = tmp_path / "results"
    (results / link).parent.mkdir(parents=True, exist_ok=True)
    (results / link).symlink_to(tmp_path / "elsewhere")
    with (
        pytest.raises(
            (ChoiceError, OutputError), match=f"results/{link} is a symbolic link"
        ),
        unfinished(results / "a" / "b" / "x.txt", results),
    ):
        pass
    assert list((tmp_path / "elsewhere").rglob("*")) == [tmp_path / "elsewhere" / "b"]
    with unfinished(results / "new" / "folder" / "x.txt", results) as file:
        file.write(b"x")
    assert (tmp_path / "real" / "new" / "folder" / "x.txt").exists()


def test_who_may_read_a_file_is_decided_by_the_umask(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        with replacing(tmp_path / "x.txt"):
            pass
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "x.txt").stat().st_mode) == 0o640


def test_programs_that_know_paths_only_write_into_the_new_file_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not by way of TMPDIR, which may be small, and through no name in the folder."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    (tmp_path / "x").write_bytes(b"old")
    with unfinished(tmp_path / "x") as file:
        new = [path for path in tmp_path.iterdir() if path.suffix == ".unfinished"]
        copied = ["cp", "/proc/self/status"]  # another process finds the path too
        by_path(lambda path: subprocess.run([*copied, path], check=True), file)
        assert new[0].read_bytes().startswith(b"Name:\tcp\n")
        by_path(lambda path: path.write_bytes(b"done"), file)
        assert [path.name for path in tmp_path.iterdir() if path not in new] == ["x"]
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"done"]


def test_the_folder_for_programs_that_know_paths_only_is_closed_to_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where no path leads to an open file."""
    monkeypatch.setattr(outputs, "sys", SimpleNamespace(platform="darwin"))
    modes = []

    def write(path: Path) -> None:
        modes.append(stat.S_IMODE(path.parent.stat().st_mode))
        path.write_bytes(b"done")

    with (tmp_path / "x").open("w+b") as file:
        by_path(write, file)
    assert (modes, (tmp_path / "x").read_bytes()) == ([0o700], b"done")
