"""The section `refine` of a spec: where the mean of a metric crosses a level, the grid
of a sweep becomes finer.

All functions raise SpecError, with file and line, for what is not allowed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from sweep.analysis.refinement import STEEPEST, RefinedAxis, Refinement
from sweep.spec.axes import Axis
from sweep.spec.contents import ListOf, Number, Text, Whole
from sweep.spec.document import Entry
from sweep.spec.keys import Key, read_section
from sweep.spec.limits import MOST_TRIALS
from sweep.spec.mistakes import Mistakes
from sweep.spec.recorded import (
    ANY_METRIC,
    Column,
    KnownMetrics,
    check_recorded,
    declaration_of,
)
from sweep.spec.replication import LEAST_LOOK
from sweep.spec.schema_parts import Schema
from sweep.spec.settings import Setting
from sweep.text import unknown

LEAST_REPLICATES = 2
FINEST = 0.001
NUMBERS = ("float", "int")


@dataclass(frozen=True)
class LevelOrSteepest(Number):
    """A level, or the word for the place where a mean changes most."""

    @property
    def words(self) -> str:
        return f"{super().words}, or {STEEPEST}"

    def read(self, entry: Entry) -> Any:
        if entry.value == STEEPEST:
            return STEEPEST
        if isinstance(entry.value, str):
            raise entry.expected(self.words)
        return super().read(entry)

    def schema(self) -> Schema:
        return {"anyOf": [super().schema(), {"const": STEEPEST}]}


@dataclass(frozen=True, kw_only=True)
class Refine:
    """The keys of the section; `Refinement` is what is made of them."""

    metric: Annotated[
        str,
        Key(
            Text("a name"),
            "a recorded metric, or `<metric>_mean` for its last half",
            example=ANY_METRIC,
        ),
    ]
    at: Annotated[
        float | str,
        Key(
            LevelOrSteepest(note="in the unit of the metric"),
            "the level that its mean crosses; or steepest, for the place along one axis"
            " where its mean changes most",
            example="0.5",
        ),
    ]
    axes: Annotated[
        tuple[str, ...],
        Key(
            ListOf(Text("an axis of `sweep`"), "axes of `sweep`"),
            "which become finer there; each has numbers that are listed or on a grid",
            example="[n]",
        ),
    ]
    until: Annotated[
        float,
        Key(
            Number(least=FINEST, below=1, note="a share of the range of an axis"),
            "how near points come to each other along each axis",
            example="0.02",
        ),
    ]
    most: Annotated[
        int | None,
        Key(
            Whole(LEAST_REPLICATES, MOST_TRIALS),
            "most trials of a point, which has `replicates` at first and more as long"
            " as the interval of its mean includes the level",
            name="max",
            otherwise="as many as `replicates`",
            example="80",
        ),
    ] = None
    budget: Annotated[
        int, Key(Whole(1, MOST_TRIALS), "most trials of the study", example="5000")
    ]
    confidence: Annotated[
        float,
        Key(
            Number(least=0.5, most=0.99),
            "with which a crossing along one axis is where it is said to be",
            example="0.99",
        ),
    ] = 0.95


BARRED = ("search", "seeds", "order")
"""Keys that cannot stand beside `refine`."""


def read_section_refine(entry: Entry | None) -> Refine | None:
    """The values of the section, each checked alone; None where there is none."""
    return read_section(Refine, entry) if entry else None


def read_refine(
    root: Entry,
    given: Refine,
    axes: Sequence[Axis],
    replicates: int | None,
    recorded: Sequence[str],
    known: KnownMetrics,
    settings: Mapping[str, Setting],
) -> Refinement:
    """The rule that the section `given` writes, in a spec with these `axes` and
    `replicates` that has `recorded` some of the metrics `known`.
    """
    entry, mistakes = root.child("refine"), Mistakes()
    with mistakes.noted():
        _check_metric(entry, given, recorded, known)
    with mistakes.noted():
        _check_trials(root, given, replicates)
    for key in BARRED:
        with mistakes.noted():
            if other := root.get(key):
                raise other.error(f'a study with "refine" takes no "{key}"')
    scales = dict[str, RefinedAxis]()
    with mistakes.noted():
        if given.at == STEEPEST and len(given.axes) > 1:
            raise entry.child("axes").error(
                f"where a mean changes most is sought along one axis: at: {STEEPEST}"
                " takes one; other axes of sweep become groups"
            )
    for name, child in zip(given.axes, entry.child("axes").entries(), strict=True):
        with mistakes.noted():
            axis = _axis(child, name, axes)
            scales[name] = _scale(child, axis, settings[name], given.until)
    mistakes.check()
    assert replicates
    return Refinement(
        metric=given.metric,
        at=given.at,
        scales=scales,
        until=given.until,
        least=replicates,
        most=given.most or replicates,
        budget=given.budget,
        confidence=given.confidence,
    )


def _check_metric(
    entry: Entry, given: Refine, recorded: Sequence[str], known: KnownMetrics
) -> None:
    name = Column.read(given.metric).metric
    check_recorded(entry.child("metric"), given.metric, recorded, known.known.metrics)
    if name not in known.known.metrics or isinstance(given.at, str):
        return
    support = declaration_of(known.known.metrics[name]).support
    if not support.low < given.at < support.high:
        raise entry.child("at").error(
            f"{given.metric} lies {support.words}, and its mean never crosses"
            f" {given.at:g}"
        )


def _check_trials(root: Entry, given: Refine, replicates: int | None) -> None:
    """Raise SpecError unless points begin with as many trials as a look needs."""
    entry = root.get("replicates")
    if entry is None:
        raise root.child("refine").error(
            'needs "replicates": how many trials a point has at first'
        )
    more = given.most is not None and given.most != replicates
    least = LEAST_LOOK if more else LEAST_REPLICATES
    if replicates is None or replicates < least:
        raise entry.expected(
            f'a whole number from {least}, as "refine" looks after so many trials of a'
            " point"
        )
    if given.most is not None and given.most < replicates:
        raise (
            root.child("refine")
            .child("max")
            .error(
                f'"max" must be at least "replicates", which is {replicates},'
                f" not {given.most}"
            )
        )


def _axis(entry: Entry, name: str, axes: Sequence[Axis]) -> Axis:
    """The axis of that name, if it can be refined."""
    names = list(dict.fromkeys(axis.name for axis in axes))
    if name not in names:
        raise entry.error(unknown("axis", name, names))
    found = [axis for axis in axes if axis.name == name]
    axis = found[0]
    if len({one.design for one in axes}) > 1:
        raise entry.error("a study that unites several designs cannot be refined")
    if list(axis.columns) != [name] or axis.sampler:
        raise entry.error(
            f'"{name}" cannot be refined: it needs one setting whose values are listed'
            " or on a grid"
        )
    if axis.when:
        raise entry.error(f'"{name}" cannot be refined: it has a condition, "when"')
    return axis


def _scale(entry: Entry, axis: Axis, setting: Setting, until: float) -> RefinedAxis:
    values = axis.columns[axis.name].tolist()
    if setting.kind not in NUMBERS:
        raise entry.error(f'"{axis.name}" cannot be refined: its values are no numbers')
    if len(values) < 2 or sorted(values) != values:
        raise entry.error(
            f'"{axis.name}" cannot be refined: it needs at least two values, ascending'
        )
    whole = setting.kind == "int"
    return RefinedAxis.until(values, until, geometric=axis.geometric, whole=whole)


def refine_dependencies() -> Schema:
    """What `read_refine` checks of several keys, as JSON Schema, by the key."""
    whole = {"properties": {"replicates": {"type": "integer"}}}
    return {"refine": {"required": ["sweep", "replicates"], **whole}}
