"""Protection from untrusted files in the current folder.

Python puts the current folder first on `sys.path` if a process starts with `-m` or
`-c`. Worker processes and their helpers start in this way. numba and matplotlib read
configuration files in the current folder before the user's configuration files.

Explicit choices of a user stay valid. An empty entry of PYTHONPATH is the current
folder, and `python -c` and notebooks have the current folder on `sys.path`.
"""

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

SAFE_PATH = "PYTHONSAFEPATH"
"""Environment variable. If set, Python adds no folder to `sys.path` by itself."""
OF_NUMBA = ".numba_config.yaml"
SETTINGS = (OF_NUMBA, "matplotlibrc")
"""Configuration files in the current folder that boidsweep ignores."""
_changing = threading.Lock()
_exists = os.path.exists
_ignored: set[str] = set()


@contextmanager
def safe_path() -> Iterator[None]:
    """Start all processes in this context with a safe path.

    This includes the trackers of multiprocessing and loky, which inherit the
    environment of this process.
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
    """Hide configuration files with these names in the current folder from now on.

    matplotlib reads its configuration file at the import. numba and numba.cuda read a
    configuration file at the import, and when the environment may have changed. No
    option prevents this. But each library calls `os.path.exists` with the bare name.
    """
    _ignored.update(names)
    os.path.exists = _exists_elsewhere


def _exists_elsewhere(path: Any) -> bool:
    return not (isinstance(path, str) and path in _ignored) and _exists(path)
