"""How many trials a point gets: a number, one for each listed seed, or as many as
intervals need.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

from sweep.analysis.sequential import MOST_METRICS, Until, Width
from sweep.spec.contents import SHARE, Content, ListOf, Number, Text, Whole, share
from sweep.spec.document import Entry
from sweep.spec.keys import Key, SectionOf, read_section, section_schema
from sweep.spec.limits import MOST_TRIALS
from sweep.spec.mistakes import Mistakes
from sweep.spec.recorded import ANY_METRIC, check_recorded
from sweep.spec.schema_parts import Schema, named, one_of

LEAST_LOOK = 3
FIRST_LOOK = 10
TRIALS = Whole(1, MOST_TRIALS)
LOOK = Whole(LEAST_LOOK, MOST_TRIALS)
NOT_ZERO = r"(?!0{1,2}(?:\.0{1,9})? ?%)"
SEEDS = ListOf(Whole(0), "whole numbers from 0")


@dataclass(frozen=True)
class HalfWidth(Content[Width]):
    """A number in the unit of the metric, or a share of the mean, as 5%."""

    number = Number(above=0, note="in the unit of the metric")

    @property
    def words(self) -> str:
        return f"{self.number.words}, or a share of the mean, as 5%"

    def read(self, entry: Entry) -> Width:
        if not isinstance(entry.value, str):
            return Width(self.number.read(entry))
        part = share(entry.value)
        if not part:
            raise entry.expected(self.words)
        return Width(float(part), relative=True)

    def schema(self) -> Schema:
        part = {"type": "string", "pattern": f"^{NOT_ZERO}{SHARE.pattern}$"}
        return {"anyOf": [self.number.schema(), part]}

    def write(self, value: Width) -> Any:
        return value.as_json()


@dataclass(frozen=True)
class HalfWidths(Content[Width | Mapping[str, Width]]):
    """A half width, or one for each of several metrics by name."""

    one = HalfWidth()

    @property
    def words(self) -> str:
        return f"{self.one.words}; or a mapping from metrics to such half widths"

    def read(self, entry: Entry) -> Width | Mapping[str, Width]:
        if not isinstance(entry.value, dict):
            return self.one.read(entry)
        mistakes, found = Mistakes(), {}
        for name, child in entry.mapping():
            with mistakes.noted():
                found[name] = self.one.read(child)
        mistakes.check()
        if len(found) > MOST_METRICS:
            raise entry.error(
                f'"{entry.name}" has {len(found)} metrics; at most {MOST_METRICS} are'
                " allowed, as their intervals hold together"
            )
        return found

    def schema(self) -> Schema:
        several = named(self.one.schema()) | {"maxProperties": MOST_METRICS}
        return {"anyOf": [*self.one.schema()["anyOf"], several]}

    def write(self, value: Width | Mapping[str, Width]) -> Any:
        if isinstance(value, Width):
            return self.one.write(value)
        return {name: self.one.write(one) for name, one in value.items()}


@dataclass(frozen=True, kw_only=True)
class Precision:
    """How narrow the intervals of the means of metrics must be: of one `metric`, or of
    those that `half_width` names.
    """

    metric: Annotated[
        str | None,
        Key(
            Text("a name"),
            "a recorded metric, or `<metric>_mean` for its last half",
            otherwise="those that `half_width` names",
            example=ANY_METRIC,
        ),
    ] = None
    half_width: Annotated[
        Width | Mapping[str, Width],
        Key(
            HalfWidths(),
            "of the interval of the mean of the metric, or of each of several by name",
            example="{speed: 0.02, dispersion: 5%}",
        ),
    ]
    confidence: Annotated[
        float,
        Key(
            Number(least=0.5, most=0.999),
            "with which the intervals of all looks, of all metrics, hold together",
            example="0.99",
        ),
    ] = 0.95


class PrecisionSection(SectionOf):
    """The section `Precision`, with what its keys must fulfil together as schema."""

    def schema(self) -> Schema:
        several = {"properties": {"half_width": {"type": "object"}}}
        alone: Schema = {"not": {"required": ["metric"]}}
        rules = {"if": several, "then": alone, "else": {"required": ["metric"]}}
        return super().schema() | rules


@dataclass(frozen=True, kw_only=True)
class UntilPrecise:
    """The mapping under `replicates`: trials are added until a mean is known well."""

    until: Annotated[
        Precision, Key(PrecisionSection(Precision), "how well means must be known")
    ]
    least: Annotated[
        int, Key(LOOK, "trials before the first look", name="min", example="20")
    ] = FIRST_LOOK
    most: Annotated[int, Key(LOOK, "most trials a point", name="max", example="200")]


@dataclass(frozen=True)
class Replicates(Content[int | Until]):
    """A number of trials, or the rule by which they are added."""

    @property
    def words(self) -> str:
        return f"{TRIALS.words}, or a mapping with `until`"

    def read(self, entry: Entry) -> int | Until:
        if not isinstance(entry.value, dict):
            return TRIALS.read(entry)
        rule, mistakes = read_section(UntilPrecise, entry), Mistakes()
        with mistakes.noted():
            _check_limits(entry, rule)
        until = rule.until
        widths = until.half_width
        if isinstance(widths, Width) == (until.metric is None):
            with mistakes.noted():
                raise entry.child("until").error(
                    'needs "metric" with one "half_width", or a mapping from metrics'
                    ' to half widths under "half_width", as {speed: 0.02,'
                    " dispersion: 5%}"
                )
        mistakes.check()
        if isinstance(widths, Width):
            assert until.metric is not None
            widths = {until.metric: widths}
        return Until(widths, until.confidence, rule.least, rule.most)

    def schema(self) -> Schema:
        return {"anyOf": [TRIALS.schema(), section_schema(UntilPrecise)]}

    @property
    def sections(self) -> tuple[type[Any], ...]:
        return (UntilPrecise,)


def _check_limits(entry: Entry, rule: UntilPrecise) -> None:
    """Raise SpecError where the first look comes after the most trials."""
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


class Replication(NamedTuple):
    """Exactly one of them is given: trials a point, literal seeds, or a rule by which
    trials are added.
    """

    replicates: int | None = None
    seeds: tuple[int, ...] | None = None
    until: Until | None = None


def read_replication(
    root: Entry, recorded: tuple[str, ...], metrics: Collection[str]
) -> Replication:
    """What the spec says under `replicates` or `seeds`; it has `recorded` some of these
    `metrics`. Raises SpecError.
    """
    replicates, seeds = root.get("replicates"), root.get("seeds")
    if (replicates is None) == (seeds is None):
        raise (seeds or root).error(
            'needs either "replicates" (trials a point) or "seeds" (a list),'
            " and not both"
        )
    if seeds:
        return Replication(seeds=SEEDS.read(seeds))
    assert replicates
    mistakes = Mistakes()
    asked = mistakes.read(Replicates().read, replicates)
    if isinstance(replicates.value, dict):
        with mistakes.noted():
            if "search" in root.value:
                raise replicates.error(
                    "a search races its candidates itself:"
                    ' "replicates" must be a whole number there'
                )
        mistakes.read(_check_recorded, replicates.get("until"), recorded, metrics)
    mistakes.check()
    if isinstance(asked, Until):
        return Replication(until=asked)
    return Replication(replicates=asked)


def replication_rules() -> Schema:
    """What `read_replication` checks of several keys, as JSON Schema."""
    return one_of(["replicates", "seeds"])


def _check_recorded(
    until: Entry | None, recorded: tuple[str, ...], metrics: Collection[str]
) -> None:
    """Raise SpecError where a metric of the rule is not recorded. What is no name is
    not looked at.
    """
    if until is None or not isinstance(until.value, dict):
        return
    one, widths, mistakes = until.get("metric"), until.get("half_width"), Mistakes()
    named = {one.value: one} if one and isinstance(one.value, str) else {}
    if widths and isinstance(widths.value, dict):
        named |= dict(widths.mapping())
    for name, entry in named.items():
        with mistakes.noted():
            check_recorded(entry, name, recorded, metrics)
    mistakes.check()
