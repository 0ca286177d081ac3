"""The table of all keys of a spec, docs/keys.md, which `make documents` writes.

The table has the descriptions of the reader of specs, so that no key is missing.
"""

from collections.abc import Iterable, Iterator

from sweep.spec.axis_keys import axis_keys
from sweep.spec.keys import Key, keys_of
from sweep.spec.study import spec_parts

HEAD = """\
# The keys of a spec

`make documents` writes this page from the descriptions of the keys.
[Writing a spec](guide/writing-a-spec.md) shows how to use the keys.
`sweep models MODEL` lists the parameters of a model. A dot leads to a key of a mapping.
NAME is a name of your choice, and [] is each part of a list. Keys below an axis, such
as `sweep.NAME` and `search.over.NAME`, have a separate table. A required key must be
given wherever the mapping of the key appears.

| key | meaning | allowed values | default | example |
|---|---|---|---|---|
"""
AXES = """
## The keys of an axis

An axis of one parameter has the name of the parameter. The value is a list, or a
mapping with one of the first keys. An axis of several parameters has a name of your
choice, and the key `zip`, `sample` or `ablate`.

| key | meaning | allowed values | default | example |
|---|---|---|---|---|
"""


def key_table() -> str:
    """Return the page of all keys, in Markdown."""
    keys = _rows(described(*spec_parts()))
    return HEAD + keys + AXES + _rows((key.name, key) for key in axis_keys())


def described(*parts: type | Key, path: str = "") -> Iterator[tuple[str, Key]]:
    """Yield each key of the parts, and the keys below, with the full path."""
    for key in keys_of(*parts):
        full_path = path + key.name
        yield full_path, key
        below = f"{full_path}{key.content.inside}."
        yield from described(*key.content.sections, path=below)


def _rows(keys: Iterable[tuple[str, Key]]) -> str:
    rows = (_row(path, key) for path, key in keys)
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _row(path: str, key: Key) -> tuple[str, ...]:
    fallback = "must be given" if key.required else key.fallback
    example = f"`{key.name}: {key.example}`" if key.example else ""
    return f"`{path}`", key.text, key.content.words, fallback, example


if __name__ == "__main__":
    print(key_table(), end="")
