"""The `search` section in the JSON Schema of a spec."""

from sweep.methods.search.statistics import STATISTICS
from sweep.spec import (
    ModelSchemas,
    Schema,
    choices,
    mapping,
    named,
    one_of,
    reference,
)


def ranges_schema() -> Schema:
    """Return the schema of mappings by name; a schema of a model narrows it."""
    return named({"type": "object"})


def objectives_schema() -> Schema:
    """Return the schema of objectives, each with direction and statistic."""
    statistics: Schema = dict.fromkeys(("minimize", "maximize"), reference("statistic"))
    return _columns(_one(statistics))


def constraints_schema() -> Schema:
    """Return the schema of the metrics with bounds."""
    bounds: Schema = {"at_most": {"type": "number"}, "at_least": {"type": "number"}}
    with_statistic = bounds | {"statistic": reference("statistic")}
    return _columns(mapping(with_statistic) | one_of(bounds))


def model_schema(forms: ModelSchemas) -> Schema:
    """Return the schema of the section for a model."""
    references = {"additionalProperties": forms.values}
    own = {
        "parameters": forms.ranges,
        "over": forms.axes,
        "references": references,
    }
    return {"properties": own}


def definitions() -> Schema:
    """Return the schema of a statistic of the values of a metric, by name."""
    share = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
    statistics = STATISTICS.items()
    alone = {name: entry for name, entry in statistics if not entry.takes_share}
    sharing: Schema = {
        name: share | {"description": entry.text}
        for name, entry in statistics
        if entry.takes_share
    }
    return {"statistic": {"anyOf": [choices(alone), _one(sharing)]}}


def _columns(item: Schema) -> Schema:
    return named(item, reference("column"))


def _one(properties: Schema) -> Schema:
    return mapping(properties) | one_of(properties)
