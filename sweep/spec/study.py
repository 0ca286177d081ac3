"""From a spec to a Study.

All checks of specs happen here and in the functions that this module calls.
"""

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from difflib import get_close_matches
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.model import Model
from kernels.models import MODELS
from sweep.analysis import Declaration, in_full
from sweep.method import methods
from sweep.spec.axes import Axis, AxisReader, by_design
from sweep.spec.contents import (
    Content,
    ListOf,
    Number,
    OneOf,
    OrFalse,
    ReadLater,
    Text,
    Truth,
    Whole,
)
from sweep.spec.continued_checks import (
    check_beside_continued,
    check_continued,
    continued_axis,
    held,
)
from sweep.spec.derived_metrics import (
    DerivedMetric,
    derived_schema,
    needed,
    read_derived,
)
from sweep.spec.document import Document, Entry, Place
from sweep.spec.expressions import Expression
from sweep.spec.failure_policy import Policy, read_policy
from sweep.spec.keys import (
    Key,
    LaterSectionOf,
    check_beside,
    check_keys,
    keys_of,
    read_section,
    read_values,
)
from sweep.spec.maps import MAP_FORMS, OwnMap, maps_schema, read_maps
from sweep.spec.mistakes import Mistakes
from sweep.spec.recorded import ANY_METRIC, Column, KnownMetrics, declaration_of
from sweep.spec.replication import SEEDS, TRIALS, read_replication
from sweep.spec.samplers import SAMPLERS
from sweep.spec.sampling import Sampler
from sweep.spec.schema_parts import OWN_CODE, TEXT, Schema, listed, reference
from sweep.spec.section import (
    GrowthRule,
    OrForm,
    SettingValues,
    SpecContext,
    SpecSection,
    StudyVariant,
    form_of,
)
from sweep.spec.setting_values import (
    check_complete,
    check_conditions,
    check_once,
    read_derive,
    read_designs,
    read_fixed,
    read_require,
)
from sweep.spec.settings import (
    USUAL_PRESET,
    Setting,
    Value,
    settings_of,
    usual_preset,
    usual_settings,
)
from sweep.spec.strict_yaml import dump, parse_document
from sweep.spec.study_folder import (
    MOST_NAME,
    NAME_WORDS,
    NOWHERE,
    STUDY_NAME,
    TAKEN,
    why_no_name,
)
from sweep.text import shortened

log = logging.getLogger("sweep")
Stream = Literal["common", "independent", "lasting"]
Order = Literal["longest", "coarse"]
NeighbourSearch = Literal["grid", "all_pairs"]
ALL_PAIRS: NeighbourSearch = "all_pairs"


class MetricName(Text):
    """The name of a metric. The model and `derive` decide which exist."""

    def schema(self) -> Schema:
        """Return a reference to the names of metrics."""
        return reference("metric")


def _swept_schema() -> Schema:
    """Return the schema of one design, or of several in a list."""
    return {"type": ["object", "array"], "minItems": 1}


LAST_FLOCKS = "last_flocks"
"""Key, and table, of the boids at the end of a trial.

Trials of another study can begin with them.
"""
TABLES = ("series", "heatmaps", "trajectories", LAST_FLOCKS)
"""Tables that a spec selects, under keys of these names."""
LAST_STATES = "last_states"
"""Key, and table, of the states with which trials of more steps resume.

No analysis reads it.
"""
CHECKPOINT_SECONDS = 60.0
STREAM = OneOf("kind of stream", get_args(Stream))
ORDER = OneOf("order", get_args(Order))
NEIGHBOUR_SEARCH = OneOf("neighbour_search", get_args(NeighbourSearch))
METRIC_NAMES = ListOf(MetricName(), "metrics (`sweep metrics`)")
SECONDS = Number(above=0, unit="seconds")


@dataclass(frozen=True)
class RecordSpec:
    """The record of a trial: frames 0, `every`, 2 `every`, ... and the last.

    `metrics` are metrics of the kernels, with all that `derive` needs. A derived metric
    follows the metrics that it needs. `series` are among both.
    """

    metrics: Annotated[
        tuple[str, ...],
        Key(
            METRIC_NAMES,
            "recorded of each trial: at its last frame, and the mean of its last half",
            otherwise="those of the model",
            example=f"[{ANY_METRIC}]",
        ),
    ]
    series: Annotated[
        tuple[str, ...],
        Key(
            METRIC_NAMES,
            "recorded of each frame, and of each trial too",
            otherwise="none",
            example=f"[{ANY_METRIC}]",
        ),
    ] = ()
    every: Annotated[
        int, Key(Whole(1), "number of steps between frames", example="10")
    ] = 1
    heatmaps: Annotated[
        bool, Key(Truth(), "whether visits are kept by pixel", example="true")
    ] = False
    trajectories: Annotated[
        bool,
        Key(
            Truth(),
            "whether the position and velocity of each boid are kept of each frame,"
            " with its state and its kind where its model has these",
            example="true",
        ),
    ] = False
    last_states: Annotated[
        bool,
        Key(
            Truth(),
            "whether all is kept with which a trial ends: a launch of the same spec"
            " with more `steps` goes on from there. No stream may be independent",
            example="true",
        ),
    ] = False
    last_flocks: Annotated[
        bool,
        Key(
            Truth(),
            "whether place, velocity and state of each boid are kept at the end of a"
            " trial, where trials of another study can begin. A study with `continue`"
            " keeps them",
            example="true",
        ),
    ] = False
    derive: Annotated[
        tuple[DerivedMetric, ...],
        Key(
            ReadLater(
                "names with expressions over metrics and settings", derived_schema
            ),
            "metrics computed from others, frame by frame, and recorded too",
            otherwise="none",
            example='{gain: "polarization / speed"}',
        ),
    ] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All metrics of a trial, derived ones last."""
        return (*self.metrics, *(metric.name for metric in self.derive))

    @property
    def tables(self) -> tuple[str, ...]:
        """The tables that are stored of a trial."""
        return ("trials", *(name for name in TABLES if getattr(self, name)))


@dataclass(frozen=True)
class Streams:
    """The kind of the random numbers of each purpose.

    They are the same at all points (common), or others at each point (independent).
    Lasting ones are the same at points that differ in `steps` alone.
    """

    start: Annotated[Stream, Key(STREAM, "of where boids start, and how fast")] = (
        "common"
    )
    world: Annotated[Stream, Key(STREAM, "of random obstacles")] = "common"
    noise: Annotated[
        Stream,
        Key(
            STREAM,
            "of all that is random during the flight",
            otherwise="independent, or common in a search",
        ),
    ] = "independent"


@dataclass(frozen=True)
class StudyName(Content[str]):
    """A name of a folder below the results that results do not use."""

    @property
    def words(self) -> str:
        """The allowed values, in words."""
        return NAME_WORDS

    def read(self, entry: Entry) -> str:
        """Return the value of an entry. Raise SpecError if it is not allowed."""
        name = entry.text()
        if why := why_no_name(name):
            raise entry.error(why)
        return name

    def schema(self) -> Schema:
        """Return the JSON Schema of allowed names."""
        return {
            "type": "string",
            "pattern": f"^{STUDY_NAME.pattern}$",
            "maxLength": MOST_NAME,
            "not": {"pattern": f"(^|/)({NOWHERE.pattern}|{TAKEN.pattern})(/|$)"},
        }


class ModelName(Text):
    """The name of a model, or a file that defines one."""

    def schema(self) -> Schema:
        """Return the JSON Schema of names, each with the source of the model."""
        names = [
            {"const": name, "description": model.source}
            for name, model in MODELS.items()
        ]
        return {"oneOf": [*names, OWN_CODE]}


@dataclass(frozen=True, eq=False, kw_only=True)
class Study:
    """A checked spec.

    Its keys are the fields that have a `Key`, and the keys of Policy. One of
    `replicates` (trials per point) and `seeds` (a literal seed per trial) is given, or
    a section is the form of `replicates`. Some further fields:

    Attributes
    ----------
    known
        Models, metrics, maps and starts by name.
    derive
        Expressions by setting, each after the expressions that it needs.
    maps
        Maps of the spec's own.
    policy
        Treatment of failed trials.
    sections
        Values of the sections of methods that the spec has, by key.
    checkpoint
        Seconds after which a trial writes down its state, None for never.
    """

    document: Document
    known: Catalogue
    name: Annotated[
        str,
        Key(
            StudyName(),
            "name of the study: its results are in results/NAME",
            name="study",
            example="my/coverage",
        ),
    ]
    model: Annotated[
        str,
        Key(
            ModelName("a name that `sweep models` lists, or a file: ./NAME.py"),
            "the model that flies",
            example=next(iter(MODELS)),
        ),
    ]
    preset: Annotated[
        str,
        Key(
            Text("a preset that `sweep models MODEL` lists"),
            "where values come from that the spec leaves out",
            otherwise=f"{USUAL_PRESET}, or the first of the model",
            example=USUAL_PRESET,
        ),
    ]
    maps: Annotated[
        dict[str, OwnMap],
        Key(
            ReadLater("maps by name", maps_schema, MAP_FORMS, ".NAME"),
            "maps of the study's own, by name",
            otherwise="none",
            example="{lab: {image: lab.png, resolution: 0.5}}",
        ),
    ]
    fixed: Annotated[
        dict[str, Value],
        Key(
            ReadLater("settings with their values"),
            "one value for each of these settings",
            otherwise="none",
            example="{n: 50, steps: 3600}",
        ),
    ]
    axes: Annotated[
        tuple[Axis, ...],
        Key(
            ReadLater("axes by name, or a list of such designs", _swept_schema),
            "axes; the points are their product, the last one fastest. Of several"
            " designs in a list the points are united",
            name="sweep",
            otherwise="one point",
            example="{n: [50, 100], width: {linspace: [100, 400, 4]}}",
        ),
    ]
    derive: Annotated[
        dict[str, Expression],
        Key(
            ReadLater("settings with expressions"),
            "settings computed from others, by expressions",
            otherwise="none",
            example="{steps: 100 * n}",
        ),
    ]
    require: Annotated[
        tuple[Expression, ...],
        Key(
            ReadLater("a list of conditions", lambda: listed(TEXT)),
            "conditions without which a point is left out",
            otherwise="none",
            example="[n < width]",
        ),
    ]
    replicates: Annotated[
        int | None,
        Key(
            OrForm(TRIALS, "replicates"),
            "trials a point: either these, or `seeds`",
            otherwise="as many as `seeds`",
            example="100",
        ),
    ]
    seeds: Annotated[
        tuple[int, ...] | None,
        Key(
            SEEDS,
            "one trial a point with each of these seeds, instead of `replicates`",
            otherwise="made from `seed`",
            example="[27, 729, 4913]",
        ),
    ]
    seed: Annotated[int, Key(Whole(0), "seed of the study", example="1")] = 0
    streams: Annotated[
        Streams,
        Key(
            LaterSectionOf(Streams),
            "common: the same random numbers at all points; independent: others at"
            " each; lasting: others at each, but for points that differ in `steps`"
            " alone",
            otherwise="only noise is independent",
            example="{noise: common}",
        ),
    ]
    record: Annotated[
        RecordSpec,
        Key(
            LaterSectionOf(RecordSpec),
            "what is kept of each trial",
            otherwise="the metrics of the model",
            example=f"{{series: [{ANY_METRIC}], every: 10}}",
        ),
    ]
    order: Annotated[
        Order,
        Key(
            ORDER,
            "which trials run first: the longest, or a coarse picture of the whole,"
            " which becomes finer",
            example="coarse",
        ),
    ] = "longest"
    time_limit: Annotated[
        float | None,
        Key(SECONDS, "seconds a trial may take", otherwise="no limit", example="60"),
    ] = None
    neighbour_search: Annotated[
        NeighbourSearch,
        Key(
            NEIGHBOUR_SEARCH,
            "how the neighbours of a boid are found: through a grid of cells, or among"
            " all pairs of boids, which takes longer and has the same bits",
            example=ALL_PAIRS,
        ),
    ] = "grid"
    checkpoint: Annotated[
        float | None,
        Key(
            OrFalse(SECONDS),
            "seconds after which a trial writes down where it is",
            example="600",
        ),
    ] = CHECKPOINT_SECONDS
    policy: Policy
    sections: Mapping[str, Any]

    @property
    def text(self) -> str:
        """The YAML as read."""
        return self.document.text

    @property
    def path(self) -> Path:
        """The file of the spec, in whose folder relative paths start."""
        return self.document.path

    @cached_property
    def settings(self) -> dict[str, Setting]:
        """Every setting of the model, and the spreads that the spec names.

        The choices of `map` include the study's own.
        """
        derived = (metric.expression for metric in self.record.derive)
        expressions = (*self.expressions, *derived)
        used = {name for expression in expressions for name in expression.names}
        every = settings_of(self.model, self.known).of_study(self.maps)
        return {
            name: setting
            for name, setting in every.items()
            if not setting.spread_of or name in used or self.place_of(name)
        }

    @cached_property
    def preset_settings(self) -> dict[str, Value]:
        """The value of every setting in the preset of the study."""
        values = usual_settings(self.model, self.preset, self.known)
        return {name: values[name] for name in self.settings}

    def map_size(self, name: str) -> tuple[float, float] | None:
        """Return the width and height of a map, built-in or the study's own.

        None for a map that suits every size.
        """
        drawn = self.maps[name] if name in self.maps else self.known.maps[name]
        return drawn.size

    @property
    def strategy_section(self) -> tuple[SpecSection, Any] | None:
        """The section with a strategy of its own, and its value, if there is one."""
        values = self.sections.items()
        every = ((sections()[key], value) for key, value in values)
        return next((pair for pair in every if pair[0].strategy), None)

    @property
    def rule(self) -> GrowthRule | None:
        """The rule that adds trials or points after looks at stored trials."""
        if self.strategy_section is None or self.strategy_section[0].has_own_points:
            return None
        rule: GrowthRule = self.strategy_section[1]
        return rule

    @property
    def command(self) -> str:
        """The command that runs the study and prints what is reported of it."""
        return self.strategy_section[0].command if self.strategy_section else "launch"

    @property
    def has_design(self) -> bool:
        """True if the points of the study are those of its axes, or begin with them."""
        return self.strategy_section is None or self.rule is not None

    @property
    def stand_in(self) -> "Study":
        """A study of a design with trials like those of this study.

        It is the study itself if it has a design. Else it lacks the section with the
        strategy, and the values that the section gives settings.
        """
        if self.strategy_section and (stand_in := self.strategy_section[0].stand_in):
            study: Study = stand_in(self, self.strategy_section[1])
            return study
        return self

    def variants(self) -> list[StudyVariant]:
        """Return the variants that sections ask for. Raises SpecError."""
        return [
            variant
            for key, value in self.sections.items()
            for variant in sections()[key].variants(self, value)
        ]

    @property
    def trials_per_point(self) -> int:
        """The number of replicates or of seeds.

        If a rule adds trials, their largest number.
        """
        if self.rule:
            return self.rule.most
        return self.replicates if self.replicates is not None else len(self.seeds or ())

    def most_trials(self, points: int) -> int:
        """Return the largest number of trials of a study.

        `points` is the number of points that the study has at first.
        """
        if self.rule:
            return self.rule.most_trials(points)
        return points * self.trials_per_point

    def distribution(self, column: str) -> Declaration:
        """Return the distribution of a column of trials, with the range of its values.

        It is the distribution of the metric of the column.
        """
        name = Column.read(column).metric
        derived = {metric.name: metric.distribution for metric in self.record.derive}
        if name in derived:
            return in_full(derived[name])
        return declaration_of(self.known.metrics[name])

    @cached_property
    def section_values(self) -> Mapping[str, SettingValues]:
        """The values that sections give settings, by setting."""
        return {
            setting: values
            for key, value in self.sections.items()
            for setting, values in sections()[key].setting_values(value).items()
        }

    @property
    def continued(self) -> Axis | None:
        """The axis along which trials are links of chains, if there is one."""
        return continued_axis(self.axes)

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """All expressions over points: `when` of axes, `derive`, `require`."""
        conditions = [axis.when for axis in self.axes if axis.when]
        return (*conditions, *self.derive.values(), *self.require)

    def place_of(self, setting: str) -> Place | None:
        """Return the keys in the spec of the value of a setting.

        None if the preset gives the value.
        """
        if setting in self.fixed:
            return ("fixed", setting)
        if setting in self.derive:
            return ("derive", setting)
        if from_section := self.section_values.get(setting):
            return from_section.place
        return next((axis.place for axis in self.axes if setting in axis.columns), None)


def parse_spec(
    spec: str | Mapping[str, Any],
    path: Path = Path("spec.yaml"),
    known: Catalogue = BUILT_IN,
) -> Study:
    """Return the study of a YAML text or a mapping.

    Parameters
    ----------
    spec : str or mapping
    path : Path, default "spec.yaml"
        The spec is read as if it were this file.
    known : Catalogue, optional
        Models, metrics, maps and starts by name; by default the built-in ones.

    Raises
    ------
    SpecError
        If the spec is not valid.
    """
    text = spec if isinstance(spec, str) else dump(spec)
    return read_study(parse_document(text, path), known)


@cache
def sections() -> Mapping[str, SpecSection]:
    """Return the sections of all methods by their keys.

    A section of a package is left out, with a warning, if its key is a key of a study
    or of another method, if another section is the form of that key already, or if it
    is recorded without the shape of its record.
    """
    own = {key.name for key in keys_of(Study, Policy)}
    by_key = dict[str, SpecSection]()
    for name, method in methods().items():
        for section in method.sections():
            key = section.key.name
            taken = key in own or key in by_key
            if taken or (section.form_of and form_of(section.form_of) is not section):
                log.warning('the section "%s" of %s: its key is taken', key, name)
            elif section.recorded and section.shape is None:
                message = 'the section "%s" of %s: its record has no "shape"'
                log.warning(message, key, name)
            else:
                by_key[key] = section
    return by_key


def spec_parts() -> tuple[type[Any] | Key, ...]:
    """Return the parts with the keys of a spec: classes, and keys of sections."""
    keys = (section.key for section in sections().values() if not section.form_of)
    return (Study, Policy, *keys)


GONE = {
    "threads": "a trial takes one core now, as a launch keeps all cores busy with"
    " trials; several for one were 0.36 to 1.6 times as fast; remove the line",
}
"""Keys of earlier versions, and the reasons why they were removed."""


def read_study(
    root: Entry,
    known: Catalogue = BUILT_IN,
    samplers: Mapping[str, Sampler] = SAMPLERS,
) -> Study:
    """Return the study of a whole document.

    A mistake in one key hides mistakes that depend on the key, and no others. Of an
    unknown model only mistakes are found that a spec of any model has. A model that
    cannot be used hides all that depends on it.

    Parameters
    ----------
    root : Entry
        The document.
    known : Catalogue, optional
        Models, metrics, maps and starts by name; by default the built-in ones.
    samplers : mapping, optional
        Samplers by name.

    Raises
    ------
    SpecError
        All mistakes are reported together.
    """
    if root.value is None:
        raise root.error("is empty")
    root.mapping()
    mistakes = Mistakes()
    with mistakes.noted():
        check_keys(root, *spec_parts(), gone=GONE)
    values = read_values(Study, root, mistakes)
    policy = mistakes.read(read_policy, root)
    if model := root.get("model"):
        mistakes.read(model.one_of, "model", known.models)
    read = None
    if values.get("model") in known.models:
        read = mistakes.read(_of_model, root, values, known, samplers=samplers)
    elif values.get("model") not in getattr(known.models, "refused", {}):
        mistakes.note_common([*_as_each_model(root, values, known, samplers)])
    mistakes.check()
    assert read
    assert policy
    return Study(document=root.document, known=known, policy=policy, **(values | read))


def _as_each_model(
    root: Entry,
    values: Mapping[str, Any],
    known: Catalogue,
    samplers: Mapping[str, Sampler],
) -> Iterator[Mistakes]:
    """Yield the mistakes of a study of each of the models.

    Models whose names are most similar to the name in the spec are first.
    """
    name = str(values.get("model", ""))
    models = [*known.models]
    for model in get_close_matches(shortened(name), models, n=len(models), cutoff=0.0):
        mistakes = Mistakes()
        with mistakes.noted():
            _of_model(root, {**values, "model": model}, known, samplers)
        yield mistakes


def _of_model(
    root: Entry,
    values: Mapping[str, Any],
    known: Catalogue,
    samplers: Mapping[str, Sampler],
) -> dict[str, Any]:
    """Return the values of a study that depend on its model, by field.

    First each key is read alone. Checks of several keys come last, if all keys are
    right. Raises SpecError.
    """
    mistakes = Mistakes()
    name = values["model"]
    folder = root.document.path.parent
    usual = usual_preset(known.models[name])
    preset = mistakes.read(_preset, root, known.models[name]) or usual
    drawn = values.get("maps")
    recorded = values.get("record")
    settings = settings_of(name, known).of_study(_names_in(drawn))
    seed = values.get("seed", 0)
    keys = {key.name for key in keys_of(*spec_parts())}
    reader = AxisReader(
        known=known,
        model=name,
        preset=preset,
        settings=settings,
        seed=seed,
        folder=folder,
        samplers=samplers,
        keys=keys,
    )
    maps = mistakes.read(read_maps, drawn, folder, known.maps)
    fixed = mistakes.read(read_fixed, values.get("fixed"), settings, keys) or {}
    derive = mistakes.read(read_derive, values.get("derive"), settings) or {}
    require = mistakes.read(read_require, values.get("require"), settings)
    derived = (
        mistakes.read(
            read_derived, _part(recorded, "derive"), name, known, settings=settings
        )
        or ()
    )
    metrics = KnownMetrics(name, known, _names_in(_part(recorded, "derive")))
    replication = mistakes.read(read_replication, root)
    context = SpecContext(
        model=name,
        preset=usual_settings(name, preset, known),
        fixed=fixed,
        maps=maps or {},
        axes=None,
        replication=replication,
        recorded=(*known.metrics, *metrics.derived),
        known=metrics,
        settings=settings,
        reader=reader,
        taken={setting: ("fixed", setting) for setting in fixed}
        | {setting: ("derive", setting) for setting in derive},
    )
    present = [section for section in sections().values() if section.is_in(root)]
    section_values: dict[str, Any] = {}
    adding = [section for section in present if section.axis]
    _read_sections(root, adding, context, section_values, mistakes=mistakes)
    added = [
        axis
        for key, value in section_values.items()
        if (axis_of := sections()[key].axis)
        and (axis := mistakes.read(axis_of, root, value, context))
    ]
    taken = [*context.taken, *(name for axis in added for name in axis.columns)]
    swept = mistakes.read(read_designs, values.get("axes"), reader, taken)
    if swept is not None:
        swept = mistakes.read(_with_axes, root, added, swept)
    context = context._replace(axes=swept)
    # What a section records may be what another one looks at.
    recording = [section for section in present if section.columns and not section.axis]
    _read_sections(root, recording, context, section_values, mistakes=mistakes)
    columns = [
        column
        for key, value in section_values.items()
        if (columns_of := sections()[key].columns)
        for column in columns_of(value)
    ]
    record = mistakes.read(_record, recorded, metrics, derived, columns=columns)
    if record:
        context = context._replace(recorded=record.names)
    looking = [section for section in present if not (section.columns or section.axis)]
    _read_sections(root, looking, context, section_values, mistakes=mistakes)
    streams = mistakes.read(_streams, values.get("streams"), present)
    mistakes.read(check_beside_continued, root, swept or ())
    mistakes.check()
    axes = swept or ()
    assert replication
    mistakes.read(_check_names, root, context.recorded, settings)
    if record and streams:
        mistakes.read(_check_lasting, root, record, streams)
    mistakes.read(check_once, root, fixed, axes, derive=derive)
    mistakes.check()
    mistakes.read(check_conditions, root, axes, derive)
    mistakes.read(check_complete, root, axes)
    assert record
    assert streams
    with mistakes.noted():
        check_continued(root, axes, settings, [*fixed, *derive])
    mistakes.read(_check_rules, root, section_values)
    for key, value in section_values.items():
        mistakes.read(sections()[key].check, root, value, context._replace(axes=axes))
    mistakes.check()
    if continued_axis(axes):
        fixed = fixed | held(axes)
        record = replace(record, last_flocks=True)
    read = {
        "preset": preset,
        "maps": maps,
        "fixed": fixed,
        "axes": axes,
        "sections": section_values,
        "derive": derive,
        "require": require,
        "streams": streams,
        "record": record,
    }
    return read | replication._asdict()


def _read_sections(
    root: Entry,
    present: Iterable[SpecSection],
    context: SpecContext,
    values: dict[str, Any],
    *,
    mistakes: Mistakes,
) -> None:
    """Enter the values of sections that a spec has, by key, and note mistakes."""
    for section in present:
        key = section.key.name
        with mistakes.noted():
            values[key] = section.read(root, context)
        mistakes.read(check_beside, root, key, section.not_beside)


def _check_rules(root: Entry, values: Mapping[str, Any]) -> None:
    """Raise SpecError for a second rule that adds trials or points."""
    growing = [key for key in values if sections()[key].strategy]
    for key in growing[1:]:
        raise root.document.error(
            sections()[key].place,
            "one rule adds trials or points of a study:"
            f' "{key}" cannot stand beside "{growing[0]}"',
        )


def _streams(entry: Entry | None, present: Iterable[SpecSection]) -> Streams:
    """Return the streams; sections of the spec decide about those left out."""
    kinds = {
        purpose: kind
        for section in present
        for purpose, kind in section.streams.items()
    }
    return read_section(Streams, entry, **kinds)


def _with_axes(
    root: Entry, added: Sequence[Axis], axes: tuple[Axis, ...]
) -> tuple[Axis, ...]:
    """Return axes with those that sections add before them, in each design.

    Raises SpecError if an axis of the spec has the name of an added one.
    """
    names = {axis.name for axis in axes}
    for axis in added:
        if axis.name in names:
            raise root.document.error(
                axis.place,
                f'an axis of "sweep" is named "{axis.name}" too: rename it',
            )
    return tuple(
        member
        for number, design in enumerate(by_design(axes))
        for member in (*(replace(axis, design=number) for axis in added), *design)
    )


def _check_lasting(root: Entry, record: RecordSpec, streams: Streams) -> None:
    """Raise SpecError if longer trials could not resume from the last states.

    Their random numbers would be others from step 0 on.
    """
    if record.last_states and (purposes := independent(streams)):
        lasting = ", ".join(f"{name}: lasting" for name in purposes)
        raise root.document.error(
            ("record", LAST_STATES),
            "last_states are of no use: trials with more steps have other random"
            f" numbers ({', '.join(purposes)}), and cannot go on; write"
            f" `streams: {{{lasting}}}`, or common",
        )


def independent(streams: Streams) -> list[str]:
    """Return the purposes whose random numbers differ at any other point."""
    return [name for name, kind in asdict(streams).items() if kind == "independent"]


def _check_names(root: Entry, recorded: Iterable[str], settings: Iterable[str]) -> None:
    """Raise SpecError for a metric with the name of a setting."""
    if taken := set(settings) & set(recorded):
        message = f"metrics have the names of settings: {', '.join(sorted(taken))}"
        raise root.document.error(("record",), message)


def _preset(root: Entry, model: Model) -> str:
    """Return the preset that the spec names, or the usual one."""
    entry = root.get("preset")
    if entry is None:
        return usual_preset(model)
    return entry.one_of(f"preset of {model.name}", model.presets)


def _part(entry: Entry | None, key: str) -> Entry | None:
    return entry.get(key) if entry and isinstance(entry.value, dict) else None


def _names_in(entry: Entry | None) -> tuple[str, ...]:
    """Return the keys of a mapping, whatever their values."""
    return tuple(entry.value) if entry and isinstance(entry.value, dict) else ()


def study_rules() -> Schema:
    """Return the checks of several keys as JSON Schema."""
    pairs = [
        (key, other)
        for key, section in sections().items()
        for other in section.not_beside
    ]
    barred = [{"required": [*pair]} for pair in pairs]
    return {"not": {"anyOf": barred}, **_lasting_rule()}


def _lasting_rule() -> Schema:
    """Return the check of `_check_lasting` as JSON Schema."""
    keeps = {"properties": {LAST_STATES: {"const": True}}, "required": [LAST_STATES]}
    usual = {field.name: field.default for field in fields(Streams)}
    never = {name: {"not": {"const": "independent"}} for name in usual}
    needed = [name for name, kind in usual.items() if kind == "independent"]
    streams = {"properties": never}
    by_section: list[Schema] = [
        {"required": [key]}
        for key, section in sections().items()
        if "independent" not in {**usual, **section.streams}.values()
    ]
    return {
        "if": {"properties": {"record": keeps}, "required": ["record"]},
        "then": {
            "properties": {"streams": streams},
            "anyOf": [
                *by_section,
                {
                    "required": ["streams"],
                    "properties": {"streams": {"required": needed}},
                },
            ],
        },
    }


def _record(
    entry: Entry | None,
    metrics: KnownMetrics,
    derived: tuple[DerivedMetric, ...],
    columns: Iterable[str],
) -> RecordSpec:
    """Return the record of a spec.

    It has the metrics that derived ones and the columns of sections need.
    """
    known = metrics.known
    usual = known.models[metrics.model].metrics
    mistakes = Mistakes()
    record = mistakes.read(read_section, RecordSpec, entry, metrics=usual)
    for names in (_part(entry, "metrics"), _part(entry, "series")):
        for child in names.items() if names and isinstance(names.value, list) else ():
            if isinstance(child.value, str):
                mistakes.read(metrics.read, child)
    mistakes.check()
    assert record
    searched = [Column.read(column).metric for column in columns]
    required = [*record.metrics, *record.series, *searched, *needed(derived)]
    measured = dict.fromkeys(name for name in required if name in known.metrics)
    return replace(record, metrics=tuple(measured), derive=derived)
