"""The JSON Schema of spec.yaml, from which editors complete names and show units and
ranges.

It describes the shape. What depends on several values, as expressions do, is checked by
`sweep.spec.study`.
"""

import math
from collections.abc import Iterable
from typing import Any

from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.worlds import MAPS
from sweep.spec.axes import GRIDS
from sweep.spec.blocks import MOST_LEVELS, OPTIONS
from sweep.spec.document import INTEGER_BOUND
from sweep.spec.layout import STUDY_NAME
from sweep.spec.limits import MOST_POINTS
from sweep.spec.maps import MAP_NAME, MOST_LENGTH
from sweep.spec.policy import policy_rules, policy_schema
from sweep.spec.replication import replicates_schema
from sweep.spec.sampling import DISTRIBUTIONS, SAMPLERS
from sweep.spec.search_schema import model_schema, search_schema
from sweep.spec.settings import Field, fields, preset_settings
from sweep.spec.study import CHECKPOINT_SECONDS, REQUIRED

Schema = dict[str, Any]

SEED: Schema = {"type": "integer", "minimum": 0, "exclusiveMaximum": INTEGER_BOUND}
TEXT: Schema = {"type": "string"}


def json_schema() -> Schema:
    """The schema, draft 2020-12, as plain dicts and lists."""
    properties = _properties()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "boidsweep study",
        **_mapping(properties, REQUIRED),
        "oneOf": [{"required": ["replicates"]}, {"required": ["seeds"]}],
        "not": {"required": ["sweep", "search"]},
        **policy_rules(),
        "allOf": (
            [
                {
                    "if": {
                        "properties": {"model": {"const": model}},
                        "required": ["model"],
                    },
                    "then": _of_model(model),
                }
                for model in MODELS
            ]
            + [_built_in_maps()]
        ),
        "$defs": (
            _shared()
            | {key: value for model in MODELS for key, value in _values(model).items()}
        ),
    }


def _properties() -> Schema:
    stream = {"enum": ["common", "independent"]}
    return {
        "study": {
            "type": "string",
            "pattern": f"^{STUDY_NAME.pattern}$",
            "description": "name of the study: its results are in results/NAME",
        },
        "model": {
            "oneOf": [
                {"const": name, "description": model.source}
                for name, model in MODELS.items()
            ]
        },
        "preset": {
            "type": "string",
            "description": "where values come from that the spec leaves out",
        },
        "maps": {
            "type": "object",
            "propertyNames": {
                "pattern": f"^{MAP_NAME.pattern}$",
                "not": {"enum": list(MAPS)},
            },
            "additionalProperties": {"anyOf": _map_forms()},
            "minProperties": 1,
            "description": "maps of the study's own, by name",
        },
        "fixed": {
            "type": "object",
            "description": "one value for each of these fields",
        },
        "sweep": {
            "type": "object",
            "description": "axes; the points are their product, the last one fastest",
        },
        "search": search_schema(),
        "derive": {
            "type": "object",
            "description": "fields computed from others, by expressions",
        },
        "require": {
            **_listed({"type": "string"}),
            "description": "conditions without which a point is left out",
        },
        "replicates": replicates_schema(),
        "seeds": {
            **_listed(SEED),
            "description": "one trial a point with each of these seeds",
        },
        "seed": {**SEED, "description": "seed of the study"},
        "streams": {
            **_mapping(dict.fromkeys(("start", "world", "noise"), stream)),
            "description": (
                "common: the same random numbers at all points; independent: others at"
                " each"
            ),
        },
        "record": _record(),
        "time_limit": {
            "type": "number",
            "exclusiveMinimum": 0,
            "description": "seconds a trial may take",
        },
        "checkpoint": {
            "anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"const": False}],
            "description": (
                "seconds after which a trial writes down where it is, by default"
                f" {CHECKPOINT_SECONDS:g}; or false"
            ),
        },
        **policy_schema(),
    }


def _record() -> Schema:
    metrics = _listed({"enum": list(METRICS)})
    return _mapping(
        {
            "metrics": (
                metrics
                | {
                    "description": (
                        "recorded of each trial; by default those of the model"
                    )
                }
            ),
            "series": metrics | {"description": "recorded of each frame"},
            "every": {
                "type": "integer",
                "minimum": 1,
                "description": "number of steps between frames",
            },
            "heatmaps": {
                "type": "boolean",
                "description": "whether visits are kept by pixel",
            },
            "trajectories": {
                "type": "boolean",
                "description": "whether all boids are kept of each frame",
            },
        }
    )


def _map_forms() -> list[Schema]:
    """The ways to write a map."""
    number: Schema = {"type": "number"}
    length: Schema = {"type": "number", "exclusiveMinimum": 0, "maximum": MOST_LENGTH}
    disc = {"x": number, "y": number, "radius": length}
    rectangle = {"x": number, "y": number, "width": length, "height": length}
    shapes = {"disc": _mapping(disc, disc), "rectangle": _mapping(rectangle, rectangle)}
    drawn: Schema = {
        "size": {
            "type": "array",
            "items": length,
            "minItems": 2,
            "maxItems": 2,
            "description": "[width, height]",
        },
        "shapes": {"type": "array", "items": _mapping(shapes) | _one_of(shapes)},
    }
    pictured: Schema = {
        "image": TEXT | {"description": "a file, whose dark pixels are occupied"},
        "resolution": length | {"description": "length of a pixel"},
    }
    ros: Schema = {"ros": TEXT | {"description": "a file of ROS's map_server"}}
    return [_mapping(form, form) for form in (drawn, pictured, ros)]


def _shared() -> Schema:
    """What fields of all models have in common: grids, distributions, and the ways to
    write an axis.
    """
    grid = {
        "type": "array",
        "prefixItems": [
            {"type": "number"},
            {"type": "number"},
            {"type": "integer", "minimum": 1},
        ],
        "minItems": 3,
        "maxItems": 3,
        "description": "[first, last, number of values]",
    }
    pair = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
    grids: Schema = dict.fromkeys(GRIDS, grid)
    drawn: Schema = {
        name: {} if name == "choice" else pair | {"description": function.__doc__}
        for name, function in DISTRIBUTIONS.items()
    }
    points = {
        "type": "integer",
        "minimum": 1,
        "maximum": MOST_POINTS,
        "description": "number of points",
    }
    when = TEXT | {"description": "condition under which the axis applies"}
    axis = _mapping({"values": {}, **grids, **drawn, "points": points, "when": when})
    return {
        "points": points,
        "when": when,
        "grid": _mapping(grids) | _one_of(grids),
        "distribution": _mapping(drawn) | _one_of(drawn),
        "axis": (
            axis
            | _one_of(["values", *grids, *drawn])
            | {"dependentRequired": {name: ["points"] for name in drawn}}
            | {"dependentSchemas": {"points": _one_of(drawn)}}
        ),
    }


def _values(model: str) -> Schema:
    """What each field of a model may be, as `model.field`, and its axes, as
    `model.sweep`.
    """
    values = {
        f"{model}.{name}": _value(model, field) for name, field in fields(model).items()
    }
    return values | {f"{model}.sweep": _swept(model)}


def _value(model: str, field: Field) -> Schema:
    presets = (
        f"{name}: {preset_settings(model, name)[field.name]}"
        for name in MODELS[model].presets
    )
    unit = f" ({field.unit})" if field.unit else ""
    schema: Schema = {"description": f"{field.text}{unit}. {', '.join(presets)}"}
    if field.name == "map":
        return schema | {
            "anyOf": [
                {"enum": list(field.choices)},
                {"type": "string", "pattern": f"^{MAP_NAME.pattern}$"},
            ]
        }
    if field.kind == "choice":
        return schema | {"enum": list(field.choices)}
    schema["type"] = {"float": "number", "int": "integer", "bool": "boolean"}[
        field.kind
    ]
    if field.low > -math.inf:
        schema["exclusiveMinimum" if field.exclusive else "minimum"] = field.low
    if field.high < math.inf:
        schema["maximum"] = field.high
    return schema


def _swept(model: str) -> Schema:
    """The axes of a study of this model."""
    values = {name: _reference(f"{model}.{name}") for name in fields(model)}
    axes = {name: _axis(value) for name, value in values.items()}
    return _mapping(axes) | {
        "additionalProperties": {"anyOf": [*_joint_axes(values), _ablation(model)]}
    }


def _of_model(model: str) -> Schema:
    """What the spec of this model may hold, beyond what holds for all."""
    values = {name: _reference(f"{model}.{name}") for name in fields(model)}
    derived = {name: TEXT for name in values if name != "map"}
    properties = {
        "preset": {"enum": list(MODELS[model].presets)},
        "fixed": _mapping(values),
        "sweep": _reference(f"{model}.sweep"),
        "search": model_schema(
            values, _reference(f"{model}.sweep"), _reference("distribution")
        ),
        "derive": _mapping(derived),
    }
    return {"properties": properties}


def _built_in_maps() -> Schema:
    """Without maps of its own, a study has the built-in ones to choose from."""
    name = {"enum": list(MAPS)}
    swept = {"properties": {"map": {"if": {"type": "array"}, "then": {"items": name}}}}
    return {
        "if": {"not": {"required": ["maps"]}},
        "then": {
            "properties": {"fixed": {"properties": {"map": name}}, "sweep": swept}
        },
    }


def _axis(value: Schema) -> Schema:
    """An axis of one field: a list, or a mapping that says how to make one."""
    typed = {"values": _listed(value), "choice": _listed(value)}
    return {"anyOf": [_listed(value), _reference("axis") | {"properties": typed}]}


def _joint_axes(values: Schema) -> list[Schema]:
    """The ways to write an axis of several fields."""
    distributions = {
        name: _reference("distribution") | {"properties": {"choice": _listed(value)}}
        for name, value in values.items()
    }
    members = {
        name: {"anyOf": [_listed(value) | {"uniqueItems": False}, _reference("grid")]}
        for name, value in values.items()
    }
    columns = {
        "anyOf": [
            _listed({"enum": list(values)}),
            _mapping(dict.fromkeys(values, TEXT)),
        ]
    }
    table = {
        "sample": {"const": "table"},
        "file": TEXT,
        "columns": columns,
        "when": _reference("when"),
    }
    return [
        _sampled(distributions),
        _mapping(table, ["sample", "file"]),
        _mapping({"zip": _mapping(members), "when": _reference("when")}, ["zip"]),
    ]


def _sampled(distributions: Schema) -> Schema:
    """A joint axis drawn by a sampler, with the keys that only some samplers know."""
    options: Schema = {
        "points": (
            _reference("points")
            | {
                "description": (
                    "number of points; of blocks of them for saltelli and morris"
                )
            }
        ),
        "when": _reference("when"),
        "second_order": {
            "type": "boolean",
            "description": (
                "false: blocks of D + 2 points for D fields, not 2 D + 2, and no"
                " indices of pairs"
            ),
        },
        "levels": {
            "type": "integer",
            "minimum": 2,
            "maximum": MOST_LEVELS,
            "multipleOf": 2,
            "description": "number of values of a field, by default 4",
        },
    }
    plain: Schema = {"sample": {"enum": list(SAMPLERS)}} | dict.fromkeys(
        OPTIONS.values(), False
    )
    blocks = [
        {"sample": {"const": name}, "points": {"minimum": 2}, "when": False}
        | {key: False for key in OPTIONS.values() if key != own}
        for name, own in OPTIONS.items()
    ]
    sampler: Schema = {"sample": {"enum": [*SAMPLERS, *OPTIONS]}}
    joint = _mapping(sampler | options | distributions, ["sample", "points"])
    return joint | {
        "anyOf": [{"properties": properties} for properties in (plain, *blocks)]
    }


def _ablation(model: str) -> Schema:
    """An axis from the preset of the study to another one."""
    other = {
        "enum": list(MODELS[model].presets),
        "description": (
            "another preset: each setting in which it differs is changed alone, and"
            " last all of them"
        ),
    }
    return _mapping({"ablate": other, "when": _reference("when")}, ["ablate"])


def _reference(name: str) -> Schema:
    return {"$ref": f"#/$defs/{name}"}


def _one_of(keys: Iterable[str]) -> Schema:
    return {"oneOf": [{"required": [key]} for key in keys]}


def _listed(items: Schema) -> Schema:
    return {"type": "array", "items": items, "minItems": 1, "uniqueItems": True}


def _mapping(properties: Schema, required: Iterable[str] = ()) -> Schema:
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
        "minProperties": 1,
    }
