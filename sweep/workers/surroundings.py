"""The current folder is no part of the program: it may contain a stranger's files.

Python puts it first on `sys.path` of a process that is started with `-m` or `-c`, as
worker processes and their helpers are. numba and matplotlib look there for settings
before they look where the user keeps them. What a user asks for stays: an empty entry
of PYTHONPATH is the current folder, and `python -c` and notebooks have it on
`sys.path`.
"""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

SAFE_PATH = "PYTHONSAFEPATH"
"""If it is set in the environment, Python adds no folder to `sys.path` by itself."""
SETTINGS = (".numba_config.yaml", "matplotlibrc")
_changing = threading.Lock()
_exists = os.path.exists


@contextmanager
def safe_path() -> Iterator[None]:
    """All processes that are started inside run with a safe path, whoever starts them.

    The trackers of multiprocessing and loky get the environment of this process.
    """
    with _changing:
        before = os.environ.get(SAFE_PATH)
        os.environ[SAFE_PATH] = "1"
        try:
            yield
        finally:
            del os.environ[SAFE_PATH]
            if before is not None:
                os.environ[SAFE_PATH] = before


def ignore_settings() -> None:
    """From now on this process finds no SETTINGS in the current folder.

    numba reads its own when it is imported and again when it compiles, matplotlib when
    it is imported. Neither can be told not to; both ask `os.path.exists` for the bare
    name. For processes of ours only: a program that uses this package has its rules.
    """
    os.path.exists = _exists_elsewhere


def _exists_elsewhere(path: Any) -> bool:
    return path not in SETTINGS and _exists(path)
