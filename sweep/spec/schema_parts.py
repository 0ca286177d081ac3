"""Parts of a JSON Schema of draft 07: many editors know no later draft.

In draft 07 all keys beside a `$ref` are ignored. A reference and other keys therefore
go into an `allOf`. Names in `patternProperties` are checked; editors suggest names in
`properties` too.
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
    "description": "a file beside the spec, ./FILE.py or ./FILE.py:NAME, or a module of"
    " an installed package, PACKAGE.MODULE:NAME",
}
OWN_CODE = reference("own_code")
"""Custom code in the place of a name: code that offers an entry."""


def mapping(properties: Mapping[str, Any], required: Iterable[str] = ()) -> Schema:
    """Return the schema of a mapping, not empty, with these keys and no others."""
    must = {"required": list(required)} if required else {}
    keys = {"properties": dict(properties)} if properties else {}
    closed = {"additionalProperties": False, "minProperties": 1}
    return {"type": "object", **keys, **must, **closed}


def named(value: Schema, names: Schema | None = None) -> Schema:
    """Return the schema of a mapping, not empty, from names to such values."""
    only = {"propertyNames": names} if names else {}
    return {"type": "object", **only, "additionalProperties": value, "minProperties": 1}


def listed(items: Schema) -> Schema:
    """Return the schema of a list, not empty, without equal items."""
    return {"type": "array", "items": items, "minItems": 1, "uniqueItems": True}


def one_of(keys: Iterable[str]) -> Schema:
    """Return the schema of a mapping with exactly one of these keys."""
    return {"oneOf": [{"required": [key]} for key in keys]}


def choices(entries: Mapping[str, Described]) -> Schema:
    """Return the schema of a name of an entry, with the text of each."""
    return {
        "oneOf": [
            {"const": name, "description": entry.text}
            for name, entry in entries.items()
        ]
    }


def any_of(names: Iterable[str]) -> str:
    """Return the pattern that matches these names."""
    return f"^({'|'.join(names)})$"
