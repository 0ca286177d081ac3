"""Keys of a spec, each described once, at the field of the value.

A section of a spec is a dataclass. The fields are the keys, each annotated with a
`Key`:

    every: Annotated[int, Key(Whole(1), "number of steps between frames")] = 1

The reader (`read_section`), the JSON Schema (`section_schema`), the writer of specs
(`written`) and the table of docs/keys.md (`sweep.spec.key_table`) come from the fields.
A field without a default is a required key, unless the `Key` has `otherwise`. Rules for
several keys together are checked next to the class.
"""

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from functools import cache
from typing import Any, TypeVar, get_args, get_type_hints

from sweep.spec.contents import Content
from sweep.spec.document import NONE_GONE, Entry
from sweep.spec.mistakes import Mistakes
from sweep.spec.schema_parts import Schema, mapping

T = TypeVar("T")

NOTHING: Any = object()
"""Marks a missing default, since None may be a default."""


@dataclass(frozen=True)
class Key:
    """A key of a section, with content and meaning.

    Attributes
    ----------
    content : Content
        The allowed values of the key.
    text : str
        The meaning, for documents and editors.
    name : str, default ""
        The key, if the key differs from the name of the field.
    otherwise : str, optional
        The default in words, if it differs from the default of the field.
    example : str, default ""
        A value in YAML.
    field : str
        The field of the dataclass, entered by `keys_of`.
    default : object
        The default of the field, or NOTHING, entered by `keys_of`.
    """

    content: Content[Any]
    text: str
    name: str = ""
    otherwise: str | None = None
    example: str = ""
    field: str = ""
    default: Any = NOTHING

    @property
    def required(self) -> bool:
        """True if the spec must have the key."""
        return self.otherwise is None and self.default is NOTHING

    @property
    def fallback(self) -> str:
        """The default in words; "" if the key is required."""
        if self.otherwise is not None:
            return self.otherwise
        return "" if self.required else _plain(self.content.write(self.default))

    def schema(self) -> Schema:
        """Return the JSON Schema of the key, with its text for editors."""
        default = f"; by default {self.fallback}" if self.fallback else ""
        example = f"; for example {self.example}" if self.example else ""
        return self.content.schema() | {"description": self.text + default + example}


@dataclass(frozen=True)
class SectionOf(Content[Any]):
    """A mapping whose keys are the fields of a dataclass, `part`."""

    part: type[Any]

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return "a mapping"

    def read(self, entry: Entry) -> Any:
        """Return the dataclass of an entry. Raises SpecError."""
        return read_section(self.part, entry)

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        return section_schema(self.part)

    def write(self, value: Any) -> Any:
        """Return a section as a mapping, without default values."""
        return differing(value)

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """The classes whose keys may appear below this key."""
        return (self.part,)


class LaterSectionOf(SectionOf):
    """A section whose reader also needs the values of further keys."""

    def read(self, entry: Entry) -> Entry:
        """Return the entry unchanged, for a special reader."""
        return entry


def keys_of(*parts: type[Any] | Key) -> tuple[Key, ...]:
    """Return the keys that the fields of dataclasses describe, in order.

    A part may also be a key.
    """
    return _keys_of(parts)


@cache
def _keys_of(parts: tuple[type[Any] | Key, ...]) -> tuple[Key, ...]:
    return tuple(key for part in parts for key in _keys_of_part(part))


def _keys_of_part(part: type[Any] | Key) -> Iterator[Key]:
    if isinstance(part, Key):
        yield part
        return
    hints = get_type_hints(part, include_extras=True)
    for field in fields(part):
        default = NOTHING if field.default is MISSING else field.default
        for key in get_args(hints[field.name])[1:]:
            if isinstance(key, Key):
                name = key.name or field.name
                yield replace(key, name=name, field=field.name, default=default)


def check_keys(
    entry: Entry, *parts: type[Any] | Key, gone: Mapping[str, str] = NONE_GONE
) -> None:
    """Raise SpecError unless an entry is a mapping with the right keys.

    Allowed keys are the keys of `parts`. All required keys must be present. `gone` has
    the reasons for the removal of keys of earlier versions.
    """
    keys = keys_of(*parts)
    required = [key.name for key in keys if key.required]
    entry.keys([key.name for key in keys], required=required, gone=gone)


def check_beside(root: Entry, key: str, barred: Mapping[str, str]) -> None:
    """Raise SpecError for keys of a spec that another key excludes.

    Parameters
    ----------
    root : Entry
        The whole spec.
    key : str
        The key that the spec has.
    barred : mapping
        The reason, or "", by excluded key. All mistakes are reported together.
    """
    mistakes = Mistakes()
    for name, why in barred.items():
        with mistakes.noted():
            if other := root.get(name):
                reason = f": {why}" if why else ""
                raise other.error(f'a study with "{key}" takes no "{name}"{reason}')
    mistakes.check()


def read_section(part: type[T], entry: Entry | None, **otherwise: Any) -> T:
    """Return the dataclass of an entry. Raises SpecError.

    `otherwise` has values by field that replace the defaults of missing keys.
    """
    if entry is None:
        return part(**otherwise)
    entry.mapping()
    mistakes = Mistakes()
    with mistakes.noted():
        check_keys(entry, part)
    values = _written_values(part, entry, mistakes)
    mistakes.check()
    return part(**(otherwise | values))


def read_values(part: type[Any], entry: Entry, mistakes: Mistakes) -> dict[str, Any]:
    """Return the values that a mapping gives, by field.

    Parameters
    ----------
    part : type
        Dataclass of the section.
    entry : Entry
        Must be a mapping.
    mistakes : Mistakes
        Collects the errors. A wrong key has no value.

    Returns
    -------
    dict
        Includes the defaults of missing keys.
    """
    keys = keys_of(part)
    defaults = {key.field: key.default for key in keys if key.default is not NOTHING}
    return defaults | _written_values(part, entry, mistakes)


def _written_values(
    part: type[Any], entry: Entry, mistakes: Mistakes
) -> dict[str, Any]:
    values = {}
    for key in keys_of(part):
        if key.name in entry.value:
            with mistakes.noted():
                values[key.field] = key.content.read(entry.child(key.name))
    return values


def section_schema(*parts: type[Any] | Key) -> Schema:
    """Return the JSON Schema of a mapping with the keys of the parts."""
    keys = keys_of(*parts)
    properties = {key.name: key.schema() for key in keys}
    return mapping(properties, [key.name for key in keys if key.required])


def written(values: Mapping[str, Any], *parts: type[Any] | Key) -> dict[str, Any]:
    """Return a mapping of a spec from values by key, in the order of the keys.

    All keys of `values` are keys of `parts`.
    """
    keys = {key.name: key for key in keys_of(*parts)}
    assert values.keys() <= keys.keys(), sorted(values.keys() - keys.keys())
    return {
        name: key.content.write(values[name])
        for name, key in keys.items()
        if name in values
    }


def differing(section: Any) -> dict[str, Any]:
    """Return a mapping that reads as a section, without default values."""
    values = [(key, getattr(section, key.field)) for key in keys_of(type(section))]
    changed = {key.name: value for key, value in values if value != key.default}
    return written(changed, type(section))


def _plain(value: Any) -> str:
    """Return a default in the form of a spec; "" for None, which a spec cannot have."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}"
    return "" if value is None else str(value)
