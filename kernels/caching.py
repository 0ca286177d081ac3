"""Where numba keeps what it has compiled, and how it knows that it may use it again.

numba's own check looks at the file of a function, and not at the functions that it
calls in other files (numba issue 1833). Here the stamp of a function decides, which
covers them too: an edit compiles what it concerns again, and nothing else. Functions of
equal stamps share what is compiled, in whatever folder their sources lie.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any
from weakref import WeakSet

from numba.core.caching import _CacheLocator

from kernels.stamps import stamp


def usual_folder() -> Path:
    """The folder of compiled kernels, as the environment says."""
    home = Path(
        os.environ.get("NUMBA_CACHE_DIR")
        or os.environ.get("XDG_CACHE_HOME")
        or Path.home() / ".cache"
    )
    return home / "boidsweep" / "kernels"


FOLDER = usual_folder()
"""That of this process, whatever becomes of the environment."""
OURS: WeakSet[Callable[..., Any]] = WeakSet()
"""The functions that `kernels.jit` compiles, in whatever package they stand."""


class ByStamp(_CacheLocator):
    """Tells numba the file and the stamp of a function of ours."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.stamp = stamp(function)
        self.package = function.__module__.partition(".")[0]

    @classmethod
    def from_function(
        cls, function: Callable[..., Any], _file: str
    ) -> "ByStamp | None":
        """numba asks this of each kind of place, and takes the first that it gets."""
        if function not in OURS:
            return None
        FOLDER.mkdir(parents=True, exist_ok=True)
        return cls(function)

    def get_cache_path(self) -> str:
        return str(FOLDER)

    def get_source_stamp(self) -> str:
        return self.stamp

    def get_disambiguator(self) -> str:
        # What is compiled names classes by their modules: those of another package,
        # which may be gone, must not be met.
        return f"{self.package}-{self.stamp[:16]}"
