"""From the file of a spec to its study, with the code that it names."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kernels.catalogue import BUILT_IN, Catalogue
from sweep.own_code.references import (
    FILE,
    Reference,
    known_to,
    own_code,
    references,
    resolved,
)
from sweep.own_code.sources import SUFFIX
from sweep.spec.document import Document, Entry
from sweep.spec.schema import json_schema
from sweep.spec.schema_parts import Schema
from sweep.spec.strict_yaml import dump, parse_document, read_document
from sweep.spec.study import Study, read_study


def load_spec(path: Path, *, code: bool = True) -> Study:
    """The study that the file of a spec describes.

    If the spec names files with code, they run. Raises SpecError, with file and line,
    for whatever is wrong with it; without `code`, for a spec that names any.
    """
    return _read(read_document(path), code)


def study_of(
    spec: str | Mapping[str, Any], path: Path = Path("spec.yaml"), *, code: bool = True
) -> Study:
    """The same for a YAML text or a mapping, as if it stood in the file `path`."""
    text = spec if isinstance(spec, str) else dump(spec)
    return _read(parse_document(text, path), code)


def code_of(path: Path) -> list[Path]:
    """The files that a spec would run, with those that they import; nothing runs.

    Raises SpecError for what cannot be read.
    """
    root = read_document(path)
    named = references(root)
    if not named:
        return []
    return [path.parent / file for file in own_code(root, named).sources.code]


def schema_for(path: Path, *, code: bool = True) -> Schema:
    """The JSON Schema of the spec in a file, with all that its own files bring.

    The files run; what else stands in the spec may be wrong. Raises SpecError, with
    file and line, for code that cannot be used; without `code`, for a spec that names
    any.
    """
    root = read_document(path)
    if not (named := _allowed(root, code)):
        return json_schema()
    known = known_to(root, named)
    plain = resolved(root, named, known)
    files: dict[str, str | None] = {str(one.entry.value): None for one in named}
    models = [one for one in named if one.kind == "models"]
    files |= {str(one.entry.value): plain.child("model").text() for one in models}
    return json_schema(known, files, known.samplers)


def named_model(text: str, *, code: bool = True) -> tuple[str, Catalogue]:
    """The name of a model that is named by itself, or by the file that has it,
    `./vortex.py` or `./file.py:NAME` from the current folder; and the catalogue for it.

    The file runs. Raises SpecError, without `code` for any file.
    """
    if not FILE.fullmatch(text):
        return text, BUILT_IN
    path, colon, name = text.partition(":")
    file = Path(path)
    spec = {"model": f"./{file.name}{colon}{name}"}
    root = Entry(Document(file, ""), (), spec)
    if not code:
        raise root.error(f'this runs code from "{text}"; no code may run')
    named = references(root)
    known = known_to(root, named)
    return str(resolved(root, named, known).value["model"]), known


def _read(root: Entry, code: bool) -> Study:
    if not (named := _allowed(root, code)):
        return read_study(root)
    known = known_to(root, named)
    return read_study(resolved(root, named, known), known, known.samplers)


def _allowed(root: Entry, code: bool) -> list[Reference]:
    """The files that a spec names. Without `code`, SpecError if one of them runs."""
    named = references(root)
    running = [one.entry for one in named if one.file.endswith(SUFFIX)]
    if running and not code:
        first = running[0]
        raise first.error(f'this spec runs code from "{first.value}"; no code may run')
    return named
