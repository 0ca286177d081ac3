"""Sections of a spec that methods add, such as `validate`.

The entry of a method lists the sections of the method, see `sweep.method`. A section is
described once:

- key and content, and the function that reads the value
- excluded keys
- variants of the study that the section requests
- the record of the section in a plan

A section appears under its key, or is the mapping form of a key of the study. For
example, `replicates` is a number, or the mapping of a method that adds trials.
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
from sweep.spec.profiles import RecordedProfile
from sweep.spec.recorded import KnownMetrics
from sweep.spec.replication import Replication
from sweep.spec.schema_parts import Schema
from sweep.spec.settings import Setting, Value, Values

Shape = Any
"""Shape of a value from JSON, in the form of `sweep.store.regular.fits`."""


class SpecContext(NamedTuple):
    """The parts of a study that a section must suit.

    Attributes
    ----------
    model : str
        Name of the model.
    preset : mapping
        Values of the preset, by parameter.
    fixed : mapping
        Values under `fixed`, by parameter.
    maps : mapping
        Custom maps of the study, by name.
    axes : sequence of Axis, optional
        Axes of the spec. None if the axes are wrong, which hides mistakes that depend
        on axes. Also None for a section that adds an axis, which is read before the
        axes.
    replication : Replication, optional
        Number of trials per point. None if the number is wrong.
    recorded : sequence of str
        Recorded metrics, or all known metrics if the record is wrong.
    profiles : sequence of RecordedProfile, optional
        Recorded profiles. None if the record is wrong.
    metrics : KnownMetrics
        Known metrics.
    settings : mapping
        Parameters of the study by name.
    reader : AxisReader
        Reader of axes of the study.
    taken : mapping
        Place in the spec of each parameter with a value under `fixed` or `derive`.
    """

    model: str
    preset: Mapping[str, Value]
    fixed: Mapping[str, Value]
    maps: Mapping[str, OwnMap]
    axes: Sequence[Axis] | None
    replication: Replication | None
    recorded: Sequence[str]
    profiles: Sequence[RecordedProfile] | None
    metrics: KnownMetrics
    settings: Mapping[str, Setting]
    reader: AxisReader
    taken: Mapping[str, Place]


class SettingValues(NamedTuple):
    """Values that a section gives to a parameter, or requests in turn.

    Attributes
    ----------
    place : Place
        Keys of the spec that lead to the values.
    values : sequence
        The values, or the bounds of a range.
    """

    place: Place
    values: Sequence[Value] | Values


class ModelSchemas(NamedTuple):
    """Schemas of the parameters of a model, for the section of a method.

    Attributes
    ----------
    ranges : Schema
        Schema of parameters, each with a range.
    axes : Schema
        Schema of axes.
    values : Schema
        Schema of parameters, each with a value.
    drawn : Schema
        Schema of parameters of any name, each with a distribution.
    names : sequence of str
        Names of the parameters.
    """

    ranges: Schema
    axes: Schema
    values: Schema
    drawn: Schema
    names: Sequence[str]


class GrowthRule(Protocol):
    """A rule that adds trials or points to a study after looks at stored trials."""

    @property
    def place(self) -> Place:
        """Keys of a spec that lead to the rule."""

    @property
    def adds_points(self) -> bool:
        """True if the rule adds points outside of the axes."""

    @property
    def least(self) -> int:
        """Initial number of trials per point."""

    @property
    def most(self) -> int:
        """Largest number of trials per point."""

    def most_trials(self, points: int) -> int:
        """Return the largest number of trials of a study.

        `points` is the initial number of points of the study.
        """

    @property
    def looks(self) -> tuple[int, ...]:
        """Numbers of trials per point at which the rule looks at a point."""

    @property
    def nominal(self) -> float:
        """Confidence of the confidence interval of a point at each look."""

    @property
    def counted(self) -> str:
        """The counted trials of a spec, in words."""

    @property
    def where(self) -> str:
        """The behaviour of the mean where points are added, in words.

        "" if the rule adds no points.
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
    name : str
        Name of the variant below the name of the study.
    description : str
        The difference in words.
    place : Place
        Keys of the spec that lead to the request for the variant.
    spec : dict
        The whole spec of the variant.
    """

    name: str
    description: str
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
    key : Key
        The key, with name and content.
    form_of : str, default ""
        The key of a study for which the section is the mapping form. The mapping then
        has the keys of the section, and `key` is one of these keys and names the
        section. "" if the section appears under `key`.
    read : callable
        Returns the value of the section, from the root of the spec and from the context
        that the value must suit. Called if the key is given. Raises SpecError.
    check : callable
        Raises SpecError if a value does not suit the whole spec. Called when each key
        alone is right.
    not_beside : mapping
        Keys that this key excludes, each with the reason, or "".
    needs : Schema, optional
        Further requirements for a spec with the key, as JSON Schema.
    check_points : callable
        Raises SpecError if a value does not suit the initial number of points, from the
        study, the value and this number.
    strategy : callable, optional
        Returns the strategy of a launch (`sweep.campaigns.strategy`), from the study,
        the value, and the folder of results or None. One section of a spec may have a
        strategy. The value is a `GrowthRule`, unless the section has `stand_in`.
    stand_in : callable, optional
        Returns a study of a design with trials similar to the trials that the strategy
        requests, from the study and the value. None if the axes give the points of the
        study.
    plan : callable, optional
        Returns the plan of a study (`sweep.design.plan.StudyPlan`), from the study, the
        number of workers and the seconds of compiling. None for the plan of a design.
    command : str, default "launch"
        Command that runs a study with the section and prints the report of the study.
    axis : callable, optional
        Returns an axis that comes first in each design of the study, from the root of
        the spec, the value and the context.
    setting_values : callable
        Returns the values that the section gives to parameters, by parameter.
    columns : callable, optional
        Returns the columns of trials that are recorded for the section, from the value.
        A section with columns is read before the record, so that the context has all
        metrics.
    columns_under : sequence of str
        Keys of the section whose content has a key for each of some columns. Like
        `streams` and `model_schema`, this is for a section with a separate key.
    streams : mapping
        Kinds of streams for purposes that a spec with the section does not name.
    definitions : callable
        Returns parts of the schema to which a reference refers.
    model_schema : callable, optional
        Returns the requirements of the section in the schema of a model.
    looks_at : callable
        Returns the columns of trials that the strategy looks at, from the record of a
        plan. The record of a `GrowthRule` has `confidence` and `nominal_confidence`.
    variants : callable
        Returns the variants of a study that a value requests. Raises SpecError.
    recorded : callable, optional
        Returns the record of a value in a plan, as JSON, from the study and the value.
        Without a record, a stored study does not know the section, unless the table of
        requested trials describes the section.
    shape : Shape
        Shape of the record. A section with `recorded` and without a shape is left out.
    check_recorded : callable
        Raises ValueError for an impossible record of this shape, from the record and
        the contents of the plan of the study.
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
        """True if the strategy requests points outside of the axes of the study."""
        return self.stand_in is not None

    @property
    def place(self) -> Place:
        """Keys of a spec that lead to the section."""
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
        """The allowed values in words."""
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
        """The classes whose keys may appear below this key."""
        form = self._form
        return form.key.content.sections if form else ()

    @property
    def _form(self) -> SpecSection | None:
        return form_of(self.name)


@cache
def form_of(name: str) -> SpecSection | None:
    """Return the section that is a form of a key of a study; None without a section."""
    every = (section for each in methods().values() for section in each.sections())
    return next((section for section in every if section.form_of == name), None)


def check_names(kind: str, names: Sequence[str], allowed: Collection[str]) -> None:
    """Raise ValueError for an unknown name, and for a name that appears twice.

    Parameters
    ----------
    kind : str
        Noun for the names, for the message.
    names : sequence of str
    allowed : collection of str
    """
    for name in names:
        if name not in allowed:
            raise ValueError(f'there is no {kind} "{name}"')
    if len(names) > len(set(names)):
        raise ValueError(f"a {kind} is listed twice")


def recorded_rule(rule: GrowthRule) -> dict[str, Any]:
    """Return the record of a rule in a plan.

    The record has the looks, and the confidence at each look.
    """
    return rule.as_json() | {"looks": rule.looks, "nominal_confidence": rule.nominal}
