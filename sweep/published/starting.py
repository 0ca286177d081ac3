"""A study of one's own, begun as a copy of a built-in one."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sweep.campaigns.plan import plan_of
from sweep.campaigns.search.plan import SearchPlan
from sweep.campaigns.warming import cache_folder
from sweep.design.plan import Plan
from sweep.errors import CacheError, OutputError, SpecError
from sweep.own_code.reading import load_spec
from sweep.published.bibliography import FILE
from sweep.spec.built_in import EXPERIMENTS
from sweep.spec.document import FOR_EDITORS, Document
from sweep.spec.schema import json_schema
from sweep.spec.strict_yaml import read_document
from sweep.spec.study import Study, parse_spec
from sweep.spec.study_folder import SPEC_ENDINGS, why_no_name
from sweep.tables.outputs import check_output, unfinished
from sweep.text import unknown

OWN = "my"
"""Studies of one's own have names below this one, and no built-in study has."""


@dataclass(frozen=True)
class BuiltInStudy:
    """A built-in study: the comment that begins its spec, and what it would run.

    `at_most` where it may end with fewer trials than planned.
    """

    name: str
    text: str
    plan: Plan | SearchPlan
    at_most: bool


@dataclass(frozen=True)
class Begun:
    """A study of one's own: it, the file of its spec, and the files that were written,
    that one first.
    """

    study: Study
    path: Path
    written: tuple[Path, ...]


def built_in_specs() -> dict[str, Path]:
    """The files of all built-in specs, by PUBLICATION/SPEC."""
    return {
        f"{path.parent.name}/{path.stem}": path
        for path in sorted(EXPERIMENTS.glob("*/*.yaml"))
        if path.name != FILE
    }


def built_in_studies(workers: int) -> list[BuiltInStudy]:
    """All built-in studies, with the plan of each for so many workers."""
    return [
        _built_in(name, load_spec(path), workers)
        for name, path in built_in_specs().items()
    ]


def begin(name: str, path: Path | None = None, *, force: bool = False) -> Begun:
    """Write the spec of the built-in study `name` as the beginning of one's own, and
    copy the files that it names.

        name   PUBLICATION/SPEC
        path   the file of the new spec; by default SPEC.yaml in the current folder
        force  whether files that are there already may be replaced

    The study gets the name of the file below `my/`, so its results are apart from those
    of the built-in one. Comments stay, and a first line leads editors to the schema.

    Raises SpecError for an unknown name and for a file whose name cannot be that of a
    study, OutputError where a file cannot be written. Nothing is written then.
    """
    specs = built_in_specs()
    if name not in specs:
        below = [one for one in specs if one.startswith(f"{name}/")]
        asked = unknown("built-in study (see `sweep init`)", name, below or specs)
        needed = "; a new file alone needs --model MODEL"
        raise SpecError(asked + needed * (Path(name).suffix in SPEC_ENDINGS))
    source = specs[name]
    target = path or Path(f"{source.stem}.yaml")
    check_new_spec(target, force=force)
    root = read_document(source)
    text = _renamed(root.document, root.child("study").text(), f"{OWN}/{target.stem}")
    # Beside the built-in one, where the files are that it names.
    study = parse_spec(text, source.with_name(target.name))
    contents = {target: text.encode()}
    for file in _named_files(root.value, source.parent):
        copy, content = target.parent / file, (source.parent / file).read_bytes()
        if not _holds(copy, content):
            check_output(copy, (copy.suffix,), force=force)
            contents[copy] = content
    for new, content in contents.items():
        with unfinished(new) as out:
            out.write(content)
    return Begun(study, target, tuple(contents))


def check_new_spec(path: Path, *, force: bool) -> None:
    """Raise SpecError where no study can be called as the file, and OutputError where
    the file cannot be written, or is there and may not be replaced.
    """
    check_output(path, SPEC_ENDINGS, force=force)
    if why := why_no_name(f"{OWN}/{path.stem}"):
        raise SpecError(f"{path}: {why}")


def for_editors(spec: str) -> str:
    """Return the text of a spec below a line that leads editors to the schema.

    The schema is written into the cache, with what installed packages bring. Where the
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
    at_most = bool(study.search or study.rule)
    plan = plan_of(study, workers)
    return BuiltInStudy(name, study.document.comment, plan, at_most)


def _renamed(document: Document, old: str, new: str) -> str:
    """The text with another name of the study, below a line for editors."""
    lines = document.text.splitlines(keepends=True)
    number = document.lines[("study",)] - 1
    key, colon, value = lines[number].partition(":")
    lines[number] = key + colon + value.replace(old, new, 1)
    return for_editors("".join(lines))


def _holds(path: Path, content: bytes) -> bool:
    try:
        return path.is_file() and path.read_bytes() == content
    except OSError:  # it is not ours to read
        return False


def _named_files(value: Any, folder: Path) -> Iterator[str]:
    """The texts in a spec that are paths of files, relative to its folder."""
    if isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            yield from _named_files(part, folder)
    elif isinstance(value, str) and (folder / value).is_file():
        yield value
