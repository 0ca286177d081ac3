"""What becomes of compiled code that nobody uses any more."""

import os
import re
import shutil
import time
from pathlib import Path

import pytest

from kernels import caching, identity
from kernels.caching import (
    DAY,
    UNUSED_DAYS,
    is_noted_alone,
    kept,
    note_alone,
    note_use,
    remove_unused,
)
from kernels.neighbours import search, square_range
from kernels.stamps import code_stamp, stamp, stamp_of_all
from tests import ROOT
from tests.commands import python

OLD = (UNUSED_DAYS + 1) * DAY
HASH = """
import sys
sys.version += "{more}"
from kernels import stamps
print(stamps.text_hash("kernels"))
"""
CALL = """
from kernels.neighbours import square_range
square_range(2.0, True)
"""

REMEMBER = """
from kernels.state import Flock, empty_flock, remember
{more}
flock = empty_flock(2)
remember({kind}(*flock), flock)
"""


def put(folder: Path, ages: dict[str, float]) -> None:
    """Files that were last changed so many seconds ago."""
    now = time.time()
    for name, age in ages.items():
        (folder / name).write_bytes(b"")
        os.utime(folder / name, (now - age, now - age))


def test_what_nobody_has_used_for_a_month_goes_with_its_data(tmp_path: Path) -> None:
    put(
        tmp_path,
        {
            "a.step-1.py311.nbi": OLD,
            "a.step-1.py311.1.nbc": OLD,
            "a.step-1.py311.12.nbc": OLD,
            "b.step-2.py311.nbi": DAY,  # it was loaded yesterday
            "b.step-2.py311.1.nbc": OLD,
            "c.step-3.py311.nbi.tmp.0fa1": OLD,
            "d.step-4.py311.1.nbc.tmp.0fa2": DAY,
            "e.step-5.py311.7.nbc": OLD,  # its index is lost
            "0f1e.alone": OLD,
            "2d3c.alone": DAY,
            "4a5b-6c7d.stamp": OLD,
            "8e9f-0a1b.stamp": DAY,
            "1b2c.ptx": OLD,
            "3d4e.cubin": OLD,
            "5f6a.cubin.tmp.1f": OLD,
            "7b8c.ptx": DAY,
            "notes.txt": OLD,
        },
    )
    remove_unused(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "2d3c.alone",
        "7b8c.ptx",
        "8e9f-0a1b.stamp",
        "b.step-2.py311.1.nbc",
        "b.step-2.py311.nbi",
        "d.step-4.py311.1.nbc.tmp.0fa2",
        "notes.txt",
    ]


def test_use_is_noted_once_a_day(tmp_path: Path) -> None:
    put(tmp_path, {"old.nbi": 2 * DAY, "new.nbi": DAY / 2})
    before = (tmp_path / "new.nbi").stat().st_mtime
    for name in ("old.nbi", "new.nbi", "gone.nbi"):
        note_use(tmp_path / name)
    assert time.time() - (tmp_path / "old.nbi").stat().st_mtime < DAY
    assert (tmp_path / "new.nbi").stat().st_mtime == before
    assert not (tmp_path / "gone.nbi").exists()


def test_what_is_made_is_kept_under_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(caching, "FOLDER", tmp_path / "new" / "kernels")
    made = iter([b"first", b"second"])
    assert kept("1b2c.ptx", lambda: next(made)) == b"first"
    assert kept("1b2c.ptx", lambda: next(made)) == b"first"
    assert kept("3d4e.ptx", lambda: next(made)) == b"second"
    assert sorted(path.name for path in caching.FOLDER.iterdir()) == [
        "1b2c.ptx",
        "3d4e.ptx",
    ]


def test_what_cannot_be_kept_is_made_each_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setattr(caching, "FOLDER", tmp_path / "file" / "kernels")
    made = iter([b"first", b"second"])
    assert kept("1b2c.ptx", lambda: next(made)) == b"first"
    assert kept("1b2c.ptx", lambda: next(made)) == b"second"


def test_a_function_is_noted_as_one_that_is_not_for_lanes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(caching, "FOLDER", tmp_path / "new" / "kernels")
    monkeypatch.setattr(caching, "_note_of", caching._note_of.__wrapped__)
    assert not is_noted_alone(square_range)
    note_alone(square_range)
    assert is_noted_alone(square_range)
    assert not is_noted_alone(note_use)
    assert len(list(caching.FOLDER.glob("*.alone"))) == 1


def test_where_no_note_can_be_made_work_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file lies where the folder would; root may write into every folder."""
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setattr(caching, "FOLDER", tmp_path / "file" / "kernels")
    monkeypatch.setattr(caching, "_note_of", caching._note_of.__wrapped__)
    note_alone(square_range)
    assert not is_noted_alone(square_range)


STAMPS = """
import sys
from kernels import caching, identity, stamps
from kernels.neighbours import search
written, made = [], stamps.written_out
stamps.written_out = lambda tree: written.append(tree) or made(tree)
print(caching._stamp(search), identity.kernels_sha(), identity.stamp(search))
print(len(written))
"""


def test_a_stamp_is_found_once_and_noted(tmp_path: Path) -> None:
    """Another process reads it, and takes no source apart."""
    folder = tmp_path / "boidsweep" / "kernels"
    *first, took = python(STAMPS, NUMBA_CACHE_DIR=str(tmp_path)).split()
    *then, later = python(STAMPS, NUMBA_CACHE_DIR=str(tmp_path)).split()
    found = [code_stamp(search), stamp_of_all(ROOT / "kernels"), stamp(search)]
    assert first == then == found
    assert int(took) > 0
    assert int(later) == 0
    notes = [*folder.glob("*.stamp")]
    assert {note.stem.partition("-")[2] for note in notes} == {*found[:2]}
    assert {note.stat().st_size for note in notes} == {0}


def test_what_every_launch_says_of_all_kernels_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(caching, "FOLDER", tmp_path)
    monkeypatch.setattr(caching, "_noted_stamps", caching._noted_stamps.__wrapped__)
    asked = identity.kernels_sha.__wrapped__, identity._flight_stamp.__wrapped__
    found = [ask() for ask in asked]
    assert found == [stamp_of_all(ROOT / "kernels"), identity._found_flight_stamp()]
    for name in ("stamp_of_texts", "_found_flight_stamp"):
        monkeypatch.setattr(identity, name, None)
    assert [ask() for ask in asked] == found


def test_a_note_is_of_the_sources_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With other sources, or with another version of Python, it is not read."""
    shutil.copytree(ROOT / "kernels", tmp_path / "kernels")
    place = tmp_path / "kernels" / "lanes" / "texts.py"  # which no stamp covers
    hashes = [python(HASH.format(more=""), tmp_path)]
    place.write_text(place.read_text() + "# more\n")
    hashes.append(python(HASH.format(more=""), tmp_path))
    hashes.append(python(HASH.format(more="+"), tmp_path))
    assert len({*hashes}) == len(hashes)
    monkeypatch.setattr(caching, "FOLDER", tmp_path)
    monkeypatch.setattr(caching, "_noted_stamps", lambda: {})
    monkeypatch.setattr(caching, "text_hash", lambda _: "of other sources")
    assert caching._stamp(search) == code_stamp(search)
    assert len(list(tmp_path.glob("*.stamp"))) == 1


def test_notes_of_other_forms_say_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stamp = code_stamp(search)
    names = "0f1e", "1a-2b", f"2d3c-{stamp}", f"-{stamp}", f"3d4e-{stamp}-5", stamp
    files = [*(f"{name}.stamp" for name in names), f"6f7a-{stamp}.nbi"]
    put(tmp_path, dict.fromkeys(files, 0.0))
    monkeypatch.setattr(caching, "FOLDER", tmp_path)
    assert caching._noted_stamps.__wrapped__() == {"2d3c": stamp}
    monkeypatch.setattr(caching, "FOLDER", tmp_path / "none")
    assert caching._noted_stamps.__wrapped__() == {}


def test_loading_notes_the_use_and_compiling_removes(tmp_path: Path) -> None:
    folder = tmp_path / "boidsweep" / "kernels"

    def call(code: str) -> None:
        python(code, NUMBA_CACHE_DIR=str(tmp_path))

    call(CALL)
    [index] = folder.glob("*square_range*.nbi")
    then = time.time() - OLD
    for path in folder.iterdir():
        os.utime(path, (then, then))
    call(CALL)  # it loads, and compiles nothing
    assert time.time() - index.stat().st_mtime < DAY
    put(folder, {"gone.step-1.py311.nbi": OLD, "gone.step-1.py311.1.nbc": OLD})
    call(CALL.replace("square_range(2.0, True)", "square_range(2, True)"))
    assert index.exists()
    assert not list(folder.glob("gone.*"))


def test_what_is_compiled_for_a_later_version_is_no_obstacle(tmp_path: Path) -> None:
    """The later one has a class in a module that ours has not, and calls the same
    function with it: ours must not be asked to load that class.
    """
    later, kept = tmp_path / "later", {"NUMBA_CACHE_DIR": str(tmp_path)}
    shutil.copytree(ROOT / "kernels", later / "kernels")
    flock = (later / "kernels" / "state.py").read_text()
    [made] = re.findall(r"class Flock\(NamedTuple\):.*?\n\n\n", flock, re.DOTALL)
    text = "from typing import Any, NamedTuple\nFloats = Any\n" + made
    (later / "kernels" / "newer.py").write_text(text.replace("Flock", "Newer"))
    more = "from kernels.newer import Newer"
    for kind, added, folder in (("Newer", more, later), ("Flock", "", ROOT)):
        python(REMEMBER.format(more=added, kind=kind), folder, **kept)
    folder = tmp_path / "boidsweep" / "kernels"
    assert len(list(folder.glob("*remember*.nbi"))) == 2
