"""From the file of a spec to its study, with the code that it names."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from kernels.catalogue import BUILT_IN, Catalogue
from sweep.errors import SpecError
from sweep.own_code.catalogue import OwnCatalogue
from sweep.own_code.installed import locations
from sweep.own_code.references import (
    FILE,
    MODULE,
    Reference,
    known_to,
    own_code,
    references,
    resolved,
)
from sweep.spec.document import Document, Entry
from sweep.spec.mistakes import Mistakes
from sweep.spec.schema import json_schema
from sweep.spec.schema_parts import Schema
from sweep.spec.strict_yaml import (
    as_document,
    dump,
    parse_document,
    read_document,
    read_documents,
)
from sweep.spec.study import Study, read_study


def load_specs(
    path: Path, *, code: bool = True, code_from: Path | None = None
) -> list[Study]:
    """The studies that a file describes, one a document. Raises as `load_spec`, and for
    two studies of one name; all mistakes of all documents are in one SpecError.
    """
    mistakes, studies = Mistakes(), dict[str, Study]()
    for root in read_documents(path):
        with mistakes.noted():
            study = _read(root, code, code_from)
            if study.name in studies:
                line = studies[study.name].document.lines["study",]
                message = f'study "{study.name}" stands twice, first in line {line}'
                raise study.document.error(("study",), message)
            studies[study.name] = study
    mistakes.check()
    return [*studies.values()]


def load_spec(path: Path, *, code: bool = True, code_from: Path | None = None) -> Study:
    """The study that the file of a spec describes, which has no other one.

    If the spec names code, it runs; files of code lie in the folder of the spec, or in
    `code_from` where it is given. Raises SpecError, with file and line, for whatever is
    wrong with the spec; without `code`, for one that names any.
    """
    return _read(read_document(path), code, code_from)


def study_of(
    spec: str | Mapping[str, Any],
    path: Path | None = None,
    *,
    code: bool = True,
    code_from: Path | None = None,
) -> Study:
    """The same for a YAML text or a mapping, as if it stood in the file `path`. Without
    one, errors of a mapping name its keys.
    """
    file = path or Path("spec.yaml")
    if path is None and isinstance(spec, Mapping):
        return _read(as_document(spec, file), code, code_from)
    text = spec if isinstance(spec, str) else dump(spec)
    return _read(parse_document(text, file), code, code_from)


def check_spec(spec: Mapping[str, Any], path: Path) -> None:
    """Raise SpecError where `study_of` would, for a mapping of what was read from YAML.

    It is not written as a text first. Its code runs.
    """
    _read(Entry(Document(path, ""), (), spec), True, None)


def with_variants(study: Study) -> list[Study]:
    """The study, and after it the variants that its sections ask for. No code runs.

    Raises SpecError, with the line of the key that asks for it, for a variant that
    cannot be.
    """
    found = [study]
    for variant in study.variants():
        try:
            text = dump(variant.spec)
            place = study.path.with_name(f"{study.path.name} ({variant.name})")
            found.append(study_with(text, place, study.known))
        except SpecError as error:
            said = "; ".join(str(one).split(": ", 1)[-1] for one in error.mistakes)
            message = f"the study cannot be run with {variant.words}: {said}"
            raise study.document.error(variant.place, message) from None
    return found


def study_with(text: str, path: Path, known: Catalogue) -> Study:
    """The study of a YAML text, as if it stood in the file `path`. The files that it
    names are those that `known` has: nothing runs. Raises SpecError.
    """
    root = parse_document(text, path)
    if not isinstance(known, OwnCatalogue):
        return read_study(root, known)
    plain = resolved(root, references(root), known)
    return read_study(plain, known, known.samplers)


def code_of(path: Path) -> list[Path]:
    """The files that a spec would run, with those that they import, and the packages
    whose modules it names; nothing runs.

    Raises SpecError for what cannot be read.
    """
    roots = read_documents(path)
    if not (named := [one for root in roots for one in references(root)]):
        return []
    code = own_code(roots[0], named)
    files = [path.parent / file for file in code.sources.code]
    return [*files, *(place for one in code.packages for place in locations(one.name))]


def schema_for(
    path: Path, *, code: bool = True, code_from: Path | None = None
) -> Schema:
    """The JSON Schema of the specs in a file, with all that the code brings that they
    name.

    The code runs; what else stands in the spec may be wrong. Raises SpecError, with
    file and line, for code that cannot be used; without `code`, for a spec that names
    any. `code_from` is as in `load_spec`.
    """
    roots = read_documents(path)
    specs = [(root, _allowed(root, code, code_from)) for root in roots]
    if not (every := [one for _, named in specs for one in named]):
        return json_schema()
    known = known_to(roots[0], every, code_from)
    files: dict[str, str | None] = {str(one.entry.value): None for one in every}
    for root, named in specs:
        plain = resolved(root, named, known)
        models = [one for one in named if one.kind == "models"]
        files |= {str(one.entry.value): plain.child("model").text() for one in models}
    return json_schema(known, files, known.samplers)


def named_model(text: str, *, code: bool = True) -> tuple[str, Catalogue]:
    """The name of a model that is named by itself, or by what has it: a file,
    `./vortex.py` or `./file.py:NAME` from the current folder, or a module of a package,
    `their_package.vortex:MODEL`. And the catalogue for it.

    The code runs. Raises SpecError, without `code` for any, and for the name of a file
    without its ending.
    """
    file = Path()
    if FILE.fullmatch(text):
        path, colon, name = text.partition(":")
        file = Path(path)
        spec = {"model": f"./{file.name}{colon}{name}"}
    elif MODULE.fullmatch(text):
        spec = {"model": text}
    else:
        if text not in BUILT_IN.models and Path(f"{text}.py").is_file():
            raise SpecError(
                f'unknown model "{text}"; that of the file is named ./{text}.py'
            )
        return text, BUILT_IN
    root = Entry(Document(file, ""), (), spec)
    if not code:
        raise root.error(f'this runs code from "{text}"; no code may run')
    named = references(root)
    known = known_to(root, named)
    return str(resolved(root, named, known).value["model"]), known


def _read(root: Entry, code: bool, code_from: Path | None) -> Study:
    if not (named := _allowed(root, code, code_from)):
        return read_study(root)
    known = known_to(root, named, code_from)
    return read_study(resolved(root, named, known), known, known.samplers)


def _allowed(root: Entry, code: bool, code_from: Path | None) -> list[Reference]:
    """What a spec names. Without `code`, SpecError if any of it runs."""
    named = references(root, code_from)
    running = [one.entry for one in named if one.runs]
    if running and not code:
        first = running[0]
        raise first.error(f'this spec runs code from "{first.value}"; no code may run')
    return named
