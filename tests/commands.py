"""The command line for tests: within this process, or as a user starts it.

A process of its own spends two to four seconds on imports. What the start adds, the
exit code, the two streams, Ctrl-C and workers, is shown with processes in
tests/test_cli.py; what a command says and does is the same without.
"""

import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from sweep.cli import main
from sweep.workers.executors import Serial
from tests import ROOT
from tests.patience import PATIENCE

SWEEP = [sys.executable, "-c", "from sweep.cli import main; main()"]
"""The command as a process, without its arguments."""


def python(code: str, folder: Path = ROOT, **environment: str) -> str:
    """What `code` prints in a new process that finds kernels and sweep in `folder`, and
    the tests' helpers.
    """
    paths = os.pathsep.join([str(folder), str(ROOT)])
    environment = (
        os.environ | {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"} | environment
    )
    command = [sys.executable, "-W", "error", "-c", code]
    finished = subprocess.run(
        command,
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


IN_TURN = """
import json, sys
from pathlib import Path
from tests.commands import sweep

for arguments in json.loads(sys.argv[1]):
    ended = sweep(Path.cwd(), *arguments)
    print(json.dumps([ended.returncode, ended.stdout, ended.stderr]))
"""


def started_in_turn(
    folder: Path, packages: Path, *commands: tuple[str, ...]
) -> list[subprocess.CompletedProcess[str]]:
    """The finished commands, run in `folder` one after the other, in one process that
    finds also the packages in `packages`: it starts once. They run as in `sweep`.
    """
    printed = subprocess.run(
        [sys.executable, "-c", IN_TURN, json.dumps(commands)],
        cwd=folder,
        env=os.environ
        | {"PYTHONPATH": os.pathsep.join([str(packages), str(ROOT)]), "COLUMNS": "200"},
        stdout=subprocess.PIPE,
        text=True,
        timeout=PATIENCE,
        check=True,
    ).stdout
    return [
        subprocess.CompletedProcess(command, *json.loads(line))
        for command, line in zip(commands, printed.splitlines(), strict=True)
    ]


def started(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The finished command, run in `folder` in a process of its own."""
    return subprocess.run(
        [*SWEEP, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )


def run_trials_here(
    patch: pytest.MonkeyPatch, make: Callable[[int], object] = Serial
) -> None:
    """Let launches run their trials in this process. Starting a worker takes longer."""
    for name in ("sweep.workers.Loky", "sweep.workers.executors.Loky"):
        patch.setattr(name, make)


def sweep(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The finished command, run in `folder` within this process, and its trials too; an
    error in it is raised here.
    """
    output, errors, code = io.StringIO(), io.StringIO(), 0
    with (
        pytest.MonkeyPatch.context() as patch,
        chdir(folder),
        redirect_stdout(output),
        redirect_stderr(errors),
    ):
        patch.setattr(sys, "argv", ["sweep", *arguments])
        run_trials_here(patch)
        try:
            main()
        except SystemExit as ending:
            code = (
                ending.code
                if isinstance(ending.code, int)
                else int(ending.code is not None)
            )
    return subprocess.CompletedProcess(
        ["sweep", *arguments], code, output.getvalue(), errors.getvalue()
    )
