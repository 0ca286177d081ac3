"""A custom study, begun as a copy of a built-in study."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sweep.campaigns import cache_folder, plan_of
from sweep.design import StudyPlan
from sweep.errors import CacheError, OutputError, SpecError
from sweep.own_code import load_spec, study_of
from sweep.published.bibliography import FILE
from sweep.spec import (
    EXPERIMENTS,
    FOR_EDITORS,
    SPEC_ENDINGS,
    Document,
    Study,
    json_schema,
    read_document,
    why_no_name,
)
from sweep.tables import check_output, unfinished
from sweep.text import unknown

OWN = "my"
"""Prefix of the names of custom studies, which no built-in study has."""


@dataclass(frozen=True)
class BuiltInStudy:
    """A built-in study: the first comment of the spec, and the plan.

    `at_most` is True if the study may end with fewer trials than planned.
    """

    name: str
    text: str
    plan: StudyPlan
    at_most: bool


@dataclass(frozen=True)
class Begun:
    """A new custom study: name, command and spec; all written files, the spec first."""

    name: str
    command: str
    path: Path
    written: tuple[Path, ...]


def built_in_specs() -> dict[str, Path]:
    """Return the files of all built-in specs, by PUBLICATION/SPEC."""
    return {
        f"{path.parent.name}/{path.stem}": path
        for path in sorted(EXPERIMENTS.glob("*/*.yaml"))
        if path.name != FILE
    }


def built_in_studies(workers: int) -> list[BuiltInStudy]:
    """Return all built-in studies, each with a plan for `workers` workers."""
    return [
        _built_in(name, load_spec(path), workers)
        for name, path in built_in_specs().items()
    ]


def begin(name: str, path: Path | None = None, *, force: bool = False) -> Begun:
    """Write a copy of the spec of a built-in study, and copy all named files.

    The study gets the name of the file below `my/`, so that the results are separate
    from the built-in study. Comments are copied. A first line links the schema for
    editors. An error before the first file leaves the folder unchanged.

    Parameters
    ----------
    name : str
        PUBLICATION/SPEC.
    path : Path, optional
        File of the new spec; by default SPEC.yaml in the current folder.
    force : bool, default False
        Allow to replace existing files.

    Raises
    ------
    SpecError
        If `name` is unknown, or no study can be called as the file.
    OutputError
        If a file cannot be written.
    """
    specs = built_in_specs()
    if name not in specs:
        below = [spec for spec in specs if spec.startswith(f"{name}/")]
        message = unknown("built-in study (see `sweep init`)", name, below or specs)
        needed = "; a new file alone needs --model MODEL"
        raise SpecError(message + needed * (Path(name).suffix in SPEC_ENDINGS))
    source = specs[name]
    target = path or Path(f"{source.stem}.yaml")
    check_new_spec(target, force=force)
    root = read_document(source)
    text = _renamed(root.document, root.child("study").text(), f"{OWN}/{target.stem}")
    # In the folder of the built-in spec, which has the named files.
    study = study_of(text, source.with_name(target.name))
    contents = {target: text.encode()}
    for file in _named_files(root.value, source.parent):
        copy = target.parent / file
        content = (source.parent / file).read_bytes()
        if not _holds(copy, content):
            check_output(copy, (copy.suffix,), force=force)
            contents[copy] = content
    for new, content in contents.items():
        with unfinished(new) as out:
            out.write(content)
    return Begun(study.name, study.command, target, tuple(contents))


def check_new_spec(path: Path, *, force: bool) -> None:
    """Check that a study can have the name of a file, and that the file can be written.

    Raises
    ------
    SpecError
        If no study can have the name of the file.
    OutputError
        If the file cannot be written, or exists and may not be replaced.
    """
    check_output(path, SPEC_ENDINGS, force=force)
    if why := why_no_name(f"{OWN}/{path.stem}"):
        raise SpecError(f"{path}: {why}")


def for_editors(spec: str) -> str:
    """Return the text of a spec below a line that links the schema for editors.

    The schema is written into the cache, with the entries of installed packages. If the
    cache cannot be written, the line is left out.
    """
    try:
        schema = cache_folder() / "spec.schema.json"
        with unfinished(schema, schema.parents[1]) as file:
            file.write(json.dumps(json_schema(), indent=1).encode())
    except (CacheError, OutputError):
        return spec
    return f"{FOR_EDITORS} $schema={schema.as_uri()}\n{spec}"


def _built_in(name: str, study: Study, workers: int) -> BuiltInStudy:
    at_most = study.strategy_section is not None
    plan = plan_of(study, workers)
    return BuiltInStudy(name, study.document.comment, plan, at_most)


def _renamed(document: Document, old: str, new: str) -> str:
    """Return the text with another name of the study, below a line for editors."""
    lines = document.text.splitlines(keepends=True)
    number = document.lines[("study",)] - 1
    key, colon, value = lines[number].partition(":")
    lines[number] = key + colon + value.replace(old, new, 1)
    return for_editors("".join(lines))


def _holds(path: Path, content: bytes) -> bool:
    try:
        return path.is_file() and path.read_bytes() == content
    except OSError:  # no permission to read
        return False


def _named_files(value: Any, folder: Path) -> Iterator[str]:
    """Yield the strings in a spec that are paths of files, relative to the folder."""
    if isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from _named_files(part, folder)
    elif isinstance(value, str) and (folder / value).is_file():
        yield value
