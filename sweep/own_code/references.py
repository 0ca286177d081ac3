"""Where a spec names files: `model: ./vortex.py`, `metrics: [./mine.py]`, `map:
./maze.py`, each with `:NAME` where the file has several; `start_draws: ./flock.csv`.

A file brings all that it offers, so other keys name its entries by their plain names.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from sweep.errors import CodeError
from sweep.own_code.catalogue import OwnCatalogue, OwnCode, loaded
from sweep.own_code.entries import MODEL
from sweep.own_code.places import PLACES
from sweep.own_code.sources import gather
from sweep.spec.document import Document, Entry, Place
from sweep.text import unknown

FILE = re.compile(r"(?P<path>[^:]*\.(?:py|csv))(?::(?P<name>\w+))?")
KINDS = {
    "model": "models",
    "metrics": "metrics",
    "series": "metrics",
    "map": "maps",
    "start_draws": "starts",
    "sample": "samplers",
}
"""The keys of a spec that may name a file, and what they want from it."""


@dataclass(frozen=True)
class Reference:
    """A file that a spec names at `entry`: its path from the folder of the spec, the
    kind of entry that is wanted, and its name in the file, None for all or the one.
    """

    entry: Entry
    file: str
    kind: str
    name: str | None


def references(root: Entry) -> list[Reference]:
    """All files that a spec names. Raises SpecError for paths that lead out of the
    folder of the spec.
    """
    return list(_within(root))


def _within(entry: Entry) -> Iterator[Reference]:
    if isinstance(entry.value, dict):
        for key in entry.value:
            yield from _within(entry.child(key))
    elif isinstance(entry.value, list):
        for index in range(len(entry.value)):
            yield from _within(entry.child(index))
    elif isinstance(entry.value, str) and (found := FILE.fullmatch(entry.value)):
        keys = [part for part in reversed(entry.place) if part in KINDS]
        if keys:
            file = _inside(entry, found["path"])
            if file.endswith(PLACES) and keys[0] != "start_draws":
                raise entry.error(f"{file} can only be a start (start_draws)")
            yield Reference(entry, file, KINDS[str(keys[0])], found["name"])


def _inside(entry: Entry, path: str) -> str:
    parts = path.split("/")
    if parts[0] not in (".", "..", "") and len(parts) == 1:
        raise entry.error(f'a file beside the spec is written "./{path}"')
    if parts[0] != "." or ".." in parts or "" in parts[1:]:
        raise entry.error(
            f'"{path}" may lie outside the folder of the spec, from where no code is'
            " taken: put the file beside the spec, and write ./NAME.py"
        )
    return "/".join(part for part in parts[1:] if part != ".")


def own_code(root: Entry, named: list[Reference]) -> OwnCode:
    """The code that a spec names. Raises SpecError for files that cannot be read."""
    files = dict[str, str | None]()
    for one in named:
        wanted = (one.name or MODEL) if one.kind == "models" else None
        files[one.file] = wanted or files.get(one.file)
    folder = root.document.path.parent
    for one in named:
        try:
            gather(folder, [one.file])
        except CodeError as error:
            raise one.entry.error(str(error)) from None
    return OwnCode(gather(folder, files), tuple(files.items()))


def known_to(root: Entry, named: list[Reference]) -> OwnCatalogue:
    """The catalogue of a spec that names files; it runs them. Raises SpecError."""
    code = own_code(root, named)
    try:
        return loaded(code)
    except CodeError as error:
        at = next((one for one in named if one.file == error.file), named[0])
        raise at.entry.error(str(error)) from error


def resolved(root: Entry, named: list[Reference], known: OwnCatalogue) -> Entry:
    """The same spec with plain names in the place of files. Raises SpecError where a
    file has no such entry, or none that is meant alone.
    """
    document = Document(
        root.document.path, root.document.text, dict(root.document.lines)
    )
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
                f"{reference.file} has several {reference.kind}: write"
                f" {reference.entry.value}:NAME, with one of {', '.join(names)}"
            )
        return names[0]
    return value


def _names(reference: Reference, known: OwnCatalogue) -> list[str]:
    """The names of the entries that a file stands for."""
    file, kind = reference.file, reference.kind
    names = [
        name
        for (one, name), origin in known.origins.items()
        if (one, origin) == (kind, file)
    ]
    if not names:
        raise reference.entry.error(f"{file} has no {kind.upper()}")
    if reference.name is None or kind == "models":
        return names
    if reference.name not in names:
        message = unknown(f"{kind[:-1]} of {file}", reference.name, names)
        raise reference.entry.error(message)
    return [reference.name]
