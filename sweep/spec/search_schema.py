"""The `search` section in the JSON Schema of a spec."""

from collections.abc import Iterable, Mapping
from typing import Any

from kernels.metrics import METRICS
from sweep.spec.limits import MOST_SEARCHED
from sweep.spec.recorded import MEAN
from sweep.spec.search import HELD_OUT_CANDIDATES, HELD_OUT_REPLICATES
from sweep.spec.search_section import (
    BATCH,
    LEVEL,
    MOST_BATCH,
    REQUIRED,
    SAMPLERS,
)

Schema = dict[str, Any]


def search_schema() -> Schema:
    """The section, whatever the model."""
    held_out = {
        "candidates": _whole(
            MOST_SEARCHED,
            f"how many of the best are judged, by default {HELD_OUT_CANDIDATES}",
        ),
        "replicates": _whole(
            MOST_SEARCHED,
            f"trials of each of them and scenario, by default {HELD_OUT_REPLICATES}",
        ),
    }
    properties = {
        "parameters": _named(
            {"type": "object"}, "fields, each with the range in which it is searched"
        ),
        "objectives": _columns(
            _objective(),
            "metrics at the last frame, or <metric>_mean over the last half",
        ),
        "constraints": _columns(_constraint(), "bounds of such metrics"),
        "budget": _whole(
            MOST_SEARCHED,
            "most trials of the search; those on held-out seeds come on top",
        ),
        "sampler": {
            "enum": list(SAMPLERS),
            "description": "by default tpe, for several objectives nsga2",
        },
        "batch": _whole(
            MOST_BATCH, f"candidates asked for at once, by default {BATCH}"
        ),
        "racing": _racing(),
        "over": {
            "type": "object",
            "description": (
                "axes of the scenarios that a candidate must be good at together"
            ),
        },
        "held_out": _mapping(held_out),
        "references": _named(
            {"type": "object"},
            "settings of all parameters, by name, that are judged too",
        ),
    }
    return _mapping(properties, REQUIRED) | {
        "description": "what is searched for, instead of a sweep"
    }


def model_schema(
    values: Mapping[str, Schema], axes: Schema, distribution: Schema
) -> Schema:
    """What the section may hold for one model: whose fields may be `values`, and whose
    `sweep` is `axes`.
    """
    parameters = {
        name: distribution | {"properties": {"choice": _listed(value), "normal": False}}
        for name, value in values.items()
    }
    references = {"additionalProperties": _mapping(values)}
    return {
        "properties": {
            "parameters": _mapping(parameters),
            "over": axes,
            "references": references,
        }
    }


def _objective() -> Schema:
    return _one({"minimize": _statistic(), "maximize": _statistic()})


def _constraint() -> Schema:
    bounds: Schema = {"at_most": {"type": "number"}, "at_least": {"type": "number"}}
    return _mapping(bounds | {"statistic": _statistic()}) | {
        "oneOf": [{"required": [name]} for name in bounds]
    }


def _statistic() -> Schema:
    share = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
    return {
        "anyOf": [{"enum": ["mean", "worst"]}, _one({"quantile": share, "cvar": share})]
    }


def _racing() -> Schema:
    level = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 0.5}
    return {
        "anyOf": [{"type": "boolean"}, _mapping({"level": level}, ["level"])],
        "description": (
            "whether candidates that are clearly worse get no more trials; true is"
            f" {{level: {LEVEL:g}}}"
        ),
    }


def _listed(item: Schema) -> Schema:
    return {"type": "array", "items": item, "minItems": 1, "uniqueItems": True}


def _columns(item: Schema, description: str) -> Schema:
    names = [name + ending for name in METRICS for ending in ("", MEAN)]
    return _named(item, description) | {"propertyNames": {"enum": names}}


def _named(item: Schema, description: str) -> Schema:
    return {
        "type": "object",
        "additionalProperties": item,
        "minProperties": 1,
        "description": description,
    }


def _whole(most: int, description: str) -> Schema:
    return {
        "type": "integer",
        "minimum": 1,
        "maximum": most,
        "description": description,
    }


def _one(properties: Schema) -> Schema:
    return _mapping(properties) | {
        "oneOf": [{"required": [name]} for name in properties]
    }


def _mapping(properties: Mapping[str, Schema], required: Iterable[str] = ()) -> Schema:
    return {
        "type": "object",
        "properties": dict(properties),
        "required": list(required),
        "additionalProperties": False,
        "minProperties": 1,
    }
