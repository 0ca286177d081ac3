"""Contents of the keys of a spec, such as `Whole(1)` or `OrFalse(Number(above=0))`.

A content reads the value of an entry, describes the allowed values in words and as JSON
Schema, and writes a value into a spec. So the reader, the schema, the table of keys and
the writers of specs always agree.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Generic, TypeVar

from sweep.errors import SpecError
from sweep.spec.document import INTEGER_BOUND, Entry, in_words
from sweep.spec.mistakes import Mistakes
from sweep.spec.schema_parts import TEXT, Described, Schema, choices, listed, reference

T = TypeVar("T")

SHARE = re.compile(r"(100(?:\.0{1,9})?|[0-9]{1,2}(?:\.[0-9]{1,9})?) ?%")
"""A percentage from 0 to 100."""


class Content(ABC, Generic[T]):
    """The allowed values of a key; `T` is the type of the value after reading."""

    @property
    @abstractmethod
    def words(self) -> str:
        """The allowed values in words, such as `an integer from 1`."""

    @abstractmethod
    def read(self, entry: Entry) -> T:
        """Return the value of `entry`, or raise SpecError if it is not allowed."""

    @abstractmethod
    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""

    def write(self, value: T) -> Any:
        """Return the value for a spec, from which `read` returns `value`."""
        return value

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """The classes with the keys below this key; see `sweep.spec.keys`."""
        return ()

    @property
    def inside(self) -> str:
        """The path from this key to the keys below: `.NAME`, `[]` or empty."""
        return ""


def share(value: object) -> Fraction | None:
    """Return the fraction of a string such as "5%"; None for all other values."""
    match = SHARE.fullmatch(value) if isinstance(value, str) else None
    return Fraction(match[1]) / 100 if match else None


@dataclass(frozen=True)
class Text(Content[str]):
    """Any string; `description` states its meaning."""

    description: str = "a string"

    @property
    def words(self) -> str:
        """The description."""
        return self.description

    def read(self, entry: Entry) -> str:
        """Return the string of `entry`."""
        return entry.text()

    def schema(self) -> Schema:
        """Return the JSON Schema of any string."""
        return TEXT


@dataclass(frozen=True)
class Truth(Content[bool]):
    """True or false."""

    @property
    def words(self) -> str:
        """The two values."""
        return "true or false"

    def read(self, entry: Entry) -> bool:
        """Return the truth value of `entry`."""
        return entry.truth()

    def schema(self) -> Schema:
        """Return the JSON Schema of a truth value."""
        return {"type": "boolean"}


@dataclass(frozen=True)
class Whole(Content[int]):
    """An integer from `least` to `most`, bounds included."""

    least: int
    most: int = INTEGER_BOUND - 1

    @property
    def _bounded(self) -> bool:
        return self.most < INTEGER_BOUND - 1

    @property
    def words(self) -> str:
        """The allowed range."""
        limit = f" to {self.most:,}" if self._bounded else ""
        return f"an integer from {self.least}{limit}"

    def read(self, entry: Entry) -> int:
        """Return the integer of `entry`."""
        return entry.whole(self.least, self.most)

    def schema(self) -> Schema:
        """Return the JSON Schema of an integer in this range."""
        # A double of JavaScript represents 2**63, and not the integer before.
        most = (
            {"maximum": self.most}
            if self._bounded
            else {"exclusiveMaximum": INTEGER_BOUND}
        )
        return {"type": "integer", "minimum": self.least} | most


@dataclass(frozen=True)
class Number(Content[float]):
    """A finite number.

    Attributes
    ----------
    least, most : float, optional
        Inclusive bounds.
    above, below : float, optional
        Exclusive bounds.
    unit : str, default ""
        Unit in words, such as "seconds".
    note : str, default ""
        End of the description in words.
    """

    least: float | None = None
    above: float | None = None
    most: float | None = None
    below: float | None = None
    unit: str = ""
    note: str = ""

    @property
    def words(self) -> str:
        """The allowed range, with the unit and the note."""
        text = f"a number of {self.unit}" if self.unit else "a number"
        if self.least is not None:
            text += f" from {self.least:g}"
        if self.above is not None:
            text += f" above {self.above:g}"
        if self.most is not None:
            text += f"{' to' if self.above is None else ', at most'} {self.most:g}"
        if self.below is not None:
            text += f" and below {self.below:g}"
        return f"{text}, {self.note}" if self.note else text

    def read(self, entry: Entry) -> float:
        """Return the number of `entry`."""
        number = entry.number()
        if not (
            (self.least is None or number >= self.least)
            and (self.above is None or number > self.above)
            and (self.most is None or number <= self.most)
            and (self.below is None or number < self.below)
        ):
            raise entry.expected(self.words)
        return number

    def schema(self) -> Schema:
        """Return the JSON Schema of a number in this range."""
        bounds = {
            "minimum": self.least,
            "exclusiveMinimum": self.above,
            "maximum": self.most,
            "exclusiveMaximum": self.below,
        }
        present = {name: bound for name, bound in bounds.items() if bound is not None}
        return {"type": "number"} | present


@dataclass(frozen=True)
class OrFalse(Content[T | None]):
    """A content that also allows `false`, which reads as None."""

    content: Content[T]

    @property
    def words(self) -> str:
        """The words of the content, "or false"."""
        return f"{self.content.words}, or false"

    def read(self, entry: Entry) -> T | None:
        """Return the value of `entry`; None for `false`."""
        if entry.value is False:
            return None
        try:
            return self.content.read(entry)
        except SpecError:
            raise entry.expected(self.words) from None

    def schema(self) -> Schema:
        """Return the JSON Schema of the content or `false`."""
        return {"anyOf": [self.content.schema(), {"const": False}]}

    def write(self, value: T | None) -> Any:
        """Return the value for a spec: `false` for None."""
        return False if value is None else self.content.write(value)


@dataclass(frozen=True)
class OneOf(Content[str]):
    """One of several names.

    Attributes
    ----------
    kind : str
        Noun of the names in an error, such as "sampler".
    names : collection of str
        Allowed names. A registry may grow later: each call uses the present names.
    listed_by : str, default ""
        Command that lists the names, "" without a command.
    definition : str, default ""
        Name of the definition of the names in the schema, "" without a definition.
    """

    kind: str
    names: Collection[str]
    listed_by: str = ""
    definition: str = ""

    @property
    def words(self) -> str:
        """The names, or the command that lists them."""
        if self.listed_by:
            return f"a name that `{self.listed_by}` lists"
        *first, last = self.names
        return f"{', '.join(first)} or {last}"

    def read(self, entry: Entry) -> str:
        """Return the name of `entry`."""
        return entry.one_of(self.kind, self.names)

    def schema(self) -> Schema:
        """Return the JSON Schema of the names, or a reference to their definition."""
        if self.definition:
            return reference(self.definition)
        return {"enum": list(self.names)}


@dataclass(frozen=True)
class EntryOf(OneOf):
    """The name of an entry of the registry `names`, whose entries have a text."""

    names: Mapping[str, Described]

    def schema(self) -> Schema:
        """Return the JSON Schema of the names, each with the text of the entry."""
        return choices(self.names)


@dataclass(frozen=True)
class ListOf(Content[tuple[T, ...]]):
    """A list of distinct values, at least one.

    Attributes
    ----------
    item : Content
        Content of each value.
    plural : str
        Noun for the values, such as "metrics".
    """

    item: Content[T]
    plural: str

    @property
    def words(self) -> str:
        """The kind of values in the list."""
        return f"a list of distinct {self.plural}"

    def read(self, entry: Entry) -> tuple[T, ...]:
        """Return the values of the list of `entry`."""
        values = dict[T, None]()
        mistakes = Mistakes()
        for child in entry.entries():
            with mistakes.noted():
                value = self.item.read(child)
                if value in values:
                    raise child.error(
                        f'{in_words(child.value)} is listed twice in "{entry.name}"'
                    )
                values[value] = None
        mistakes.check()
        return tuple(values)

    def schema(self) -> Schema:
        """Return the JSON Schema of the list."""
        return listed(self.item.schema())

    def write(self, value: tuple[T, ...]) -> Any:
        """Return the list for a spec."""
        return [self.item.write(element) for element in value]

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """The classes with the keys of an item."""
        return self.item.sections

    @property
    def inside(self) -> str:
        """The path from this key to the keys of an item."""
        return "[]" if self.sections else ""


@dataclass(frozen=True)
class ReadLater(Content[Entry]):
    """A content that depends on other keys, such as parameters on the model.

    Reading returns the entry itself.

    Attributes
    ----------
    description : str
        Allowed values in words.
    form : callable
        Returns the JSON Schema, as far as it does not depend on other keys.
    parts : tuple of type
        Dataclasses whose keys are below this key.
    between : str, default ""
        Path from this key to the keys below: `.NAME`, `[]` or empty.
    """

    description: str
    form: Callable[[], Schema] = lambda: {"type": "object"}
    parts: tuple[type[Any], ...] = ()
    between: str = ""

    @property
    def words(self) -> str:
        """The description."""
        return self.description

    def read(self, entry: Entry) -> Entry:
        """Return `entry` itself."""
        return entry

    def schema(self) -> Schema:
        """Return the JSON Schema that `form` returns."""
        return self.form()

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """The classes with the keys below this key."""
        return self.parts

    @property
    def inside(self) -> str:
        """The path from this key to the keys below."""
        return self.between
