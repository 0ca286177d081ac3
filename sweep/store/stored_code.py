"""Custom code that computed stored trials.

The text of the code is stored with the study. So a trial runs again with unchanged
code, even if the files have changed. The user who launches a study seals the code with
a key. The code runs again for this user. The code of a study of another user runs only
with `--trust`.
"""

import hmac
import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any

from kernels.catalogue import BUILT_IN, Catalogue
from sweep.errors import CodeError, UnreadableError
from sweep.own_code import (
    MOST_BYTES,
    MOST_FILES,
    PLACES,
    SUFFIX,
    Installed,
    OwnCatalogue,
    OwnCode,
    Sources,
    completed,
    loaded,
    unloaded,
)
from sweep.recordings import SUFFIX as RECORDING_SUFFIX
from sweep.recordings import check_kept
from sweep.spec import CODE, code_file
from sweep.store.locations import Location, patiently
from sweep.store.regular import fits, read_json, regular_size
from sweep.store.store import Store
from sweep.store.user_key import own_key

SHAPE = {"files": {str: str}, "named": {str: str | None}, "about": {}}
PACKAGES = [[str]]
"""Shape of `packages`; files of earlier versions lack `packages` and `folder`."""
MOST = 16_000_000
"""Most bytes of the file; parsed JSON takes many times as much memory."""
PURPOSE = b"boidsweep code "
ENDINGS = (SUFFIX, PLACES, RECORDING_SUFFIX)
"""Endings of the files: code, tables of initial positions, and recordings.

A file with another ending may be a configuration file of a program.
"""


def _is_inside(name: str) -> bool:
    """Return whether a relative path is plain, and stays inside its folder."""
    path = PurePosixPath(name)
    plain = name.isprintable() and path.as_posix() == name and not path.is_absolute()
    return plain and bool(path.parts) and ".." not in path.parts


def seal(sha: str) -> str:
    """Return the seal of this user for code."""
    return hmac.new(own_key(), PURPOSE + sha.encode(), "sha256").hexdigest()


def is_ours(origin: Mapping[str, Any]) -> bool:
    """Return whether this user has launched the custom code of an origin."""
    stored = str(origin["own"]["seal"]).encode(errors="replace")
    return hmac.compare_digest(seal(str(origin["own"]["sha"])).encode(), stored)


def keep_code(store: Store, catalogue: Catalogue) -> None:
    """Store the custom code of a catalogue, if the catalogue has custom code.

    Raises StoreError.
    """
    if isinstance(catalogue, OwnCatalogue):
        code = catalogue.code
        content = {
            "files": code.sources.texts,
            "named": dict(code.named),
            "about": catalogue.description,
            "packages": code.packages,
            "folder": code.folder,
        }
        store.write_code(code.sha, json.dumps(content).encode())


def kept_code(store: Store) -> dict[str, int]:
    """Return the bytes of each file of code that is stored with a study, by sha256."""
    return patiently(lambda: dict(_kept(store)))


def forget_code(store: Store, sha: str) -> None:
    """Delete the file of code with this sha256, if it exists.

    Raises StoreError.
    """
    store.place.remove(code_file(sha))


def _kept(store: Store) -> Iterator[tuple[str, int]]:
    for file in store.folder.iterdir():
        if match := CODE.fullmatch(file.name):
            with suppress(OSError):  # the file is not regular, or has just gone
                yield match[1], _size(file)


def _size(file: Location) -> int:
    return regular_size(file) if isinstance(file, Path) else file.stat().st_size


def codes_of(origins: Iterable[Mapping[str, Any]]) -> set[str]:
    """Return the sha256 of all custom code that computed trials of some origins."""
    return {str(origin["own"]["sha"]) for origin in origins if "own" in origin}


def known_without_code(store: Store, origin: Mapping[str, Any]) -> Catalogue:
    """Return the catalogue of names in trials of an origin, without running code.

    Packages with entries need not be installed. Raises StoreError if the origin is not
    a valid record of a launch.
    """
    catalogue = _stored(store, origin)[0] if "own" in origin else BUILT_IN
    try:
        return (
            completed(catalogue, origin["packages"])
            if "packages" in origin
            else catalogue
        )
    except ValueError as error:
        remedy = "launch the study again"
        raise UnreadableError(
            store.folder, f"the plan is damaged: {error}", remedy
        ) from None


def known_with_code(store: Store, origin: Mapping[str, Any], trust: bool) -> Catalogue:
    """Return the catalogue for running trials with the code that computed them.

    Parameters
    ----------
    store : Store
    origin : mapping
        Origin of the trials.
    trust : bool
        Allow custom code that this user has not launched here.

    Raises
    ------
    CodeError
        If the code has no seal of this user and `trust` is false, or if the code cannot
        run.
    StoreError
        If the stored code is not a valid record of a launch, or if the frames of a
        recording are not on this machine.
    """
    if "own" not in origin:
        return BUILT_IN
    _, code = _stored(store, origin)
    if code.runs and not (trust or is_ours(origin)):
        raise CodeError(
            f"{store.folder}: custom code computed the trials, version"
            f" {code.sha[:12]} ({', '.join(code.runs)}), which you have not"
            " launched here. The code has all your rights: read it (`sweep code`), then"
            " allow it with --trust"
        )
    catalogue = loaded(code)
    for model in catalogue.own.models.values():
        check_kept(model.events)
    return catalogue


def stored_sources(store: Store, origin: Mapping[str, Any]) -> Mapping[str, str]:
    """Return the text of each file of the custom code of an origin, if any."""
    return _stored(store, origin)[1].sources.texts if "own" in origin else {}


def stored_folder(store: Store, sha: str) -> str:
    """Return the path from the folder of a spec to the folder of its code."""
    return _read(store, sha)[1].folder


def other_now(store: Store, origin: Mapping[str, Any]) -> list[Path]:
    """Return the files next to the spec that differ from the code of an origin."""
    if "own" not in origin:
        return []
    code = _stored(store, origin)[1]
    folder = Path(str(origin.get("spec_path", ""))).parent / code.folder
    texts = code.sources.texts
    return [folder / name for name in texts if _differs(folder / name, texts[name])]


def _packages(stored: Mapping[str, Any]) -> tuple[Installed, ...]:
    """Return the packages of stored code.

    Raises ValueError if the record does not describe packages.
    """
    packages = stored.get("packages", [])
    size = len(Installed._fields)
    if not fits(packages, PACKAGES) or any(len(fields) != size for fields in packages):
        raise ValueError("the record of packages is not valid")
    return tuple(Installed(*fields) for fields in packages)


def _folder(stored: Mapping[str, Any]) -> str:
    """Return the path from the folder of the spec to the folder of its code.

    Raises ValueError if the record has no valid path.
    """
    folder = stored.get("folder", ".")
    if not isinstance(folder, str) or not folder.isprintable():
        raise ValueError("the folder is not a path")
    return folder


def _differs(path: Path, text: str) -> bool:
    """Return whether a file exists and has a different text."""
    try:
        if not path.is_file() or path.is_symlink():
            return False
        too_large = path.stat().st_size > MOST_BYTES
        return too_large or path.read_text("utf-8-sig") != text
    except (OSError, ValueError):
        return False


def _stored(store: Store, origin: Mapping[str, Any]) -> tuple[OwnCatalogue, OwnCode]:
    return _read(store, origin["own"]["sha"])


@lru_cache(maxsize=16)
def _read(store: Store, sha: str) -> tuple[OwnCatalogue, OwnCode]:
    file = store.folder / code_file(sha)
    remedy = "launch the study again, or copy the file from where it was launched"
    if not CODE.fullmatch(file.name):
        raise UnreadableError(store.folder, f'no code has the name "{sha}"', remedy)
    try:
        stored = patiently(lambda: read_json(file, MOST, SHAPE))
        sources = Sources(tuple(sorted(stored["files"].items())))
        named = tuple(stored["named"].items())
        code = OwnCode(sources, named, _packages(stored), _folder(stored))
        if code.sha != sha:
            raise ValueError("the sha256 of the content differs from the file name")
        if astray := [name for name in stored["files"] if not _is_inside(name)]:
            raise ValueError(f"a file is outside the folder of the code: {astray[0]}")
        if odd := [name for name in stored["files"] if not name.endswith(ENDINGS)]:
            raise ValueError(f"a file is not code: {odd[0]}")
        if len(stored["files"]) > MOST_FILES or not dict(code.named):
            raise ValueError("too many files, or no file with a used name")
        files = {name for name, _ in named if not code.package_of(name)}
        if lost := files - stored["files"].keys():
            raise ValueError(f"the file {min(lost)} is missing")
        return unloaded(code, json.dumps(stored["about"])), code
    except (OSError, ValueError) as error:
        wrong = f"the code of the trials cannot be read: {error}"
        raise UnreadableError(file, wrong, remedy) from None
