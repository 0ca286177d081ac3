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
from sweep.spec.axes import Axis, AxisReader
from sweep.spec.contents import Content
from sweep.spec.document import Entry, Place
from sweep.spec.keys import Key
from sweep.spec.maps import OwnMap
from sweep.spec.recorded import KnownMetrics
from sweep.spec.replication import Replication
from sweep.spec.schema_parts import Schema
from sweep.spec.settings import Setting, Value, Values

Shape = Any
"""Shape of a value from JSON, as `sweep.store.regular.fits` compares it."""


class SpecContext(NamedTuple):
    """The parts of a study that a section must suit.

    Attributes
    ----------
    model
        Name of the model.
    preset
        Values of the preset, by setting.
    fixed
        Values under `fixed`, by setting.
    maps
        Maps of the study's own, by name.
    axes
        Axes of the spec. None if they are wrong, which hides mistakes that depend on
        them, and for a section that adds an axis, which is read before them.
    replication
        Number of trials per point. None if it is wrong.
    recorded
        Recorded metrics, or all known ones if the record is wrong.
    known
        Metrics that are known.
    settings
        Settings of the study by name.
    reader
        Reader of axes of the study.
    taken
        Place in the spec of each setting that has a value under `fixed` or `derive`.
    """

    model: str
    preset: Mapping[str, Value]
    fixed: Mapping[str, Value]
    maps: Mapping[str, OwnMap]
    axes: Sequence[Axis] | None
    replication: Replication | None
    recorded: Sequence[str]
    known: KnownMetrics
    settings: Mapping[str, Setting]
    reader: AxisReader
    taken: Mapping[str, Place]


class SettingValues(NamedTuple):
    """Values that a section gives a setting, or asks for one after the other.

    Attributes
    ----------
    place
        Keys of the spec that lead to them.
    values
        The values, or the bounds of a range.
    """

    place: Place
    values: Sequence[Value] | Values


class ModelSchemas(NamedTuple):
    """Schemas of the settings of a model, for the section of a method.

    Attributes
    ----------
    ranges
        Schema of settings, each with a range.
    axes
        Schema of axes.
    values
        Schema of settings, each with a value.
    """

    ranges: Schema
    axes: Schema
    values: Schema


class GrowthRule(Protocol):
    """A rule that adds trials or points to a study after looks at stored trials."""

    @property
    def place(self) -> Place:
        """Keys of a spec that lead to the rule."""

    @property
    def adds_points(self) -> bool:
        """True if the rule adds points that no axis has."""

    @property
    def least(self) -> int:
        """Number of trials per point at first."""

    @property
    def most(self) -> int:
        """Largest number of trials per point."""

    def most_trials(self, points: int) -> int:
        """Return the largest number of trials of a study.

        `points` is the number of points that the study has at first.
        """

    @property
    def looks(self) -> tuple[int, ...]:
        """Numbers of trials after which a point is looked at."""

    @property
    def nominal(self) -> float:
        """Confidence of the confidence interval of a point at each look."""

    @property
    def counted(self) -> str:
        """The trials of a spec that are counted, in words."""

    @property
    def where(self) -> str:
        """The behaviour of the mean where points are added, in words.

        "" if none are added.
        """

    @property
    def in_words(self) -> str:
        """The condition under which trials or points are added, in words."""

    def as_json(self) -> dict[str, Any]:
        """Return the rule as JSON."""


@dataclass(frozen=True)
class StudyVariant:
    """A study with a changed spec, stored in the folder of the original study.

    Attributes
    ----------
    name
        Its name below the name of the study.
    words
        The difference, in words.
    place
        Keys of the spec that lead to the request for it.
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
        The key, with its name and content.
    form_of
        The key of a study whose form as a mapping the section is, which has the keys of
        the section; `key` is then one of them, and names the section. "" if the section
        appears under `key`.
    read
        Returns the value of the section, from the root of the spec and from the context
        that the value must suit. Called if the key is given. Raises SpecError.
    check
        Raises SpecError if a value does not suit the whole spec. Called when each key
        alone is right.
    not_beside
        Keys that cannot appear beside this one, each with the reason, or "".
    needs
        Further requirements to a spec with the key, as JSON Schema.
    check_points
        Raises SpecError if a value does not suit the number of points that a study has
        at first, from the study, the value and this number.
    strategy
        Returns the strategy of a launch (`sweep.campaigns.strategy`), from the study,
        the value, and the folder of results or None. One section of a spec may have a
        strategy. The value is a `GrowthRule`, unless the section has `stand_in`.
    stand_in
        Returns a study of a design whose trials are like those that the strategy asks
        for, from the study and the value. None if the points of the study are those of
        its axes.
    plan
        Returns the plan of a study (`sweep.design.plan.StudyPlan`), from the study, the
        number of workers and the seconds of compiling. None for the plan of a design.
    command
        Command that runs a study with the section and prints its report.
    axis
        Returns an axis that each design of the study begins with, from the root of the
        spec, the value and the context.
    setting_values
        Returns the values that the section gives settings, by setting.
    columns
        Returns the columns of trials that are recorded for the section, from its value.
        Such a section is read before the record: its context has all metrics.
    columns_under
        Keys of the section whose content has a key for each of some columns. As
        `streams` and `model_schema`, it is for a section under a key of its own.
    streams
        Kinds of streams that a spec with the section leaves out, by purpose.
    definitions
        Returns parts of the schema that a reference names.
    model_schema
        Returns what the schema of one model demands of the section.
    looks_at
        Returns the columns of trials that the strategy looks at, from the record of a
        plan. The record of a `GrowthRule` has its `confidence` and
        `nominal_confidence`.
    variants
        Returns the variants of a study that a value requests. Raises SpecError.
    recorded
        Returns the record of a value in a plan, as JSON, from the study and the value.
        None if nothing is recorded: a stored study then does not know the section,
        unless the table of what its strategy has asked for describes it.
    shape
        Shape of the record. A section with `recorded` and without it is left out.
    check_recorded
        Raises ValueError for a record of that shape that is impossible, from the record
        and all that the plan says of its study.
    """

    key: Key
    read: Callable[[Entry, SpecContext], Any]
    recorded: Callable[[Any, Any], Any] | None = None
    shape: Shape = None
    check: Callable[[Entry, Any, SpecContext], None] = _nothing_to_check
    not_beside: Mapping[str, str] = field(default_factory=dict)
    needs: Schema | None = None
    check_points: Callable[[Any, Any, int], None] = _no_points_to_check
    strategy: Callable[[Any, Any, Any], Any] | None = None
    stand_in: Callable[[Any, Any], Any] | None = None
    plan: Callable[[Any, int, float], Any] | None = None
    command: str = "launch"
    axis: Callable[[Entry, Any, SpecContext], Axis] | None = None
    setting_values: Callable[[Any], Mapping[str, SettingValues]] = lambda _value: {}
    columns: Callable[[Any], Sequence[str]] | None = None
    columns_under: Sequence[str] = ()
    streams: Mapping[str, str] = field(default_factory=dict)
    definitions: Callable[[], Schema] = dict
    model_schema: Callable[[ModelSchemas], Schema] | None = None
    form_of: str = ""
    looks_at: Callable[[Any], tuple[str, ...]] = lambda _record: ()
    variants: Callable[[Any, Any], Sequence[StudyVariant]] = _no_variants
    check_recorded: Callable[[Any, Mapping[str, Any]], None] = lambda *_: None

    @property
    def has_own_points(self) -> bool:
        """True if the strategy asks for points that no axis of the study has."""
        return self.stand_in is not None

    @property
    def place(self) -> Place:
        """Keys in a spec of the section, or of the key that it is a form of."""
        return (self.form_of, self.key.name) if self.form_of else (self.key.name,)

    def is_in(self, root: Entry) -> bool:
        """Return whether a spec has the section."""
        entry = root.get(self.form_of or self.key.name)
        return entry is not None and (not self.form_of or isinstance(entry.value, dict))


@dataclass(frozen=True)
class OrForm(Content[Any]):
    """A plain value, or the mapping of a section that is a form of the key `name`.

    Reading such a mapping returns its entry.
    """

    plain: Content[Any]
    name: str

    @property
    def words(self) -> str:
        """The allowed values, in words."""
        if form := self._form:
            return f"{self.plain.words}, or a mapping with `{form.key.name}`"
        return self.plain.words

    def read(self, entry: Entry) -> Any:
        """Return the plain value, or the entry of the mapping. Raises SpecError."""
        if self._form and isinstance(entry.value, dict):
            return entry
        return self.plain.read(entry)

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        if form := self._form:
            return {"anyOf": [self.plain.schema(), form.key.content.schema()]}
        return self.plain.schema()

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """The classes whose keys may appear below this one."""
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


def check_names(kind: str, names: Sequence[str], known: Collection[str]) -> None:
    """Raise ValueError for a name that is not known, or that appears twice.

    Parameters
    ----------
    kind : str
        Noun for the names, for the message.
    names : sequence of str
    known : collection of str
    """
    for name in names:
        if name not in known:
            raise ValueError(f'there is no {kind} "{name}"')
    if len(names) > len(set(names)):
        raise ValueError(f"a {kind} stands twice")


def recorded_rule(rule: GrowthRule) -> dict[str, Any]:
    """Return the record of a rule in a plan.

    It has its looks and its confidence at each look.
    """
    return rule.as_json() | {"looks": rule.looks, "nominal_confidence": rule.nominal}
