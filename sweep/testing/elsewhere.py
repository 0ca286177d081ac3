"""Programs of this check in a process of their own."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from sweep.testing.mishaps import sentence

MISHAP = 3
"""The exit code where what is checked raises something; what stands on standard
output.
"""


def run_elsewhere(
    where: str, program: str, *arguments: str, **environment: str
) -> None:
    """Run a module with these arguments. Raises AssertionError with the sentence, and
    `where` that is, where what is checked raises something, and RuntimeError where the
    program fails.
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
        said = done.stdout.strip().splitlines()[-1]  # the author's code may print, too
        raise AssertionError(f"{said} ({where})")
    if done.returncode:
        raise RuntimeError(done.stderr)


@contextmanager
def mishaps_said() -> Iterator[None]:
    """In such a program: what is raised inside is printed, and ends it with MISHAP."""
    try:
        yield
    except Exception as error:
        print(sentence(error))
        raise SystemExit(MISHAP) from None
