"""Every file that is written comes to be in one way: see sweep/store/new_files.py."""

import ast
import os
import stat
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from sweep.errors import ChoiceError, OutputError
from sweep.store.new_files import create, replacing
from sweep.tables import outputs
from sweep.tables.outputs import by_path, unfinished
from tests import ROOT

SOURCES = [*ROOT.glob("sweep/**/*.py"), *ROOT.glob("kernels/**/*.py")]
SOURCES += [*ROOT.glob("experiments/**/*.py"), *ROOT.glob("notebooks/*.py")]
CHANGING = {"O_WRONLY", "O_RDWR", "O_CREAT", "O_APPEND", "O_TRUNC"}
WRITERS = {
    *("write_text", "write_bytes", "touch", "symlink_to", "hardlink_to", "mkfifo"),
    *("savefig", "imsave", "imwrite", "save", "tofile", "savez", "savetxt"),
    *("to_csv", "to_parquet", "to_feather", "to_excel", "to_netcdf", "to_pickle"),
    *("ParquetWriter", "CSVWriter", "write_csv", "OSFile", "create_memory_map"),
    *(
        "NamedTemporaryFile",
        "TemporaryFile",
        "TemporaryDirectory",
        "mkstemp",
        "mkdtemp",
    ),
    *("mktemp", "shutil.copy", "copy2", "copyfile", "copytree", "fdopen", "FileIO"),
}
"""What can write to a path, or make a file."""

INTO_A_FILE = {
    "experiments/vasarhelyi2018/winners.py to_csv": "into the repository",
    "sweep/explorer/widget.py savefig": "into memory",
    "sweep/figures/saving.py savefig": "into a file of `unfinished`",
    "sweep/replays/animation.py save": "into a file of `unfinished`",
    "sweep/sharing/packed_file.py open": "a member of a file of `unfinished`",
    "sweep/tables/exporting.py CSVWriter": "into a file of `unfinished`",
    "sweep/replays/video.py save": "into a file of `unfinished`",
    "sweep/store/parquet.py ParquetWriter": "into a file of `create` or `unfinished`",
    "sweep/web/export.py save": "into memory",
    "sweep/web/export.py savefig": "into memory",
    "sweep/web/replayed_page.py save": "our own, which is by `unfinished`",
    "sweep/published/drawings.py save": "our own, in sweep/figures/saving.py",
    "sweep/figures/kinds.py save": "our own, in sweep/figures/saving.py",
    "kernels/caching.py save": "our own, which numba writes into its cache",
}
OTHERWISE = {
    "sweep/store/new_files.py open": "this is the one place",
    "sweep/store/new_files.py fdopen": "this is the one place",
    "sweep/store/regular.py fdopen": (
        "reads, and opens what is there for `lock_files.py` and checkpoints"
    ),
    "sweep/workers/checkpoint_file.py open_regular": (
        "frames are added to a file, which may be no link"
    ),
    "sweep/store/lock_files.py open_regular": (
        "a claim of our own that must not come back once deleted"
    ),
    "sweep/trial/compiled.py TemporaryFile": (
        "a try whether numba can write in its folder"
    ),
    "sweep/trial/compiled.py mkdtemp": (
        "where kernels are compiled; nobody else may enter it"
    ),
    "sweep/store/user_key.py open": (
        "a key that must never be replaced: made exclusively"
    ),
    "sweep/store/user_key.py fdopen": "the same key",
    "sweep/store/user_key.py hardlink_to": ("the same key, which comes to be whole"),
    "sweep/web/export.py TemporaryFile": "a film for the page; it has no name",
    "sweep/workers/watch.py mkstemp": (
        "the board, which workers map: made exclusively, for us alone"
    ),
    "sweep/workers/watch.py fdopen": "the same board",
    "sweep/workers/watch.py open": "the same board, in a worker",
    "sweep/tables/outputs.py TemporaryDirectory": (
        "for programs that know paths only; nobody else may enter it"
    ),
    "sweep/store/buckets.py TemporaryDirectory": (
        "where parts are made up; nobody else may enter it"
    ),
    "sweep/tables/netcdf.py to_netcdf": "into that folder",
    "sweep/replays/video.py TemporaryDirectory": (
        "a folder of its own, for the metadata that ffmpeg reads"
    ),
    "sweep/replays/video.py write_text": "into that folder",
    "sweep/testing/compiled.py TemporaryDirectory": (
        "where the interpreter leaves its flights; nobody else may enter it"
    ),
    "sweep/testing/interpreted.py savez": "into that folder",
    "sweep/testing/offered.py TemporaryDirectory": (
        "where another process leaves its numbers; nobody else may enter it"
    ),
    "sweep/testing/given.py savez": "into that folder",
    "sweep/published/trying.py TemporaryDirectory": (
        "where a copy of the program lies that has a mistake; nobody else may enter it"
    ),
    "sweep/published/trying.py write_text": "into that folder",
    "sweep/published/program_mutants.py copytree": "into that folder",
    "sweep/published/program_mutants.py write_text": "into that folder",
    "sweep/published/headline.py write_text": (
        "README.md of a checkout, by `make documents`"
    ),
    "sweep/cli/output.py open": "os.devnull",
    "sweep/web/launching.py TemporaryFile": "has no name; what a launch says",
    "sweep/spec/images.py FileIO": "reads",
    "kernels/caching.py touch": "an empty file, whose name says all",
    "kernels/caching.py write_bytes": "beside its place, then renamed",
    "sweep/store/lock.py touch": "our own, which gives a claim the time of now",
    "notebooks/execute.py TemporaryDirectory": (
        "an empty folder in which a notebook runs"
    ),
    "notebooks/execute.py shutil.copy": "into that folder",
}


def written(path: Path) -> Iterator[str]:
    """The calls in a module that write a file, or could."""
    module = path.relative_to(ROOT).as_posix()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        bare = isinstance(node.func, ast.Name)
        name = node.func.id if bare else getattr(node.func, "attr", "")  # type: ignore[attr-defined]
        name = "shutil.copy" if ast.unparse(node.func) == "shutil.copy" else name
        values = [*node.args, *(word.value for word in node.keywords)]
        texts = [
            one.value
            for one in values
            if isinstance(one, ast.Constant) and isinstance(one.value, str)
        ]
        inner = {
            one.attr
            for value in values
            for one in ast.walk(value)
            if isinstance(one, ast.Attribute)
        }
        names = {
            one.id
            for value in values
            for one in ast.walk(value)
            if isinstance(one, ast.Name)
        }
        modes = name == "open" and any(
            set(text) & set("wax+") and len(text) < 5 for text in texts
        )
        flags = name in ("open", "open_regular") and inner & CHANGING
        # os.open(path, FLAGS) with flags that are named elsewhere
        flagged = name == "open" and names & {"NEW"}
        as_text = name.startswith("to_") and not node.args
        if (name in WRITERS and not as_text) or modes or flags or flagged:
            yield f"{module} {name}"


def test_no_module_writes_a_file_in_a_way_of_its_own() -> None:
    found = {call for path in SOURCES for call in written(path)}
    assert found == INTO_A_FILE.keys() | OTHERWISE.keys()


@pytest.mark.parametrize(
    "line",
    [
        "open(path, 'w')",
        "path.open('ab')",
        "path.open(mode='r+b')",
        "path.write_text('x')",
        "os.open(path, os.O_WRONLY | os.O_CREAT)",
        "figure.savefig(path)",
        "pq.ParquetWriter(path, schema)",
        "tempfile.NamedTemporaryFile()",
        "shutil.copyfile(a, b)",
    ],
)
def test_another_way_would_be_found(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(globals(), "ROOT", tmp_path)
    (tmp_path / "module.py").write_text(line)
    assert list(written(tmp_path / "module.py"))


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
