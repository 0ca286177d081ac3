"""Cache of compiled kernels, and the rule by which a cached kernel is still valid.

numba's own check looks at the file of a function, and not at the functions that it
calls in other files (numba issue 1833). Here the stamp of a function decides, which
covers them too: an edit compiles again what it concerns, and nothing else. Functions of
equal stamps share what is compiled, in whatever folder their sources are.

Old entries are removed when nobody has loaded them for a month.

A process that compiles nothing begins quickly: it imports nothing with which numba
compiles, and takes no source apart. A note in the same folder has the stamp of each
built-in function. The name of a note has a hash of all sources of the package, so that
a note of other sources is never read.
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
    """Return the folder of compiled kernels that the environment names."""
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
"""Functions that `kernels.jit` compiles, in any package, and those of kernels.fours."""
MADE_OF: WeakKeyDictionary[Callable[..., Any], Callable[..., Any]] = WeakKeyDictionary()
"""Original functions of functions that are made for lanes."""
MAKERS = "lanes/", "device/", "jit.py"
"""Beginnings of the names of files that make functions of others."""
OUR_PACKAGE = __name__.partition(".")[0]
DAY = 86_400.0
UNUSED_DAYS = 30
CONFIG: Any = config
"""numba's settings, which it declares at run time."""
USUAL_OPT = 3
"""Optimization level of numba by default."""
STAMP_DIGITS = 64
ENTRIES = ".nbi", ".ptx", ".cubin", ".alone", ".promises", ".stamp"
"""Endings of the names of files that are entries of the cache."""

TUPLES = (types.Tuple, types.UniTuple, types.NamedTuple, types.NamedUniTuple)


class ByStamp(_CacheLocator):
    """Tells numba the location of a function of the project.

    Its stamp is computed when the function is called: most functions are only parts of
    others, and are never loaded.
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
        """The stamp of the function as it was when it was imported."""
        return _stamp(self.function)

    def get_cache_path(self) -> str:
        """Return the folder of the cache."""
        return str(FOLDER)

    def ensure_cache_path(self) -> None:
        """Do nothing: `ByClasses.save` makes the folder if it can."""

    def get_source_stamp(self) -> str:
        """Return "": `ByClasses` asks for the stamp."""
        return ""  # `ByClasses` asks for the stamp

    def get_disambiguator(self) -> str:
        # What is compiled names classes by their modules: those of another package,
        # which may be gone, must not be met.
        """Return the package and the code of the function."""
        return f"{self.package}-{self.code}"


class OfOurs(CompileResultCacheImpl):
    """Answers to numba's cache about a function of the project.

    Its location is the one of `ByStamp`: numba would look it up in its settings, which
    change with the environment.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._locator = ByStamp(function)
        self._lineno = function.__code__.co_firstlineno
        name = f"{Path(self._locator._py_file).stem}.{function.__qualname__}"
        numbas: Any = super()
        self._filename_base = numbas.get_filename_base(name, sys.abiflags)

    def check_cachable(self, result: Any) -> bool:
        """Return whether compiled code means the same in another process.

        It does not if it has addresses: of a table of over a megabyte, of which numba
        warns, and without optimization, of the functions that it calls.
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
    """Return the hash that decides whether code made of functions is valid."""
    plain = [getattr(function, "py_func", function) for function in functions]
    stamps = " ".join([*map(noted_stamp, plain), _makers()])
    return hashlib.sha256(stamps.encode()).hexdigest()


@cache
def _makers() -> str:
    """Return the stamp of the files that make functions of others."""
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

    The stamp of a built-in function is noted.
    """
    if function.__module__.partition(".")[0] != OUR_PACKAGE:
        return code_stamp(function)
    subject = f"{function.__module__} {function.__qualname__}"
    return noted(subject, lambda: code_stamp(function))


def noted(subject: str, find: Callable[[], str]) -> str:
    """Return a sha256, in hexadecimal, that follows from the sources of the package.

    The sources are as this process has read them. `find` computes the hash of `subject`
    once, and the hash is noted.
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
    """Return the stamps that are noted in the folder, by their keys.

    Everything is in the names of the notes, which are empty: so a note is either
    complete or absent.
    """
    stamps = {}
    for note in FOLDER.glob("*.stamp"):
        key, _, stamp = note.stem.partition("-")
        if key and len(stamp) == STAMP_DIGITS:
            stamps[key] = stamp
    return stamps


class ByClasses:
    """Files of a function in numba's cache: one per set of classes of its arguments.

    The index in such a file names the classes, and is loaded as a whole. A custom model
    may call built-in functions with its own parameters, and a later version of the
    package with classes that this one lacks: classes that cannot be imported must not
    be met.

    Functions that only kernels can call, `within` them, are kept apart from functions
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
        """Do the same as numba's `load_overload`, but for `context.refresh`.

        The refresh imports all with which numba could compile, and scipy, in 0.3 s, and
        numba also calls it before it compiles. Built-in kernels need none of it to be
        loaded; custom ones may call what it brings.
        """
        rtsys.initialize(context)
        with self._cache._guard_against_spurious_io_errors():
            return self._cache._load_overload(signature, context)

    def load(self, key: Any) -> Any:
        """Return the compiled code for a key; None if there is none.

        The key begins with the types of the arguments.
        """
        file = self._file(key[0])
        compiled = file.load(key)
        if compiled is not None:
            note_use(Path(file._index_path))
        return compiled

    def save(self, key: Any, data: Any) -> None:
        """Keep the compiled code for a key, and remove unused entries once per process.

        Code that cannot be written is used nevertheless, and NOT_KEPT has the reason.

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

        Compiled code holds their numbers.
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

    They change what is compiled, and numba's own index does not name them.
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
    with suppress(OSError):  # without the note others find the same out again
        place.parent.mkdir(parents=True, exist_ok=True)
        place.touch()


def is_noted_alone(function: Callable[..., Any]) -> bool:
    """Return whether a note tells that a function cannot be compiled for lanes."""
    try:
        return _note_of(function).exists()
    except OSError:  # a folder that nobody may look into
        return False


@cache
def _note_of(function: Callable[..., Any]) -> Path:
    return FOLDER / f"{stamp_of_made(function)[:32]}.alone"


def is_kept(
    function: Callable[..., Any], classes: Collection[type] | None = None
) -> bool:
    """Return whether the compiled code of a function of the project is cached.

    The arguments have any types, or these `classes`. It is True where functions are not
    compiled, with NUMBA_DISABLE_JIT=1.
    """
    cached = getattr(function, "_cache", None)
    if cached is None:
        return True
    file: ByClasses = cached._cache_file
    return file.holds_any() if classes is None else file.holds(classes)


def kept(name: str, make: Callable[[], bytes]) -> bytes:
    """Return the content of a file in FOLDER, made and kept if there is none.

    `make` makes the content. The name must follow from all that the content depends on.
    """
    place = FOLDER / name
    with suppress(OSError):
        content = place.read_bytes()
        note_use(place)
        return content
    content = make()
    with suppress(OSError):  # without it others make the same again
        FOLDER.mkdir(parents=True, exist_ok=True)
        beside = FOLDER / f"{name}.tmp.{os.getpid():x}"
        beside.write_bytes(content)
        beside.replace(place)
        remove_unused(FOLDER)
    return content


def note_use(index: Path) -> None:
    """Note that an entry of the cache is used now, by the time of its index.

    The time is written at most once per day, so that reading seldom writes.
    """
    with suppress(OSError):  # removed meanwhile, or not ours to write
        if time.time() - index.stat().st_mtime > DAY:
            os.utime(index)


@cache
def remove_unused(folder: Path) -> None:
    """Remove the entries of a cache that nobody has used for UNUSED_DAYS.

    A process that is about to load one compiles it again.
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
    process, `NAME.nbi.tmp.0f`. Code that is compiled for a GPU, `NAME.ptx` and
    `NAME.cubin`, and a note, `NAME.alone`, `NAME.promises` or `NAME.stamp`, are entries
    too.
    """
    name = Path(file.partition(".tmp.")[0])
    if name.suffix == ".nbc":
        return name.with_suffix("").stem
    return name.stem if name.suffix in ENTRIES else ""


def _of_code(code: CodeType) -> str:
    """Return a short hash of the code of a function: several may have one name."""
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
    """Yield the classes of named tuples among types of arguments, and within them."""
    for argument in arguments:
        if isinstance(argument, types.NamedTuple | types.NamedUniTuple):
            yield argument.instance_class
        if isinstance(argument, TUPLES):
            yield from _classes(argument.types)
