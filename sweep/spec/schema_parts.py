"""Parts of a JSON Schema of draft 07, the latest draft that many editors know.

Draft 07 ignores all keys next to a `$ref`. A reference with further keys therefore
needs an `allOf`. Names in `patternProperties` are only checked. Editors also suggest
names in `properties`.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

Schema = dict[str, Any]

TEXT: Schema = {"type": "string"}


class Described(Protocol):
    """An entry of a registry with a description."""

    @property
    def text(self) -> str:
        """Description of the entry."""


def reference(name: str) -> Schema:
    """Return a reference to the definition of a name."""
    return {"$ref": f"#/definitions/{name}"}


OWN_CODE_FORM: Schema = {
    "type": "string",
    "pattern": r"^(\.{1,2}/.+\.py(:\w+)?|[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:\w+)$",
    "description": "a file next to the spec, ./FILE.py or ./FILE.py:NAME, or a module"
    " of an installed package, PACKAGE.MODULE:NAME",
}
OWN_CODE = reference("own_code")
"""Custom code instead of a name: code that defines an entry."""


def mapping(properties: Mapping[str, Any], required: Iterable[str] = ()) -> Schema:
    """Return the schema of a mapping, not empty, with only the given keys."""
    must = {"required": list(required)} if required else {}
    keys = {"properties": dict(properties)} if properties else {}
    closed = {"additionalProperties": False, "minProperties": 1}
    return {"type": "object", **keys, **must, **closed}


def named(value: Schema, names: Schema | None = None) -> Schema:
    """Return the schema of a mapping, not empty, from names to values."""
    only = {"propertyNames": names} if names else {}
    return {"type": "object", **only, "additionalProperties": value, "minProperties": 1}


def listed(items: Schema) -> Schema:
    """Return the schema of a list, not empty, without equal items."""
    return {"type": "array", "items": items, "minItems": 1, "uniqueItems": True}


def one_of(keys: Iterable[str]) -> Schema:
    """Return the schema of a mapping with exactly one of the keys."""
    return {"oneOf": [{"required": [key]} for key in keys]}


def choices(entries: Mapping[str, Described]) -> Schema:
    """Return the schema of a name of an entry, with the texts of the entries."""
    return {
        "oneOf": [
            {"const": name, "description": entry.text}
            for name, entry in entries.items()
        ]
    }


def any_of(names: Iterable[str]) -> str:
    """Return the pattern that matches the names."""
    return f"^({'|'.join(names)})$"
