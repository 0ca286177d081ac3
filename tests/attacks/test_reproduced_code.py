"""`sweep reproduce` says which code it runs, and runs no other."""

import os
import py_compile
from importlib.util import cache_from_source
from pathlib import Path

import pytest

from sweep.errors import SpecError
from sweep.published.publications import code_files, read_all
from tests.commands import sweep
from tests.publications import FIGURES, PUBLISHED, SPEC, experiments

MARK = "from pathlib import Path\nPath({mark!r}).write_text('')\n"
SAYING = "import sys\nprint('it runs', file=sys.stderr)\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of experiments: `tiny`, and `evil` with code that leaves marks."""
    found = experiments(tmp_path)
    evil = found / "evil"
    evil.mkdir()
    for name, text in (("small.yaml", SPEC), ("published.yaml", PUBLISHED)):
        (evil / name).write_text(text.replace("tiny", "evil"))
    code = FIGURES + MARK.format(mark=str(tmp_path / "figures.py ran"))
    (evil / "figures.py").write_text(code)
    for place in (evil, found / "tiny", found):
        for name in ("__init__", "conftest", "setup", "small", "sitecustomize"):
            mark = MARK.format(mark=str(tmp_path / f"{name}.py ran"))
            (place / f"{name}.py").write_text(mark)
    return found


def marks(folder: Path) -> list[str]:
    """Which files have run."""
    return [path.name for path in folder.parent.glob("* ran")]


def test_code_that_was_not_asked_for_does_not_run(folder: Path) -> None:
    evil, tiny = read_all(folder, quick=True, only=("tiny",))
    assert marks(folder) == []
    assert (evil.selected, tiny.selected) == (False, True)
    assert (evil.family, tiny.family) == (0, 1)
    assert (evil.drawings, evil.functions) == ({}, {})
    assert [claim.measure for claim in evil.claims] == [None, None]
    assert code_files(folder, ("tiny",)) == [folder / "tiny" / "figures.py"]


@pytest.mark.parametrize(
    "name", ["published.yaml", "small.yaml", "figures.py", "other.yaml"]
)
def test_no_pipe_is_waited_for(folder: Path, name: str) -> None:
    (folder / "evil" / name).unlink(missing_ok=True)
    os.mkfifo(folder / "evil" / name)
    with pytest.raises(SpecError, match=f"evil/{name}: not an ordinary file"):
        read_all(folder, quick=True, only=("tiny",))


def test_of_what_was_asked_for_only_the_named_code_runs(folder: Path) -> None:
    read_all(folder, quick=True)
    assert marks(folder) == ["figures.py ran"]
    named = [folder / name / "figures.py" for name in ("evil", "tiny")]
    assert code_files(folder) == named


def test_bytecode_does_not_run_in_the_place_of_what_can_be_read(folder: Path) -> None:
    """Python takes bytecode that says so for that of any source."""
    source, evil = folder / "tiny" / "figures.py", folder / "evil" / "figures.py"
    cached = Path(cache_from_source(str(source)))
    mode = py_compile.PycInvalidationMode.UNCHECKED_HASH
    py_compile.compile(str(evil), str(cached), invalidation_mode=mode)
    read_all(folder, quick=True, only=("tiny",))
    assert marks(folder) == []


HELPED = "from .helper import SIDE\nfrom . import other\n" + FIGURES


def test_files_that_are_imported_are_named_too(folder: Path) -> None:
    tiny = folder / "tiny"
    (tiny / "figures.py").write_text(HELPED)
    (tiny / "helper.py").write_text("from .further import SIDE\n")
    (tiny / "further.py").write_text("SIDE = 3\n")
    (tiny / "other.py").write_text("")
    files = ("figures.py", "helper.py", "other.py", "further.py")
    assert code_files(folder, ("tiny",)) == [tiny / name for name in files]
    publications = read_all(folder, quick=True, only=("tiny",))
    assert publications[1].functions.keys() >= {"curves"}
    assert marks(folder) == []


@pytest.mark.parametrize("text", ["from .helper import", "\0", "(" * 10_000])
def test_what_is_no_python_is_named_all_the_same(folder: Path, text: str) -> None:
    file = folder / "tiny" / "figures.py"
    file.write_text(text)
    assert code_files(folder, ("tiny",)) == [file]
    with pytest.raises(SpecError, match=r"figures.py.*: cannot be loaded: "):
        read_all(folder, quick=True, only=("tiny",))


def test_what_cannot_be_read_is_named_all_the_same(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "read_bytes", refuse)
    named = [folder / "tiny" / "figures.py"]
    assert code_files(folder, ("tiny",)) == named


def test_an_imported_file_is_that_of_this_folder(folder: Path, tmp_path: Path) -> None:
    for place in (folder, experiments(tmp_path / "second")):
        (place / "tiny" / "figures.py").write_text(
            "from .helper import MARKED\n" + FIGURES
        )
        mark = MARK.format(mark=str(place.parent / "helper.py ran"))
        (place / "tiny" / "helper.py").write_text(mark + "MARKED = 1\n")
        read_all(place, quick=True, only=("tiny",))
        assert marks(place) == ["helper.py ran"]


@pytest.mark.parametrize("name", ["below", "below.deeper"])
def test_what_lies_below_the_folder_is_not_imported(folder: Path, name: str) -> None:
    """It is not named either."""
    tiny, below = folder / "tiny", folder / "tiny" / "below"
    below.mkdir()
    for file in ("__init__", "deeper"):
        mark = MARK.format(mark=str(folder.parent / f"{file}.py ran"))
        (below / f"{file}.py").write_text(mark)
    (tiny / "figures.py").write_text(f"from .{name} import Path\n" + FIGURES)
    assert code_files(folder, ("tiny",)) == [tiny / "figures.py"]
    with pytest.raises(SpecError, match=r"figures.py:1: cannot be loaded: ModuleNot"):
        read_all(folder, quick=True, only=("tiny",))
    assert marks(folder) == []


def test_bytecode_of_an_imported_file_does_not_run(folder: Path) -> None:
    helper, evil = folder / "tiny" / "helper.py", folder / "evil" / "figures.py"
    helper.write_text("SIDE = 3\n")
    helper.with_name("figures.py").write_text("from .helper import SIDE\n" + FIGURES)
    cached = Path(cache_from_source(str(helper)))
    mode = py_compile.PycInvalidationMode.UNCHECKED_HASH
    py_compile.compile(str(evil), str(cached), invalidation_mode=mode)
    read_all(folder, quick=True, only=("tiny",))
    assert marks(folder) == []


def test_the_command_says_what_it_runs_before_it_runs_it(folder: Path) -> None:
    (folder / "tiny" / "figures.py").write_text(SAYING + FIGURES)
    wanted = ("--only", "tiny", "--scale", "quick")
    done = sweep(folder.parent, "reproduce", "experiments", *wanted)
    assert done.returncode == 0, done.stderr
    first, second, *_ = done.stderr.splitlines()
    assert first == "this runs code: experiments/tiny/figures.py"
    assert second == "it runs"
    assert marks(folder) == []


def test_of_the_programs_own_experiments_nothing_needs_to_be_said(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sweep.spec.EXPERIMENTS", folder)
    done = sweep(folder.parent, "reproduce", "--only", "tiny", "--scale", "quick")
    assert "this runs code" not in done.stderr
    assert "statements of tiny: " in done.stderr


def test_a_folder_of_experiments_goes_before_the_built_in_ones(folder: Path) -> None:
    done = sweep(folder.parent, "reproduce", "--only", "tiny", "--scale", "quick")
    first, *_ = done.stderr.splitlines()
    assert first == "this runs code: experiments/tiny/figures.py"
    assert "built-in" not in done.stderr


def test_the_help_says_that_code_runs(tmp_path: Path) -> None:
    words = sweep(tmp_path, "reproduce", "--help").stdout.replace("│", " ").split()
    assert "This runs code: figures.py of each study in the folder" in " ".join(words)
