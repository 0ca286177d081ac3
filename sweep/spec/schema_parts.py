"""The parts of a JSON Schema, of draft 07: many editors know no later one.

In that draft all that stands beside a `$ref` is ignored. So both go into an `allOf`.
Names in `patternProperties` are checked; those in `properties` are suggested, too.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

Schema = dict[str, Any]

TEXT: Schema = {"type": "string"}


class Described(Protocol):
    """An entry of a registry, which says what it is."""

    @property
    def text(self) -> str: ...


def reference(name: str) -> Schema:
    """The schema of that name among the definitions."""
    return {"$ref": f"#/definitions/{name}"}


OWN_CODE_FORM: Schema = {
    "type": "string",
    "pattern": r"^(\.{1,2}/.+\.py(:\w+)?|[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:\w+)$",
    "description": "a file beside the spec, ./FILE.py or ./FILE.py:NAME, or a module of"
    " an installed package, PACKAGE.MODULE:NAME",
}
OWN_CODE = reference("own_code")
"""In the place of a name: code of the user's own that offers it."""


def mapping(properties: Mapping[str, Any], required: Iterable[str] = ()) -> Schema:
    """A mapping that is not empty, with these keys and no others."""
    must = {"required": list(required)} if required else {}
    keys = {"properties": dict(properties)} if properties else {}
    closed = {"additionalProperties": False, "minProperties": 1}
    return {"type": "object", **keys, **must, **closed}


def named(value: Schema, names: Schema | None = None) -> Schema:
    """A mapping that is not empty, from names to such values."""
    only = {"propertyNames": names} if names else {}
    return {"type": "object", **only, "additionalProperties": value, "minProperties": 1}


def listed(items: Schema) -> Schema:
    """A list that is not empty, of items none of which stands twice."""
    return {"type": "array", "items": items, "minItems": 1, "uniqueItems": True}


def one_of(keys: Iterable[str]) -> Schema:
    """A mapping with exactly one of these keys."""
    return {"oneOf": [{"required": [key]} for key in keys]}


def choices(entries: Mapping[str, Described]) -> Schema:
    """One of the names of these entries, each with its text."""
    return {
        "oneOf": [
            {"const": name, "description": entry.text}
            for name, entry in entries.items()
        ]
    }


def any_of(names: Iterable[str]) -> str:
    """The pattern of these names."""
    return f"^({'|'.join(names)})$"
