"""Strict YAML: from a text to plain values with line numbers, and back.

The language is YAML 1.2 with two restrictions: a key may not appear twice, and tags,
anchors and aliases are rejected. A file may have several documents. Each document
begins with a line `---`, and has a separate text. The text may be untrusted: no part is
executed, and size and depth are limited.
"""

import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from io import StringIO
from os import PathLike, fspath
from pathlib import Path
from typing import Any, NamedTuple

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from sweep.errors import SpecError
from sweep.spec.document import (
    INTEGER_BOUND,
    MAPPING,
    Document,
    Entry,
    Place,
    keys_in_words,
)
from sweep.spec.mistakes import Mistakes
from sweep.text import shortened

MOST_BYTES = 1_000_000
MOST_LEVELS = 20
TAG = "tag:yaml.org,2002:"
MARK = re.compile(r"^---(?=\s|$)", re.MULTILINE)
CONTENT = re.compile(r"^(?!---)\s*[^\s#%]", re.MULTILINE)


def read_document(path: Path) -> Entry:
    """Return the content of a YAML file of one document.

    Raises SpecError if the file cannot be read, or is not strict YAML.
    """
    return parse_document(_text(path), path)


def read_documents(path: Path) -> list[Entry]:
    """Return the content of each document of a YAML file, at least one.

    Raises SpecError if the file cannot be read, or is not strict YAML.
    """
    mistakes = Mistakes()
    pieces = _pieces(_text(path))
    roots = [mistakes.read(_parsed, piece, path) for piece in pieces]
    mistakes.check()
    return [root for root in roots if root]


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise SpecError(
                f"{path}: is larger than {MOST_BYTES:,} bytes:"
                " move long lists into a table"
            )
        return content.decode("utf-8").replace("\r\n", "\n")
    except FileNotFoundError:
        raise SpecError(f"{path}: no such file") from None
    except OSError as error:
        raise SpecError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SpecError(f"{path}: is not UTF-8 text") from None


def as_document(mapping: Mapping[str, Any], path: Path) -> Entry:
    """Return the content of a mapping, read as if from the file `path`.

    Errors name the keys of the mapping. Raises TypeError as `dump` does, and SpecError
    if the mapping is not strict YAML.
    """
    return _parsed(_Piece(dump(mapping), 0), path, of_mapping=True)


def parse_document(text: str, path: Path) -> Entry:
    """Return the content of a YAML text of one document.

    Errors name `path`. Raises SpecError if the text is not strict YAML.
    """
    first, *further = _pieces(text)
    if further:
        message = "begins a second study; only one is allowed here: use separate files"
        raise Document(path, text).error_in_line(further[0].lines_before + 1, message)
    return _parsed(first, path)


class _Piece(NamedTuple):
    """The text of a document, and the number of lines of the file before it."""

    text: str
    lines_before: int


def _pieces(text: str) -> list[_Piece]:
    """Return the documents of a text.

    Comments and directives alone are not a document.
    """
    starts = [0, *(mark.start() for mark in MARK.finditer(text) if mark.start())]
    if len(starts) > 1 and not CONTENT.search(text, 0, starts[1]):
        del starts[1]
    ends = [*starts[1:], len(text)]
    return [
        _Piece(text[start:end], text.count("\n", 0, start))
        for start, end in zip(starts, ends, strict=True)
    ]


def _parsed(piece: _Piece, path: Path, *, of_mapping: bool = False) -> Entry:
    document = Document(path, piece.text, of_mapping=of_mapping)
    before = piece.lines_before
    try:
        # With the empty lines, all marks have the line numbers of the file.
        root = _composed("\n" * before + piece.text)
        if root is None:
            document.lines[()] = before + 1
        value = _YamlReader(document).read(root, ()) if root is not None else None
    except YAMLError as error:
        raise _syntax_error(document, error) from None
    except RecursionError:
        raise document.error((), "is nested too deeply") from None
    return Entry(document, (), value)


@lru_cache(maxsize=8)  # of a megabyte each, at most
def _composed(text: str) -> Node | None:
    """Return the nodes of a text, which callers do not change.

    The nodes are cached, because some texts are composed many times, such as a spec
    whose variants are tried in turn.
    """
    root: Node | None = YAML(typ="safe", pure=True).compose(text)
    return root


def dump(mapping: Mapping[str, Any]) -> str:
    """Return the YAML text of a mapping of dicts, lists, strings and numbers.

    Numbers and arrays of numpy are also allowed. Raises TypeError, with the key, for
    all other types.
    """
    yaml: Any = YAML(typ="safe", pure=True)
    stream = StringIO()
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False
    yaml.representer.ignore_aliases = lambda _: True
    yaml.width = 110
    yaml.dump(_plain(mapping, ()), stream)
    return stream.getvalue()


def _plain(value: Any, place: Place) -> Any:
    """Return a value, also of numpy or pandas, as dicts, lists, strings and numbers."""
    if len(place) > MOST_LEVELS:
        raise TypeError(f"{MAPPING}, {keys_in_words(place)}: is nested too deeply")
    if hasattr(value, "tolist"):  # an array or a number of numpy, a column of pandas
        value = value.tolist()
    if isinstance(value, Mapping):
        return {
            _key(key, place): _plain(child, (*place, str(key)))
            for key, child in value.items()
        }
    if isinstance(value, list | tuple | range):
        return [_plain(child, (*place, index)) for index, child in enumerate(value)]
    if isinstance(value, PathLike):
        value = fspath(value)
    if isinstance(value, str):
        return str.__str__(value)
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int | float):
        return int(value) if isinstance(value, int) else float(value)
    raise _not_plain(place, value)


def _key(key: Any, place: Place) -> str:
    if not isinstance(key, str):
        raise _not_plain(place, key)
    return str.__str__(key)


def _not_plain(place: Place, value: Any) -> TypeError:
    where = f"{MAPPING}, {keys_in_words(place)}" if place else MAPPING
    wrong = f"{type(value).__name__} {shortened(repr(value))}"
    rule = "a spec has only dicts with string keys, lists, strings and numbers"
    return TypeError(f"{where}: {rule}, not {wrong}")


def _syntax_error(document: Document, error: YAMLError) -> SpecError:
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or str(error).splitlines()[0]
    return document.error_in_line(
        mark.line + 1 if mark else 1, f"is not valid YAML: {problem}"
    )


class _YamlReader:
    """A reader of plain values from YAML nodes.

    The reader enters the line of each value into the document.
    """

    def __init__(self, document: Document) -> None:
        self.document = document

    def read(self, node: Node, place: Place) -> Any:
        """Return the value of a node.

        Parameters
        ----------
        node : Node
        place : tuple
            Keys and indices that lead to the node.

        Raises
        ------
        SpecError
            If the node is not strict YAML.
        """
        line = node.start_mark.line + 1
        self.document.lines.setdefault(place, line)
        if node.anchor is not None:
            raise self.document.error_in_line(
                line, "anchors and aliases (& and *) are not allowed"
            )
        if len(place) > MOST_LEVELS:
            raise self.document.error_in_line(line, "is nested too deeply", place)
        if isinstance(node, ScalarNode):
            return self._scalar(node, place)
        if isinstance(node, SequenceNode) and node.tag == TAG + "seq":
            return [
                self.read(child, (*place, index))
                for index, child in enumerate(node.value)
            ]
        if isinstance(node, MappingNode) and node.tag == TAG + "map":
            return self._mapping(node, place)
        raise self.document.error_in_line(line, f"tag {node.tag} is not allowed")

    def _mapping(self, node: MappingNode, place: Place) -> dict[str, Any]:
        """Return the value of a mapping. Raises SpecError."""
        values: dict[str, Any] = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            key = key_node.value
            if key_node.tag != TAG + "str":
                wrong = f', not "{key[:40]}"' if isinstance(key, str) else ""
                raise self.document.error_in_line(
                    line, "a key must be a string" + wrong
                )
            if key in values:
                first = self.document.lines[(*place, key)]
                raise self.document.error_in_line(
                    line, f'"{key}" appears twice, first in line {first}'
                )
            self.document.lines[(*place, key)] = line
            values[key] = self.read(value_node, (*place, key))
        return values

    def _scalar(self, node: ScalarNode, place: Place) -> Any:
        """Return the value of a scalar. Raises SpecError."""
        line = node.start_mark.line + 1
        convert = SCALARS.get(str(node.tag))
        if convert is None:
            raise self.document.error_in_line(line, f"tag {node.tag} is not allowed")
        try:
            return convert(node.value)
        except OverflowError:
            message = f"{node.value[:40]} is too large: integers must be below 2^63"
            raise self.document.error_in_line(line, message, place) from None
        except (ValueError, KeyError):
            kind = str(node.tag).removeprefix(TAG)
            raise self.document.error_in_line(
                line, f'cannot read "{node.value[:40]}" as {kind}', place
            ) from None


def _integer(text: str) -> int:
    """Return the integer of a string; 010 is ten, as in YAML 1.2."""
    value = int(text, 0) if "0o" in text or "0x" in text or "0b" in text else int(text)
    if abs(value) >= INTEGER_BOUND:
        raise OverflowError
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
