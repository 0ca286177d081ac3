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
OF_NUMBA = ".numba_config.yaml"
SETTINGS = (OF_NUMBA, "matplotlibrc")
"""What no process of ours obeys in the current folder."""
_changing = threading.Lock()
_exists = os.path.exists
_ignored: set[str] = set()


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


def ignore_settings(*names: str) -> None:
    """From now on this process finds no settings of these names in the current folder.

    matplotlib reads its own when it is imported. numba and numba.cuda do so when they
    are imported and whenever the environment may have changed. None can be told not to;
    all ask `os.path.exists` for the bare name.
    """
    _ignored.update(names)
    os.path.exists = _exists_elsewhere


def _exists_elsewhere(path: Any) -> bool:
    return not (isinstance(path, str) and path in _ignored) and _exists(path)
