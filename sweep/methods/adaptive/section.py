"""The form of `replicates` that is a mapping.

Trials are added until means are precise.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from sweep.analysis import LEAST_LOOK, MOST_METRICS, Width
from sweep.errors import SpecError
from sweep.methods.adaptive.rule import Until, from_json
from sweep.spec import (
    ANY_METRIC,
    MOST_BEFORE,
    MOST_TRIALS,
    SHARE,
    Content,
    Document,
    Entry,
    Key,
    LaterSectionOf,
    Mistakes,
    Number,
    Schema,
    SectionOf,
    SpecContext,
    SpecSection,
    Study,
    Text,
    Whole,
    check_recorded,
    continued_axis,
    named,
    read_section,
    recorded_rule,
    share,
)
from sweep.store import Location

FIRST_LOOK = 10
LOOK = Whole(LEAST_LOOK, MOST_TRIALS)
NOT_ZERO = r"(?!0{1,2}(?:\.0{1,9})? ?%)"
FORM_OF = "replicates"


@dataclass(frozen=True)
class HalfWidth(Content[Width]):
    """A number in the unit of the metric, or a fraction of the mean, such as 5%."""

    number = Number(above=0, note="in the unit of the metric")

    @property
    def words(self) -> str:
        """The allowed values."""
        return f"{self.number.words}, or a fraction of the mean, such as 5%"

    def read(self, entry: Entry) -> Width:
        """Return the half-width of an entry. Raises SpecError if it is not allowed."""
        if not isinstance(entry.value, str):
            return Width(self.number.read(entry))
        part = share(entry.value)
        if not part:
            raise entry.expected(self.words)
        return Width(float(part), relative=True)

    def schema(self) -> Schema:
        """Return the allowed values as JSON Schema."""
        part = {"type": "string", "pattern": f"^{NOT_ZERO}{SHARE.pattern}$"}
        return {"anyOf": [self.number.schema(), part]}

    def write(self, value: Width) -> Any:
        """Return a half-width in the form of a spec."""
        return value.as_json()


@dataclass(frozen=True)
class HalfWidths(Content[Width | Mapping[str, Width]]):
    """A half-width, or a half-width per metric by name."""

    single = HalfWidth()

    @property
    def words(self) -> str:
        """The allowed values."""
        return f"{self.single.words}; or a mapping from metrics to half-widths"

    def read(self, entry: Entry) -> Width | Mapping[str, Width]:
        """Return the half-widths of an entry.

        Raises SpecError if a half-width is not allowed. All mistakes are reported
        together.
        """
        if not isinstance(entry.value, dict):
            return self.single.read(entry)
        mistakes = Mistakes()
        widths = dict[str, Width]()
        for name, child in entry.mapping():
            with mistakes.noted():
                widths[name] = self.single.read(child)
        mistakes.check()
        if len(widths) > MOST_METRICS:
            raise entry.error(
                f'"{entry.name}" has {len(widths)} metrics; at most {MOST_METRICS} are'
                " allowed, because all intervals are simultaneous"
            )
        return widths

    def schema(self) -> Schema:
        """Return the allowed values as JSON Schema."""
        several = named(self.single.schema()) | {"maxProperties": MOST_METRICS}
        return {"anyOf": [*self.single.schema()["anyOf"], several]}

    def write(self, value: Width | Mapping[str, Width]) -> Any:
        """Return half-widths in the form of a spec."""
        if isinstance(value, Width):
            return self.single.write(value)
        return {name: self.single.write(width) for name, width in value.items()}


@dataclass(frozen=True, kw_only=True)
class Precision:
    """The largest half-widths of the confidence intervals of the means of metrics.

    There is a single `metric`, or `half_width` names several metrics.
    """

    metric: Annotated[
        str | None,
        Key(
            Text("a name"),
            "a recorded metric, or `<metric>_mean` for the second half",
            otherwise="the metrics in `half_width`",
            example=ANY_METRIC,
        ),
    ] = None
    half_width: Annotated[
        Width | Mapping[str, Width],
        Key(
            HalfWidths(),
            "half-width of the confidence interval of a mean, or a value per metric",
            example="{speed: 0.02, dispersion: 5%}",
        ),
    ]
    confidence: Annotated[
        float,
        Key(
            Number(least=0.5, most=0.999),
            "simultaneous confidence of the intervals of all looks and metrics",
            example="0.99",
        ),
    ] = 0.95


class PrecisionSection(SectionOf):
    """The section `Precision`, whose schema has the rules for combinations of keys."""

    def schema(self) -> Schema:
        """Return the schema of the section.

        A single half-width needs `metric`, and a mapping of half-widths excludes
        `metric`.
        """
        several = {"properties": {"half_width": {"type": "object"}}}
        alone: Schema = {"not": {"required": ["metric"]}}
        rules = {"if": several, "then": alone, "else": {"required": ["metric"]}}
        return super().schema() | rules


@dataclass(frozen=True, kw_only=True)
class UntilPrecise:
    """The mapping under `replicates`: trials are added until a mean is precise."""

    until: Annotated[
        Precision, Key(PrecisionSection(Precision), "required precision of the means")
    ]
    least: Annotated[
        int, Key(LOOK, "trials before the first look", name="min", example="20")
    ] = FIRST_LOOK
    most: Annotated[int, Key(LOOK, "most trials per point", name="max", example="200")]


KEY = Key(
    LaterSectionOf(UntilPrecise),
    "trials are added until the means are precise",
    name="until",
    otherwise="a fixed number of trials",
)


def read_until(root: Entry, context: SpecContext) -> Until:
    """Return the rule of the mapping under `replicates`.

    Raises SpecError for all mistakes together.
    """
    entry = root.child(FORM_OF)
    mistakes = Mistakes()
    rule = mistakes.read(_read, entry)
    until = entry.get("until")
    if until is not None and isinstance(until.value, dict):
        mistakes.read(_check_metrics, until, context)
        with mistakes.noted():
            if continued_axis(context.axes or ()):
                raise until.error(
                    'a study with "continue" needs a fixed number of replicates: each'
                    ' replicate is a chain, but "until" adds trials to single points'
                )
    mistakes.check()
    assert rule
    return rule


def _read(entry: Entry) -> Until:
    """Return the rule of an entry alone. Raises SpecError.

    The rest of the spec is not checked.
    """
    rule = read_section(UntilPrecise, entry)
    mistakes = Mistakes()
    with mistakes.noted():
        _check_limits(entry, rule)
    precision = rule.until
    widths = precision.half_width
    if isinstance(widths, Width) == (precision.metric is None):
        with mistakes.noted():
            raise entry.child("until").error(
                'needs "metric" with one "half_width", or a mapping from metrics'
                ' to half-widths under "half_width", for example {speed: 0.02,'
                " dispersion: 5%}"
            )
    mistakes.check()
    if isinstance(widths, Width):
        assert precision.metric is not None
        widths = {precision.metric: widths}
    return Until(widths, precision.confidence, rule.least, rule.most)


def _check_limits(entry: Entry, rule: UntilPrecise) -> None:
    """Raise SpecError if the first look comes after the most trials."""
    if rule.least <= rule.most:
        return
    if "min" in entry.value:
        raise entry.child("min").error(
            f'"min" must be at most "max", which is {rule.most}, not {rule.least}'
        )
    raise entry.child("max").error(
        f'"max" is {rule.most}, below the default of "min", {rule.least}:'
        ' give "min" too'
    )


def _check_metrics(until: Entry, context: SpecContext) -> None:
    """Raise SpecError if a metric of the rule is not recorded.

    A value that is not a name has a separate error.
    """
    metric = until.get("metric")
    widths = until.get("half_width")
    entries = dict[str, Entry]()
    if metric and isinstance(metric.value, str):
        entries[metric.value] = metric
    if widths and isinstance(widths.value, dict):
        entries |= dict(widths.mapping())
    mistakes = Mistakes()
    for name, entry in entries.items():
        mistakes.read(
            check_recorded,
            entry,
            name,
            context.recorded,
            metrics=context.metrics.catalogue.metrics,
        )
    mistakes.check()


def check_record(record: dict[str, Any], plan: Mapping[str, Any]) -> None:
    """Raise ValueError unless a spec can have the rule of a record."""
    keys = ("metric", "half_width", "confidence")
    most = record["max"]
    if MOST_TRIALS < most <= MOST_BEFORE:  # earlier versions allowed more
        most = MOST_TRIALS
    written = {
        "until": {name: record[name] for name in keys if name in record},
        "min": record["min"],
        "max": most,
    }
    entry = Entry(Document(Path("plan.parquet"), ""), (), written)
    try:
        rule = _read(entry)
        for name in rule.widths:
            check_recorded(entry, name, plan["record"], plan["record"])
    except SpecError as error:
        raise ValueError(f"{error}") from None
    if not 0.0 < record["nominal_confidence"] < 1.0:
        raise ValueError(f"nominal_confidence is {record['nominal_confidence']}")


def _strategy(study: Study, rule: Until, _results: Location | None) -> Any:
    """Return the strategy of a study. The call imports `sweep.campaigns`."""
    from sweep.methods.adaptive.strategy import AdaptiveStrategy

    return AdaptiveStrategy(study, rule)


NUMBER = int | float
SECTION = SpecSection(
    KEY,
    form_of=FORM_OF,
    read=read_until,
    not_beside={
        "search": '"replicates" must be an integer there, because a search races'
        " candidates"
    },
    strategy=_strategy,
    recorded=lambda _study, rule: recorded_rule(rule),
    shape={
        "min": int,
        "max": int,
        "half_width": object,
        "confidence": NUMBER,
        "nominal_confidence": NUMBER,
    },
    check_recorded=check_record,
    looks_at=lambda record: (*from_json(record).widths,),
)
