"""How many trials a point gets: a number, one for each listed seed, or as many as an
interval needs.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

from sweep.analysis.sequential import Until
from sweep.spec.contents import Content, ListOf, Number, Text, Whole
from sweep.spec.document import Entry
from sweep.spec.keys import Key, SectionOf, read_section, section_schema
from sweep.spec.limits import MOST_TRIALS
from sweep.spec.recorded import ANY_METRIC, columns_of
from sweep.spec.schema_parts import Schema, one_of
from sweep.text import unknown

LEAST_LOOK = 3
FIRST_LOOK = 10
TRIALS = Whole(1, MOST_TRIALS)
LOOK = Whole(LEAST_LOOK, MOST_TRIALS)
SEEDS = ListOf(Whole(0), "whole numbers from 0")


@dataclass(frozen=True, kw_only=True)
class Precision:
    """How narrow the interval of the mean of a metric must be."""

    metric: Annotated[
        str,
        Key(
            Text("a name"),
            "a recorded metric, or `<metric>_mean` for its last half",
            example=ANY_METRIC,
        ),
    ]
    half_width: Annotated[
        float,
        Key(
            Number(above=0, note="in the unit of the metric"),
            "of the interval of the metric's mean, in the unit of the metric",
            example="0.5",
        ),
    ]
    confidence: Annotated[
        float,
        Key(
            Number(least=0.5, most=0.999),
            "with which the intervals of all looks hold together",
            example="0.99",
        ),
    ] = 0.95


@dataclass(frozen=True, kw_only=True)
class UntilPrecise:
    """The mapping under `replicates`: trials are added until a mean is known well."""

    until: Annotated[
        Precision, Key(SectionOf(Precision), "how well a mean must be known")
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
        rule = read_section(UntilPrecise, entry)
        if rule.least > rule.most:
            if "min" in entry.value:
                raise entry.child("min").error(
                    f'"min" must be at most "max", which is {rule.most},'
                    f" not {rule.least}"
                )
            raise entry.child("max").error(
                f'"max" is {rule.most}, below the default of "min", {rule.least}:'
                ' give "min" too'
            )
        until = rule.until
        return Until(
            until.metric, until.half_width, until.confidence, rule.least, rule.most
        )

    def schema(self) -> Schema:
        return {"anyOf": [TRIALS.schema(), section_schema(UntilPrecise)]}

    @property
    def sections(self) -> tuple[type[Any], ...]:
        return (UntilPrecise,)


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
    asked = Replicates().read(replicates)
    if isinstance(asked, int):
        return Replication(replicates=asked)
    if "search" in root.value:
        raise replicates.error(
            "a search races its candidates itself:"
            ' "replicates" must be a whole number there'
        )
    _check_recorded(replicates.child("until").child("metric"), recorded, metrics)
    return Replication(until=asked)


def replication_rules() -> Schema:
    """What `read_replication` checks of several keys, as JSON Schema."""
    return one_of(["replicates", "seeds"])


def _check_recorded(
    entry: Entry, recorded: tuple[str, ...], metrics: Collection[str]
) -> None:
    name = entry.text()
    if name in metrics and name not in recorded:
        raise entry.error(
            f'metric "{name}" is not recorded: list it under "metrics" of "record"'
        )
    columns = columns_of(recorded)
    if name not in columns:
        raise entry.error(unknown("recorded metric", name, columns))
