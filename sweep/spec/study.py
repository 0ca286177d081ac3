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
    SectionOf,
    check_beside,
    check_keys,
    keys_of,
    read_section,
    read_values,
    section_schema,
)
from sweep.spec.maps import MAP_FORMS, OwnMap, maps_schema, read_maps
from sweep.spec.mistakes import Mistakes
from sweep.spec.profiles import (
    ANY_PROFILE,
    PROFILE_NAMES,
    RecordedProfile,
    check_profile,
)
from sweep.spec.recorded import ANY_METRIC, Column, KnownMetrics, declaration_of
from sweep.spec.recording import (
    RECORDING,
    RecordingSpec,
    check_measurable,
    check_of_recording,
)
from sweep.spec.replication import SEEDS, TRIALS, read_replication
from sweep.spec.samplers import SAMPLERS
from sweep.spec.sampling import Sampler
from sweep.spec.schema_parts import (
    OWN_CODE,
    TEXT,
    Schema,
    listed,
    one_of,
    reference,
)
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
    """The name of a metric, which the model or `derive` must define."""

    def schema(self) -> Schema:
        """Return a reference to the names of metrics."""
        return reference("metric")


def _swept_schema() -> Schema:
    """Return the schema of a design, or of a list of designs."""
    return {"type": ["object", "array"], "minItems": 1}


MODEL = "model"
LAST_FLOCKS = "last_flocks"
"""Key, and table, of the boids at the end of a trial.

The boids can be the initial condition of trials of another study.
"""
TABLES = ("series", "heatmaps", "trajectories", "profiles", LAST_FLOCKS)
"""Tables that a spec selects, under keys of these names."""
LAST_STATES = "last_states"
"""Key, and table, of the states from which trials with more steps resume.

No analysis reads this table.
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

    `metrics` are metrics of the kernels, with all metrics that `derive` needs. A
    derived metric follows the metrics in its expression. `series` are some of `metrics`
    and `derive`.
    """

    metrics: Annotated[
        tuple[str, ...],
        Key(
            METRIC_NAMES,
            "metrics of each trial: the value at the last frame, and the mean over the"
            " second half, or over an event of a recording",
            otherwise="the metrics of the model",
            example=f"[{ANY_METRIC}]",
        ),
    ]
    series: Annotated[
        tuple[str, ...],
        Key(
            METRIC_NAMES,
            "metrics stored at each frame (time series), and also for each trial",
            otherwise="none",
            example=f"[{ANY_METRIC}]",
        ),
    ] = ()
    every: Annotated[
        int, Key(Whole(1), "number of steps between frames", example="10")
    ] = 1
    heatmaps: Annotated[
        bool, Key(Truth(), "visits per pixel of the map", example="true")
    ] = False
    trajectories: Annotated[
        bool,
        Key(
            Truth(),
            "position and velocity of each boid at each frame, with state and type if"
            " the model has states and types",
            example="true",
        ),
    ] = False
    last_states: Annotated[
        bool,
        Key(
            Truth(),
            "complete final states of trials. A launch of the spec with more `steps`"
            " resumes from these states. No stream may be independent",
            example="true",
        ),
    ] = False
    last_flocks: Annotated[
        bool,
        Key(
            Truth(),
            "final position, velocity and state of each boid, as an initial condition"
            " of another study. A study with `continue` always has this table",
            example="true",
        ),
    ] = False
    derive: Annotated[
        tuple[DerivedMetric, ...],
        Key(
            ReadLater(
                "names with expressions over metrics and parameters", derived_schema
            ),
            "metrics computed from metrics and parameters at each frame, and recorded",
            otherwise="none",
            example='{gain: "polarization / speed"}',
        ),
    ] = ()

    profiles: Annotated[
        tuple[RecordedProfile, ...],
        Key(
            PROFILE_NAMES,
            "metrics with values along an axis, such as a distance or a lag; means over"
            " the second half of a trial, or over an event of a recording",
            otherwise="none",
            example=f"[{ANY_PROFILE}]",
        ),
    ] = ()

    @property
    def profile_names(self) -> tuple[str, ...]:
        """The names of the recorded profiles."""
        return tuple(recorded.name for recorded in self.profiles)

    @property
    def looks(self) -> bool:
        """True if a trial keeps the positions of all boids in the frames."""
        return self.trajectories or bool(self.profiles)

    @property
    def names(self) -> tuple[str, ...]:
        """All metrics of a trial, with derived metrics at the end."""
        return (*self.metrics, *(metric.name for metric in self.derive))

    @property
    def tables(self) -> tuple[str, ...]:
        """The stored tables of a trial."""
        return ("trials", *(name for name in TABLES if getattr(self, name)))


@dataclass(frozen=True)
class Streams:
    """The kind of the random numbers of each purpose.

    Common numbers are equal at all points. Independent numbers differ from point to
    point. Lasting numbers also differ, but are equal at points that differ only in
    `steps`.
    """

    start: Annotated[
        Stream,
        Key(
            STREAM,
            "initial positions and velocities",
            otherwise="common, or independent in a calibration",
        ),
    ] = "common"
    world: Annotated[
        Stream,
        Key(
            STREAM,
            "random obstacles",
            otherwise="common, or independent in a calibration",
        ),
    ] = "common"
    noise: Annotated[
        Stream,
        Key(
            STREAM,
            "random numbers during a trial",
            otherwise="independent, or common in a search",
        ),
    ] = "independent"


@dataclass(frozen=True)
class StudyName(Content[str]):
    """The name of a study, which is a folder below the folder of results."""

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return NAME_WORDS

    def read(self, entry: Entry) -> str:
        """Return the name of an entry, or raise SpecError for a wrong name."""
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
        """Return the JSON Schema of names, with the sources of the models."""
        names = [
            {"const": name, "description": model.source}
            for name, model in MODELS.items()
        ]
        return {"oneOf": [*names, OWN_CODE]}


@dataclass(frozen=True, eq=False, kw_only=True)
class Study:
    """A checked spec.

    The keys of a spec are the fields with a `Key`, and the keys of Policy. The spec has
    either `replicates` (trials per point), `seeds` (a seed per trial), or a section
    that is a form of `replicates`. Some fields need an explanation:

    Attributes
    ----------
    catalogue : Catalogue
        Models, metrics, maps and starts by name.
    derive : dict
        Expressions by parameter, each after the expressions that it needs.
    maps : dict
        Custom maps of the spec.
    policy : Policy
        Treatment of failed trials.
    sections : mapping
        Values of the sections of methods that the spec has, by key.
    checkpoint : float, optional
        Least time between two checkpoints of a trial, in seconds. None for no
        checkpoints.
    """

    document: Document
    catalogue: Catalogue
    name: Annotated[
        str,
        Key(
            StudyName(),
            "name of the study; the results are in results/NAME",
            name="study",
            example="my/coverage",
        ),
    ]
    model: Annotated[
        str,
        Key(
            ModelName("a name that `sweep models` lists, or a file: ./NAME.py"),
            "model of the boids",
            example=next(iter(MODELS)),
        ),
    ]
    preset: Annotated[
        str,
        Key(
            Text("a preset that `sweep models MODEL` lists"),
            "source of all values that the spec does not give",
            otherwise=f"{USUAL_PRESET}, or the first preset of the model",
            example=USUAL_PRESET,
        ),
    ]
    recording: Annotated[
        RecordingSpec | None,
        Key(
            SectionOf(RecordingSpec),
            "tracked individuals in files, instead of `model`; each event is a trial,"
            " so `replicates` and `seeds` are not allowed",
            otherwise="none",
            example="{files: [tracks.csv], time_step: 0.1}",
        ),
    ] = None
    maps: Annotated[
        dict[str, OwnMap],
        Key(
            ReadLater("maps by name", maps_schema, MAP_FORMS, ".NAME"),
            "custom maps, by name",
            otherwise="none",
            example="{lab: {image: lab.png, resolution: 0.5}}",
        ),
    ]
    fixed: Annotated[
        dict[str, Value],
        Key(
            ReadLater("parameters with values"),
            "one value per parameter",
            otherwise="none",
            example="{n: 50, steps: 3600}",
        ),
    ]
    axes: Annotated[
        tuple[Axis, ...],
        Key(
            ReadLater("axes by name, or a list of designs with axes", _swept_schema),
            "axes. The points are the product of all axes, and the last axis varies"
            " fastest. A list unites the points of several designs",
            name="sweep",
            otherwise="one point",
            example="{n: [50, 100], width: {linspace: [100, 400, 4]}}",
        ),
    ]
    derive: Annotated[
        dict[str, Expression],
        Key(
            ReadLater("parameters with expressions"),
            "parameters computed from other parameters",
            otherwise="none",
            example="{steps: 100 * n}",
        ),
    ]
    require: Annotated[
        tuple[Expression, ...],
        Key(
            ReadLater("a list of conditions", lambda: listed(TEXT)),
            "conditions; points that violate a condition are rejected",
            otherwise="none",
            example="[n < width]",
        ),
    ]
    replicates: Annotated[
        int | None,
        Key(
            OrForm(TRIALS, "replicates"),
            "number of trials per point; either `replicates` or `seeds`",
            otherwise="the number of `seeds`",
            example="100",
        ),
    ]
    seeds: Annotated[
        tuple[int, ...] | None,
        Key(
            SEEDS,
            "one trial per point with each of these seeds, instead of `replicates`",
            otherwise="computed from `seed`",
            example="[27, 729, 4913]",
        ),
    ]
    seed: Annotated[int, Key(Whole(0), "seed of the study", example="1")] = 0
    streams: Annotated[
        Streams,
        Key(
            LaterSectionOf(Streams),
            "kinds of random numbers. `common`: equal at all points. `independent`:"
            " different at each point. `lasting`: different at each point, but equal at"
            " points that differ only in `steps`",
            otherwise="only noise is independent",
            example="{noise: common}",
        ),
    ]
    record: Annotated[
        RecordSpec,
        Key(
            LaterSectionOf(RecordSpec),
            "data to store for each trial",
            otherwise="the metrics of the model",
            example=f"{{series: [{ANY_METRIC}], every: 10}}",
        ),
    ]
    order: Annotated[
        Order,
        Key(
            ORDER,
            "trials that run first: the longest trials, or a coarse overview of all"
            " points, which then becomes finer",
            example="coarse",
        ),
    ] = "longest"
    time_limit: Annotated[
        float | None,
        Key(SECONDS, "maximum time per trial", otherwise="no limit", example="60"),
    ] = None
    neighbour_search: Annotated[
        NeighbourSearch,
        Key(
            NEIGHBOUR_SEARCH,
            "search for the neighbours of a boid: in a grid of cells, or among all"
            " pairs of boids, which is slower. The results are bitwise identical",
            example=ALL_PAIRS,
        ),
    ] = "grid"
    checkpoint: Annotated[
        float | None,
        Key(
            OrFalse(SECONDS),
            "least time between two checkpoints of a trial; false for no checkpoints",
            example="600",
        ),
    ] = CHECKPOINT_SECONDS
    policy: Policy
    sections: Mapping[str, Any]

    @property
    def text(self) -> str:
        """The YAML text of the spec, unchanged."""
        return self.document.text

    @property
    def path(self) -> Path:
        """The file of the spec. Relative paths start in the folder of the file."""
        return self.document.path

    @cached_property
    def settings(self) -> dict[str, Setting]:
        """Every parameter of the model, and the spreads that the spec names.

        The choices of `map` include the custom maps of the study.
        """
        derived = (metric.expression for metric in self.record.derive)
        expressions = (*self.expressions, *derived)
        used = {name for expression in expressions for name in expression.names}
        every = settings_of(self.model, self.catalogue).of_study(self.maps)
        return {
            name: setting
            for name, setting in every.items()
            if not setting.spread_of or name in used or self.place_of(name)
        }

    @cached_property
    def preset_settings(self) -> dict[str, Value]:
        """The value of every parameter in the preset of the study."""
        values = usual_settings(self.model, self.preset, self.catalogue)
        return {name: values[name] for name in self.settings}

    def map_size(self, name: str) -> tuple[float, float] | None:
        """Return the width and height of a built-in or custom map.

        None for a map that suits every size.
        """
        drawn = self.maps[name] if name in self.maps else self.catalogue.maps[name]
        return drawn.size

    @property
    def strategy_section(self) -> tuple[SpecSection, Any] | None:
        """The section with a strategy, and the value of the section; None without."""
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
        """The command that runs the study and prints the report."""
        return self.strategy_section[0].command if self.strategy_section else "launch"

    @property
    def has_design(self) -> bool:
        """True if the axes give the points of the study, or the initial points."""
        return self.strategy_section is None or self.rule is not None

    @property
    def stand_in(self) -> "Study":
        """A study of a design with trials similar to the trials of this study.

        A study with a design is returned unchanged. Otherwise the result lacks the
        section with the strategy, and the values that the section gives to parameters.
        """
        if self.strategy_section and (stand_in := self.strategy_section[0].stand_in):
            study: Study = stand_in(self, self.strategy_section[1])
            return study
        return self

    def variants(self) -> list[StudyVariant]:
        """Return the variants that sections request. Raises SpecError."""
        return [
            variant
            for key, value in self.sections.items()
            for variant in sections()[key].variants(self, value)
        ]

    @property
    def trials_per_point(self) -> int:
        """The number of replicates or of seeds.

        If a rule adds trials, the largest number of trials per point.
        """
        if self.rule:
            return self.rule.most
        return self.replicates if self.replicates is not None else len(self.seeds or ())

    def most_trials(self, points: int) -> int:
        """Return the largest number of trials of a study.

        `points` is the initial number of points of the study.
        """
        if self.rule:
            return self.rule.most_trials(points)
        return points * self.trials_per_point

    def distribution(self, column: str) -> Declaration:
        """Return the distribution of a column of trials, with the range of values.

        The distribution is declared by the metric of the column.
        """
        name = Column.read(column).metric
        derived = {metric.name: metric.distribution for metric in self.record.derive}
        if name in derived:
            return in_full(derived[name])
        return declaration_of(self.catalogue.metrics[name])

    @cached_property
    def section_values(self) -> Mapping[str, SettingValues]:
        """The values that sections give to parameters, by parameter."""
        return {
            setting: values
            for key, value in self.sections.items()
            for setting, values in sections()[key].setting_values(value).items()
        }

    @property
    def continued(self) -> Axis | None:
        """The axis along which trials are links of chains; None without this axis."""
        return continued_axis(self.axes)

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """All expressions over points: `when` of axes, `derive`, `require`."""
        conditions = [axis.when for axis in self.axes if axis.when]
        return (*conditions, *self.derive.values(), *self.require)

    def place_of(self, setting: str) -> Place | None:
        """Return the keys in the spec of the value of a parameter.

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
    catalogue: Catalogue = BUILT_IN,
) -> Study:
    """Return the study of a YAML text or a mapping.

    Parameters
    ----------
    spec : str or mapping
    path : Path, default "spec.yaml"
        The spec is read as if from this file.
    catalogue : Catalogue, optional
        Models, metrics, maps and starts by name; by default the built-in ones.

    Raises
    ------
    SpecError
        If the spec is not valid.
    """
    text = spec if isinstance(spec, str) else dump(spec)
    return read_study(parse_document(text, path), catalogue)


@cache
def sections() -> Mapping[str, SpecSection]:
    """Return the sections of all methods by key.

    A section of a package is left out, with a warning, for three reasons:

    - The key is already a key of a study or of another method.
    - Another section is already the form of the key.
    - The section is recorded without the shape of the record.
    """
    own = {key.name for key in keys_of(Study, Policy)}
    by_key = dict[str, SpecSection]()
    for name, method in methods().items():
        for section in method.sections():
            key = section.key.name
            taken = key in own or key in by_key
            if taken or (section.form_of and form_of(section.form_of) is not section):
                log.warning('the section "%s" of %s: the key is taken', key, name)
            elif section.recorded and section.shape is None:
                message = 'the section "%s" of %s: the record has no "shape"'
                log.warning(message, key, name)
            else:
                by_key[key] = section
    return by_key


def spec_parts() -> tuple[type[Any] | Key, ...]:
    """Return the parts with the keys of a spec: classes, and keys of sections."""
    keys = (section.key for section in sections().values() if not section.form_of)
    return (Study, Policy, *keys)


GONE = {
    "threads": "a trial takes one core now, and a launch uses all cores. Several cores"
    " per trial were 0.36 to 1.6 times as fast. Remove the line",
}
"""Keys of earlier versions, with the reasons for the removal."""


def read_study(
    root: Entry,
    catalogue: Catalogue = BUILT_IN,
    samplers: Mapping[str, Sampler] = SAMPLERS,
) -> Study:
    """Return the study of a whole document.

    A mistake in one key hides only mistakes that depend on the key. For an unknown
    model, only the mistakes that are common to all models are reported. A model that
    cannot be used hides all mistakes that depend on the model.

    Parameters
    ----------
    root : Entry
        The document.
    catalogue : Catalogue, optional
        Models, metrics, maps and starts by name; by default the built-in ones.
    samplers : mapping, optional
        Samplers by name.

    Raises
    ------
    SpecError
        With all mistakes, if the spec is not valid.
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
        mistakes.read(model.one_of, "model", catalogue.models)
    read = None
    if values.get("model") in catalogue.models:
        read = mistakes.read(_of_model, root, values, catalogue, samplers=samplers)
    elif values.get("model") not in getattr(catalogue.models, "refused", {}):
        mistakes.note_common([*_as_each_model(root, values, catalogue, samplers)])
    mistakes.check()
    assert read
    assert policy
    return Study(
        document=root.document, catalogue=catalogue, policy=policy, **(values | read)
    )


def _as_each_model(
    root: Entry,
    values: Mapping[str, Any],
    catalogue: Catalogue,
    samplers: Mapping[str, Sampler],
) -> Iterator[Mistakes]:
    """Yield the mistakes of the spec for each model in turn.

    Models whose names are most similar to the name in the spec are first.
    """
    name = str(values.get("model", ""))
    models = [*catalogue.models]
    for model in get_close_matches(shortened(name), models, n=len(models), cutoff=0.0):
        mistakes = Mistakes()
        with mistakes.noted():
            _of_model(root, {**values, "model": model}, catalogue, samplers)
        yield mistakes


def _of_model(
    root: Entry,
    values: Mapping[str, Any],
    catalogue: Catalogue,
    samplers: Mapping[str, Sampler],
) -> dict[str, Any]:
    """Return the values of a study that depend on its model, by field.

    First each key is read alone. If all keys are right, checks of several keys follow.
    Raises SpecError.
    """
    mistakes = Mistakes()
    name = values["model"]
    folder = root.document.path.parent
    usual = usual_preset(catalogue.models[name])
    preset = mistakes.read(_preset, root, catalogue.models[name]) or usual
    drawn = values.get("maps")
    recorded = values.get("record")
    settings = settings_of(name, catalogue).of_study(_names_in(drawn))
    seed = values.get("seed", 0)
    keys = {key.name for key in keys_of(*spec_parts())}
    reader = AxisReader(
        catalogue=catalogue,
        model=name,
        preset=preset,
        settings=settings,
        seed=seed,
        folder=folder,
        samplers=samplers,
        keys=keys,
    )
    maps = mistakes.read(read_maps, drawn, folder, catalogue.maps)
    fixed = mistakes.read(read_fixed, values.get("fixed"), settings, keys) or {}
    derive = mistakes.read(read_derive, values.get("derive"), settings) or {}
    require = mistakes.read(read_require, values.get("require"), settings)
    derived = (
        mistakes.read(
            read_derived, _part(recorded, "derive"), name, catalogue, settings=settings
        )
        or ()
    )
    metrics = KnownMetrics(name, catalogue, _names_in(_part(recorded, "derive")))
    replication = mistakes.read(read_replication, root)
    context = SpecContext(
        model=name,
        preset=usual_settings(name, preset, catalogue),
        fixed=fixed,
        maps=maps or {},
        axes=None,
        replication=replication,
        recorded=(*catalogue.metrics, *metrics.derived),
        profiles=None,
        metrics=metrics,
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
    # A section may look at metrics that an earlier section records.
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
        context = context._replace(recorded=record.names, profiles=record.profiles)
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
    if (model := catalogue.models[name]).events and record:
        set_here: dict[str, list[Value]] = {key: [fixed[key]] for key in fixed}
        set_here |= {key: [] for key in derive}
        places: dict[str, Place] = {key: ("fixed", key) for key in fixed}
        places |= {key: ("derive", key) for key in derive}
        for axis in axes:
            set_here |= {key: each.tolist() for key, each in axis.columns.items()}
            places |= dict.fromkeys(axis.columns, axis.place)
        if section := root.get(RECORDING):  # the spec of one trial has all parameters
            expressions: dict[Place, Expression] = {
                axis.place: axis.when for axis in axes if axis.when
            }
            expressions |= {("derive", key): derive[key] for key in derive}
            expressions |= {
                ("require", index): each for index, each in enumerate(require or ())
            }
            mistakes.read(
                check_of_recording,
                section,
                model,
                set_here,
                places=places,
                expressions=expressions,
                strategies=[key for key in section_values if sections()[key].strategy],
            )
        mistakes.read(
            check_measurable,
            root,
            model,
            tables=[
                table for table in ("heatmaps", LAST_FLOCKS) if getattr(record, table)
            ],
            set_here=set_here if section else settings,
            metrics={metric: catalogue.metrics[metric] for metric in record.metrics},
        )
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
    """Enter the values of the sections of a spec, by key, and note mistakes."""
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
            "at most one section may add trials or points:"
            f' "{key}" excludes "{growing[0]}"',
        )


def _streams(entry: Entry | None, present: Iterable[SpecSection]) -> Streams:
    """Return the streams. Sections of the spec decide the default kinds."""
    kinds = {
        purpose: kind
        for section in present
        for purpose, kind in section.streams.items()
    }
    return read_section(Streams, entry, **kinds)


def _with_axes(
    root: Entry, added: Sequence[Axis], axes: tuple[Axis, ...]
) -> tuple[Axis, ...]:
    """Return the axes of each design, after the axes that sections add.

    Raises SpecError if an axis of the spec has the name of an added axis.
    """
    names = {axis.name for axis in axes}
    for axis in added:
        if axis.name in names:
            raise root.document.error(
                axis.place,
                f'an axis of "sweep" is also named "{axis.name}": rename the axis',
            )
    return tuple(
        member
        for number, design in enumerate(by_design(axes))
        for member in (*(replace(axis, design=number) for axis in added), *design)
    )


def _check_lasting(root: Entry, record: RecordSpec, streams: Streams) -> None:
    """Raise SpecError if longer trials could not resume from the last states.

    The random numbers of longer trials would differ from step 0 on.
    """
    if record.last_states and (purposes := independent(streams)):
        lasting = ", ".join(f"{name}: lasting" for name in purposes)
        raise root.document.error(
            ("record", LAST_STATES),
            "last_states has no effect: trials with more steps have different random"
            f" numbers ({', '.join(purposes)}), and cannot resume; write"
            f" `streams: {{{lasting}}}`, or common",
        )


def independent(streams: Streams) -> list[str]:
    """Return the purposes whose random numbers differ from point to point."""
    return [name for name, kind in asdict(streams).items() if kind == "independent"]


def _check_names(root: Entry, recorded: Iterable[str], settings: Iterable[str]) -> None:
    """Raise SpecError for a metric with the name of a parameter."""
    if taken := set(settings) & set(recorded):
        message = f"metrics have the names of parameters: {', '.join(sorted(taken))}"
        raise root.document.error(("record",), message)


def _preset(root: Entry, model: Model) -> str:
    """Return the preset that the spec names, or the default preset."""
    entry = root.get("preset")
    if entry is None:
        return usual_preset(model)
    return entry.one_of(f"preset of {model.name}", model.presets)


def _part(entry: Entry | None, key: str) -> Entry | None:
    return entry.get(key) if entry and isinstance(entry.value, dict) else None


def _names_in(entry: Entry | None) -> tuple[str, ...]:
    """Return the keys of a mapping, or () for all other values."""
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


def spec_schema() -> Schema:
    """Return the JSON Schema of the keys of a spec, with a model or a recording."""
    schema = section_schema(*spec_parts())
    if MODEL not in schema["required"]:
        return schema
    required = [key for key in schema["required"] if key != MODEL]
    return schema | {"required": required} | one_of([MODEL, RECORDING])


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

    The record includes the metrics that derived metrics and columns of sections need.
    """
    catalogue = metrics.catalogue
    usual = catalogue.models[metrics.model].metrics
    mistakes = Mistakes()
    record = mistakes.read(read_section, RecordSpec, entry, metrics=usual)
    for names in (_part(entry, "metrics"), _part(entry, "series")):
        for child in names.items() if names and isinstance(names.value, list) else ():
            if isinstance(child.value, str):
                mistakes.read(metrics.read, child)
    if (profiles := _part(entry, "profiles")) and record:
        for child, recorded in zip(profiles.items(), record.profiles, strict=True):
            model = catalogue.models[metrics.model]
            mistakes.read(check_profile, child, recorded, catalogue, model=model)
        with mistakes.noted():
            listed = list(record.profile_names)
            if twice := {name for name in listed if listed.count(name) > 1}:
                raise profiles.error(f"listed twice: {', '.join(sorted(twice))}")
        if record.last_states:
            with mistakes.noted():
                reason = f'"{LAST_STATES}" keep no positions of earlier steps, which'
                raise profiles.error(f"{reason} profiles need; remove one of the keys")
    mistakes.check()
    assert record
    searched = [Column.read(column).metric for column in columns]
    required = [*record.metrics, *record.series, *searched, *needed(derived)]
    measured = dict.fromkeys(name for name in required if name in catalogue.metrics)
    return replace(record, metrics=tuple(measured), derive=derived)
