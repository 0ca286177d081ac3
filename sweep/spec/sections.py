"""Sections of a spec that methods add, such as `validate`.

A method has its sections in its entry, see `sweep.method`. Each is described once: its
key, how it is read, what cannot stand beside it, which variants of the study it asks
for, and what a plan records of it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

from sweep.method import methods
from sweep.spec.axes import Axis
from sweep.spec.document import Entry, Place
from sweep.spec.keys import Key
from sweep.spec.recorded import KnownMetrics
from sweep.spec.replication import Replication
from sweep.spec.schema_parts import Schema
from sweep.spec.settings import Setting

Shape = Any
"""The shape of a value from JSON, as `sweep.store.regular.fits` compares it."""


class Around(NamedTuple):
    """What a section must suit.

    Attributes
    ----------
    model
        The name of the model.
    axes
        The axes of the spec. None where they are wrong, which hides what depends on
        them.
    replication
        How many trials a point has. None where that is wrong.
    recorded
        Some of the metrics that are known.
    known
        The metrics that are known.
    settings
        The settings of the study by their names.
    """

    model: str
    axes: Sequence[Axis] | None
    replication: Replication | None
    recorded: Sequence[str]
    known: KnownMetrics
    settings: Mapping[str, Setting]


@dataclass(frozen=True)
class StudyVariant:
    """The same study with something else in its spec; it lies in the folder of the
    study.

    Attributes
    ----------
    name
        Its name below that of the study.
    words
        What differs.
    place
        The key that asks for it.
    spec
        Its whole spec.
    """

    name: str
    words: str
    place: Place
    spec: dict[str, Any]


def _nothing_to_check(_root: Entry, _value: Any, _around: Around) -> None:
    """Do nothing."""


def _no_variants(_study: Any, _value: Any) -> list[StudyVariant]:
    return []


@dataclass(frozen=True)
class SpecSection:
    """A section that a spec may have.

    Attributes
    ----------
    key
        The key, with its name and what may stand under it.
    read
        Returns the value of the section, from the root of the spec and from what the
        value must suit. Called where the key is given. Raises SpecError.
    check
        Raises SpecError where a value does not suit the whole spec. Called when each
        key alone is right.
    not_beside
        Keys that cannot stand beside this one, each with the reason, "" where none is
        said. The section is not read where one of them is given.
    needs
        What a spec with the key needs besides, as JSON Schema.
    variants
        Returns the variants of a study that a value asks for. Raises SpecError.
    recorded
        Returns what a plan records of a value, as JSON, from the study and the value.
    shape
        The shape of what a plan records.
    check_recorded
        Raises ValueError for a record of that shape that cannot be, from the record and
        all that the plan says of its study.
    """

    key: Key
    read: Callable[[Entry, Around], Any]
    recorded: Callable[[Any, Any], Any]
    shape: Shape
    check: Callable[[Entry, Any, Around], None] = _nothing_to_check
    not_beside: Mapping[str, str] = field(default_factory=dict)
    needs: Schema | None = None
    variants: Callable[[Any, Any], Sequence[StudyVariant]] = _no_variants
    check_recorded: Callable[[Any, Mapping[str, Any]], None] = lambda *_: None


@cache
def sections() -> Mapping[str, SpecSection]:
    """Return the sections of all methods by their keys."""
    return {
        section.key.name: section
        for method in methods().values()
        for section in method.sections()
    }


def section_keys() -> tuple[Key, ...]:
    """Return the keys of the sections of all methods."""
    return tuple(section.key for section in sections().values())


def variants_of(values: Mapping[str, Any], study: Any) -> Iterator[StudyVariant]:
    """Return the variants that the sections of a study ask for, by their `values`."""
    for name, value in values.items():
        yield from sections()[name].variants(study, value)
