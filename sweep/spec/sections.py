"""Sections of a spec that methods add, such as `validate`.

A method has its sections in its entry, see `sweep.method`. Each is described once: its
key, how it is read, what cannot stand beside it, which variants of the study it asks
for, and what a plan records of it.

A section stands under its key, or it is the form of a key of the study that is a
mapping: `replicates` is a number, or the mapping of a method that adds trials.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple, Protocol

from sweep.method import methods
from sweep.spec.axes import Axis
from sweep.spec.contents import Content
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
    form_of
        The key of a study whose form as a mapping the section is, which has the keys of
        the section; `key` is then one of them, and names the section. "" where the
        section stands under `key`.
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
    form_of: str = ""
    looks_at: Callable[[Any], tuple[str, ...]] = lambda _record: ()
    variants: Callable[[Any, Any], Sequence[StudyVariant]] = _no_variants
    check_recorded: Callable[[Any, Mapping[str, Any]], None] = lambda *_: None

    @property
    def place(self) -> Place:
        """The key in a spec that the section stands under, or is a form of."""
        return (self.form_of, self.key.name) if self.form_of else (self.key.name,)

    def is_in(self, root: Entry) -> bool:
        """Return whether a spec has the section."""
        entry = root.get(self.form_of or self.key.name)
        return entry is not None and (not self.form_of or isinstance(entry.value, dict))


@dataclass(frozen=True)
class OrForm(Content[Any]):
    """A plain value, or the mapping of a section that is a form of the key `name`.

    Reading gives on the entry of such a mapping.
    """

    plain: Content[Any]
    name: str

    @property
    def words(self) -> str:
        if form := self._form:
            return f"{self.plain.words}, or a mapping with `{form.key.name}`"
        return self.plain.words

    def read(self, entry: Entry) -> Any:
        if self._form and isinstance(entry.value, dict):
            return entry
        return self.plain.read(entry)

    def schema(self) -> Schema:
        if form := self._form:
            return {"anyOf": [self.plain.schema(), form.key.content.schema()]}
        return self.plain.schema()

    @property
    def sections(self) -> tuple[type[Any], ...]:
        form = self._form
        return form.key.content.sections if form else ()

    @property
    def _form(self) -> SpecSection | None:
        return form_of(self.name)


@cache
def form_of(name: str) -> SpecSection | None:
    """Return the section that is the form of a key of a study, if there is one."""
    every = (section for each in methods().values() for section in each.sections())
    return next((section for section in every if section.form_of == name), None)


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
