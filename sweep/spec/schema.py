"""The JSON Schema of spec.yaml: editors complete names from it, and show what they are.

It describes the shape. What depends on several values, as expressions do, is checked by
`sweep.spec.study`.
"""

from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.worlds import MAPS
from sweep.spec.axes import GRIDS
from sweep.spec.document import INTEGER_BOUND
from sweep.spec.layout import STUDY_NAME
from sweep.spec.limits import MOST_POINTS
from sweep.spec.maps import MAP_NAME, MOST_LENGTH
from sweep.spec.policy import policy_rules, policy_schema
from sweep.spec.recorded import columns_of
from sweep.spec.replication import replicates_schema
from sweep.spec.sampling import DISTRIBUTIONS
from sweep.spec.schema_parts import (
    TEXT,
    Schema,
    listed,
    mapping,
    named,
    one_of,
    reference,
    whole,
)
from sweep.spec.schema_settings import kinds, of_model, sampled
from sweep.spec.search_schema import search_schema, statistic
from sweep.spec.study import CHECKPOINT_SECONDS, REQUIRED

SEED: Schema = {"type": "integer", "minimum": 0, "exclusiveMaximum": INTEGER_BOUND}


def json_schema() -> Schema:
    """The schema, draft 07, as plain dicts and lists."""
    models = [{"if": _is(model), "then": reference(model)} for model in MODELS]
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "boidsweep study",
        **mapping(_properties(), REQUIRED),
        **one_of(["replicates", "seeds"]),
        "not": {"required": ["sweep", "search"]},
        **policy_rules(),
        "allOf": [*models, _built_in_maps()],
        "definitions": _definitions(),
    }


def _is(model: str) -> Schema:
    return {"properties": {"model": {"const": model}}, "required": ["model"]}


def _definitions() -> Schema:
    """What stands once and is referred to."""
    metrics = {"enum": list(METRICS)}
    columns = {"enum": columns_of(METRICS)}
    models = {name: part for model in MODELS for name, part in of_model(model).items()}
    names = {"metric": metrics, "column": columns, "built_in_map": {"enum": list(MAPS)}}
    return names | {"statistic": statistic()} | _forms() | kinds() | models


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
            **named(
                {"anyOf": _map_forms()},
                {"pattern": f"^{MAP_NAME.pattern}$", "not": reference("built_in_map")},
            ),
            "description": "maps of the study's own, by name",
        },
        "fixed": {
            "type": "object",
            "description": "one value for each of these settings",
        },
        "sweep": {
            "type": "object",
            "description": "axes; the points are their product, the last one fastest",
        },
        "search": search_schema(),
        "derive": {
            "type": "object",
            "description": "settings computed from others, by expressions",
        },
        "require": {
            **listed(TEXT),
            "description": "conditions without which a point is left out",
        },
        "replicates": replicates_schema(),
        "seeds": {
            **listed(SEED),
            "description": "one trial a point with each of these seeds",
        },
        "seed": {**SEED, "description": "seed of the study"},
        "streams": {
            **mapping(dict.fromkeys(("start", "world", "noise"), stream)),
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
    metrics = listed(reference("metric"))
    return mapping(
        {
            "metrics": metrics
            | {"description": "recorded of each trial; by default those of the model"},
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
    shapes = {"disc": mapping(disc, disc), "rectangle": mapping(rectangle, rectangle)}
    drawn: Schema = {
        "size": {
            "type": "array",
            "items": length,
            "minItems": 2,
            "maxItems": 2,
            "description": "[width, height]",
        },
        "shapes": {"type": "array", "items": mapping(shapes) | one_of(shapes)},
    }
    pictured: Schema = {
        "image": TEXT | {"description": "a file, whose dark pixels are occupied"},
        "resolution": length | {"description": "length of a pixel"},
    }
    ros: Schema = {"ros": TEXT | {"description": "a file of ROS's map_server"}}
    return [mapping(form, form) for form in (drawn, pictured, ros)]


def _forms() -> Schema:
    """How axes, their members and ranges are written, whatever the setting."""
    number: Schema = {"type": "number"}
    grid = {
        "type": "array",
        "items": [number, number, {"type": "integer", "minimum": 1}],
        "minItems": 3,
        "maxItems": 3,
        "description": "[first, last, number of values]",
    }
    pair = {"type": "array", "items": number, "minItems": 2, "maxItems": 2}
    # Without a title, the language server for YAML mistakes it for schemas like it.
    values: Schema = {"title": "list", "type": "array", "minItems": 1}
    ranges: Schema = {
        name: pair | {"description": _one_line(function.__doc__ or "")}
        for name, function in DISTRIBUTIONS.items()
    }
    grids = dict.fromkeys(GRIDS, reference("grid_values"))
    drawn = {name: reference(name) for name in DISTRIBUTIONS}
    narrow = {"allOf": [reference("distribution")], "properties": {"normal": False}}
    return {
        **ranges,
        "choice": reference("list"),
        "grid_values": grid,
        "points": whole(MOST_POINTS, "number of points"),
        "when": TEXT | {"description": "condition under which the axis applies"},
        "list": values | {"uniqueItems": True},
        "grid": mapping(grids) | one_of(grids),
        "distribution": mapping(drawn) | one_of(drawn),
        "axis": _axis(grids, drawn),
        "swept": {"anyOf": [reference("list"), reference("axis")]},
        "member": {"anyOf": [values, reference("grid")]},
        "parameter": narrow,
        "sampled": sampled(),
    }


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _axis(grids: Schema, drawn: Schema) -> Schema:
    """A mapping that makes the values of an axis; drawn ones need `points`."""
    ways = {"values": reference("list")} | grids | drawn
    rest = {"points": reference("points"), "when": reference("when")}
    needed: Schema = {name: ["points"] for name in drawn}
    together = {"dependencies": needed | {"points": one_of(drawn)}}
    return mapping(ways | rest) | one_of(ways) | together


def _built_in_maps() -> Schema:
    """Without maps of its own, a study has the built-in ones to choose from."""
    name = reference("built_in_map")
    swept = {"properties": {"map": {"if": {"type": "array"}, "then": {"items": name}}}}
    return {
        "if": {"not": {"required": ["maps"]}},
        "then": {
            "properties": {"fixed": {"properties": {"map": name}}, "sweep": swept}
        },
    }
