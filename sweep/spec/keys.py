"""The keys of a spec: each is described once, where its value is kept.

A part of a spec is a dataclass. Its fields are the keys, each annotated with a `Key`:

    every: Annotated[int, Key(Whole(1), "number of steps between frames")] = 1

From that come the reader (`read_section`), the JSON Schema (`section_schema`), what
writes specs (`written`) and the table of docs/keys.md (`sweep.spec.key_table`). A field
without a default is a key that must be given, unless its `Key` says what holds
`otherwise`. What several keys must fulfil together is checked beside the class.
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
"""Stands where there is no default: None may be one."""


@dataclass(frozen=True)
class Key:
    """What may stand under a key, and what it means.

    `name` is the key, where it is not the name of the field. `otherwise` says in words
    what holds without the key, where the default of the field does not. `example` is a
    value in YAML. `field` and `default` are those of the dataclass: `keys_of` enters
    them.
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
        """Whether the key must be given."""
        return self.otherwise is None and self.default is NOTHING

    @property
    def fallback(self) -> str:
        """What holds without the key, in words; nothing where it must be given."""
        if self.otherwise is not None:
            return self.otherwise
        return "" if self.required else _plain(self.content.write(self.default))

    def schema(self) -> Schema:
        """What may stand under the key, with its text for editors."""
        default = f"; by default {self.fallback}" if self.fallback else ""
        example = f"; for example {self.example}" if self.example else ""
        return self.content.schema() | {"description": self.text + default + example}


@dataclass(frozen=True)
class SectionOf(Content[Any]):
    """A mapping whose keys are the fields of a dataclass, `part`."""

    part: type[Any]

    @property
    def words(self) -> str:
        return "a mapping"

    def read(self, entry: Entry) -> Any:
        return read_section(self.part, entry)

    def schema(self) -> Schema:
        return section_schema(self.part)

    def write(self, value: Any) -> Any:
        return differing(value)

    @property
    def sections(self) -> tuple[type[Any], ...]:
        return (self.part,)


class LaterSectionOf(SectionOf):
    """A section whose reader must know other keys. Reading gives on the entry."""

    def read(self, entry: Entry) -> Entry:
        return entry


def keys_of(*parts: type[Any] | Key) -> tuple[Key, ...]:
    """The keys that the fields of some dataclasses describe, in their order; a part may
    be a key itself.
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
    """Raise SpecError unless `entry` is a mapping with keys of these parts only, and
    with those that must be given; `gone` says of keys of earlier versions why there are
    none any more.
    """
    keys = keys_of(*parts)
    required = [key.name for key in keys if key.required]
    entry.keys([key.name for key in keys], required=required, gone=gone)


def check_beside(root: Entry, key: str, barred: Mapping[str, str]) -> None:
    """Raise SpecError for all keys of a spec that cannot stand in it beside `key`;
    `barred` has them, each with the reason, "" where none is said.
    """
    mistakes = Mistakes()
    for name, why in barred.items():
        with mistakes.noted():
            if other := root.get(name):
                reason = f": {why}" if why else ""
                raise other.error(f'a study with "{key}" takes no "{name}"{reason}')
    mistakes.check()


def read_section(part: type[T], entry: Entry | None, **otherwise: Any) -> T:
    """The dataclass `part` that `entry` writes; `otherwise` gives by field what holds
    for keys that are left out, where that is not the default. Raises SpecError.
    """
    if entry is None:
        return part(**otherwise)
    entry.mapping()
    mistakes = Mistakes()
    with mistakes.noted():
        check_keys(entry, part)
    given = _given(part, entry, mistakes)
    mistakes.check()
    return part(**(otherwise | given))


def read_values(part: type[Any], entry: Entry, mistakes: Mistakes) -> dict[str, Any]:
    """The values that the mapping `entry` gives, by the fields of `part`; defaults for
    keys that are left out, where there are any. What is wrong is noted in `mistakes`,
    and has no value.
    """
    keys = keys_of(part)
    defaults = {key.field: key.default for key in keys if key.default is not NOTHING}
    return defaults | _given(part, entry, mistakes)


def _given(part: type[Any], entry: Entry, mistakes: Mistakes) -> dict[str, Any]:
    given = {}
    for key in keys_of(part):
        if key.name in entry.value:
            with mistakes.noted():
                given[key.field] = key.content.read(entry.child(key.name))
    return given


def section_schema(*parts: type[Any] | Key) -> Schema:
    """The JSON Schema of a mapping with the keys of these parts."""
    keys = keys_of(*parts)
    properties = {key.name: key.schema() for key in keys}
    return mapping(properties, [key.name for key in keys if key.required])


def written(values: Mapping[str, Any], *parts: type[Any] | Key) -> dict[str, Any]:
    """A mapping of a spec with these values by key, in the order of the parts' keys."""
    keys = {key.name: key for key in keys_of(*parts)}
    assert values.keys() <= keys.keys(), sorted(values.keys() - keys.keys())
    return {
        name: key.content.write(values[name])
        for name, key in keys.items()
        if name in values
    }


def differing(section: Any) -> dict[str, Any]:
    """A mapping of a spec that reads as `section`, without what is so by default."""
    values = [(key, getattr(section, key.field)) for key in keys_of(type(section))]
    changed = {key.name: value for key, value in values if value != key.default}
    return written(changed, type(section))


def _plain(value: Any) -> str:
    """A default as a spec has it; nothing for what a spec cannot say."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:g}"
    return "" if value is None else str(value)
