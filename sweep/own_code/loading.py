"""Modules made from sources, and imported from memory.

No file is written. So no file can be edited, incomplete, or owned by somebody else.

The folder of the sources is a package. Its name has the hash of the sources. So two
versions of a file are two modules, also in one process.
"""

import importlib
import importlib.abc
import importlib.machinery
import linecache
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from threading import RLock
from types import CodeType, ModuleType

from sweep.errors import CodeError
from sweep.own_code.sources import PACKAGE, Sources

STAMPED_AS = "own"
"""Name of the package in code hashes, in place of the name with a hash."""
_LOCK = RLock()


class _Finder(importlib.abc.MetaPathFinder, importlib.abc.InspectLoader):
    """Finder and loader of the modules of all requested sources."""

    def __init__(self) -> None:
        self.known: dict[str, Sources] = {}

    def find_spec(
        self, name: str, _path: Sequence[str] | None, _target: object = None
    ) -> importlib.machinery.ModuleSpec | None:
        package, _, inner = name.partition(".")
        sources = self.known.get(package)
        if sources is None:
            return None
        file, is_package = _file(sources, inner)
        if file is None and not is_package:
            return None
        origin = f"{package}/{file}" if file else package
        spec = importlib.machinery.ModuleSpec(
            name, self, origin=origin, is_package=is_package
        )
        spec.has_location = file is not None
        return spec

    def exec_module(self, module: ModuleType) -> None:
        if sources := self.known.get(module.__name__):
            texts = {
                sources.module(file): (text, file.endswith(PACKAGE))
                for file, text in sources.files
                if file in sources.code
            }
            vars(module).update(__stamped__=STAMPED_AS, __sources__=texts)
        super().exec_module(module)

    def get_source(self, name: str) -> str:
        package, _, inner = name.partition(".")
        file, _ = _file(self.known[package], inner)
        return self.known[package].texts[file] if file else ""

    def get_code(self, name: str) -> CodeType:
        package, _, inner = name.partition(".")
        file, _ = _file(self.known[package], inner)
        text = self.get_source(name)
        path = f"{package}/{file}"
        # Tracebacks, and messages of numba, show lines from here.
        linecache.cache[path] = (len(text), None, text.splitlines(True), path)
        return compile(text, path, "exec", dont_inherit=True)


def _file(sources: Sources, inner: str) -> tuple[str | None, bool]:
    """Return the file of a module, if there is one, and whether it is a package."""
    path = inner.replace(".", "/")
    if f"{path}.py" in sources.texts:
        return f"{path}.py", False
    first = f"{path}/{PACKAGE}".lstrip("/")
    is_package = not path or any(file.startswith(f"{path}/") for file in sources.texts)
    return (first if first in sources.texts else None), is_package


_FINDER = _Finder()


def load(sources: Sources, file: str) -> ModuleType:
    """Return the module of a source; the code runs at the first request.

    Raises CodeError, with file and line, for any error of the code.
    """
    with _LOCK, _explained(sources):
        if sources.package not in _FINDER.known:
            _FINDER.known[sources.package] = sources
            if _FINDER not in sys.meta_path:
                sys.meta_path.append(_FINDER)
        return importlib.import_module(sources.module(file))


@contextmanager
def _explained(sources: Sources) -> Iterator[None]:
    try:
        yield
    except (Exception, SystemExit) as error:
        own = [
            frame
            for frame in traceback.extract_tb(error.__traceback__)
            if frame.filename.startswith(f"{sources.package}/")
        ]
        where = ""
        if own:
            file = own[-1].filename.partition("/")[2]
            where = f"{file}, line {own[-1].lineno}: "
        raise CodeError(f"{where}{type(error).__name__}: {error}") from error
