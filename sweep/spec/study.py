"""From a spec to a Study. All validation happens here and in what this module calls."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, cast

from kernels.metrics import METRICS
from kernels.model import Model
from kernels.models import MODELS
from kernels.worlds import MAPS
from sweep.analysis.sequential import Until
from sweep.spec.axes import Axis, AxisReader
from sweep.spec.document import Document, Entry, Place
from sweep.spec.expressions import Expression
from sweep.spec.layout import STUDY_NAME, taken_name
from sweep.spec.maps import OwnMap, read_maps
from sweep.spec.policy import KEYS as POLICY_KEYS
from sweep.spec.policy import Policy, read_policy
from sweep.spec.recorded import Column, check_metric
from sweep.spec.replication import read_replication
from sweep.spec.search import Search
from sweep.spec.search_section import read_search
from sweep.spec.settings import Setting, Value, settings_of_study
from sweep.spec.strict_yaml import dump, parse_document, read_document
from sweep.spec.values import (
    check_complete,
    check_conditions,
    check_once,
    read_axes,
    read_derive,
    read_fixed,
    read_require,
)

Stream = Literal["common", "independent"]

REQUIRED = ("study", "model", "preset", "seed")
CHECKPOINT_SECONDS = 60.0
KEPT = ("heatmaps", "trajectories")
KEYS = (
    *REQUIRED,
    *("maps", "fixed", "sweep", "search", "derive", "require"),
    *("replicates", "seeds", "streams", "record"),
    *("time_limit", "checkpoint", *POLICY_KEYS),
)


@dataclass(frozen=True)
class RecordSpec:
    """What is kept of a trial: frames 0, `every`, 2 `every`, ... and the last. `series`
    are among `metrics`.
    """

    metrics: tuple[str, ...]
    series: tuple[str, ...] = ()
    every: int = 1
    heatmaps: bool = False
    trajectories: bool = False


@dataclass(frozen=True)
class Streams:
    """Whether the random numbers of each purpose are the same at all points (common) or
    not (independent).
    """

    start: Stream = "common"
    world: Stream = "common"
    noise: Stream = "independent"


@dataclass(frozen=True, eq=False)
class Study:
    """A checked spec. `derive` is in an order in which each expression needs only what
    stands before it.

    `maps` are those of the spec's own, `policy` says what becomes of trials that fail.
    `checkpoint` is after how many seconds a trial writes down where it is, None for
    never. One of `replicates` (trials a point), `seeds` (one literal seed a trial) and
    `until` (a rule) is given.
    """

    document: Document
    name: str
    model: str
    preset: str
    maps: dict[str, OwnMap]
    fixed: dict[str, Value]
    axes: tuple[Axis, ...]
    derive: dict[str, Expression]
    require: tuple[Expression, ...]
    replicates: int | None
    seeds: tuple[int, ...] | None
    seed: int
    streams: Streams
    record: RecordSpec
    time_limit: float | None
    checkpoint: float | None
    policy: Policy
    until: Until | None = None
    search: Search | None = None

    @property
    def text(self) -> str:
        """The YAML as read."""
        return self.document.text

    @property
    def path(self) -> Path:
        """The file of the spec; tables and images stand relative to its folder."""
        return self.document.path

    @cached_property
    def settings(self) -> dict[str, Setting]:
        """Every setting of the model; the choices of `map` include the study's own."""
        return settings_of_study(self.model, self.maps)

    def map_size(self, name: str) -> tuple[float, float] | None:
        """The width and height of a map, built-in or the study's own; None where any
        size will do.
        """
        return self.maps[name].size if name in self.maps else MAPS[name].size

    @property
    def trials_per_point(self) -> int:
        """The number of replicates, or of seeds; where a rule adds trials, the most of
        them.
        """
        if self.until:
            return self.until.most
        return self.replicates if self.replicates is not None else len(self.seeds or ())

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """All that is computed at points: `when` of axes, `derive`, `require`."""
        conditions = [axis.when for axis in self.axes if axis.when]
        return (*conditions, *self.derive.values(), *self.require)

    def place_of(self, setting: str) -> Place | None:
        """Where in the spec a setting has its value; None where the preset gives it."""
        if setting in self.fixed:
            return ("fixed", setting)
        if setting in self.derive:
            return ("derive", setting)
        if self.search and (place := self.search.place_of(setting)):
            return place
        return next(
            (("sweep", axis.name) for axis in self.axes if setting in axis.columns),
            None,
        )


def load_spec(path: Path) -> Study:
    """The study that a spec file describes.

    Raises SpecError, with file and line, for whatever is wrong with it.
    """
    return read_study(read_document(path))


def parse_spec(spec: str | Mapping[str, Any], path: Path = Path("spec.yaml")) -> Study:
    """The study that a YAML text or a mapping describes, as if it stood in the file
    `path`.

    Raises SpecError.
    """
    text = spec if isinstance(spec, str) else dump(spec)
    return read_study(parse_document(text, path))


def read_study(root: Entry) -> Study:
    """The study that a whole document describes. Raises SpecError."""
    if root.value is None:
        raise root.error("is empty")
    root.keys(KEYS, required=REQUIRED)
    model = root.child("model").one_of("model", MODELS)
    seed = root.child("seed").whole(0)
    preset = root.child("preset").one_of(f"preset of {model}", MODELS[model].presets)
    folder = root.document.path.parent
    maps = read_maps(root.get("maps"), folder)
    reader = AxisReader(model, preset, settings_of_study(model, maps), seed, folder)
    fixed, derive = (
        read_fixed(root.get("fixed"), reader.settings),
        read_derive(root.get("derive"), reader.settings),
    )
    axes = read_axes(root.get("sweep"), reader, [*fixed, *derive])
    check_once(root, fixed, axes, derive)
    check_conditions(root, axes, derive)
    check_complete(root, axes)
    search = _search(root, reader, MODELS[model], {"fixed": fixed, "derive": derive})
    record = _record(
        root.get("record"), MODELS[model], search.columns if search else ()
    )
    replication = read_replication(root, record.metrics)
    return Study(
        document=root.document,
        name=_name(root.child("study")),
        model=model,
        preset=preset,
        maps=maps,
        fixed=fixed,
        axes=axes,
        derive=derive,
        require=read_require(root.get("require"), reader.settings),
        replicates=replication.replicates,
        seeds=replication.seeds,
        seed=seed,
        streams=_streams(
            root.get("streams"), Streams(noise="common") if search else Streams()
        ),
        record=record,
        time_limit=_time_limit(root.get("time_limit")),
        checkpoint=_checkpoint(root.get("checkpoint")),
        policy=read_policy(root),
        until=replication.until,
        search=search,
    )


def _name(entry: Entry) -> str:
    name = entry.text()
    if not STUDY_NAME.fullmatch(name) or len(name) > 200:
        raise entry.error(
            f'study "{name}" is not allowed: names of letters, digits, "_", "-" and "."'
            ' joined by "/", none beginning with a dot'
        )
    if taken := taken_name(name):
        said = "is a name that results use themselves"
        raise entry.error(f'study "{name}" is not allowed: "{taken}" {said}')
    return name


def _search(
    root: Entry, reader: AxisReader, model: Model, given: dict[str, Iterable[str]]
) -> Search | None:
    entry = root.get("search")
    if entry and "sweep" in root.value:
        raise entry.error(
            "a search has no sweep: what a candidate must be good at together stands"
            " under search: over"
        )
    places = {name: (key, name) for key, names in given.items() for name in names}
    return read_search(entry, reader, model, places) if entry else None


def _streams(entry: Entry | None, default: Streams) -> Streams:
    if entry is None:
        return default
    entry.keys(["start", "world", "noise"])
    chosen = {
        name: child.one_of("kind of stream", ["common", "independent"])
        for name, child in entry.mapping()
    }
    return replace(default, **cast(dict[str, Stream], chosen))


def _record(entry: Entry | None, model: Model, columns: Iterable[str]) -> RecordSpec:
    """What the spec says, and the metrics of the `columns` that a search needs."""
    needed = [Column.read(column).metric for column in columns]
    if entry is None:
        return RecordSpec(tuple(dict.fromkeys([*model.metrics, *needed])))
    entry.keys(["metrics", "series", "every", *KEPT])
    metrics, series = entry.get("metrics"), entry.get("series")
    every, kept = (
        entry.get("every"),
        {name: entry.child(name).truth() for name in KEPT if name in entry.value},
    )
    recorded = _metrics(metrics, model) if metrics else model.metrics
    followed = _metrics(series, model) if series else ()
    return RecordSpec(
        metrics=tuple(dict.fromkeys([*recorded, *followed, *needed])),
        series=followed,
        every=every.whole(1) if every else 1,
        **kept,
    )


def _metrics(entry: Entry, model: Model) -> tuple[str, ...]:
    names = tuple(child.one_of("metric", METRICS) for child in entry.entries())
    for index, name in enumerate(names):
        if name in names[:index]:
            raise entry.child(index).error(f'"{name}" stands twice in "{entry.name}"')
        check_metric(entry.child(index), name, model)
    return names


def _time_limit(entry: Entry | None) -> float | None:
    if entry is None:
        return None
    seconds = entry.number()
    if seconds <= 0:
        raise entry.expected("a number of seconds above 0")
    return seconds


def _checkpoint(entry: Entry | None) -> float | None:
    if entry is None:
        return CHECKPOINT_SECONDS
    if entry.value is False:
        return None
    if (
        isinstance(entry.value, bool)
        or not isinstance(entry.value, int | float)
        or not 0 < entry.value < math.inf
    ):
        raise entry.expected("a number of seconds above 0, or false")
    return float(entry.value)
