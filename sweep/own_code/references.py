"""References of a spec to code.

A spec names files, such as `model: ./vortex.py`, `metrics: [./mine.py]` and `map:
./maze.py`, each with `:NAME` if the file has several entries. A spec also names tables,
such as `start_draws: ./flock.csv`, and modules of installed packages, such as `model:
their_package.vortex:MODEL`. A file or module brings all offered entries, so that
further keys name the entries by plain names.
"""

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from sweep.errors import CodeError
from sweep.own_code.catalogue import OwnCatalogue, OwnCode, loaded
from sweep.own_code.entries import MODEL
from sweep.own_code.installed import Installed, installed_package
from sweep.own_code.places import PLACES
from sweep.own_code.sources import SUFFIX, gather
from sweep.recordings import SUFFIX as RECORDING_SUFFIX
from sweep.spec import RECORDING, Entry, Place, check_beside
from sweep.text import unknown

FILE = re.compile(r"(?P<path>[^:]*\.(?:py|csv))(?::(?P<name>\w+))?")
MODULE = re.compile(r"(?P<path>[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):(?P<name>\w+)")
RECORDED = f"{RECORDING}{RECORDING_SUFFIX}"
"""Name of the text of the section `recording` among the files of a spec."""
BESIDE = {
    "model": "the recorded individuals follow no model",
    "replicates": "each event of the recording is a trial",
    "seeds": "a recording has no random numbers",
}
"""Keys that a recording excludes, with the reasons."""
KINDS = {
    "model": "models",
    "metrics": "metrics",
    "series": "metrics",
    "map": "maps",
    "start_draws": "starts",
    "profiles": "profiles",
    "sample": "samplers",
}
"""Keys of a spec that may name code, and the kind of entries of each key."""


@dataclass(frozen=True)
class Reference:
    """A file or module that a spec names.

    Attributes
    ----------
    entry : Entry
        Entry of the spec that names the file or module.
    origin : str
        Path of the file from the folder of code, or name of the module.
    kind : str
        Kind of entry that the spec takes, such as ``models``.
    name : str or None
        Name of the entry in the file; None for all entries of the kind, or the only
        entry.
    """

    entry: Entry
    origin: str
    kind: str
    name: str | None

    @property
    def text(self) -> str:
        """The text of the spec that names the file or module."""
        return str(self.entry.value)

    @property
    def is_file(self) -> bool:
        """True for a file, False for a module or a recording."""
        return self.origin.endswith((SUFFIX, PLACES))

    @property
    def is_recording(self) -> bool:
        """True for the section `recording`."""
        return self.origin == RECORDED

    @property
    def runs(self) -> bool:
        """True for code, False for a table or a recording."""
        return not self.origin.endswith((PLACES, RECORDED))


def references(root: Entry, code_from: Path | None = None) -> list[Reference]:
    """Return all files and modules that a spec names.

    Raises SpecError for paths that lead out of the folder from which code is taken: the
    folder of the spec, or `code_from`.
    """
    named = list(_within(root, code_from))
    if isinstance(root.value, dict) and (recording := root.get(RECORDING)):
        named.append(Reference(recording, RECORDED, "models", None))
    return named


def _within(entry: Entry, code_from: Path | None) -> Iterator[Reference]:
    if isinstance(entry.value, dict):
        for key in entry.value:
            yield from _within(entry.child(key), code_from)
    elif isinstance(entry.value, list):
        for index in range(len(entry.value)):
            yield from _within(entry.child(index), code_from)
    elif isinstance(entry.value, str) and (
        keys := [part for part in reversed(entry.place) if part in KINDS]
    ):
        kind = KINDS[str(keys[0])]
        if match := FILE.fullmatch(entry.value):
            file = _inside(entry, match["path"], code_from)
            if file.endswith(PLACES) and keys[0] != "start_draws":
                raise entry.error(f"{file} is a table; allowed: only in start_draws")
            yield Reference(entry, file, kind, match["name"])
        elif match := MODULE.fullmatch(entry.value):
            yield Reference(entry, match["path"], kind, match["name"])


def _inside(entry: Entry, path: str, code_from: Path | None) -> str:
    """Return the path of a file from the folder from which code is taken."""
    parts = path.split("/")
    if parts[0] not in (".", "..", "") and len(parts) == 1:
        raise entry.error(f'write "./{path}" for a file next to the spec')
    if code_from is None:
        if parts[0] != "." or ".." in parts or "" in parts[1:]:
            raise entry.error(
                f'"{path}" may be outside the folder of the spec. Code comes only from'
                " that folder: copy the file there and write ./NAME.py, or allow"
                " another folder with --code-from FOLDER"
            )
        return "/".join(part for part in parts[1:] if part != ".")
    if parts[0] not in (".", "..") or "" in parts:
        raise entry.error(f'"{path}" begins neither with ./ nor with ../')
    file = Path(os.path.normpath(entry.document.path.parent.resolve() / path))
    if not file.is_relative_to(code_from.resolve()):
        raise entry.error(
            f'"{path}" is outside {code_from}, the only folder of code (--code-from)'
        )
    return file.relative_to(code_from.resolve()).as_posix()


def own_code(
    root: Entry, named: list[Reference], code_from: Path | None = None
) -> OwnCode:
    """Return the code that a spec names; nothing runs.

    Parameters
    ----------
    root : Entry
        The spec.
    named : list of Reference
        The references of the spec, from `references`.
    code_from : Path, optional
        Folder of the files of code; by default the folder of the spec.

    Raises
    ------
    SpecError
        If a file cannot be read, or a package is not installed.
    """
    models = dict[str, str | None]()
    for reference in named:
        model = (reference.name or MODEL) if reference.kind == "models" else None
        models[reference.origin] = model or models.get(reference.origin)
    beside = root.document.path.parent
    folder = code_from or beside
    packages = dict[str, Installed]()
    for reference in named:
        try:
            if reference.is_file:
                gather(folder, [reference.origin])
            elif not reference.is_recording:
                package = installed_package(reference.origin)
                packages[package.name] = package
        except CodeError as error:
            raise reference.entry.error(str(error)) from None
    files = {reference.origin for reference in named if reference.is_file}
    up = os.path.relpath(folder.resolve(), beside.resolve())
    sources = gather(folder, [origin for origin in models if origin in files])
    for reference in named:
        if reference.is_recording:
            from sweep.recordings import described  # workers read no tables

            sources = sources.also(RECORDED, described(reference.entry))
    return OwnCode(
        sources,
        tuple(models.items()),
        tuple(sorted(packages.values())),
        Path(up).as_posix(),
    )


def known_to(
    root: Entry, named: list[Reference], code_from: Path | None = None
) -> OwnCatalogue:
    """Return the catalogue of a spec that names code. The code runs.

    Parameters
    ----------
    root, named, code_from
        As in `own_code`; there is at least one reference.

    Raises
    ------
    SpecError
        If the code cannot be read or used.
    """
    code = own_code(root, named, code_from)
    try:
        return loaded(code)
    except CodeError as error:
        blamed = (reference for reference in named if reference.origin == error.file)
        raise next(blamed, named[0]).entry.error(str(error)) from error


def resolved(root: Entry, named: list[Reference], catalogue: OwnCatalogue) -> Entry:
    """Return the spec with plain names in place of files and modules.

    Parameters
    ----------
    root : Entry
        The spec.
    named : list of Reference
        The references of the spec.
    catalogue : OwnCatalogue
        Catalogue with all entries of the references.

    Raises
    ------
    SpecError
        If a file has no such entry, or several entries for a key that needs one.
    """
    document = replace(root.document, lines=dict(root.document.lines))
    by_place = {reference.entry.place: reference for reference in named}
    value = _replaced(root.value, (), by_place, catalogue, lines=document.lines)
    if any(reference.is_recording for reference in named):
        value = value | _as_model(root, catalogue)
    return replace(root, document=document, value=value)


def _as_model(root: Entry, catalogue: OwnCatalogue) -> dict[str, Any]:
    """Return the keys that a recording gives: the model, and a trial per event.

    Raises SpecError for keys that a recording excludes.
    """
    check_beside(root, RECORDING, BESIDE)
    events = catalogue.models[RECORDING].events
    return {"model": RECORDING, "replicates": len(events)}


def _replaced(
    value: Any,
    place: Place,
    named: dict[Place, Reference],
    catalogue: OwnCatalogue,
    lines: dict[Place, int],
) -> Any:
    if isinstance(value, dict):
        return {
            key: _replaced(child, (*place, key), named, catalogue, lines=lines)
            for key, child in value.items()
        }
    if isinstance(value, list):
        children = list[Any]()
        lines_of = list[int | None]()
        for index, child in enumerate(value):
            here = (*place, index)
            names = _names(named[here], catalogue) if here in named else None
            new = names or [_replaced(child, here, named, catalogue, lines=lines)]
            children += new
            lines_of += [lines.get(here)] * len(new)
        if len(children) > len(value):  # a list of names, each in the line of its file
            lines |= {(*place, k): line for k, line in enumerate(lines_of) if line}
        return children
    if place in named:
        names = _names(named[place], catalogue)
        if len(names) > 1:
            reference = named[place]
            raise reference.entry.error(
                f"{reference.origin} has several {reference.kind}: write"
                f" {reference.entry.value}:NAME, with one of {', '.join(names)}"
            )
        return names[0]
    return value


def _names(reference: Reference, catalogue: OwnCatalogue) -> list[str]:
    """Return the names of the entries that a reference selects."""
    origin = reference.origin
    kind = reference.kind
    names = [
        name
        for (kind_of_entry, name), file in catalogue.origins.items()
        if kind_of_entry == kind and file == origin
    ]
    if not names:
        raise reference.entry.error(f"{origin} has no {kind.upper()}")
    if reference.name is None or kind == "models":
        return names
    if reference.name not in names:
        message = unknown(f"{kind[:-1]} of {origin}", reference.name, names)
        raise reference.entry.error(message)
    return [reference.name]
