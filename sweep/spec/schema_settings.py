"""Parameters of models in the JSON Schema of a spec, each defined once.

Parameters of all models share a few kinds, such as "a number from 0". The schema has
three separate parts:

- the values that a kind allows, for a single value and for several values
- the forms of axes, in `sweep.spec.schema`
- the meaning of each parameter of a model

The schema of a `sweep` or a `zip` combines the three parts.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from kernels.catalogue import Catalogue
from sweep.spec.axis_keys import ABLATE, LEAVE_OUT, POINTS
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.maps import MAP_NAME
from sweep.spec.point_tables import TABLE
from sweep.spec.samplers import SAMPLERS
from sweep.spec.sampling import Sampler
from sweep.spec.schema_parts import (
    OWN_CODE,
    TEXT,
    Schema,
    any_of,
    choices,
    listed,
    mapping,
    named,
    reference,
)
from sweep.spec.section import ModelSchemas
from sweep.spec.settings import (
    MOST_PLACE,
    MOST_PLACES,
    Setting,
    Value,
    settings_of,
    usual_settings,
)
from sweep.spec.study import sections

ON_CONDITION: Schema = {"when": reference("when")}
Presets = Mapping[str, Mapping[str, Value]]
NUMBER = {"type": "number", "minimum": -MOST_PLACE, "maximum": MOST_PLACE}
PLACE = {"type": "array", "items": NUMBER, "minItems": 2, "maxItems": 2}
PLACES: Schema = {"type": "array", "items": PLACE, "maxItems": MOST_PLACES}
IN_A_LINE = r"^ *([^ ;]+ +[^ ;]+ *(; *[^ ;]+ +[^ ;]+ *)*)?$"
TYPES = {"float": "number", "int": "integer", "bool": "boolean"}


def kinds(catalogue: Catalogue) -> Schema:
    """Return the schema of a value of each kind of parameter, by name of the kind.

    The name with the prefix `each.` has the schema of several values.
    """
    settings = [
        setting
        for model in catalogue.models
        for setting in settings_of(model, catalogue).of_study(()).values()
    ]
    every = {_kind(setting): setting for setting in settings}
    several = {f"each.{kind}": _each(reference(kind)) for kind in every}
    return {kind: _value(setting) for kind, setting in every.items()} | several


def _kind(setting: Setting) -> str:
    """Return the name of the allowed values of a parameter, without the unit."""
    if setting.name == "map" or setting.kind == "places":
        return "map" if setting.name == "map" else setting.kind
    return replace(setting, unit="").allowed().replace(" ", "_")


def _value(setting: Setting) -> Schema:
    if setting.name == "map":
        own = {"type": "string", "pattern": f"^{MAP_NAME.pattern}$"}
        return {"anyOf": [reference("built_in_map"), own, OWN_CODE]}
    if setting.name == "start_draws":
        return {"anyOf": [{"enum": list(setting.choices)}, OWN_CODE]}
    if setting.kind == "choice":
        return {"enum": list(setting.choices)}
    if setting.kind == "places":
        return {"anyOf": [PLACES, {"type": "string", "pattern": IN_A_LINE}]}
    schema: Schema = {"type": TYPES[setting.kind]}
    if setting.low > -math.inf:
        schema["exclusiveMinimum" if setting.exclusive else "minimum"] = setting.low
    if setting.high < math.inf:
        schema["maximum"] = setting.high
    return schema


def _each(value: Schema) -> Schema:
    """Return the schema of values in a list, or in an axis with a list."""
    items = {"items": value}
    lists = [name for name, each in DISTRIBUTIONS.items() if each.kind == "listed"]
    return items | {"patternProperties": {any_of(["values", *lists]): items}}


def of_model(model: str, catalogue: Catalogue) -> Schema:
    """Return the definitions of a model: parameters, axes, and additions to a spec."""
    settings = settings_of(model, catalogue).of_study(())
    presets = {
        name: usual_settings(model, name, catalogue)
        for name in catalogue.models[model].presets
    }
    values = {name: reference(_kind(setting)) for name, setting in settings.items()}
    texts = {
        name: {"description": _text(setting, presets)}
        for name, setting in settings.items()
    }
    not_derived = {"properties": {"map": texts.pop("map")}}
    description = {"allOf": [reference(f"{model}.about")]}
    return {
        f"{model}.derived": {"properties": texts},
        f"{model}.about": not_derived | {"allOf": [reference(f"{model}.derived")]},
        f"{model}.settings": mapping(values) | description,
        f"{model}.each": {"patternProperties": dict(_by_kind(settings))} | description,
        f"{model}.sweep": _swept(model, settings, presets),
        f"{model}.spec": _spec(model, settings, presets),
    }


def _by_kind(settings: Mapping[str, Setting]) -> Iterator[tuple[str, Schema]]:
    """Yield the pattern of the parameters and the rule of the values of each kind."""
    names = defaultdict[str, list[str]](list)
    for name, setting in settings.items():
        names[_kind(setting)].append(name)
    for kind, alike in names.items():
        yield any_of(alike), reference(f"each.{kind}")


def _text(setting: Setting, presets: Presets) -> str:
    """Return the text of a parameter for editors: meaning, unit, values of presets."""
    if setting.spread_of:  # 0 in all presets
        return f"{setting.text}."
    values = [f"{name}: {preset[setting.name]}" for name, preset in presets.items()]
    unit = f" ({setting.unit})" if setting.unit else ""
    return f"{setting.text}{unit}. {', '.join(values)}"


def _spec(model: str, names: Iterable[str], presets: Iterable[str]) -> Schema:
    settings = reference(f"{model}.settings")
    axes = reference(f"{model}.sweep")
    derived = [name for name in names if name != "map"]
    properties = {
        "preset": {"enum": list(presets)},
        "fixed": settings,
        "sweep": each_design(axes),
        "derive": _named(derived, TEXT) | {"allOf": [reference(f"{model}.derived")]},
    }
    forms = ModelSchemas(
        ranges=_written(model, names, "parameter"),
        axes=axes,
        values=settings,
        drawn={
            "additionalProperties": reference("distribution"),
            "allOf": [reference(f"{model}.each")],
        },
        names=list(names),
    )
    by_section = {
        key: section.model_schema(forms)
        for key, section in sections().items()
        if section.model_schema
    }
    return {"properties": properties | by_section}


def each_design(design: Schema) -> Schema:
    """Return the rule of a design under `sweep`, or of each design in a list."""
    return {"if": {"type": "array"}, "then": {"items": design}, "else": design}


def _named(names: Iterable[str], value: Schema, keys: Iterable[str] = ()) -> Schema:
    """Return the schema of a mapping, not empty, from some names or from `keys`."""
    patterns = {"patternProperties": {any_of(names): value}}
    return mapping(dict.fromkeys(keys, True)) | patterns


def _written(model: str, names: Iterable[str], form: str) -> Schema:
    """Return the schema of parameters of the model, each written in one form."""
    each = {"allOf": [reference(f"{model}.each")]}
    return _named(names, reference(form)) | each


def _swept(model: str, names: Iterable[str], presets: Iterable[str]) -> Schema:
    """Return the schema of the axes of a study.

    An axis of one parameter has the name of the parameter. An axis of several
    parameters has a free name.
    """
    joint = [
        _sampled(model, names),
        _table(names),
        _zipped(model, names),
        _ablation(model, presets),
    ]
    return _written(model, names, "swept") | {"additionalProperties": {"anyOf": joint}}


def _sampled(model: str, names: Iterable[str]) -> Schema:
    parts = [reference("sampled"), reference(f"{model}.each")]
    return _named(names, reference("distribution"), _sampled_keys()) | {"allOf": parts}


def _table(names: Iterable[str]) -> Schema:
    columns = {"anyOf": [listed({"enum": list(names)}), _named(names, TEXT)]}
    table = {"sample": {"const": TABLE}, "file": TEXT, "columns": columns}
    return mapping(table | ON_CONDITION, ["sample", "file"])


def _zipped(model: str, names: Iterable[str]) -> Schema:
    return mapping({"zip": _written(model, names, "member")} | ON_CONDITION, ["zip"])


def _ablation(model: str, presets: Iterable[str]) -> Schema:
    """Return the schema of an ablation axis: a second preset, or named components."""
    details = named(reference(f"{model}.settings"))
    other = {
        "anyOf": [{"enum": list(presets)}, details],
        "description": ABLATE.text,
    }
    left_out = {LEAVE_OUT.name: LEAVE_OUT.content.schema()}
    return mapping({ABLATE.name: other} | left_out | ON_CONDITION, [ABLATE.name])


def sampled(samplers: Mapping[str, Sampler]) -> Schema:
    """Return the schema of a joint axis drawn by a sampler.

    Some keys belong only to some samplers.
    """
    none = {key: False for key in _sampled_keys() if key not in SAMPLED}
    plain = [name for name, sampler in samplers.items() if not sampler.blocks]
    forms: list[Schema] = [{"sample": {"enum": plain}} | none, {"sample": OWN_CODE}]
    for name, sampler in samplers.items():
        if sampler.blocks:
            own = {key.name: True for key in sampler.blocks.options}
            whole_blocks = {"points": {"minimum": 2}, "when": False}
            forms.append(none | whole_blocks | {"sample": {"const": name}} | own)
    sample: Schema = {"sample": {"anyOf": [choices(samplers), OWN_CODE]}}
    return {
        "properties": _sampled_keys() | sample,
        "required": ["sample", "points"],
        "anyOf": [{"properties": properties} for properties in forms],
    }


SAMPLED = ("sample", "points", *ON_CONDITION)


def _sampled_keys() -> Schema:
    """Return the schemas of the keys of a sampled axis, without the parameters."""
    rules = [sampler.blocks for sampler in SAMPLERS.values() if sampler.blocks]
    own = {key.name: key.schema() for blocks in rules for key in blocks.options}
    keys = {"sample": TEXT, "points": POINTS.schema()}
    return keys | ON_CONDITION | own
