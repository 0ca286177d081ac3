"""The JSON Schema of spec.yaml, from which editors complete names and show units and ranges.

It describes the shape. What depends on several values at once, such as expressions, is checked by `sweep.spec`.
"""

import math
from typing import Any

from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.document import INTEGER_BOUND
from sweep.fields import Field, fields, preset_settings
from sweep.sampling import DISTRIBUTIONS, SAMPLERS
from sweep.spec import MOST_REPLICATES, REQUIRED, STUDY_NAME

Schema = dict[str, Any]

CONDITION: Schema = {"type": "string", "description": "condition under which the axis applies"}
POINTS: Schema = {"type": "integer", "minimum": 1, "description": "number of points"}
PAIR: Schema = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
SEED: Schema = {"type": "integer", "minimum": 0, "exclusiveMaximum": INTEGER_BOUND}
GRID: Schema = {
    "type": "array",
    "prefixItems": [{"type": "number"}, {"type": "number"}, {"type": "integer", "minimum": 1}],
    "minItems": 3,
    "maxItems": 3,
    "description": "[first, last, number of values]",
}


def json_schema() -> Schema:
    """The schema, draft 2020-12, as plain dicts and lists."""
    properties = _properties()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "boidsweep study",
        **_mapping(properties, required=list(REQUIRED)),
        "oneOf": [{"required": ["replicates"]}, {"required": ["seeds"]}],
        "allOf": [
            {
                "if": {"properties": {"model": {"const": model}}, "required": ["model"]},
                "then": _of_model(model),
            }
            for model in MODELS
        ],
    }


def _properties() -> Schema:
    metrics = _listed({"enum": list(METRICS)})
    stream = {"enum": ["common", "independent"]}
    return {
        "study": {
            "type": "string",
            "pattern": f"^{STUDY_NAME.pattern}$",
            "description": "name of the study: its results are in results/NAME",
        },
        "model": {"oneOf": [{"const": name, "description": model.source} for name, model in MODELS.items()]},
        "preset": {"type": "string", "description": "where values come from that the spec leaves out"},
        "fixed": {"type": "object", "description": "one value for each of these fields"},
        "sweep": {
            "type": "object",
            "description": "axes; the points are their product, the last one fastest",
        },
        "derive": {"type": "object", "description": "fields computed from others, by expressions"},
        "require": {
            **_listed({"type": "string"}),
            "description": "conditions without which a point is left out",
        },
        "replicates": {
            "type": "integer",
            "minimum": 1,
            "maximum": MOST_REPLICATES,
            "description": "trials a point",
        },
        "seeds": {**_listed(SEED), "description": "one trial a point with each of these seeds"},
        "seed": {**SEED, "description": "seed of the study"},
        "streams": {
            **_mapping(dict.fromkeys(("start", "world", "noise"), stream)),
            "description": "common: the same random numbers at all points; independent: others at each",
        },
        "record": _mapping(
            {
                "metrics": {
                    **metrics,
                    "description": "recorded of each trial; by default those of the model",
                },
                "series": {**metrics, "description": "recorded of each frame"},
                "every": {"type": "integer", "minimum": 1, "description": "number of steps between frames"},
                "heatmaps": {"type": "boolean", "description": "whether visits are kept by pixel"},
            }
        ),
        "time_limit": {"type": "number", "exclusiveMinimum": 0, "description": "seconds a trial may take"},
    }


def _of_model(model: str) -> Schema:
    """What the spec of this model may hold, beyond what holds for all."""
    known = fields(model)
    values = {
        name: _value(field) | {"description": _description(model, field)} for name, field in known.items()
    }
    axes = {
        name: {"description": values[name]["description"], "anyOf": _forms(_value(field))}
        for name, field in known.items()
    }
    expressions = {
        name: {"type": "string", "description": values[name]["description"]}
        for name in known
        if name != "map"
    }
    properties = {
        "preset": {"enum": list(MODELS[model].presets)},
        "fixed": _mapping(values),
        "sweep": {**_mapping(axes), "additionalProperties": {"anyOf": _joint_forms(known)}},
        "derive": _mapping(expressions),
    }
    return {"properties": properties}


def _description(model: str, field: Field) -> str:
    presets = (f"{name}: {preset_settings(model, name)[field.name]}" for name in MODELS[model].presets)
    return f"{field.text}{f' ({field.unit})' if field.unit else ''}. {', '.join(presets)}"


def _value(field: Field) -> Schema:
    if field.kind == "choice":
        return {"enum": list(field.choices)}
    if field.kind == "bool":
        return {"type": "boolean"}
    schema: Schema = {"type": "integer" if field.kind == "int" else "number"}
    if field.low > -math.inf:
        schema["exclusiveMinimum" if field.exclusive else "minimum"] = field.low
    if field.high < math.inf:
        schema["maximum"] = field.high
    return schema


def _forms(value: Schema) -> list[Schema]:
    """The ways to write an axis of one field."""
    grids = [_mapping({grid: GRID, "when": CONDITION}, required=[grid]) for grid in ("linspace", "logspace")]
    drawn = [
        _mapping(
            {**distribution["properties"], "points": POINTS, "when": CONDITION}, required=[name, "points"]
        )
        for name, distribution in _distributions(value).items()
    ]
    values = _mapping({"values": _listed(value), "when": CONDITION}, required=["values"])
    return [_listed(value), values, *grids, *drawn]


def _joint_forms(known: dict[str, Field]) -> list[Schema]:
    """The ways to write an axis of several fields."""
    distributions = {
        name: {"anyOf": list(_distributions(_value(field)).values())} for name, field in known.items()
    }
    members = {
        name: {"anyOf": [{**_listed(_value(field)), "uniqueItems": False}, *_grids()]}
        for name, field in known.items()
    }
    columns = {"anyOf": [_listed({"enum": list(known)}), _mapping(dict.fromkeys(known, {"type": "string"}))]}
    return [
        _mapping(
            {"sample": {"enum": list(SAMPLERS)}, "points": POINTS, "when": CONDITION, **distributions},
            required=["sample", "points"],
        ),
        _mapping(
            {"sample": {"const": "table"}, "file": {"type": "string"}, "columns": columns, "when": CONDITION},
            required=["sample", "file"],
        ),
        _mapping({"zip": _mapping(members), "when": CONDITION}, required=["zip"]),
    ]


def _grids() -> list[Schema]:
    return [_mapping({grid: GRID}, required=[grid]) for grid in ("linspace", "logspace")]


def _distributions(value: Schema) -> dict[str, Schema]:
    return {
        name: _mapping({name: _listed(value) if name == "choice" else PAIR}, required=[name])
        for name in DISTRIBUTIONS
    }


def _listed(items: Schema) -> Schema:
    return {"type": "array", "items": items, "minItems": 1, "uniqueItems": True}


def _mapping(properties: Schema, required: list[str] | None = None) -> Schema:
    return {
        "type": "object",
        "properties": properties,
        "required": required or [],
        "additionalProperties": False,
        "minProperties": 1,
    }
