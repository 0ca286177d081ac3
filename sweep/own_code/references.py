"""Where a spec names code: files as `model: ./vortex.py`, `metrics: [./mine.py]` and
`map: ./maze.py`, each with `:NAME` where the file has several; `start_draws:
./flock.csv`; and modules of installed packages, as `model: their_package.vortex:MODEL`.

A file or module brings all that it offers, so other keys name its entries by their
plain names.
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
from sweep.spec.document import Entry, Place
from sweep.text import unknown

FILE = re.compile(r"(?P<path>[^:]*\.(?:py|csv))(?::(?P<name>\w+))?")
MODULE = re.compile(r"(?P<path>[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*):(?P<name>\w+)")
KINDS = {
    "model": "models",
    "metrics": "metrics",
    "series": "metrics",
    "map": "maps",
    "start_draws": "starts",
    "sample": "samplers",
}
"""The keys of a spec that may name code, and what they want from it."""


@dataclass(frozen=True)
class Reference:
    """What a spec names at `entry`: the path of a file from the folder of code, or a
    module; the kind of entry that is wanted; and its name there, None for all or the
    one.
    """

    entry: Entry
    origin: str
    kind: str
    name: str | None

    @property
    def is_file(self) -> bool:
        """Whether it is a file, and no module."""
        return self.origin.endswith((SUFFIX, PLACES))

    @property
    def runs(self) -> bool:
        """Whether it is code, and no table."""
        return not self.origin.endswith(PLACES)


def references(root: Entry, code_from: Path | None = None) -> list[Reference]:
    """All files and modules that a spec names.

    Raises SpecError for paths that lead out of the folder from which code is taken:
    that of the spec, or `code_from`.
    """
    return list(_within(root, code_from))


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
        if found := FILE.fullmatch(entry.value):
            file = _inside(entry, found["path"], code_from)
            if file.endswith(PLACES) and keys[0] != "start_draws":
                raise entry.error(f"{file} can only be a start (start_draws)")
            yield Reference(entry, file, kind, found["name"])
        elif found := MODULE.fullmatch(entry.value):
            yield Reference(entry, found["path"], kind, found["name"])


def _inside(entry: Entry, path: str, code_from: Path | None) -> str:
    """The path of a file from the folder from which code is taken."""
    parts = path.split("/")
    if parts[0] not in (".", "..", "") and len(parts) == 1:
        raise entry.error(f'a file beside the spec is written "./{path}"')
    if code_from is None:
        if parts[0] != "." or ".." in parts or "" in parts[1:]:
            raise entry.error(
                f'"{path}" may lie outside the folder of the spec, from where no code'
                " is taken: put the file beside the spec, and write ./NAME.py, or allow"
                " its folder with --code-from FOLDER"
            )
        return "/".join(part for part in parts[1:] if part != ".")
    if parts[0] not in (".", "..") or "" in parts:
        raise entry.error(f'"{path}" begins neither with ./ nor with ../')
    whole = os.path.normpath(entry.document.path.parent.resolve() / path)
    if not Path(whole).is_relative_to(code_from.resolve()):
        raise entry.error(
            f'"{path}" lies outside {code_from}, from where alone code is taken'
            " (--code-from)"
        )
    return Path(whole).relative_to(code_from.resolve()).as_posix()


def own_code(
    root: Entry, named: list[Reference], code_from: Path | None = None
) -> OwnCode:
    """The code that a spec names. Raises SpecError for what cannot be read."""
    wanted, packages = dict[str, str | None](), dict[str, Installed]()
    for one in named:
        model = (one.name or MODEL) if one.kind == "models" else None
        wanted[one.origin] = model or wanted.get(one.origin)
    beside = root.document.path.parent
    folder = code_from or beside
    for one in named:
        try:
            if one.is_file:
                gather(folder, [one.origin])
            else:
                package = installed_package(one.origin)
                packages[package.name] = package
        except CodeError as error:
            raise one.entry.error(str(error)) from None
    files = {one.origin for one in named if one.is_file}
    up = os.path.relpath(folder.resolve(), beside.resolve())
    return OwnCode(
        gather(folder, [origin for origin in wanted if origin in files]),
        tuple(wanted.items()),
        tuple(sorted(packages.values())),
        Path(up).as_posix(),
    )


def known_to(
    root: Entry, named: list[Reference], code_from: Path | None = None
) -> OwnCatalogue:
    """The catalogue of a spec that names code; it runs it. Raises SpecError."""
    code = own_code(root, named, code_from)
    try:
        return loaded(code)
    except CodeError as error:
        at = next((one for one in named if one.origin == error.file), named[0])
        raise at.entry.error(str(error)) from error


def resolved(root: Entry, named: list[Reference], known: OwnCatalogue) -> Entry:
    """The same spec with plain names in the place of files. Raises SpecError where a
    file has no such entry, or none that is meant alone.
    """
    document = replace(root.document, lines=dict(root.document.lines))
    by_place = {one.entry.place: one for one in named}
    value = _replaced(root.value, (), by_place, known, document.lines)
    return replace(root, document=document, value=value)


def _replaced(
    value: Any,
    place: Place,
    named: dict[Place, Reference],
    known: OwnCatalogue,
    lines: dict[Place, int],
) -> Any:
    if isinstance(value, dict):
        return {
            key: _replaced(one, (*place, key), named, known, lines)
            for key, one in value.items()
        }
    if isinstance(value, list):
        found, at = list[Any](), list[int | None]()
        for index, one in enumerate(value):
            here = (*place, index)
            names = _names(named[here], known) if here in named else None
            new = names or [_replaced(one, here, named, known, lines)]
            found += new
            at += [lines.get(here)] * len(new)
        if len(found) > len(value):  # a list of names, each in the line of its file
            lines |= {(*place, k): line for k, line in enumerate(at) if line}
        return found
    if place in named:
        names = _names(named[place], known)
        if len(names) > 1:
            reference = named[place]
            raise reference.entry.error(
                f"{reference.origin} has several {reference.kind}: write"
                f" {reference.entry.value}:NAME, with one of {', '.join(names)}"
            )
        return names[0]
    return value


def _names(reference: Reference, known: OwnCatalogue) -> list[str]:
    """The names of the entries that a file or module stands for."""
    origin, kind = reference.origin, reference.kind
    names = [name for one, name in known.origins if one == kind]
    names = [name for name in names if known.origins[kind, name] == origin]
    if not names:
        raise reference.entry.error(f"{origin} has no {kind.upper()}")
    if reference.name is None or kind == "models":
        return names
    if reference.name not in names:
        message = unknown(f"{kind[:-1]} of {origin}", reference.name, names)
        raise reference.entry.error(message)
    return [reference.name]
