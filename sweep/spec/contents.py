"""What may stand under a key of a spec, as `Whole(1)` or `OrFalse(Number(above=0))`.

A content reads the value of an entry, says what is allowed, in words and as JSON
Schema, and writes a value as a spec has it. So the reader, the schema, the guide and
whatever writes a spec cannot disagree.
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
"""A number of per cent from 0 to 100."""


class Content(ABC, Generic[T]):
    """What may stand under a key; `T` is the type of its value once it is read."""

    @property
    @abstractmethod
    def words(self) -> str:
        """What is allowed, as `a whole number from 1`."""

    @abstractmethod
    def read(self, entry: Entry) -> T:
        """The value of `entry`. Raises SpecError where it is not allowed."""

    @abstractmethod
    def schema(self) -> Schema:
        """What is allowed, as JSON Schema."""

    def write(self, value: T) -> Any:
        """The value as a spec has it: what `read` makes the same value of."""
        return value

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """The classes whose keys may stand below this one; see `sweep.spec.keys`."""
        return ()

    @property
    def inside(self) -> str:
        """What leads from this key to those: `.NAME`, `[]` or nothing."""
        return ""


def share(value: object) -> Fraction | None:
    """The share that a text such as "5%" writes; None for what is none."""
    found = SHARE.fullmatch(value) if isinstance(value, str) else None
    return Fraction(found[1]) / 100 if found else None


@dataclass(frozen=True)
class Text(Content[str]):
    """Any text; `said` tells what it is to be."""

    said: str = "a text"

    @property
    def words(self) -> str:
        return self.said

    def read(self, entry: Entry) -> str:
        return entry.text()

    def schema(self) -> Schema:
        return TEXT


@dataclass(frozen=True)
class Truth(Content[bool]):
    """True or false."""

    @property
    def words(self) -> str:
        return "true or false"

    def read(self, entry: Entry) -> bool:
        return entry.truth()

    def schema(self) -> Schema:
        return {"type": "boolean"}


@dataclass(frozen=True)
class Whole(Content[int]):
    """A whole number from `least` to `most`, both allowed."""

    least: int
    most: int = INTEGER_BOUND - 1

    @property
    def _bounded(self) -> bool:
        return self.most < INTEGER_BOUND - 1

    @property
    def words(self) -> str:
        limit = f" to {self.most:,}" if self._bounded else ""
        return f"a whole number from {self.least}{limit}"

    def read(self, entry: Entry) -> int:
        return entry.whole(self.least, self.most)

    def schema(self) -> Schema:
        # 2**63 is a double of JavaScript, and the number before it is none.
        most = (
            {"maximum": self.most}
            if self._bounded
            else {"exclusiveMaximum": INTEGER_BOUND}
        )
        return {"type": "integer", "minimum": self.least} | most


@dataclass(frozen=True)
class Number(Content[float]):
    """A finite number.

    It is at least `least`, at most `most`, and neither `above` nor `below` themselves
    are allowed. `unit` follows in words ("of seconds"), and `note` after all.
    """

    least: float | None = None
    above: float | None = None
    most: float | None = None
    below: float | None = None
    unit: str = ""
    note: str = ""

    @property
    def words(self) -> str:
        words = f"a number of {self.unit}" if self.unit else "a number"
        if self.least is not None:
            words += f" from {self.least:g}"
        if self.above is not None:
            words += f" above {self.above:g}"
        if self.most is not None:
            words += f"{' to' if self.above is None else ', at most'} {self.most:g}"
        if self.below is not None:
            words += f" and below {self.below:g}"
        return f"{words}, {self.note}" if self.note else words

    def read(self, entry: Entry) -> float:
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
        bounds = {
            "minimum": self.least,
            "exclusiveMinimum": self.above,
            "maximum": self.most,
            "exclusiveMaximum": self.below,
        }
        given = {name: bound for name, bound in bounds.items() if bound is not None}
        return {"type": "number"} | given


@dataclass(frozen=True)
class OrFalse(Content[T | None]):
    """`false`, which reads as None, or something else."""

    content: Content[T]

    @property
    def words(self) -> str:
        return f"{self.content.words}, or false"

    def read(self, entry: Entry) -> T | None:
        if entry.value is False:
            return None
        try:
            return self.content.read(entry)
        except SpecError:
            raise entry.expected(self.words) from None

    def schema(self) -> Schema:
        return {"anyOf": [self.content.schema(), {"const": False}]}

    def write(self, value: T | None) -> Any:
        return False if value is None else self.content.write(value)


@dataclass(frozen=True)
class OneOf(Content[str]):
    """One of some `names`, which may be those of a registry: they are asked for anew.

    `kind` is what an error calls them. Where a command lists them, `listed_by` is that
    command. Where the schema has a definition of them, `definition` is its name.
    """

    kind: str
    names: Collection[str]
    listed_by: str = ""
    definition: str = ""

    @property
    def words(self) -> str:
        if self.listed_by:
            return f"a name that `{self.listed_by}` lists"
        *others, last = self.names
        return f"{', '.join(others)} or {last}"

    def read(self, entry: Entry) -> str:
        return entry.one_of(self.kind, self.names)

    def schema(self) -> Schema:
        if self.definition:
            return reference(self.definition)
        return {"enum": list(self.names)}


@dataclass(frozen=True)
class EntryOf(OneOf):
    """The name of an entry of a registry, `names`, whose entries say what they are."""

    names: Mapping[str, Described]

    def schema(self) -> Schema:
        return choices(self.names)


@dataclass(frozen=True)
class ListOf(Content[tuple[T, ...]]):
    """A list of `plural` that is not empty, in which nothing stands twice."""

    item: Content[T]
    plural: str

    @property
    def words(self) -> str:
        return f"a list of {self.plural}, none twice"

    def read(self, entry: Entry) -> tuple[T, ...]:
        values, mistakes = dict[T, None](), Mistakes()
        for child in entry.entries():
            with mistakes.noted():
                value = self.item.read(child)
                if value in values:
                    raise child.error(
                        f'{in_words(child.value)} stands twice in "{entry.name}"'
                    )
                values[value] = None
        mistakes.check()
        return tuple(values)

    def schema(self) -> Schema:
        return listed(self.item.schema())

    def write(self, value: tuple[T, ...]) -> Any:
        return [self.item.write(one) for one in value]


@dataclass(frozen=True)
class ReadLater(Content[Entry]):
    """What depends on other keys, as settings do on the model. Reading gives on the
    entry. `said` tells in words what is allowed, and `form` as far as JSON Schema can.
    `parts` are the dataclasses whose keys stand below, if any, and `between` is what
    leads from this key to theirs.
    """

    said: str
    form: Callable[[], Schema] = lambda: {"type": "object"}
    parts: tuple[type[Any], ...] = ()
    between: str = ""

    @property
    def words(self) -> str:
        return self.said

    def read(self, entry: Entry) -> Entry:
        return entry

    def schema(self) -> Schema:
        return self.form()

    @property
    def sections(self) -> tuple[type[Any], ...]:
        return self.parts

    @property
    def inside(self) -> str:
        return self.between
