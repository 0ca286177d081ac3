"""How many trials a point gets: a number, one for each listed seed, or as many as an
interval needs.
"""

from typing import Any, NamedTuple

from kernels.metrics import METRICS
from sweep.analysis.sequential import Until
from sweep.spec.document import Entry
from sweep.spec.limits import MOST_TRIALS
from sweep.spec.recorded import columns_of
from sweep.text import unknown

LEAST_LOOK = 3
FIRST_LOOK = 10
CONFIDENCE = 0.95
LOWEST_CONFIDENCE, HIGHEST_CONFIDENCE = 0.5, 0.999


class Replication(NamedTuple):
    """Exactly one of them is given: trials a point, literal seeds, or a rule by which
    trials are added.
    """

    replicates: int | None = None
    seeds: tuple[int, ...] | None = None
    until: Until | None = None


def read_replication(root: Entry, recorded: tuple[str, ...]) -> Replication:
    """What the spec says under `replicates` or `seeds`; `recorded` are its metrics.
    Raises SpecError.
    """
    replicates, seeds = root.get("replicates"), root.get("seeds")
    if (replicates is None) == (seeds is None):
        raise (seeds or root).error(
            'needs either "replicates" (trials a point) or "seeds" (a list),'
            " and not both"
        )
    if seeds:
        return Replication(seeds=_seeds(seeds))
    assert replicates
    if not isinstance(replicates.value, dict):
        return Replication(replicates=replicates.whole(1, MOST_TRIALS))
    if "search" in root.value:
        raise replicates.error(
            "a search races its candidates itself:"
            ' "replicates" must be a whole number there'
        )
    return Replication(until=_until(replicates, recorded))


def _seeds(entry: Entry) -> tuple[int, ...]:
    numbers: dict[int, None] = {}
    for child in entry.entries():
        number = child.whole(0)
        if number in numbers:
            raise child.error(f'{number} stands twice in "seeds"')
        numbers[number] = None
    return tuple(numbers)


def _until(entry: Entry, recorded: tuple[str, ...]) -> Until:
    entry.keys(["until", "min", "max"], ["until", "max"])
    rule = entry.child("until")
    rule.keys(["metric", "half_width", "confidence"], ["metric", "half_width"])
    most = entry.child("max").whole(LEAST_LOOK, MOST_TRIALS)
    first = entry.get("min")
    if first is None and most < FIRST_LOOK:
        raise entry.child("max").error(
            f'"max" is {most}, below the default of "min", {FIRST_LOOK}: give "min" too'
        )
    least = first.whole(LEAST_LOOK, MOST_TRIALS) if first else FIRST_LOOK
    if first and least > most:
        raise first.error(f'"min" must be at most "max", which is {most}, not {least}')
    return Until(
        _metric(rule.child("metric"), recorded),
        _half_width(rule),
        _confidence(rule),
        least,
        most,
    )


def _metric(entry: Entry, recorded: tuple[str, ...]) -> str:
    name = entry.text()
    if name in METRICS and name not in recorded:
        raise entry.error(
            f'metric "{name}" is not recorded: list it under "metrics" of "record"'
        )
    columns = columns_of(recorded)
    if name not in columns:
        raise entry.error(unknown("recorded metric", name, columns))
    return name


def _half_width(rule: Entry) -> float:
    entry = rule.child("half_width")
    if entry.number() <= 0.0:
        raise entry.expected("a number above 0, in the unit of the metric")
    return entry.number()


def _confidence(rule: Entry) -> float:
    entry = rule.get("confidence")
    if entry is None:
        return CONFIDENCE
    if not LOWEST_CONFIDENCE <= entry.number() <= HIGHEST_CONFIDENCE:
        raise entry.expected(
            f"a number from {LOWEST_CONFIDENCE} to {HIGHEST_CONFIDENCE}"
        )
    return entry.number()


def replicates_schema() -> dict[str, Any]:
    """The JSON Schema of `replicates`."""
    number = {"type": "integer", "minimum": LEAST_LOOK, "maximum": MOST_TRIALS}
    rule = {
        "metric": {
            "type": "string",
            "description": "a recorded metric, or <metric>_mean for its last half",
        },
        "half_width": {
            "type": "number",
            "exclusiveMinimum": 0,
            "description": "in the unit of the metric",
        },
        "confidence": {
            "type": "number",
            "minimum": LOWEST_CONFIDENCE,
            "maximum": HIGHEST_CONFIDENCE,
        },
    }
    adaptive = {
        "until": (
            _mapping(rule, ["metric", "half_width"])
            | {"description": "of the interval of the metric's mean"}
        ),
        "min": (
            number
            | {"description": f"trials before the first look, by default {FIRST_LOOK}"}
        ),
        "max": number | {"description": "most trials a point"},
    }
    fixed = {"type": "integer", "minimum": 1, "maximum": MOST_TRIALS}
    return {
        "anyOf": [fixed, _mapping(adaptive, ["until", "max"])],
        "description": "trials a point",
    }


def _mapping(properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": properties,
        "required": required,
        "additionalProperties": False,
    }
