"""Where numba keeps what it has compiled, and how it knows that it may use it again.

numba's own check looks at the file of a function, and not at the functions that it
calls in other files (numba issue 1833). Here the stamp of a function decides, which
covers them too: an edit compiles what it concerns again, and nothing else. Functions of
equal stamps share what is compiled, in whatever folder their sources lie.
"""

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any
from weakref import WeakSet

from numba import types
from numba.core.caching import FunctionCache, IndexDataCacheFile, _CacheLocator
from numba.core.sigutils import normalize_signature

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


class ByClasses(FunctionCache):
    """numba's cache of a function, with a file for what takes classes of its own
    package and ours, and others for what takes those of other packages.

    The index in such a file names the classes. An own model may call functions of ours
    with its own parameters: where its package is not at hand, they must not be met.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What is compiled for a signature; None where it is not there."""
        self._cache_file = self._file(sig)
        return super().load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what is compiled for a signature."""
        self._cache_file = self._file(sig)
        super().save_overload(sig, data)

    def _file(self, signature: Any) -> IndexDataCacheFile:
        names = {self._py_func.__module__, __name__}
        ours = {name.partition(".")[0] for name in names}
        arguments, _ = normalize_signature(signature)
        others = {
            one.__module__.partition(".")[0] for one in _classes(arguments)
        } - ours
        return IndexDataCacheFile(
            cache_path=self.cache_path,
            filename_base="-".join([self._impl.filename_base, *sorted(others)]),
            source_stamp=self._impl.locator.get_source_stamp(),
        )


def _classes(arguments: Iterable[Any]) -> Iterator[type[Any]]:
    """The named tuples among types of arguments, and within them."""
    for one in arguments:
        if isinstance(one, types.BaseNamedTuple):
            yield one.instance_class
        if isinstance(one, types.BaseTuple):
            yield from _classes(one.types)
