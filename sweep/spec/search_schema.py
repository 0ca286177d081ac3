"""The `search` section in the JSON Schema of a spec."""

from sweep.spec.limits import MOST_SEARCHED
from sweep.spec.schema_parts import (
    Schema,
    mapping,
    named,
    one_of,
    reference,
    whole,
)
from sweep.spec.search import HELD_OUT_CANDIDATES, HELD_OUT_REPLICATES
from sweep.spec.search_section import BATCH, LEVEL, MOST_BATCH, REQUIRED, SAMPLERS

ANY: Schema = {"type": "object"}
"""What only the schema of a model can tell."""
METRIC_TEXT = "metrics at the last frame, or <metric>_mean over the last half"
OVER_TEXT = "axes of the scenarios that a candidate must be good at together"


def search_schema() -> Schema:
    """The section, whatever the model."""
    properties = {
        "parameters": {
            **named(ANY),
            "description": "settings, each with the range in which it is searched",
        },
        "objectives": {
            **_columns(_objective()),
            "description": METRIC_TEXT,
        },
        "constraints": {
            **_columns(_constraint()),
            "description": "bounds of such metrics",
        },
        "budget": whole(
            MOST_SEARCHED,
            "most trials of the search; those on held-out seeds come on top",
        ),
        "sampler": {
            "enum": list(SAMPLERS),
            "description": "by default tpe, for several objectives nsga2",
        },
        "batch": whole(MOST_BATCH, f"candidates asked for at once, by default {BATCH}"),
        "racing": _racing(),
        "over": {
            **ANY,
            "description": OVER_TEXT,
        },
        "held_out": _held_out(),
        "references": {
            **named(ANY),
            "description": "settings of all parameters, by name, that are judged too",
        },
    }
    what = {"description": "what is searched for, instead of a sweep"}
    return mapping(properties, REQUIRED) | what


def model_schema(parameters: Schema, axes: Schema, settings: Schema) -> Schema:
    """What the section may hold for one model; each reference gives `settings`."""
    references = {"additionalProperties": settings}
    own = {"parameters": parameters, "over": axes, "references": references}
    return {"properties": own}


def _held_out() -> Schema:
    best = f"how many of the best are judged, by default {HELD_OUT_CANDIDATES}"
    trials = f"trials of each of them and scenario, by default {HELD_OUT_REPLICATES}"
    counts = {"candidates": best, "replicates": trials}
    return mapping({name: whole(MOST_SEARCHED, text) for name, text in counts.items()})


def _objective() -> Schema:
    statistics: Schema = dict.fromkeys(("minimize", "maximize"), reference("statistic"))
    return _one(statistics)


def _constraint() -> Schema:
    bounds: Schema = {"at_most": {"type": "number"}, "at_least": {"type": "number"}}
    return mapping(bounds | {"statistic": reference("statistic")}) | one_of(bounds)


def statistic() -> Schema:
    """What a search takes of the values of a metric."""
    share = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
    return {
        "anyOf": [{"enum": ["mean", "worst"]}, _one({"quantile": share, "cvar": share})]
    }


def _racing() -> Schema:
    level = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 0.5}
    return {
        "anyOf": [{"type": "boolean"}, mapping({"level": level}, ["level"])],
        "description": (
            "whether candidates that are clearly worse get no more trials;"
            f" true is {{level: {LEVEL:g}}}"
        ),
    }


def _columns(item: Schema) -> Schema:
    return named(item, reference("column"))


def _one(properties: Schema) -> Schema:
    return mapping(properties) | one_of(properties)
