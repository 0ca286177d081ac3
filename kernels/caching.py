"""Cache of compiled kernels, and the rule that decides whether an entry is valid.

The check of numba looks at the file of a function and ignores the called functions in
other files (numba issue 1833). Here the stamp of a function decides, which covers
called functions too. An edit causes the compilation of the affected functions only.
Functions with equal stamps share compiled code, whatever the folder of the sources.

Entries that no process has loaded for a month are removed.

A process that compiles nothing starts quickly: the process neither imports the compiler
of numba nor parses sources. Notes in the folder of the cache hold the stamp of each
built-in function. The name of a note has a hash of all sources of the package, so notes
of other sources are never read.
"""

import glob
import hashlib
import os
import sys
import time
import warnings
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import suppress
from functools import cache, cached_property
from pathlib import Path
from types import CodeType
from typing import Any
from weakref import WeakKeyDictionary, WeakSet

from numba import config, types
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    _CacheLocator,
)
from numba.core.errors import NumbaWarning
from numba.core.runtime.nrt import rtsys

from kernels.stamps import (
    code_stamp,
    note_sources,
    stamp_of_texts,
    text_hash,
    texts_of,
    values,
)


def usual_folder() -> Path:
    """Return the folder of compiled kernels from the environment."""
    home = Path(
        os.environ.get("NUMBA_CACHE_DIR")
        or os.environ.get("XDG_CACHE_HOME")
        or Path.home() / ".cache"
    )
    return home / "boidsweep" / "kernels"


FOLDER = usual_folder()
"""Folder of this process, fixed when the module is imported."""
NOT_KEPT: dict[str, str] = {}
"""Reasons why compiled code could not be kept, by folder."""
OURS: WeakSet[Callable[..., Any]] = WeakSet()
"""Functions that `kernels.jit` compiles, and functions of kernels.fours."""
MADE_OF: WeakKeyDictionary[Callable[..., Any], Callable[..., Any]] = WeakKeyDictionary()
"""Original functions of the functions that are generated for lanes."""
MAKERS = "lanes/", "device/", "jit.py"
"""Beginnings of the names of files that generate functions from functions."""
OUR_PACKAGE = __name__.partition(".")[0]
DAY = 86_400.0
UNUSED_DAYS = 30
CONFIG: Any = config
"""Settings of numba, which numba declares at run time."""
USUAL_OPT = 3
"""Optimization level of numba by default."""
STAMP_DIGITS = 64
ENTRIES = ".nbi", ".ptx", ".cubin", ".wasm", ".alone", ".promises", ".stamp"
"""Endings of the names of files that are entries of the cache."""

TUPLES = (types.Tuple, types.UniTuple, types.NamedTuple, types.NamedUniTuple)


class ByStamp(_CacheLocator):
    """Location of a function of the project in the cache of numba.

    The stamp is computed when the function is called. Most functions are only parts of
    larger functions and are never loaded.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        note_sources(MADE_OF.get(function, function))
        if function in MADE_OF:
            _makers()
        self.function = function
        self._py_file = function.__code__.co_filename
        self.package = function.__module__.partition(".")[0]
        self.code = _of_code(function.__code__)

    @cached_property
    def stamp(self) -> str:
        """Stamp of the function at the time of its import."""
        return _stamp(self.function)

    def get_cache_path(self) -> str:
        """Return the folder of the cache."""
        return str(FOLDER)

    def ensure_cache_path(self) -> None:
        """Do nothing: `ByClasses.save` makes the folder."""

    def get_source_stamp(self) -> str:
        """Return "": `ByClasses` asks for the stamp."""
        return ""  # `ByClasses` asks for the stamp

    def get_disambiguator(self) -> str:
        # Compiled code names classes by their modules. A module of another package
        # may be missing and must not be imported.
        """Return the package and the code of the function."""
        return f"{self.package}-{self.code}"


class OfOurs(CompileResultCacheImpl):
    """Interface between the cache of numba and a function of the project.

    `ByStamp` gives the location. The settings of numba, which change with the
    environment, play no part.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._locator = ByStamp(function)
        self._lineno = function.__code__.co_firstlineno
        name = f"{Path(self._locator._py_file).stem}.{function.__qualname__}"
        numbas: Any = super()
        self._filename_base = numbas.get_filename_base(name, sys.abiflags)

    def check_cachable(self, result: Any) -> bool:
        """Return whether compiled code is valid in another process.

        Compiled code with addresses is not valid there. Code has addresses of tables of
        over a megabyte, about which numba warns. Without optimization, code also has
        addresses of the called functions.
        """
        numbas: Any = super()
        if CONFIG.OPT > 0:
            return bool(numbas.check_cachable(result))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NumbaWarning)
            return bool(numbas.check_cachable(result))


def _impl(function: Callable[..., Any]) -> CompileResultCacheImpl:
    return (OfOurs if function in OURS else CompileResultCacheImpl)(function)


setattr(FunctionCache, "_impl_class", staticmethod(_impl))  # noqa: B010


def _stamp(function: Callable[..., Any]) -> str:
    """Return the hash that decides whether a function must be compiled again."""
    if function not in MADE_OF:
        return noted_stamp(function)
    return stamp_of_made(MADE_OF[function])


def stamp_of_made(*functions: Callable[..., Any]) -> str:
    """Return the hash that decides whether code generated from functions is valid."""
    plain = [getattr(function, "py_func", function) for function in functions]
    stamps = " ".join([*map(noted_stamp, plain), _makers()])
    return hashlib.sha256(stamps.encode()).hexdigest()


@cache
def _makers() -> str:
    """Return the stamp of the files that generate functions from functions."""
    return noted(
        "makers",
        lambda: stamp_of_texts(
            (name, text)
            for name, text in texts_of(OUR_PACKAGE)
            if name.startswith(MAKERS)
        ),
    )


def noted_stamp(function: Callable[..., Any]) -> str:
    """Return `kernels.stamps.code_stamp` of a function.

    A note keeps the stamp of a built-in function.
    """
    if function.__module__.partition(".")[0] != OUR_PACKAGE:
        return code_stamp(function)
    subject = f"{function.__module__} {function.__qualname__}"
    return noted(subject, lambda: code_stamp(function))


def noted(subject: str, find: Callable[[], str]) -> str:
    """Return a sha256 (hexadecimal) that follows from the sources of the package.

    The sources are the texts that this process has read. `find` computes the hash of
    `subject` once, and a note keeps the hash.
    """
    of_sources = f"{text_hash(OUR_PACKAGE)} {subject}"
    key = hashlib.sha256(of_sources.encode()).hexdigest()[:32]
    if stamp := _noted_stamps().get(key):
        note_use(_stamp_note(key, stamp))
        return stamp
    stamp = find()
    _note(_stamp_note(key, stamp))
    return stamp


def _stamp_note(key: str, stamp: str) -> Path:
    return FOLDER / f"{key}-{stamp}.stamp"


@cache
def _noted_stamps() -> dict[str, str]:
    """Return the stamps of the notes in the folder, by key.

    The name of a note holds the key and the stamp, and the file is empty. So a note is
    either complete or absent.
    """
    stamps = {}
    for note in FOLDER.glob("*.stamp"):
        key, _, stamp = note.stem.partition("-")
        if key and len(stamp) == STAMP_DIGITS:
            stamps[key] = stamp
    return stamps


class ByClasses:
    """Files of a function in the cache of numba: one per set of argument classes.

    The index in a file names the classes, and numba loads the whole index. A class that
    cannot be imported would make the load fail. A custom model may call built-in
    functions with its own parameters. A later version of the package may have classes
    that this version lacks. So each set of classes has its own file.

    Functions `within` kernels, which only kernels call, are stored apart from functions
    that Python calls.
    """

    def __init__(
        self, function: Callable[..., Any], cache: Any, within: bool = False
    ) -> None:
        packages = function.__module__, __name__
        self._ours = {name.partition(".")[0] for name in packages}
        self._package = function.__module__.partition(".")[0]
        self._folder = cache.cache_path
        self._cache = cache
        self._begin = "within-" if within else ""
        if self._package == OUR_PACKAGE:
            cache.load_overload = self._load_overload

    @property
    def _stamp(self) -> str:
        stamp: str = self._cache._impl.locator.stamp
        return stamp

    @property
    def _name(self) -> str:
        begin = "".join([*_unusual(), self._begin])
        return f"{begin}{self._cache._impl.filename_base}-{self._stamp[:16]}"

    def _load_overload(self, signature: Any, context: Any) -> Any:
        """Load compiled code without the `context.refresh` of numba's `load_overload`.

        The refresh imports the compiler of numba and scipy in 0.3 s. numba also
        refreshes before each compilation. Built-in kernels load without the refresh;
        custom kernels may need the imported modules.
        """
        rtsys.initialize(context)
        with self._cache._guard_against_spurious_io_errors():
            return self._cache._load_overload(signature, context)

    def load(self, key: Any) -> Any:
        """Return the compiled code for a key; None if the cache has no entry.

        The key begins with the types of the arguments.
        """
        file = self._file(key[0])
        compiled = file.load(key)
        if compiled is not None:
            note_use(Path(file._index_path))
        return compiled

    def save(self, key: Any, data: Any) -> None:
        """Store compiled code for a key, and remove unused entries once per process.

        The process uses code that cannot be written, too, and NOT_KEPT records the
        reason.

        Parameters
        ----------
        key : tuple
            Begins with the types of the arguments.
        data : Any
            The compile result of numba.
        """
        folder = Path(self._folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file(key[0]).save(key, data)
            remove_unused(folder)
        except OSError as error:
            NOT_KEPT[self._folder] = error.strerror or str(error)

    def holds_any(self) -> bool:
        """Return whether the function is compiled for arguments of any types."""
        pattern = f"{glob.escape(self._name)}*.nbi"
        return any(Path(self._folder).glob(pattern))

    def holds(self, classes: Iterable[type]) -> bool:
        """Return whether the function is compiled for arguments of these classes."""
        return Path(self._folder, f"{self._name_with(classes)}.nbi").exists()

    def _loaded(self) -> list[str]:
        """Return the modules of the function's package.

        Compiled code contains the numbers of these modules.
        """
        start = f"{self._package}."
        return [
            name
            for name in list(sys.modules)
            if name == self._package or name.startswith(start)
        ]

    def _file(self, arguments: Any) -> Any:
        index_file: Any = IndexDataCacheFile
        return index_file(
            self._folder, self._name_with(_classes(arguments)), self._stamp
        )

    def _name_with(self, classes: Iterable[type]) -> str:
        """Return the name of the file for arguments of these classes."""
        taken = {f"{kind.__module__}.{kind.__qualname__}" for kind in classes}
        packages = {name.partition(".")[0] for name in taken}
        held = [] if self._package == OUR_PACKAGE else [values(self._loaded())[:16]]
        if taken:
            names = " ".join(sorted(taken))
            held.append(hashlib.sha256(names.encode()).hexdigest()[:8])
        return "-".join([self._name, *held, *sorted(packages - self._ours)])


def _unusual() -> Iterator[str]:
    """Return the settings of numba that the user has changed.

    These settings change compiled code, and the index of numba does not record the
    settings.
    """
    if CONFIG.OPT != USUAL_OPT:
        yield f"opt{int(CONFIG.OPT)}-"
    if CONFIG.BOUNDSCHECK is not None:
        yield f"bounds{CONFIG.BOUNDSCHECK}-"


def note_alone(function: Callable[..., Any]) -> None:
    """Note that a function cannot be compiled for lanes.

    The note is valid until the code of the function changes, for UNUSED_DAYS at most.
    """
    _note(_note_of(function))


def _note(place: Path) -> None:
    with suppress(OSError):  # without the note, later processes try again
        place.parent.mkdir(parents=True, exist_ok=True)
        place.touch()


def is_noted_alone(function: Callable[..., Any]) -> bool:
    """Return whether a note states that a function cannot be compiled for lanes."""
    try:
        return _note_of(function).exists()
    except OSError:  # a folder that cannot be read
        return False


@cache
def _note_of(function: Callable[..., Any]) -> Path:
    return FOLDER / f"{stamp_of_made(function)[:32]}.alone"


def is_kept(
    function: Callable[..., Any], classes: Collection[type] | None = None
) -> bool:
    """Return whether the compiled code of a function of the project is cached.

    The arguments have any types, or the given `classes`. The result is True if
    functions are not compiled, with NUMBA_DISABLE_JIT=1.
    """
    cached = getattr(function, "_cache", None)
    if cached is None:
        return True
    file: ByClasses = cached._cache_file
    return file.holds_any() if classes is None else file.holds(classes)


def kept(name: str, make: Callable[[], bytes]) -> bytes:
    """Return the content of a file in FOLDER; make and store a missing file.

    `make` makes the content. The name must depend on every input of the content.
    """
    place = FOLDER / name
    with suppress(OSError):
        content = place.read_bytes()
        note_use(place)
        return content
    content = make()
    with suppress(OSError):  # without the file, later processes make the content again
        FOLDER.mkdir(parents=True, exist_ok=True)
        beside = FOLDER / f"{name}.tmp.{os.getpid():x}"
        beside.write_bytes(content)
        beside.replace(place)
        remove_unused(FOLDER)
    return content


def note_use(index: Path) -> None:
    """Set the time of the index of a cache entry to the present time.

    The time is written at most once per day, so most loads write nothing.
    """
    with suppress(OSError):  # removed meanwhile, or not writable
        if time.time() - index.stat().st_mtime > DAY:
            os.utime(index)


@cache
def remove_unused(folder: Path) -> None:
    """Remove the entries of a cache that no process has used for UNUSED_DAYS.

    A process that is about to load a removed entry compiles the function again.
    """
    entries = defaultdict[str, list[Path]](list)
    for file in folder.iterdir():
        if name := _entry(file.name):
            entries[name].append(file)
    for files in entries.values():
        with suppress(OSError):  # another process removes it
            used = max(file.stat().st_mtime for file in files)
            for file in files if time.time() - used > UNUSED_DAYS * DAY else ():
                file.unlink()


def _entry(file: str) -> str:
    """Return the entry to which a file of the cache belongs; "" for other files.

    An entry has an index `NAME.nbi`, data `NAME.1.nbc`, and remains of an ended
    process, `NAME.nbi.tmp.0f`. Compiled code for a GPU (`NAME.ptx`, `NAME.cubin`) and
    notes (`NAME.alone`, `NAME.promises`, `NAME.stamp`) are entries too.
    """
    name = Path(file.partition(".tmp.")[0])
    if name.suffix == ".nbc":
        return name.with_suffix("").stem
    return name.stem if name.suffix in ENTRIES else ""


def _of_code(code: CodeType) -> str:
    """Return a short hash of the code of a function, since names may repeat."""
    content = list[str]()
    waiting = [code]
    while waiting:
        block = waiting.pop()
        inner = [part for part in block.co_consts if isinstance(part, CodeType)]
        plain = [part for part in block.co_consts if not isinstance(part, CodeType)]
        content += [block.co_code.hex(), repr(plain), repr(block.co_names)]
        waiting += inner
    return hashlib.sha256("\n".join(content).encode()).hexdigest()[:12]


def _classes(arguments: Iterable[Any]) -> Iterator[type[Any]]:
    """Yield the classes of named tuples among argument types, at any depth."""
    for argument in arguments:
        if isinstance(argument, types.NamedTuple | types.NamedUniTuple):
            yield argument.instance_class
        if isinstance(argument, TUPLES):
            yield from _classes(argument.types)
