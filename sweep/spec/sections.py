"""Sections of a spec that methods add, such as `validate`.

A method has its sections in its entry, see `sweep.method`. Each is described once: its
key, how it is read, what cannot stand beside it, which variants of the study it asks
for, and what a plan records of it.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from sweep.spec.axes import Axis
from sweep.spec.document import Entry, Place
from sweep.spec.keys import Key
from sweep.spec.recorded import KnownMetrics
from sweep.spec.replication import Replication
from sweep.spec.schema_parts import Schema
from sweep.spec.settings import Setting

Shape = Any
"""The shape of a value from JSON, as `sweep.store.regular.fits` compares it."""


class SpecContext(NamedTuple):
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


class GrowthRule(Protocol):
    """What adds trials or points to a study, after looks at those that are stored."""

    @property
    def place(self) -> Place:
        """The key of a spec that writes the rule."""

    @property
    def adds_points(self) -> bool:
        """Whether points follow that no axis has."""

    @property
    def least(self) -> int:
        """The trials of a point at first."""

    @property
    def most(self) -> int:
        """The most trials of a point."""

    def most_trials(self, points: int) -> int:
        """Return the most trials of a study that has so many points at first."""

    @property
    def looks(self) -> tuple[int, ...]:
        """The numbers of trials after which a point is looked at."""

    @property
    def nominal(self) -> float:
        """The confidence of the interval of a point at each look."""

    @property
    def counted(self) -> str:
        """Which trials of a spec are counted, in words."""

    @property
    def where(self) -> str:
        """What the mean does where points are added, in words; "" where none are."""

    @property
    def in_words(self) -> str:
        """When trials or points are added, in words."""

    def as_json(self) -> dict[str, Any]:
        """Return the rule as JSON."""


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


def _nothing_to_check(_root: Entry, _value: Any, _context: SpecContext) -> None:
    """Do nothing."""


def _no_points_to_check(_study: Any, _value: Any, _points: int) -> None:
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
        said.
    needs
        What a spec with the key needs besides, as JSON Schema.
    check_points
        Raises SpecError where a value does not suit how many points a study has at
        first, from the study, the value and this number.
    strategy
        Returns the strategy of a launch (`sweep.campaigns.strategy`) of a study and a
        value. The value is then a `GrowthRule`.
    looks_at
        Returns the columns of trials that the strategy looks at, from what a plan
        records. The record of a `GrowthRule` has its `confidence` and
        `nominal_confidence`.
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
    read: Callable[[Entry, SpecContext], Any]
    recorded: Callable[[Any, Any], Any]
    shape: Shape
    check: Callable[[Entry, Any, SpecContext], None] = _nothing_to_check
    not_beside: Mapping[str, str] = field(default_factory=dict)
    needs: Schema | None = None
    check_points: Callable[[Any, Any, int], None] = _no_points_to_check
    strategy: Callable[[Any, Any], Any] | None = None
    looks_at: Callable[[Any], tuple[str, ...]] = lambda _record: ()
    variants: Callable[[Any, Any], Sequence[StudyVariant]] = _no_variants
    check_recorded: Callable[[Any, Mapping[str, Any]], None] = lambda *_: None


def check_names(what: str, names: Sequence[str], known: Collection[str]) -> None:
    """Raise ValueError for a name that is not known, and for one that stands twice.
    `what` says what the names are of.
    """
    for name in names:
        if name not in known:
            raise ValueError(f'there is no {what} "{name}"')
    if len(names) > len(set(names)):
        raise ValueError(f"a {what} stands twice")


def recorded_rule(rule: GrowthRule) -> dict[str, Any]:
    """Return what a plan records of a rule: with when it looks, and how sure it is."""
    return rule.as_json() | {"looks": rule.looks, "nominal_confidence": rule.nominal}
