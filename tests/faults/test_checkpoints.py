"""Whoever is killed in the middle of a long trial, the next to run it goes on, to the
tables of a launch in peace.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.faults.campaign import assert_no_orphans, tables, workers
from tests.own_models import FILES, OTHER_RULE, edited
from tests.patience import PATIENCE
from tests.studies import launched

SPEC = """
study: long
model: aziel_chen2025
preset: as_run
fixed: {n: 50, steps: 80000}
sweep: {cohesion_weight: [0.1, 0.2]}
replicates: 1
seed: 5
checkpoint: 0.02
record: {metrics: [speed, escapes], series: [speed], trajectories: true, every: 2000}
"""
OWN = SPEC.replace("model: aziel_chen2025", "model: ./drawn.py").replace(
    "[speed, escapes]", "[speed, ./mine.py]"
)
LAUNCH = [
    sys.executable,
    "-c",
    "from sweep.cli import main; main()",
    "launch",
    "spec.yaml",
    "--workers",
    "1",
]
WENT_ON = re.compile(r"trial (\w+): resumes at step ([0-9,]+) of 80,000")


def awaited(process: "subprocess.Popen[str]", there: Callable[[], bool]) -> None:
    """Wait until something is there, while a launch is running."""
    deadline = time.monotonic() + PATIENCE
    while not there():
        assert process.poll() is None, "the launch is over too soon"
        assert time.monotonic() < deadline
        time.sleep(0.005)


def steps_of(folder: Path) -> dict[str, int]:
    """By trial the step of its checkpoint, which is being tried where the kill came
    just after it was read.
    """
    whole = [path for path in folder.iterdir() if path.suffix in (".state", ".tried-1")]
    headers = (json.loads(path.read_bytes().split(b"\n")[1]) for path in whole)
    return {header["trial_id"]: header["step"] for header in headers}


def went_on(errors: Path) -> dict[str, int]:
    """By trial the last step from which it has gone on."""
    return {
        trial: int(step.replace(",", ""))
        for trial, step in WENT_ON.findall(errors.read_text())
    }


def launch(place: Path, name: str) -> "subprocess.Popen[str]":
    """A launch by its command, which says what it has to say to a file of that name."""
    with (place / name).open("w") as errors:
        return subprocess.Popen(
            LAUNCH, cwd=place, stderr=errors, text=True, start_new_session=True
        )


def written(folder: Path, spec: str) -> None:
    """A spec, and the files that it may name."""
    for name, text in (FILES | {"spec.yaml": spec}).items():
        (folder / name).write_text(text)


@pytest.mark.slow
@pytest.mark.parametrize(
    "spec",
    [
        pytest.param(SPEC, id="ours", marks=pytest.mark.slow),
        pytest.param(OWN, id="own code"),
    ],
)
def test_long_trials_go_on_after_kills_of_workers_and_of_the_coordinator(
    spec: str, tmp_path: Path
) -> None:
    written(tmp_path, spec)
    folder = tmp_path / "results" / "long"
    checkpoints = folder / "checkpoints"
    process = launch(tmp_path, "first")
    awaited(process, lambda: bool(workers(process.pid)))
    [worker] = workers(process.pid)
    awaited(process, lambda: bool(list(checkpoints.glob("*.state"))))
    os.kill(worker, signal.SIGKILL)
    awaited(process, lambda: bool(went_on(tmp_path / "first")))
    process.kill()
    process.wait()
    assert_no_orphans(process.pid)
    steps = steps_of(checkpoints)
    assert len(steps) == 1
    process = launch(tmp_path, "second")
    assert process.wait(PATIENCE) == 0, (tmp_path / "second").read_text()
    assert went_on(tmp_path / "second") == steps
    assert min(steps.values()) > 0
    assert not checkpoints.exists()
    launched(spec.replace("checkpoint: 0.02", "checkpoint: false"), tmp_path / "whole")
    assert tables(folder) == tables(tmp_path / "whole" / "long")


@pytest.mark.slow
def test_a_checkpoint_of_an_own_model_is_not_that_of_an_edited_one(
    tmp_path: Path,
) -> None:
    """It is deleted, as no trial of the new rule will ask for it."""
    written(tmp_path, OWN)
    checkpoints = tmp_path / "results" / "long" / "checkpoints"
    process = launch(tmp_path, "first")
    awaited(process, lambda: bool(list(checkpoints.glob("*.state"))))
    process.kill()
    process.wait()
    assert_no_orphans(process.pid)
    edited(tmp_path, *OTHER_RULE)
    process = launch(tmp_path, "second")
    assert process.wait(PATIENCE) == 0, (tmp_path / "second").read_text()
    assert went_on(tmp_path / "second") == {}
    assert not checkpoints.exists()
