"""Pipes, devices and endless files in a study: nobody waits, or reads on and on."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from sweep.store.regular import open_regular, read_json, read_whole
from sweep.trial.state import State
from sweep.workers.checkpoint_file import Saved, frame_type, read_frames
from tests import ROOT
from tests.attacks.special import FILES, FOLDERS, KINDS, LISTED, MOST_MEMORY

SECONDS = 300
"""What takes a few seconds would take for ever if anybody waited."""

LINK = "StoreError: .*is a symbolic link; nothing is read or written outside.*"
OF_A_PART = ("manifest", "trials", "series", "unlisted", "replaces")
READ = ("trials", "series", "replaces", "plan", "asked")


def launched(name: str, kind: str) -> str:
    """What comes of a launch: a bad part is set aside and its six trials run again."""
    if name == "unlisted":
        return "0"
    if name == "manifest" and kind == "device":  # which is a link to one
        return (
            "StoreError: .*is a symbolic link, which is not followed.*nothing was set"
            " aside.*"
        )
    if name in OF_A_PART:
        return "6"
    if name in FOLDERS and kind in ("pipe", "huge"):
        needed = name in ("parts/", "writing/", "lock/")
        return r"StoreError: .*: cannot write .*" if needed else "0"
    if name in FOLDERS and kind == "folder":
        return "6" if name == "parts/" else "0"
    if name == "lock":
        return "StoreError: .*/lock: this study is being launched by somebody.*"
    if kind == "device":
        return LINK
    return "StoreError: .*Is a directory.*" if kind == "folder" else "0"


def expected() -> dict[str, str]:
    """The outcome of every attack, as a pattern."""
    kinds = [kind.__name__ for kind in KINDS]
    found = {
        f"{name} {kind} launch": launched(name, kind)
        for name in FILES | FOLDERS
        for kind in kinds
    }
    read = dict.fromkeys(FOLDERS, "6, 36") | {"parts/": "0, 0"}
    found |= {
        f"{name} {kind} read": said for name, said in read.items() for kind in kinds
    }
    found["parts/ device read"] = LINK
    refused = r"StoreError: [^\n]*: cannot be read \([^\n]*\); [^\n]*"
    found |= {
        f"{name} {kind} read": refused if name in READ else "6, 36"
        for name in FILES
        for kind in kinds
    }
    found |= {f"listed {name} launch": "6" for name in LISTED} | {
        f"listed {name} read": "6, 36" for name in LISTED
    }
    return found | {
        f"{name} {kind} launch": "6"
        for name in ("state", "tried-1", "frames")
        for kind in kinds
    }


@pytest.mark.slow
def test_no_file_of_a_study_is_waited_for_or_read_without_an_end(
    tmp_path: Path,
) -> None:
    """All in one process: after one that hangs, the others have no outcome."""
    command = [sys.executable, "-m", "tests.attacks.special", str(tmp_path)]
    # Threads of libraries take room for addresses, which is bounded, with each core.
    few = os.environ | {
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        "MALLOC_ARENA_MAX": "2",
    }
    try:
        said = subprocess.run(
            command, cwd=ROOT, env=few, capture_output=True, text=True, timeout=SECONDS
        ).stdout
    except subprocess.TimeoutExpired as ending:
        said = (
            ending.stdout.decode()
            if isinstance(ending.stdout, bytes)
            else ending.stdout or ""
        )
    outcomes = dict(json.loads(line) for line in said.splitlines())
    wrong = {
        name: outcomes.get(name, "no outcome")
        for name, pattern in expected().items()
        if not re.fullmatch(pattern, outcomes.get(name, "no outcome"))
    }
    assert wrong == {}
    assert outcomes.keys() == expected().keys()


def test_what_is_read_whole_has_a_bound(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text("[1, 2]")
    assert read_whole(tmp_path / "x.json", 6) == b"[1, 2]"
    with pytest.raises(OSError, match="is larger than 5 bytes"):
        read_whole(tmp_path / "x.json", 5)
    assert read_json(tmp_path / "x.json", 6, [int]) == [1, 2]


@pytest.mark.parametrize(
    "text",
    ["", "[", "5", '["x"]', '{"a": 1}', "[" * 100_000, "9" * 5000, "\x00", '["\xff"]'],
)
def test_json_of_another_shape_is_an_error_of_one_kind(
    tmp_path: Path, text: str
) -> None:
    (tmp_path / "x.json").write_text(text, encoding="latin-1")
    with pytest.raises(ValueError, match=r"."):
        read_json(tmp_path / "x.json", 10**6, [int])


def test_a_file_with_a_second_name_is_read_and_not_written(tmp_path: Path) -> None:
    (tmp_path / "x").write_text("mine")
    (tmp_path / "y").hardlink_to(tmp_path / "x")
    with open_regular(tmp_path / "y") as file:
        assert file.read() == b"mine"
    with pytest.raises(OSError, match="has a second name"):
        open_regular(tmp_path / "y", 2)


def test_frames_that_a_checkpoint_makes_up_take_no_memory(tmp_path: Path) -> None:
    """As in an endless file without content, which a header with right checksums
    declares.
    """
    kind = frame_type(1, 100)
    with (tmp_path / "x.frames").open("wb") as file:
        file.truncate(2 * MOST_MEMORY)
    state = State({}, {})
    saved = Saved(state, 1.0, 2 * MOST_MEMORY // kind.itemsize, 0)
    with pytest.raises(ValueError, match="has more frames than the trial has steps"):
        read_frames(tmp_path / "x.frames", kind, saved, most=1000)
