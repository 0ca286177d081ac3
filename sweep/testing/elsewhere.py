"""Programs of the checks in separate processes."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from sweep.testing.mishaps import sentence

MISHAP = 3
"""Exit code if the checked code raises; the sentence is on standard output."""


def run_elsewhere(
    where: str, program: str, *arguments: str, **environment: str
) -> None:
    """Run a module in a separate process.

    Parameters
    ----------
    where : str
        The process in words, for a message.
    program : str
        Name of the module.
    *arguments : str
        Arguments of the program.
    **environment : str
        Variables added to the environment.

    Raises
    ------
    AssertionError
        If the checked code raises, with the sentence of the error and `where`.
    RuntimeError
        If the program itself fails.
    """
    paths = os.pathsep.join(filter(None, sys.path))
    done = subprocess.run(
        [sys.executable, "-P", "-m", program, *arguments],
        env=os.environ | {"PYTHONPATH": paths, "PYTHONUTF8": "1"} | environment,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    if done.returncode == MISHAP:
        # The code of the author may print, too.
        message = done.stdout.strip().splitlines()[-1]
        raise AssertionError(f"{message} ({where})")
    if done.returncode:
        raise RuntimeError(done.stderr)


@contextmanager
def mishaps_said() -> Iterator[None]:
    """Print the sentence of an error that is raised inside, and exit with MISHAP.

    A program that `run_elsewhere` starts uses this context.
    """
    try:
        yield
    except Exception as error:
        print(sentence(error))
        raise SystemExit(MISHAP) from None
