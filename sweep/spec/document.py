"""Values of a spec with line numbers, and errors that name the line."""

import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sweep.errors import SpecError
from sweep.spec.mistakes import Mistakes
from sweep.text import abridged, closest, shortened, unknown

Place = tuple[str | int, ...]
NONE_GONE: Mapping[str, str] = MappingProxyType({})

FOR_EDITORS = "# yaml-language-server:"
"""Start of a line that gives the schema to the YAML server of an editor."""

MAPPING = "spec (mapping)"
"""Name in errors of a spec that is not a file."""

INTEGER_BOUND = 2**63
"""Upper bound of the integers of a spec, not included, so that int64 is enough."""


def keys_in_words(place: Place) -> str:
    """Return keys and indices as a string, such as `sweep.noise[2]`."""
    parts = (f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)
    return "".join(parts).removeprefix(".")


@dataclass(frozen=True)
class Document:
    """A YAML text, and the line of every value in the text.

    The place of a value is the path of keys and indices to the value.
    """

    path: Path
    text: str
    lines: dict[Place, int] = field(default_factory=dict, repr=False)
    of_mapping: bool = False
    """True if the text comes from a Python mapping. Errors then name keys."""

    @property
    def for_readers(self) -> list[str]:
        """The lines of the text, except lines for editors."""
        lines = self.text.splitlines()
        return [line for line in lines if not line.startswith(FOR_EDITORS)]

    @property
    def comment(self) -> str:
        """The comment at the start of the text, up to the first empty line, joined."""
        lines = takewhile(lambda line: line.startswith("#"), self.for_readers)
        return " ".join(line.removeprefix("#").strip() for line in lines)

    def error(self, place: Place, message: str) -> SpecError:
        """Return an error with the line of a value.

        Parameters
        ----------
        place : Place
            Keys and indices that lead to the value. If the text lacks the value, the
            error names the line of the nearest part above.
        message : str

        Returns
        -------
        SpecError
        """
        nearest = place
        while nearest and nearest not in self.lines:
            nearest = nearest[:-1]
        error = self.error_in_line(self.lines.get(nearest, 1), message, nearest)
        error.place = place
        return error

    def error_in_line(self, line: int, message: str, place: Place = ()) -> SpecError:
        """Return an error with a line, or with keys for a spec from a mapping.

        Parameters
        ----------
        line : int
            Number of the line, from 1.
        message : str
        place : Place, default ()
            Keys and indices that lead to the value, for a spec from a mapping.

        Returns
        -------
        SpecError
        """
        where = f"{self.path.name}:{line}"
        if self.of_mapping:
            where = f"{MAPPING}, {keys_in_words(place)}" if place else MAPPING
        return SpecError(f"{where}: {abridged(message)}", line)


@dataclass(frozen=True)
class Entry:
    """A value of a document with its place.

    The methods that read the value raise SpecError for a wrong type.
    """

    document: Document
    place: Place
    value: Any

    @property
    def name(self) -> str:
        """The last key that leads to this value; the file for the whole document."""
        return next(
            (part for part in reversed(self.place) if isinstance(part, str)),
            self.document.path.name,
        )

    def error(self, message: str) -> SpecError:
        """Return an error with the line of this value."""
        return self.document.error(self.place, message)

    def lacks(self, key: str, message: str) -> SpecError:
        """Return an error for a missing key.

        Parameters
        ----------
        key : str
            Key that this mapping must have.
        message : str
        """
        return self.document.error((*self.place, key), message)

    def expected(self, allowed: str) -> SpecError:
        """Return the error for a value that is not `allowed`, such as "a list"."""
        value = in_words(self.value)
        return self.error(f'"{self.name}" must be {allowed}, not {value}')

    def child(self, key: str | int) -> "Entry":
        """Return the value below this value at `key`, which must exist."""
        return Entry(self.document, (*self.place, key), self.value[key])

    def get(self, key: str) -> "Entry | None":
        """Return the value of this mapping at `key`; None without the key."""
        return self.child(key) if key in self.value else None

    def mapping(self) -> Iterator[tuple[str, "Entry"]]:
        """Return the keys and values of this mapping, which must not be empty."""
        if not isinstance(self.value, dict) or not self.value:
            raise self.expected("a mapping with at least one entry")
        return ((key, self.child(key)) for key in self.value)

    def keys(
        self,
        allowed: Iterable[str],
        required: Iterable[str] = (),
        gone: Mapping[str, str] = NONE_GONE,
    ) -> None:
        """Check the keys of this mapping.

        Parameters
        ----------
        allowed : iterable of str
        required : iterable of str, optional
            Keys that must be present.
        gone : mapping, optional
            Keys of earlier versions, each with the reason for the removal.

        Raises
        ------
        SpecError
            With all mistakes, if this is not a mapping, a key is not allowed, or a
            required key is missing.
        """
        self.mapping()
        mistakes = Mistakes()
        where = f' in "{self.name}"' if self.place else ""
        for key in self.value:
            with mistakes.noted():
                if key in gone:
                    raise self.child(key).error(f'key "{key}" was removed: {gone[key]}')
                if key not in allowed:
                    error = self.child(key).error(unknown("key", key, allowed))
                    meant = closest(key, allowed)
                    if meant and meant not in self.value:
                        error.meant = (*self.place, meant)
                    raise error
        for key in required:
            with mistakes.noted():
                if key not in self.value:
                    raise self.lacks(key, f'missing key "{key}"{where}')
        mistakes.check()

    def entries(self) -> list["Entry"]:
        """Return the values of this list, which must not be empty."""
        if not isinstance(self.value, list) or not self.value:
            raise self.expected("a list with at least one value")
        return self.items()

    def items(self) -> list["Entry"]:
        """Return the values of this list, which may be empty."""
        if not isinstance(self.value, list):
            raise self.expected("a list")
        return [self.child(index) for index in range(len(self.value))]

    def text(self) -> str:
        """Return this string."""
        if not isinstance(self.value, str):
            raise self.expected("a string")
        return self.value

    def truth(self) -> bool:
        """Return this truth value."""
        if not isinstance(self.value, bool):
            raise self.expected("true or false")
        return self.value

    def number(self) -> float:
        """Return this finite number."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.expected("a number")
        if not abs(self.value) <= sys.float_info.max:  # an integer may be larger
            raise self.expected("a finite number")
        return float(self.value)

    def whole(self, low: int, high: int = INTEGER_BOUND - 1) -> int:
        """Return this integer.

        Parameters
        ----------
        low : int
        high : int, default 2**63 - 1
            The bounds are included.

        Returns
        -------
        int

        Raises
        ------
        SpecError
            If the value is not an integer between the bounds.
        """
        if (
            isinstance(self.value, bool)
            or not isinstance(self.value, int)
            or not low <= self.value <= high
        ):
            limit = f" to {high}" if high < INTEGER_BOUND - 1 else ""
            raise self.expected(f"an integer from {low}{limit}")
        return self.value

    def one_of(self, kind: str, allowed: Iterable[str]) -> str:
        """Return this name, which must be an allowed name.

        Parameters
        ----------
        kind : str
            Noun of the names in the error, such as "sampler".
        allowed : iterable of str

        Returns
        -------
        str

        Raises
        ------
        SpecError
            If the value is not an allowed name.
        """
        name = self.text()
        if name not in allowed:
            raise self.error(unknown(kind, name, allowed))
        return name


def in_words(value: Any) -> str:
    """Return a value for an error: a string in quotes, or the kind of a container."""
    if isinstance(value, dict):
        return "a mapping" if value else "an empty mapping"
    if isinstance(value, list):
        return "a list" if value else "an empty list"
    if isinstance(value, bool):
        return str(value).lower()
    if value is None:
        return "an empty value"
    return f'"{shortened(value)}"' if isinstance(value, str) else repr(value)
