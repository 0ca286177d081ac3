"""JSON Schema of spec.yaml, from which editors complete names and show meanings.

The schema comes from the descriptions of the keys, see `sweep.spec.keys`. Only
`sweep.spec.study` checks rules for several values, such as expressions.
"""

import re
from collections.abc import Iterable, Mapping

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.metrics.parts import OF, has_parts
from kernels.model import WORKING
from sweep.spec.axes import GRIDS
from sweep.spec.axis_keys import CONTINUE, HOLD, POINTS, WHEN
from sweep.spec.derived_metrics import NAME
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.failure_policy import policy_dependencies
from sweep.spec.maps import shape_schema
from sweep.spec.recorded import MEAN, columns_of
from sweep.spec.recording import RECORDING
from sweep.spec.replication import replication_rules
from sweep.spec.samplers import SAMPLERS
from sweep.spec.sampling import Sampler
from sweep.spec.schema_parts import (
    OWN_CODE,
    OWN_CODE_FORM,
    Schema,
    any_of,
    mapping,
    one_of,
    reference,
)
from sweep.spec.schema_settings import each_design, kinds, of_model, sampled
from sweep.spec.study import sections, spec_schema, study_rules

NO_FILES: Mapping[str, str | None] = {}
"""Default of `files`: a spec without custom files."""


def json_schema(
    catalogue: Catalogue = BUILT_IN,
    files: Mapping[str, str | None] = NO_FILES,
    samplers: Mapping[str, Sampler] = SAMPLERS,
) -> Schema:
    """Return the schema, draft 07, as plain dicts and lists.

    Parameters
    ----------
    catalogue : Catalogue, optional
        Models, metrics, maps and starts by name; by default the built-in ones.
    files : mapping, optional
        The model of each custom file with known entries, None for a file without a
        model. Keys are the names of the files in the spec.
    samplers : mapping, optional
        Samplers that a sample may have.
    """
    own = {text: model for text, model in files.items() if model}
    models = [
        {"if": _is(text), "then": reference(f"{model}.spec")}
        for text, model in ({name: name for name in BUILT_IN.models} | own).items()
    ]
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "boidsweep study",
        **spec_schema(),
        **study_rules(),
        "dependencies": policy_dependencies()
        | {key: each.needs for key, each in sections().items() if each.needs},
        "allOf": [
            *models,
            _known_maps(files),
            _known_metrics(files),
            replication_rules(),
        ],
        "definitions": _definitions(catalogue, samplers),
    }


def _is(model: str) -> Schema:
    return {"properties": {"model": {"const": model}}, "required": ["model"]}


def _definitions(catalogue: Catalogue, samplers: Mapping[str, Sampler]) -> Schema:
    """Return the schemas to which references refer by name."""
    models = {
        name: part
        for model in catalogue.models
        for name, part in of_model(model, catalogue).items()
    }
    derived = {"type": "string", "pattern": f"^{NAME.pattern}$"}
    names = {
        "metric": {"anyOf": [reference("built_in_metric"), derived, OWN_CODE]},
        "column": {"anyOf": [reference("built_in_column"), derived]},
        "built_in_metric": {
            "anyOf": [{"enum": list(catalogue.metrics)}, reference("metric_of_part")]
        },
        "built_in_column": {
            "anyOf": [
                {"enum": columns_of(catalogue.metrics)},
                {"pattern": any_of([f"{_of_parts(catalogue)}({MEAN})?"])},
            ]
        },
        "metric_of_part": {"pattern": any_of([_of_parts(catalogue)])},
        "built_in_map": {"enum": list(catalogue.maps)},
    }
    names |= {"own_code": OWN_CODE_FORM, "shape": shape_schema()}
    by_section: Schema = {}
    for section in sections().values():
        by_section |= section.definitions()
    return by_section | names | _forms(samplers) | kinds(catalogue) | models


def _of_parts(catalogue: Catalogue) -> str:
    """Return the pattern of the metrics of a kind of boids, or of working boids."""
    names = [name for name, metric in catalogue.metrics.items() if has_parts(metric)]
    kinds = [kind for model in catalogue.models.values() for kind in model.kinds]
    parts = dict.fromkeys((*map(re.escape, kinds), WORKING))
    return f"({'|'.join(names)}){OF}({'|'.join(parts)})"


def _forms(samplers: Mapping[str, Sampler]) -> Schema:
    """Return the schemas of axes, members and ranges, for any parameter."""
    number: Schema = {"type": "number"}
    grid = {
        "type": "array",
        "items": [number, number, {"type": "integer", "minimum": 1}],
        "minItems": 3,
        "maxItems": 3,
        "description": "[first, last, number of values]",
    }
    pair = {"type": "array", "items": number, "minItems": 2, "maxItems": 2}
    # Without a title, the language server for YAML confuses it with similar schemas.
    values: Schema = {"title": "list", "type": "array", "minItems": 1}
    ranges: Schema = {
        name: reference("list")
        if distribution.kind == "listed"
        else pair | {"description": distribution.text}
        for name, distribution in DISTRIBUTIONS.items()
    }
    grids = dict.fromkeys(GRIDS, reference("grid_values"))
    drawn = {name: reference(name) for name in DISTRIBUTIONS}
    endless = [
        name for name, distribution in DISTRIBUTIONS.items() if not distribution.bounded
    ]
    narrow = {
        "allOf": [reference("distribution")],
        "properties": dict.fromkeys(endless, False),
    }
    return {
        **ranges,
        "grid_values": grid,
        "points": POINTS.schema(),
        "when": WHEN.schema(),
        "list": values | {"uniqueItems": True},
        "grid": mapping(grids) | one_of(grids),
        "distribution": mapping(drawn) | one_of(drawn),
        "axis": _axis(grids, drawn),
        "swept": {"anyOf": [reference("list"), reference("axis")]},
        "member": {"anyOf": [values, reference("grid")]},
        "parameter": narrow,
        "sampled": sampled(samplers),
    }


def _axis(grids: Schema, drawn: Schema) -> Schema:
    """Return the schema of a mapping for an axis; drawn values need `points`."""
    ways = {"values": reference("list")} | grids | drawn
    rest = {"points": reference("points"), "when": reference("when")}
    rest |= {key.name: key.schema() for key in (CONTINUE, HOLD)}
    needed: Schema = {name: ["points"] for name in drawn}
    needed |= {
        HOLD.name: [CONTINUE.name],
        CONTINUE.name: {"not": {"required": ["when"]}},
    }
    together = {"dependencies": needed | {"points": one_of(drawn)}}
    return mapping(ways | rest) | one_of(ways) | together


def _other_code(files: Iterable[str]) -> Schema:
    """Return the schema of custom code outside of some files."""
    return {"allOf": [OWN_CODE, {"not": {"enum": list(files)}}]} if files else OWN_CODE


def _other_model(files: Iterable[str]) -> Schema:
    """Return the schema of a study with entries that the schema does not know.

    The entries are those of custom code outside of some files, and the kinds of
    individuals of a recording.
    """
    other = {"properties": {"model": _other_code(files)}, "required": ["model"]}
    return {"anyOf": [other, {"required": [RECORDING]}]}


def _known_maps(files: Iterable[str]) -> Schema:
    """Return the rule that a study without custom maps names known maps."""
    name = {"anyOf": [reference("built_in_map"), OWN_CODE]}
    swept = {"properties": {"map": {"if": {"type": "array"}, "then": {"items": name}}}}
    return {
        "if": {"not": {"anyOf": [{"required": ["maps"]}, _other_model(files)]}},
        "then": {
            "properties": {
                "fixed": {"properties": {"map": name}},
                "sweep": each_design(swept),
            }
        },
    }


def _known_metrics(files: Iterable[str]) -> Schema:
    """Return the rule that a study names known metrics.

    The rule does not apply if the study derives metrics, or names a further file, which
    may define metrics.
    """
    lists = [
        {"properties": {name: {"contains": _other_code(files)}}, "required": [name]}
        for name in ("metrics", "series")
    ]
    more = {"anyOf": [{"required": ["derive"]}, *lists]}
    adding = {"properties": {"record": more}, "required": ["record"]}
    names = {"items": {"anyOf": [reference("built_in_metric"), OWN_CODE]}}
    columns = {"propertyNames": reference("built_in_column")}
    record = dict.fromkeys(("metrics", "series"), names)
    by_section = {
        key: {"properties": dict.fromkeys(section.columns_under, columns)}
        for key, section in sections().items()
        if section.columns_under
    }
    return {
        "if": {"not": {"anyOf": [adding, _other_model(files)]}},
        "then": {
            "properties": {
                "record": {"properties": record},
                **by_section,
            }
        },
    }
