"""Keys of a spec, each described once, beside the field that holds its value.

A section of a spec is a dataclass. Its fields are the keys, each annotated with a
`Key`:

    every: Annotated[int, Key(Whole(1), "number of steps between frames")] = 1

The reader (`read_section`), the JSON Schema (`section_schema`), the writer of specs
(`written`) and the table of docs/keys.md (`sweep.spec.key_table`) come from the fields.
A field without a default is a required key, unless its `Key` says what holds
`otherwise`. Rules for several keys together are checked beside the class.
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
    """A key of a section: its content and its meaning.

    Attributes
    ----------
    content
        The values that the key may have.
    text
        The meaning, for documents and editors.
    name
        The key, if it is not the name of the field.
    otherwise
        In words, what holds without the key, if the default of the field does not.
    example
        A value in YAML.
    field
        The field of the dataclass. `keys_of` enters it.
    default
        The default of the field, or NOTHING. `keys_of` enters it.
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
        """In words, what holds without the key.

        "" if the key is required.
        """
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
        """The allowed values, in words."""
        return "a mapping"

    def read(self, entry: Entry) -> Any:
        """Return the dataclass that an entry writes. Raises SpecError."""
        return read_section(self.part, entry)

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        return section_schema(self.part)

    def write(self, value: Any) -> Any:
        """Return a section as a mapping, without its defaults."""
        return differing(value)

    @property
    def sections(self) -> tuple[type[Any], ...]:
        """The classes whose keys may appear below this one."""
        return (self.part,)


class LaterSectionOf(SectionOf):
    """A section whose reader must know other keys."""

    def read(self, entry: Entry) -> Entry:
        """Return the entry as it is, for its own reader."""
        return entry


def keys_of(*parts: type[Any] | Key) -> tuple[Key, ...]:
    """Return the keys that the fields of dataclasses describe, in their order.

    A part may be a key itself.
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

    The keys are those of `parts` and no others, and all required ones. `gone` tells for
    keys of earlier versions why they were removed.
    """
    keys = keys_of(*parts)
    required = [key.name for key in keys if key.required]
    entry.keys([key.name for key in keys], required=required, gone=gone)


def check_beside(root: Entry, key: str, barred: Mapping[str, str]) -> None:
    """Raise SpecError for keys of a spec that cannot appear beside another key.

    Parameters
    ----------
    root : Entry
        The whole spec.
    key : str
        The key that the spec has.
    barred : mapping
        The reason, or "", by key that cannot appear beside it. All mistakes are
        reported together.
    """
    mistakes = Mistakes()
    for name, why in barred.items():
        with mistakes.noted():
            if other := root.get(name):
                reason = f": {why}" if why else ""
                raise other.error(f'a study with "{key}" takes no "{name}"{reason}')
    mistakes.check()


def read_section(part: type[T], entry: Entry | None, **otherwise: Any) -> T:
    """Return the dataclass that an entry writes. Raises SpecError.

    `otherwise` has values by field for keys that are left out, instead of the defaults.
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
        Errors are noted here. A wrong key has no value.

    Returns
    -------
    dict
        With the defaults of keys that are left out, if they have one.
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
    """Return the JSON Schema of a mapping with the keys of these parts."""
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
    """Return a mapping that reads as a section, without its defaults."""
    values = [(key, getattr(section, key.field)) for key in keys_of(type(section))]
    changed = {key.name: value for key, value in values if value != key.default}
    return written(changed, type(section))


def _plain(value: Any) -> str:
    """Return a default as a spec writes it.

    "" for None, which a spec cannot write.
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}"
    return "" if value is None else str(value)
