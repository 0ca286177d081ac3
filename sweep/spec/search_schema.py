"""The `search` section in the JSON Schema of a spec."""

from sweep.spec.schema_parts import (
    Schema,
    choices,
    mapping,
    named,
    one_of,
    reference,
)
from sweep.spec.statistics import STATISTICS


def ranges_schema() -> Schema:
    """Mappings by name, of which only the schema of a model can tell more."""
    return named({"type": "object"})


def objectives_schema() -> Schema:
    """The metrics to be made better, each in what direction and by what statistic."""
    statistics: Schema = dict.fromkeys(("minimize", "maximize"), reference("statistic"))
    return _columns(_one(statistics))


def constraints_schema() -> Schema:
    """The metrics that are bounded."""
    bounds: Schema = {"at_most": {"type": "number"}, "at_least": {"type": "number"}}
    with_statistic = bounds | {"statistic": reference("statistic")}
    return _columns(mapping(with_statistic) | one_of(bounds))


def model_schema(parameters: Schema, axes: Schema, settings: Schema) -> Schema:
    """What the section may hold for one model; each reference gives `settings`."""
    references = {"additionalProperties": settings}
    own = {"parameters": parameters, "over": axes, "references": references}
    return {"properties": own}


def statistic() -> Schema:
    """What a search takes of the values of a metric."""
    share = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
    known = STATISTICS.items()
    alone = {name: about for name, about in known if not about.takes_share}
    sharing: Schema = {
        name: share | {"description": about.text}
        for name, about in known
        if about.takes_share
    }
    return {"anyOf": [choices(alone), _one(sharing)]}


def _columns(item: Schema) -> Schema:
    return named(item, reference("column"))


def _one(properties: Schema) -> Schema:
    return mapping(properties) | one_of(properties)
