"""Code that changes while trials run: what comes later runs as before, or is refused;
never anything else.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sweep.workers import fingerprint
from tests import ROOT
from tests.patience import PATIENCE

LAUNCH = """
import os, signal, sys, time
from functools import partial
from pathlib import Path
import sweep.trial.simulation
import naps
from sweep.errors import WorkersError
from sweep.workers.chunks import Chunks
from sweep.workers.executors import Loky
from sweep.workers.runner import drive

assert Path(sweep.trial.simulation.__file__).is_relative_to(os.getcwd())
engine, kept = Loky(2), []
batches = drive(range(60), naps.nap, executor=engine, costs=naps.a_second,
                failed=naps.failed, deal=partial(Chunks, seconds=1e-6))
try:
    for batch in batches:
        kept += batch
        for place, (edited, line) in enumerate({edits!r}):
            if len(kept) == 20 * place + 10:
                with open(edited, "a") as code:
                    code.write(line)
                os.kill(next(iter(engine.start()._processes)), signal.SIGKILL)
except WorkersError as error:
    print(error)
print(len(kept), len(set(kept)))
engine.stop()
"""
NAPS = """
import time
import sweep.trial.simulation

def nap(job):
    time.sleep(0.02)
    return job

def a_second(jobs):
    return [1.0] * len(jobs)

def failed(job, error):
    return error
"""


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the code in a folder of its own, which the test may edit."""
    folder = tmp_path / "copy"
    for package in ("kernels", "sweep"):
        shutil.copytree(
            ROOT / package,
            folder / package,
            ignore=shutil.ignore_patterns("__pycache__"),
        )
    (folder / "naps.py").write_text(NAPS, encoding="utf-8")
    return folder


def launched(folder: Path, *edits: tuple[str, str]) -> list[str]:
    """What a launch of 60 jobs prints; now and then a file is edited, and a worker
    killed so that others start.
    """
    environment = os.environ | {"PYTHONPATH": str(folder)}
    script = [sys.executable, "-c", LAUNCH.format(edits=edits)]
    done = subprocess.run(
        script,
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


@pytest.mark.slow
def test_workers_that_start_with_edited_code_are_refused_and_what_is_done_is_kept(
    copy: Path,
) -> None:
    """Other kernels are refused, a command that no trial runs is not."""
    edits = (
        ("sweep/cli/__init__.py", "# harmless"),
        ("kernels/coverage.py", "number = 1"),
    )
    refusal, kept = launched(copy, *edits)
    beginning = "the code or its libraries have changed since this launch began: "
    assert refusal.startswith(f"{beginning}other code in kernels/coverage.py; ")
    ending = "finished trials are stored: launch again to resume with the present code"
    assert refusal.endswith(f" {ending}")
    number, different = map(int, kept.split())
    assert 30 <= number == different < 60


@pytest.mark.slow
@pytest.mark.parametrize("line", ["# a word", "this is no Python"])
def test_code_beside_the_kernels_counts_and_such_as_cannot_be_imported(
    copy: Path, line: str
) -> None:
    refusal, kept = launched(copy, ("sweep/trial/result.py", line + "\n"))
    assert "other code in " in refusal
    assert "sweep/trial/result.py; finished trials are stored" in refusal
    assert 10 <= int(kept.split()[0]) < 60


IMPORTED = """
from tests import builders
from kernels.models import MODELS
from sweep.trial.simulation import run
from sweep.workers.fingerprint import imported

before = imported()
jobs = [builders.job(name, steps=2) for name in {names} or MODELS]
print({{run(job).status for job in jobs}}, imported() - before)
"""


@pytest.mark.parametrize(
    "names",
    [
        pytest.param(["nguyen2024"], id="one model"),
        pytest.param([], id="every model", marks=pytest.mark.slow),
    ],
)
def test_all_that_a_trial_runs_is_imported_before_the_first(names: list[str]) -> None:
    """What is imported later could be edited by then."""
    script = [sys.executable, "-c", IMPORTED.format(names=names)]
    assert (
        subprocess.run(script, cwd=ROOT, capture_output=True, text=True).stdout
        == "{'done'} set()\n"
    )


def test_versions_and_files_that_differ_are_named() -> None:
    ours = {
        "python": "3.11.7",
        "numba": "0.66.0",
        "sweep/a.py": "1",
        "sweep/b.py": "1",
        "sweep/c.py": "1",
    }
    theirs = {
        "python": "3.11.7",
        "numba": "0.65.1",
        "sweep/b.py": "2",
        "sweep/c.py": "1",
        "sweep/d.py": "1",
    }
    words = fingerprint.differences(json.dumps(ours), json.dumps(theirs))
    assert (
        words == "numba 0.66.0 here, 0.65.1 there; other code in sweep/b.py, sweep/d.py"
    )
    assert fingerprint.differences(json.dumps(ours), json.dumps(ours)) == ""
    many = {f"sweep/{number}.py": "1" for number in range(7)}
    assert fingerprint.differences("{}", json.dumps(many)).endswith(
        "sweep/3.py and 3 more files"
    )
