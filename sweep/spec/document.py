"""Values that know in which line of a spec they stand, and errors that say so."""

import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sweep.errors import SpecError
from sweep.spec.mistakes import Mistakes
from sweep.text import abridged, shortened, unknown

Place = tuple[str | int, ...]
NONE_GONE: Mapping[str, str] = MappingProxyType({})

FOR_EDITORS = "# yaml-language-server:"
"""How a line begins that tells the YAML server of an editor where a schema is."""

MAPPING = "spec (mapping)"
"""What errors call a spec that is no file."""

INTEGER_BOUND = 2**63
"""Whole numbers of a spec are smaller than this, so that they fit into int64."""


def keys_in_words(place: Place) -> str:
    """Keys and indices as `sweep.noise[2]`."""
    parts = (f"[{one}]" if isinstance(one, int) else f".{one}" for one in place)
    return "".join(parts).removeprefix(".")


@dataclass(frozen=True)
class Document:
    """A YAML text, and the line of every value in it. A value is found by its place:
    the keys and indices that lead to it.
    """

    path: Path
    text: str
    lines: dict[Place, int] = field(default_factory=dict, repr=False)
    of_mapping: bool = False
    """Whether it was made of a mapping of Python, whose user has seen no line of it."""

    @property
    def for_readers(self) -> list[str]:
        """The lines of the text without those for editors."""
        lines = self.text.splitlines()
        return [line for line in lines if not line.startswith(FOR_EDITORS)]

    @property
    def comment(self) -> str:
        """The comment with which the text begins for readers, in one line. An empty
        line ends it.
        """
        lines = takewhile(lambda line: line.startswith("#"), self.for_readers)
        return " ".join(line.removeprefix("#").strip() for line in lines)

    def error(self, place: Place, message: str) -> SpecError:
        """The SpecError that says `message` with the line of `place`, or of the nearest
        part above it.
        """
        known = place
        while known and known not in self.lines:
            known = known[:-1]
        error = self.error_in_line(self.lines.get(known, 1), message, known)
        error.place = place
        return error

    def error_in_line(self, line: int, message: str, place: Place = ()) -> SpecError:
        """The SpecError that says `message` with this line; of a mapping with the keys
        that lead to `place`.
        """
        where = f"{self.path.name}:{line}"
        if self.of_mapping:
            where = f"{MAPPING}, {keys_in_words(place)}" if place else MAPPING
        return SpecError(f"{where}: {abridged(message)}", line)


@dataclass(frozen=True)
class Entry:
    """One value of a document and its place. The methods that read it raise SpecError
    where it is something else.
    """

    document: Document
    place: Place
    value: Any

    @property
    def name(self) -> str:
        """The last key that leads to this value. The whole document has the name of its
        file.
        """
        return next(
            (part for part in reversed(self.place) if isinstance(part, str)),
            self.document.path.name,
        )

    def error(self, message: str) -> SpecError:
        """The SpecError that says `message` with the line of this value."""
        return self.document.error(self.place, message)

    def expected(self, what: str) -> SpecError:
        """The SpecError for a value that is not `what`."""
        return self.error(f'"{self.name}" must be {what}, not {in_words(self.value)}')

    def child(self, key: str | int) -> "Entry":
        """The value below this one at `key`, which must be there."""
        return Entry(self.document, (*self.place, key), self.value[key])

    def get(self, key: str) -> "Entry | None":
        """The value below this mapping at `key`, or None."""
        return self.child(key) if key in self.value else None

    def mapping(self) -> Iterator[tuple[str, "Entry"]]:
        """Keys and values of this mapping, which may not be empty."""
        if not isinstance(self.value, dict) or not self.value:
            raise self.expected("a mapping with at least one entry")
        return ((key, self.child(key)) for key in self.value)

    def keys(
        self,
        allowed: Iterable[str],
        required: Iterable[str] = (),
        gone: Mapping[str, str] = NONE_GONE,
    ) -> None:
        """Raise SpecError unless this is a mapping with these keys only, and with the
        required ones; `gone` says of keys of earlier versions why there are none.
        """
        self.mapping()
        mistakes, where = Mistakes(), f' in "{self.name}"' if self.place else ""
        for key in self.value:
            with mistakes.noted():
                if key in gone:
                    raise self.child(key).error(
                        f'"{key}" is no key any more: {gone[key]}'
                    )
                if key not in allowed:
                    raise self.child(key).error(unknown("key", key, allowed))
        for key in required:
            with mistakes.noted():
                if key not in self.value:
                    raise self.error(f'missing key "{key}"{where}')
        mistakes.check()

    def entries(self) -> list["Entry"]:
        """The values of this list, which may not be empty."""
        if not isinstance(self.value, list) or not self.value:
            raise self.expected("a list with at least one value")
        return self.items()

    def items(self) -> list["Entry"]:
        """The values of this list, of which there may be none."""
        if not isinstance(self.value, list):
            raise self.expected("a list")
        return [self.child(index) for index in range(len(self.value))]

    def text(self) -> str:
        """This text."""
        if not isinstance(self.value, str):
            raise self.expected("a text")
        return self.value

    def truth(self) -> bool:
        """This truth value."""
        if not isinstance(self.value, bool):
            raise self.expected("true or false")
        return self.value

    def number(self) -> float:
        """This finite number."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.expected("a number")
        if not abs(self.value) <= sys.float_info.max:  # a whole one may be longer
            raise self.expected("a finite number")
        return float(self.value)

    def whole(self, low: int, high: int = INTEGER_BOUND - 1) -> int:
        """This whole number, at least `low` and at most `high`."""
        if (
            isinstance(self.value, bool)
            or not isinstance(self.value, int)
            or not low <= self.value <= high
        ):
            limit = f" to {high}" if high < INTEGER_BOUND - 1 else ""
            raise self.expected(f"a whole number from {low}{limit}")
        return self.value

    def one_of(self, kind: str, allowed: Iterable[str]) -> str:
        """This name of a `kind` of thing, one of those allowed."""
        name = self.text()
        if name not in allowed:
            raise self.error(unknown(kind, name, allowed))
        return name


def in_words(value: Any) -> str:
    """What was given, for an error: a text in quotes, and the kind of a container."""
    if isinstance(value, dict):
        return "a mapping" if value else "an empty mapping"
    if isinstance(value, list):
        return "a list" if value else "an empty list"
    if isinstance(value, bool):
        return str(value).lower()
    if value is None:
        return "nothing"
    return f'"{shortened(value)}"' if isinstance(value, str) else repr(value)
