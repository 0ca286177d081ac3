"""Where numba keeps what it has compiled, and how it knows that it may use it again.

numba's own check looks at the file of a function, and not at the functions that it
calls in other files (numba issue 1833). Here the stamp of a function decides, which
covers them too: an edit compiles what it concerns again, and nothing else. Functions of
equal stamps share what is compiled, in whatever folder their sources lie.

What an edit leaves behind is removed when nobody has loaded it for a month.

A process that compiles nothing begins quickly: it imports nothing with which numba
compiles, and takes no source apart. A note in the same folder has the stamp of each
function of ours. The name of a note has a hash of all our sources, so that a note of
other sources is never read.
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
    """The folder of compiled kernels, as the environment says."""
    home = Path(
        os.environ.get("NUMBA_CACHE_DIR")
        or os.environ.get("XDG_CACHE_HOME")
        or Path.home() / ".cache"
    )
    return home / "boidsweep" / "kernels"


FOLDER = usual_folder()
"""That of this process, whatever becomes of the environment."""
NOT_KEPT: dict[str, str] = {}
"""The folders where what was compiled could not be kept, and why."""
OURS: WeakSet[Callable[..., Any]] = WeakSet()
"""The functions that `kernels.jit` compiles, in whatever package they stand, and those
of kernels.fours.
"""
MADE_OF: WeakKeyDictionary[Callable[..., Any], Callable[..., Any]] = WeakKeyDictionary()
"""Of functions that are made of others, for lanes, these others."""
MAKERS = "lanes/", "device/", "jit.py"
"""How the files of what makes them begin."""
OUR_PACKAGE = __name__.partition(".")[0]
DAY, UNUSED_DAYS = 86_400.0, 30
CONFIG: Any = config
"""numba's settings, which it declares at run time."""
USUAL_OPT = 3
"""The level of optimization of numba where nothing sets another."""
STAMP_DIGITS = 64
ENTRIES = ".nbi", ".ptx", ".cubin", ".alone", ".promises", ".stamp"
"""How the names of files end that are entries of the cache."""

TUPLES = (types.Tuple, types.UniTuple, types.NamedTuple, types.NamedUniTuple)


class ByStamp(_CacheLocator):
    """Tells numba the place of a function of ours. Its stamp is found when the function
    is called: most are only parts of others, and are never loaded.
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
        return str(FOLDER)

    def ensure_cache_path(self) -> None:
        """Nothing: `ByClasses.save` does what can be done."""

    def get_source_stamp(self) -> str:
        return ""  # `ByClasses` asks for the stamp

    def get_disambiguator(self) -> str:
        # What is compiled names classes by their modules: those of another package,
        # which may be gone, must not be met.
        return f"{self.package}-{self.code}"


class OfOurs(CompileResultCacheImpl):
    """What numba's cache asks about a function of ours. Its place is that of `ByStamp`:
    numba would look it up in its settings, which change with the environment.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._locator = ByStamp(function)
        self._lineno = function.__code__.co_firstlineno
        name = f"{Path(self._locator._py_file).stem}.{function.__qualname__}"
        numbas: Any = super()
        self._filename_base = numbas.get_filename_base(name, sys.abiflags)

    def check_cachable(self, result: Any) -> bool:
        """Whether what is compiled means the same in another process. It does not where
        it has addresses: of a table of over a megabyte, of which numba warns, and
        without optimization of the functions that it calls.
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
    """What decides whether a function must be compiled again."""
    if function not in MADE_OF:
        return noted_stamp(function)
    return stamp_of_made(MADE_OF[function])


def stamp_of_made(*functions: Callable[..., Any]) -> str:
    """What decides whether what is made of functions must be compiled again."""
    plain = [getattr(one, "py_func", one) for one in functions]
    stamps = " ".join([*map(noted_stamp, plain), _makers()])
    return hashlib.sha256(stamps.encode()).hexdigest()


@cache
def _makers() -> str:
    """The stamp of what makes functions of others."""
    return noted(
        "makers",
        lambda: stamp_of_texts(
            (name, text)
            for name, text in texts_of(OUR_PACKAGE)
            if name.startswith(MAKERS)
        ),
    )


def noted_stamp(function: Callable[..., Any]) -> str:
    """`kernels.stamps.code_stamp` of a function. That of one of ours is noted."""
    if function.__module__.partition(".")[0] != OUR_PACKAGE:
        return code_stamp(function)
    about = f"{function.__module__} {function.__qualname__}"
    return noted(about, lambda: code_stamp(function))


def noted(about: str, find: Callable[[], str]) -> str:
    """A sha256, in hexadecimal, that follows from our sources as this process has read
    them: found once for what `about` says, and noted.
    """
    about = f"{text_hash(OUR_PACKAGE)} {about}"
    key = hashlib.sha256(about.encode()).hexdigest()[:32]
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
    """The stamps that are noted in the folder, by what they are of. All is in the names
    of the notes, which are empty: so a note is there as a whole, or it is not.
    """
    found = {}
    for note in FOLDER.glob("*.stamp"):
        key, _, stamp = note.stem.partition("-")
        if key and len(stamp) == STAMP_DIGITS:
            found[key] = stamp
    return found


class ByClasses:
    """The files of a function in numba's cache: one for each set of classes that its
    arguments have.

    The index in such a file names the classes, and is loaded as a whole. An own model
    may call functions of ours with its own parameters, and a later version of ours with
    classes that this one lacks: where they are not at hand, they must not be met.

    What only kernels can call, `within` them, is kept apart from what Python calls.
    """

    def __init__(
        self, function: Callable[..., Any], cache: Any, within: bool = False
    ) -> None:
        packages = function.__module__, __name__
        self._ours = {name.partition(".")[0] for name in packages}
        self._package = function.__module__.partition(".")[0]
        self._folder, self._cache = cache.cache_path, cache
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
        """What numba's `load_overload` does, but for `context.refresh`. It imports all
        with which numba could compile, and scipy, in 0.3 s, and numba also calls it
        before it compiles. Our kernels need none of it to be loaded; those of others
        may call what it brings.
        """
        rtsys.initialize(context)
        with self._cache._guard_against_spurious_io_errors():
            return self._cache._load_overload(signature, context)

    def load(self, key: Any) -> Any:
        """What is compiled for a key, which begins with the types of the arguments;
        None where it is not there.
        """
        file = self._file(key[0])
        found = file.load(key)
        if found is not None:
            note_use(Path(file._index_path))
        return found

    def save(self, key: Any, data: Any) -> None:
        """Keep what is compiled for a key, and once in a process remove what nobody
        uses. What cannot be written is used all the same, and NOT_KEPT has why.
        """
        folder = Path(self._folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file(key[0]).save(key, data)
            remove_unused(folder)
        except OSError as error:
            NOT_KEPT[self._folder] = error.strerror or str(error)

    def holds_any(self) -> bool:
        """Whether the function is compiled already, for arguments of any types."""
        pattern = f"{glob.escape(self._name)}*.nbi"
        return any(Path(self._folder).glob(pattern))

    def holds(self, classes: Iterable[type]) -> bool:
        """Whether the function is compiled already, for arguments of these classes."""
        return Path(self._folder, f"{self._name_with(classes)}.nbi").exists()

    def _loaded(self) -> list[str]:
        """The modules of the function's package: compiled code holds their numbers."""
        start = f"{self._package}."
        return [
            name
            for name in list(sys.modules)
            if name == self._package or name.startswith(start)
        ]

    def _file(self, arguments: Any) -> Any:
        made: Any = IndexDataCacheFile
        return made(self._folder, self._name_with(_classes(arguments)), self._stamp)

    def _name_with(self, classes: Iterable[type]) -> str:
        """The name of the file for arguments of these classes."""
        taken = {f"{one.__module__}.{one.__qualname__}" for one in classes}
        packages = {name.partition(".")[0] for name in taken}
        held = [] if self._package == OUR_PACKAGE else [values(self._loaded())[:16]]
        if taken:
            names = " ".join(sorted(taken))
            held.append(hashlib.sha256(names.encode()).hexdigest()[:8])
        return "-".join([self._name, *held, *sorted(packages - self._ours)])


def _unusual() -> Iterator[str]:
    """Settings of numba which change what is compiled, and which numba's own index does
    not name, where the user has set them.
    """
    if CONFIG.OPT != USUAL_OPT:
        yield f"opt{int(CONFIG.OPT)}-"
    if CONFIG.BOUNDSCHECK is not None:
        yield f"bounds{CONFIG.BOUNDSCHECK}-"


def note_alone(function: Callable[..., Any]) -> None:
    """Note that a function cannot be compiled for lanes: until its code changes, and
    for UNUSED_DAYS at most.
    """
    _note(_note_of(function))


def _note(place: Path) -> None:
    with suppress(OSError):  # without the note others find the same out again
        place.parent.mkdir(parents=True, exist_ok=True)
        place.touch()


def is_noted_alone(function: Callable[..., Any]) -> bool:
    """Whether it is known that a function cannot be compiled for lanes."""
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
    """Whether what a function of ours is compiled to is kept, for arguments of any
    types or of these `classes`; True where it is not to be compiled, with
    NUMBA_DISABLE_JIT=1.
    """
    cached = getattr(function, "_cache", None)
    if cached is None:
        return True
    file: ByClasses = cached._cache_file
    return file.holds_any() if classes is None else file.holds(classes)


def kept(name: str, make: Callable[[], bytes]) -> bytes:
    """The content of the file of this name in FOLDER; what `make` makes, which is kept
    there, where there is no such file. The name must follow from all that the content
    depends on.
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
    """Note that an entry of the cache is used now, by the time of its index; at most
    once a day, so that reading seldom writes.
    """
    with suppress(OSError):  # removed meanwhile, or not ours to write
        if time.time() - index.stat().st_mtime > DAY:
            os.utime(index)


@cache
def remove_unused(folder: Path) -> None:
    """Remove from a cache what nobody has used for UNUSED_DAYS.

    A process that is about to load it compiles it again.
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
    """The entry to which a file of numba's belongs: an index `NAME.nbi`, data
    `NAME.1.nbc`, and what an ended process has left, `NAME.nbi.tmp.0f`. What is
    compiled for a GPU, `NAME.ptx` and `NAME.cubin`, and a note of ours, `NAME.alone`,
    `NAME.promises` or `NAME.stamp`, are ones too; "" for others.
    """
    name = Path(file.partition(".tmp.")[0])
    if name.suffix == ".nbc":
        return name.with_suffix("").stem
    return name.stem if name.suffix in ENTRIES else ""


def _of_code(code: CodeType) -> str:
    """What a function is compiled from, as a few digits: several may have one name."""
    content, waiting = [], [code]
    while waiting:
        one = waiting.pop()
        inner = [part for part in one.co_consts if isinstance(part, CodeType)]
        plain = [part for part in one.co_consts if not isinstance(part, CodeType)]
        content += [one.co_code.hex(), repr(plain), repr(one.co_names)]
        waiting += inner
    return hashlib.sha256("\n".join(content).encode()).hexdigest()[:12]


def _classes(arguments: Iterable[Any]) -> Iterator[type[Any]]:
    """The named tuples among types of arguments, and within them."""
    for one in arguments:
        if isinstance(one, types.NamedTuple | types.NamedUniTuple):
            yield one.instance_class
        if isinstance(one, TUPLES):
            yield from _classes(one.types)
