"""The explorer next to a launch, in a separate process.

So the launch and the explorer cannot disturb each other. The process of the explorer
ends with the command that started the explorer.
"""

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec

from sweep.cli.app import stop
from sweep.store import started
from sweep.text import installing

NEEDED = ("starlette", "uvicorn", "websockets")
SHOW = """
import sys
from sweep.cli import main
from sweep.store import end_with

_, parent, began, *words = sys.argv
end_with(int(parent), began or None)
sys.argv = ["sweep", "show", *words]
main()
"""
"""The program of the explorer: the command, which ends with the parent process."""


def check_installed() -> None:
    """End the command if a package of the explorer is missing."""
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        needed = f"--show: the explorer needs {', '.join(missing)}, not installed"
        stop(f"{needed}: {installing('view')}")


@contextmanager
def page_beside(arguments: Sequence[str]) -> Iterator[None]:
    """Run `sweep show` with these words during the context.

    If the context ends without an error, the explorer stays until Ctrl-C. The explorer
    has a separate session: only this process receives Ctrl-C, and ends the explorer.
    """
    parent = os.getpid()
    page = subprocess.Popen(
        [
            *(sys.executable, "-P", "-c", SHOW),
            *(str(parent), started(parent) or "", *arguments),
        ],
        stdin=subprocess.DEVNULL,
        stdout=sys.stderr,
        start_new_session=True,
    )
    try:
        yield
        if page.poll() is None:
            print("the explorer stays open until Ctrl-C", file=sys.stderr)
        with suppress(KeyboardInterrupt):
            page.wait()
    finally:
        page.terminate()
        page.wait()
