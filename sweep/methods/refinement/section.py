"""The section `refine` of a spec, for a grid that becomes finer at a boundary.

At the boundary, the mean of a metric crosses a level. All functions raise SpecError,
with file and line, for values that are not allowed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

from sweep.analysis import LEAST_LOOK
from sweep.methods.refinement.rule import (
    MOST_HALVINGS,
    STEEPEST,
    RefinedAxis,
    Refinement,
)
from sweep.spec import (
    ANY_METRIC,
    MOST_BEFORE,
    MOST_POINTS,
    MOST_TRIALS,
    Axis,
    Column,
    Entry,
    Key,
    LaterSectionOf,
    ListOf,
    Mistakes,
    Number,
    Replication,
    Schema,
    SpecContext,
    SpecSection,
    Study,
    Text,
    Whole,
    check_keys,
    check_names,
    check_recorded,
    columns_of,
    continued_axis,
    declaration_of,
    read_values,
    recorded_rule,
)
from sweep.store import Location
from sweep.text import shortened, unknown

LEAST_REPLICATES = 2
FINEST = 0.001
NUMBERS = ("float", "int")


@dataclass(frozen=True)
class LevelOrSteepest(Number):
    """A level, or the word for the position at which a mean changes most."""

    @property
    def words(self) -> str:
        """The allowed values, in words."""
        return f"{super().words}, or {STEEPEST}"

    def read(self, entry: Entry) -> Any:
        """Return the level or the word. SpecError for any other value."""
        if entry.value == STEEPEST:
            return STEEPEST
        if isinstance(entry.value, str):
            raise entry.expected(self.words)
        return super().read(entry)

    def schema(self) -> Schema:
        """Return the allowed values as JSON Schema."""
        return {"anyOf": [super().schema(), {"const": STEEPEST}]}


@dataclass(frozen=True, kw_only=True)
class Refine:
    """The keys of the section, from which `read_refine` makes a `Refinement`."""

    metric: Annotated[
        str,
        Key(
            Text("a name"),
            "a recorded metric, or `<metric>_mean` for the second half",
            example=ANY_METRIC,
        ),
    ]
    at: Annotated[
        float | str,
        Key(
            LevelOrSteepest(note="in the unit of the metric"),
            "the level that the mean crosses; or steepest, for the position along an"
            " axis at which the mean changes most",
            example="0.5",
        ),
    ]
    axes: Annotated[
        tuple[str, ...],
        Key(
            ListOf(Text("an axis of `sweep`"), "axes of `sweep`"),
            "axes that become finer; each has a list of numbers or a grid",
            example="[n]",
        ),
    ]
    until: Annotated[
        float,
        Key(
            Number(least=FINEST, below=1, note="a fraction of the range of an axis"),
            "smallest distance of points along each axis",
            example="0.02",
        ),
    ]
    most: Annotated[
        int | None,
        Key(
            Whole(LEAST_REPLICATES, MOST_TRIALS),
            "most trials of a point: `replicates` at first, and more while the"
            " confidence interval of the mean includes the level",
            name="max",
            otherwise="equal to `replicates`",
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
            "confidence of each reported crossing along an axis",
            example="0.99",
        ),
    ] = 0.95


KEY = Key(
    LaterSectionOf(Refine),
    "the grid of `sweep` becomes finer where a mean crosses a level",
    name="refine",
    otherwise="a fixed grid",
)


def read_refine(root: Entry, context: SpecContext) -> Refinement | None:
    """Return the rule that the section writes; None if another key is wrong."""
    entry = root.child(KEY.name)
    mistakes = Mistakes()
    entry.mapping()
    with mistakes.noted():
        check_keys(entry, Refine)
    values = read_values(Refine, entry, mistakes)
    if "metric" in values:
        mistakes.read(_check_metric, entry, values, context)
    if context.replication:
        mistakes.read(_check_trials, root, values["most"], context.replication)
    axes = list[Axis]()
    if "axes" in values and context.axes is not None:
        for child in entry.child("axes").entries():
            with mistakes.noted():
                axes.append(_axis(child, context))
    with mistakes.noted():
        if continued_axis(context.axes or ()):
            raise entry.error(
                'a study with "continue" takes no "refine": which points follow would'
                " depend on chains that have not run yet"
            )
    with mistakes.noted():
        if values.get("at") == STEEPEST and len(values.get("axes", ())) > 1:
            raise entry.child("axes").error(
                f'"at: {STEEPEST}" needs exactly 1 axis; further axes of "sweep" become'
                " groups"
            )
    mistakes.check()
    if context.axes is None or context.replication is None:
        return None
    rule = Refine(**values)
    scales = {axis.name: _scale(axis, context, rule.until) for axis in axes}
    least = context.replication.replicates
    assert least
    return Refinement(
        metric=rule.metric,
        at=rule.at,
        scales=scales,
        until=rule.until,
        least=least,
        most=rule.most or least,
        budget=rule.budget,
        confidence=rule.confidence,
    )


def _check_metric(
    entry: Entry, values: Mapping[str, Any], context: SpecContext
) -> None:
    column = values["metric"]
    metrics = context.metrics.catalogue.metrics
    check_recorded(entry.child("metric"), column, context.recorded, metrics)
    name = Column.read(column).metric
    if name not in metrics or values.get("at", STEEPEST) == STEEPEST:
        return
    support = declaration_of(metrics[name]).support
    at = values["at"]
    if not support.low < at < support.high:
        raise entry.child("at").error(
            f"{column} is {support.words}, so the mean never crosses {at:g}"
        )


def _check_trials(root: Entry, most: int | None, replication: Replication) -> None:
    """Raise SpecError unless points begin with as many trials as a look needs."""
    entry = root.get("replicates")
    replicates = replication.replicates
    if entry is None:
        raise root.child("refine").error(
            'needs "replicates": the number of trials of a point at first'
        )
    more = most is not None and most != replicates
    least = LEAST_LOOK if more else LEAST_REPLICATES
    if replicates is None or replicates < least:
        raise entry.expected(
            f'an integer from {least}, because "refine" looks after {least} trials of a'
            " point"
        )
    if most is not None and most < replicates:
        raise (
            root.child("refine")
            .child("max")
            .error(
                f'"max" must be at least "replicates", which is {replicates},'
                f" not {most}"
            )
        )


def _axis(entry: Entry, context: SpecContext) -> Axis:
    """Return the axis that an entry names. SpecError if it cannot be refined."""
    name = entry.text()
    axes = context.axes or ()
    settings = list(dict.fromkeys(axis.name for axis in axes))
    if name not in settings:
        raise entry.error(unknown("axis", name, settings))
    axis = next(axis for axis in axes if axis.name == name)
    if len({other.design for other in axes}) > 1:
        raise entry.error("a study that unites several designs cannot be refined")
    if list(axis.columns) != [name] or axis.sampler:
        raise entry.error(
            f'"{name}" cannot be refined: the axis needs a single parameter with a list'
            " of values or a grid"
        )
    if axis.when:
        raise entry.error(f'"{name}" cannot be refined: it has a condition, "when"')
    if context.settings[name].kind not in NUMBERS:
        raise entry.error(f'"{name}" cannot be refined: the values are no numbers')
    values = axis.columns[name].tolist()
    if len(values) < 2 or sorted(values) != values:
        raise entry.error(
            f'"{name}" cannot be refined: the axis needs at least two ascending values'
        )
    return axis


def _scale(axis: Axis, context: SpecContext, until: float) -> RefinedAxis:
    return RefinedAxis.until(
        axis.columns[axis.name].tolist(),
        until,
        geometric=axis.geometric,
        integer=context.settings[axis.name].kind == "int",
    )


def check_points(study: Study, rule: Refinement, points: int) -> None:
    """Check that the budget suffices for the first points of a study.

    Parameters
    ----------
    study : Study
    rule : Refinement
    points : int
        Number of points at first.

    Raises
    ------
    SpecError
        The first points exceed the budget.
    """
    if points * rule.least > rule.budget:
        raise study.document.error(
            (KEY.name, "budget"),
            f"a budget of {rule.budget:,} trials is too small for the first points:"
            f" {points:,} points with {rule.least:,} trials each need at least"
            f" {points * rule.least:,}",
        )


def check_record(rule: dict[str, Any], plan: Mapping[str, Any]) -> None:
    """Check a recorded rule. ValueError if no spec can have such numbers.

    `plan` is the description of the study in the plan.
    """
    columns = columns_of(plan["record"])
    scales = rule["scales"]
    if rule["metric"] not in columns:
        raise ValueError(f'the refined metric "{rule["metric"]}" is not recorded')
    check_names("axis", list(scales), plan.get("axes", {}))
    if (
        not scales
        or math.prod(len(scale["values"]) for scale in scales.values()) > MOST_POINTS
    ):
        raise ValueError("the refined axes have no values, or too many")
    for name, scale in scales.items():
        values = scale["values"]
        ascending = all(value < next_ for value, next_ in pairwise(values))
        if len(values) < 2 or not ascending or not all(map(math.isfinite, values)):
            raise ValueError(f'axis "{name}" has no ascending values')
        if scale["geometric"] and values[0] <= 0:
            raise ValueError(
                f'axis "{name}" has values at ratios, and one is not above 0'
            )
        if not 0 <= scale["halvings"] <= MOST_HALVINGS:
            raise ValueError(f'axis "{name}" is halved {scale["halvings"]} times')
    if rule["at"] == STEEPEST:
        level = 0.0
        if len(scales) > 1:
            raise ValueError("the rule seeks the steepest position along several axes")
    elif isinstance(rule["at"], str):
        raise ValueError(f'the rule refines at "{shortened(rule["at"])}"')
    else:
        level = rule["at"]
    numbers = (level, rule["until"], rule["confidence"])
    if not all(map(math.isfinite, numbers)) or not 0.0 < rule["until"] < 1.0:
        raise ValueError("the numbers of the refinement are not allowed")
    if not 2 <= rule["min"] <= rule["max"] or rule["budget"] > MOST_BEFORE:
        raise ValueError("the numbers of trials of the refinement are not allowed")
    if not 0.0 < rule["nominal_confidence"] < 1.0:
        raise ValueError(f"nominal_confidence is {rule['nominal_confidence']}")


def _strategy(study: Study, rule: Refinement, _results: Location | None) -> Any:
    """Return the strategy of a study. The call imports `sweep.campaigns`."""
    from sweep.methods.refinement.strategy import RefineStrategy

    return RefineStrategy(study, rule)


NUMBER = int | float
SECTION = SpecSection(
    KEY,
    read=read_refine,
    not_beside={"search": "", "seeds": "", "order": ""},
    needs={
        "required": ["sweep", "replicates"],
        "properties": {"replicates": {"type": "integer"}},
    },
    check_points=check_points,
    strategy=_strategy,
    recorded=lambda _study, rule: recorded_rule(rule),
    shape={
        "metric": str,
        "min": int,
        "max": int,
        "budget": int,
        "at": NUMBER | str,
        "until": NUMBER,
        "confidence": NUMBER,
        "nominal_confidence": NUMBER,
        "scales": {
            str: {"values": [NUMBER], "halvings": int, "geometric": bool, "whole": bool}
        },
    },
    check_recorded=check_record,
    looks_at=lambda record: (record["metric"],),
)
