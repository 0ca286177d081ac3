"""A model, a metric or a map of one's own, begun as a copy of an example.

The examples are real files, which are checked and tested as they stand. A copy has
another name in the place of theirs, wherever that is a word of its own.
"""

import keyword
import re
import sys
from dataclasses import dataclass
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.registry import Registry
from kernels.worlds import MAPS
from sweep.errors import OutputError, UserError
from sweep.published.starting import ENDINGS, OWN, for_editors
from sweep.spec.built_in import EXAMPLES
from sweep.spec.study_folder import taken_name
from sweep.store.locations import in_unicode
from sweep.tables.outputs import unfinished
from sweep.text import shortened, unknown


@dataclass(frozen=True)
class Template:
    """An example by its `name`, its `files`, of which the first is the code, and what
    is known of the same kind, whose names are taken.
    """

    name: str
    files: tuple[str, ...]
    known: Registry[Any]


TEMPLATES: dict[str, Template] = {
    "model": Template("vortex", ("vortex.py", "vortex.yaml", "test_vortex.py"), MODELS),
    "metric": Template("rotation", ("rotation.py",), METRICS),
    "map": Template("pillars", ("pillars.py",), MAPS),
}
"""By the kind of what they are."""


def create(kind: str, name: str, folder: Path) -> tuple[Path, ...]:
    """Write the files of a model, a metric or a map called `name` into `folder`.

        kind    one of TEMPLATES
        name    a name for Python that nothing of the kind has yet
        folder  a folder that is there

    Returns the files, the code first. A spec of it is the study my/NAME, and leads
    editors to the schema.

    Raises UserError for another kind and for a name that cannot be, OutputError where a
    file is there already or cannot be written. Nothing is written then.
    """
    if kind not in TEMPLATES:
        raise UserError(unknown("kind of code", kind, TEMPLATES))
    template = TEMPLATES[kind]
    _check_name(kind, name, template.known)
    _check_folder(folder)
    contents = {
        folder / file.replace(template.name, name): _copied(template, file, name)
        for file in template.files
    }
    there = [path for path in contents if path.exists() or path.is_symlink()]
    if there:
        raise OutputError(
            f"{', '.join(map(str, there))}: there already, and nothing is replaced;"
            " another name or --folder keeps them apart"
        )
    for path, text in contents.items():
        with unfinished(path) as file:
            file.write(text.encode())
    return tuple(contents)


def _copied(template: Template, file: str, name: str) -> str:
    text = (EXAMPLES / file).read_text(encoding="utf-8")
    renamed = re.sub(rf"\b{template.name}\b", name, text)
    return for_editors(renamed) if Path(file).suffix in ENDINGS else renamed


def _check_folder(folder: Path) -> None:
    in_unicode(folder)
    if not folder.is_dir():
        raise OutputError(f"{folder}: there is no such folder")


def _check_name(kind: str, name: str, known: Registry[Any]) -> None:
    """Raise UserError where a file, a study or an entry cannot have the name."""
    if not _is_for_python(name):
        fitting = re.sub("[^A-Za-z0-9_]", "_", name)
        fitting = fitting if _is_for_python(fitting) else f"my_{fitting}"
        raise UserError(
            f'a {kind} cannot be called "{shortened(name)}": a name has letters, digits'
            " and _, begins with a letter and is no keyword of Python;"
            f' did you mean "{shortened(fitting)}"?'
        )
    if why := _taken(kind, name, known):
        raise UserError(f'a {kind} of your own cannot be called "{name}": {why}')


def _is_for_python(name: str) -> bool:
    letters = re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name)
    return letters is not None and not keyword.iskeyword(name)


def _taken(kind: str, name: str, known: Registry[Any]) -> str:
    """By what a name is taken; "" for a free one."""
    if name in known:
        owner = known.origins.get(name)
        return f"{owner} has one" if owner else f"it is a built-in {kind}"
    if taken_name(f"{OWN}/{name}"):
        return "results use this name themselves"
    if name in sys.stdlib_module_names or PathFinder.find_spec(name):
        return f"a file {name}.py would hide the module {name} that is installed"
    return ""
