"""The way from the file of a spec to the study, with all named code."""

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
from sweep.spec import (
    Document,
    Entry,
    Mistakes,
    Schema,
    Study,
    as_document,
    dump,
    json_schema,
    parse_document,
    read_document,
    read_documents,
    read_study,
)


def load_specs(
    path: Path, *, code: bool = True, code_from: Path | None = None
) -> list[Study]:
    """Return the studies that a file describes, one per document.

    Parameters
    ----------
    path, code, code_from
        As in `load_spec`.

    Raises
    ------
    SpecError
        As `load_spec`, and for two studies of one name. The error has all mistakes of
        all documents.
    """
    mistakes = Mistakes()
    studies = dict[str, Study]()
    for root in read_documents(path):
        with mistakes.noted():
            study = _read(root, code, code_from)
            if study.name in studies:
                line = studies[study.name].document.lines["study",]
                message = f'study "{study.name}" is listed twice, first in line {line}'
                raise study.document.error(("study",), message)
            studies[study.name] = study
    mistakes.check()
    return [*studies.values()]


def load_spec(path: Path, *, code: bool = True, code_from: Path | None = None) -> Study:
    """Return the study of a spec file with exactly one study.

    Parameters
    ----------
    path : Path
        File of the spec.
    code : bool, default True
        Whether code that the spec names may run.
    code_from : Path, optional
        Folder of the files of code; by default the folder of the spec.

    Raises
    ------
    SpecError
        With file and line, if the spec is wrong, or names code that may not run.
    """
    return _read(read_document(path), code, code_from)


def study_of(
    spec: str | Mapping[str, Any],
    path: Path | None = None,
    *,
    code: bool = True,
    code_from: Path | None = None,
) -> Study:
    """Return the study of a YAML text or a mapping.

    Parameters
    ----------
    spec : str or mapping
    path : Path, optional
        File of the spec, which need not exist: errors name the file, and the folder has
        the code. Without `path`, errors of a mapping name keys.
    code, code_from
        As in `load_spec`.

    Raises
    ------
    SpecError
        As `load_spec`.
    """
    file = path or Path("spec.yaml")
    if path is None and isinstance(spec, Mapping):
        return _read(as_document(spec, file), code, code_from)
    text = spec if isinstance(spec, str) else dump(spec)
    return _read(parse_document(text, file), code, code_from)


def check_spec(spec: Mapping[str, Any], path: Path) -> None:
    """Raise SpecError if `study_of` would, for a mapping that was read from YAML.

    The mapping is not written as a text first. The code runs.
    """
    _read(Entry(Document(path, ""), (), spec), True, None)


def with_variants(study: Study) -> list[Study]:
    """Return the study, followed by the variants that sections of the spec request.

    No code runs. Raises SpecError, with the line of the requesting key, for a variant
    that is no valid study.
    """
    studies = [study]
    for variant in study.variants():
        try:
            text = dump(variant.spec)
            path = study.path.with_name(f"{study.path.name} ({variant.name})")
            studies.append(study_with(text, path, study.catalogue))
        except SpecError as error:
            mistakes = (str(mistake).split(": ", 1)[-1] for mistake in error.mistakes)
            message = (
                f"the study cannot be run with {variant.description}:"
                f" {'; '.join(mistakes)}"
            )
            raise study.document.error(variant.place, message) from None
    return studies


def study_with(text: str, path: Path, catalogue: Catalogue) -> Study:
    """Return the study of a YAML text with loaded code; nothing runs.

    Parameters
    ----------
    text : str
        YAML text of the spec.
    path : Path
        File of the spec, which need not exist: errors name the file.
    catalogue : Catalogue
        Catalogue with the files and modules that the spec names.

    Raises
    ------
    SpecError
        If the spec is wrong.
    """
    root = parse_document(text, path)
    if not isinstance(catalogue, OwnCatalogue):
        return read_study(root, catalogue)
    plain = resolved(root, references(root), catalogue)
    return read_study(plain, catalogue, catalogue.samplers)


def code_of(path: Path) -> list[Path]:
    """Return the paths of the code of a spec; nothing runs.

    The paths are the files that would run, all imported files, and the locations of the
    packages of named modules. Raises SpecError if the spec or a file cannot be read.
    """
    roots = read_documents(path)
    if not (named := [reference for root in roots for reference in references(root)]):
        return []
    code = own_code(roots[0], named)
    paths = [path.parent / file for file in code.sources.code]
    for package in code.packages:
        paths += locations(package.name)
    return paths


def schema_for(
    path: Path, *, code: bool = True, code_from: Path | None = None
) -> Schema:
    """Return the JSON Schema of the specs in a file, with the entries of custom code.

    The code runs. The rest of the spec may be wrong.

    Parameters
    ----------
    path, code, code_from
        As in `load_spec`.

    Raises
    ------
    SpecError
        With file and line, if code cannot be used, or a spec names code that may not
        run.
    """
    roots = read_documents(path)
    specs = [(root, _allowed(root, code, code_from)) for root in roots]
    if not (every := [reference for _, named in specs for reference in named]):
        return json_schema()
    catalogue = known_to(roots[0], every, code_from)
    files = dict[str, str | None].fromkeys(reference.text for reference in every)
    for root, named in specs:
        plain = resolved(root, named, catalogue)
        models = [reference for reference in named if reference.kind == "models"]
        files |= {model.text: plain.child("model").text() for model in models}
    return json_schema(catalogue, files, catalogue.samplers)


def named_model(text: str, *, code: bool = True) -> tuple[str, Catalogue]:
    """Return the name of a model, and the catalogue with the model. Its code runs.

    Parameters
    ----------
    text : str
        Name of the model; or the file, ``./vortex.py`` or ``./file.py:NAME`` from the
        current folder; or the module, ``their_package.vortex:MODEL``.
    code : bool, default True
        Whether code may run.

    Raises
    ------
    SpecError
        If the model cannot be used, its code may not run, or the text is the name of a
        file without the ending.
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
                f'unknown model "{text}"; to use the file, write ./{text}.py'
            )
        return text, BUILT_IN
    root = Entry(Document(file, ""), (), spec)
    if not code:
        raise root.error(f'the model runs code from "{text}"; no code may run')
    named = references(root)
    catalogue = known_to(root, named)
    return str(resolved(root, named, catalogue).value["model"]), catalogue


def _read(root: Entry, code: bool, code_from: Path | None) -> Study:
    if not (named := _allowed(root, code, code_from)):
        return read_study(root)
    catalogue = known_to(root, named, code_from)
    return read_study(resolved(root, named, catalogue), catalogue, catalogue.samplers)


def _allowed(root: Entry, code: bool, code_from: Path | None) -> list[Reference]:
    """Return the references of a spec. Raises SpecError for code that may not run."""
    named = references(root, code_from)
    running = [reference.entry for reference in named if reference.runs]
    if running and not code:
        first = running[0]
        raise first.error(f'the spec runs code from "{first.value}"; no code may run')
    return named
