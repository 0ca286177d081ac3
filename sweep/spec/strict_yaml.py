"""Strict YAML: from a text to plain values whose lines are known, and back.

It is YAML 1.2 without what surprises people: a key may not stand twice; tags, anchors
and aliases are refused. The text may come from anyone: nothing in it is executed, and
its size and depth are limited.
"""

from collections.abc import Callable, Mapping
from io import StringIO
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from sweep.errors import SpecError
from sweep.spec.document import INTEGER_BOUND, Document, Entry, Place

MOST_BYTES = 1_000_000
MOST_LEVELS = 20
TAG = "tag:yaml.org,2002:"


def read_document(path: Path) -> Entry:
    """The content of a YAML file. Raises SpecError where it cannot be read or is not
    strict YAML.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise SpecError(
                f"{path}: is larger than {MOST_BYTES:,} bytes:"
                " put long lists into a table"
            )
        text = content.decode("utf-8").replace("\r\n", "\n")
    except FileNotFoundError:
        raise SpecError(f"{path}: no such file") from None
    except OSError as error:
        raise SpecError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SpecError(f"{path}: is not a text in UTF-8") from None
    return parse_document(text, path)


def parse_document(text: str, path: Path) -> Entry:
    """The content of a YAML text; errors name `path`. Raises SpecError where it is not
    strict YAML.
    """
    document = Document(path, text)
    try:
        root = YAML(typ="safe", pure=True).compose(text)
        value = _YamlReader(document).read(root, ()) if root is not None else None
    except YAMLError as error:
        raise _syntax_error(document, error) from None
    except RecursionError:
        raise document.error((), "is nested too deeply") from None
    return Entry(document, (), value)


def dump(mapping: Mapping[str, Any]) -> str:
    """The YAML text of a mapping of dicts, lists, texts and numbers. Raises TypeError
    for anything else.
    """
    yaml: Any = YAML(typ="safe", pure=True)
    stream = StringIO()
    yaml.default_flow_style, yaml.sort_base_mapping_type_on_output = None, False
    yaml.representer.ignore_aliases, yaml.width = lambda _: True, 110
    try:
        yaml.dump(dict(mapping), stream)
    except YAMLError as error:
        raise TypeError(
            f"a spec holds only dicts, lists, texts and numbers: {error}"
        ) from None
    return stream.getvalue()


def _syntax_error(document: Document, error: YAMLError) -> SpecError:
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    return document.error_in_line(
        mark.line + 1 if mark else 1, f"is not valid YAML: {problem}"
    )


class _YamlReader:
    """Makes plain values of YAML nodes, and writes the line of each into the
    document.
    """

    def __init__(self, document: Document) -> None:
        self.document = document

    def read(self, node: Node, place: Place) -> Any:
        line = node.start_mark.line + 1
        self.document.lines.setdefault(place, line)
        if node.anchor is not None:
            raise self.document.error_in_line(
                line, "anchors and aliases (& and *) are not allowed"
            )
        if len(place) > MOST_LEVELS:
            raise self.document.error_in_line(line, "is nested too deeply")
        if isinstance(node, ScalarNode):
            return self.scalar(node, line)
        if isinstance(node, SequenceNode) and node.tag == TAG + "seq":
            return [
                self.read(child, (*place, index))
                for index, child in enumerate(node.value)
            ]
        if isinstance(node, MappingNode) and node.tag == TAG + "map":
            return self.mapping(node, place)
        raise self.document.error_in_line(line, f"tag {node.tag} is not allowed")

    def mapping(self, node: MappingNode, place: Place) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for key_node, value_node in node.value:
            line, key = key_node.start_mark.line + 1, key_node.value
            if key_node.tag != TAG + "str":
                given = f', not "{key[:40]}"' if isinstance(key, str) else ""
                raise self.document.error_in_line(line, "a key must be a name" + given)
            if key in values:
                first = self.document.lines[(*place, key)]
                raise self.document.error_in_line(
                    line, f'"{key}" stands twice, first in line {first}'
                )
            self.document.lines[(*place, key)] = line
            values[key] = self.read(value_node, (*place, key))
        return values

    def scalar(self, node: ScalarNode, line: int) -> Any:
        convert = SCALARS.get(str(node.tag))
        if convert is None:
            raise self.document.error_in_line(line, f"tag {node.tag} is not allowed")
        try:
            return convert(node.value)
        except (ValueError, KeyError):
            kind = str(node.tag).removeprefix(TAG)
            raise self.document.error_in_line(
                line, f'cannot read "{node.value[:40]}" as {kind}'
            ) from None


def _integer(text: str) -> int:
    """010 is ten, as YAML 1.2 has it."""
    value = int(text, 0) if "0o" in text or "0x" in text or "0b" in text else int(text)
    if abs(value) >= INTEGER_BOUND:
        raise ValueError("too large")
    return value


def _float(text: str) -> float:
    return float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))


SCALARS: dict[str, Callable[[str], Any]] = {
    TAG + "str": str,
    TAG + "int": _integer,
    TAG + "float": _float,
    TAG + "bool": lambda text: {"true": True, "false": False}[text.lower()],
    TAG + "null": lambda _: None,
    TAG + "timestamp": str,
}
