"""The environment of all tests: none of the user's, so that theirs is the same
everywhere.

What a user has set, for Amazon, dask, numba, matplotlib, git, a proxy or a language, in
variables or below the home folder, is not seen by any test, nor by what a test starts.
Kept is what programs need to be found and to run, and the folder of caches, so that
compiled kernels are. Importing this module does it; `conftest.py` does so first.
"""

import atexit
import os
import shutil
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path

KEPT = ("PATH", "LD_LIBRARY_PATH", "TMPDIR", "USER", "LOGNAME", "TERM")
KEPT_PREFIXES = ("PYTEST_", "HYPOTHESIS_", "COV_")
OWN = {
    "TZ": "UTC",
    "LANG": "C.UTF-8",
    # glibc keeps what is freed, and the more the larger it was, unless it is told not
    # to. That holds for the workers of a run, which are started from this process.
    "MALLOC_MMAP_THRESHOLD_": "1000000",
    "MALLOC_TRIM_THRESHOLD_": "1000000",
}


def cleaned(environment: Mapping[str, str], home: Path) -> dict[str, str]:
    """The variables of a user whose home folder is `home` and who has set nothing."""
    caches = environment.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    kept = {
        name: value
        for name, value in environment.items()
        if name in KEPT or name.startswith(KEPT_PREFIXES)
    }
    return kept | OWN | {"HOME": str(home), "XDG_CACHE_HOME": caches}


def _begin() -> None:
    home = Path(tempfile.mkdtemp(prefix="boidsweep-home-"))
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    variables = cleaned(os.environ, home)
    os.environ.clear()
    os.environ.update(variables)
    time.tzset()
    os.umask(0o022)


_begin()
