"""A custom model, metric, map or initial condition, begun as a copy of an example.

The examples are real files, which are checked and tested. A copy replaces every
occurrence of the name of the example as a separate word.
"""

import re
import sys
from contextlib import suppress
from dataclasses import dataclass
from importlib.machinery import PathFinder
from pathlib import Path

from sweep.errors import CodeError, OutputError, UserError
from sweep.own_code import check_free, check_name
from sweep.published.starting import OWN, for_editors
from sweep.spec import EXAMPLES, SPEC_ENDINGS, taken_name
from sweep.store import in_unicode
from sweep.tables import unfinished
from sweep.text import shortened, unknown


@dataclass(frozen=True)
class Template:
    """An example: a name and files. The first file is the code."""

    name: str
    files: tuple[str, ...]


TEMPLATES = {
    "model": Template("vortex", ("vortex.py", "vortex.yaml", "test_vortex.py")),
    "metric": Template("rotation", ("rotation.py",)),
    "map": Template("pillars", ("pillars.py",)),
    "start": Template("ring", ("ring.py",)),
}
"""Examples by the kind of code."""


def create(kind: str, name: str, folder: Path) -> tuple[Path, ...]:
    """Write the files of a custom entry `name` into `folder`.

    A spec among the files is the study my/NAME, with a link to the schema for editors
    in the first line. An error before the first file leaves the folder unchanged.

    Parameters
    ----------
    kind : str
        A key of TEMPLATES.
    name : str
        A Python name that no entry of the kind has yet.
    folder : Path
        An existing folder.

    Returns
    -------
    tuple of Path
        The files, the code first.

    Raises
    ------
    UserError
        If `kind` is unknown.
    CodeError
        If an entry, a study or a file cannot have the name.
    OutputError
        If a file already exists or cannot be written.
    """
    if kind not in TEMPLATES:
        raise UserError(unknown("kind of code", kind, TEMPLATES))
    template = TEMPLATES[kind]
    _check_name(kind, name)
    _check_folder(folder)
    contents = {
        folder / file.replace(template.name, name): _copied(template, file, name)
        for file in template.files
    }
    existing = [path for path in contents if path.exists() or path.is_symlink()]
    if existing:
        raise OutputError(
            f"{', '.join(map(str, existing))}: exists already, and no file is"
            " replaced; use another name or --folder"
        )
    for path, text in contents.items():
        with unfinished(path) as file:
            file.write(text.encode())
    return tuple(contents)


def _copied(template: Template, file: str, name: str) -> str:
    text = (EXAMPLES / file).read_text(encoding="utf-8")
    renamed = re.sub(rf"\b{template.name}\b", name, text)
    return for_editors(renamed) if Path(file).suffix in SPEC_ENDINGS else renamed


def _check_folder(folder: Path) -> None:
    in_unicode(folder)
    if not folder.is_dir():
        raise OutputError(f"{folder}: there is no such folder")


def _check_name(kind: str, name: str) -> None:
    """Raise CodeError if an entry, a study or a file cannot have the name."""
    file = f"{shortened(name)}.py"
    try:
        check_name(file, kind, name)
    except CodeError as error:
        raise CodeError(f"{error}{_fitting(kind, name)}") from None
    check_free(file, f"{kind}s", name)
    if taken_name(f"{OWN}/{name}"):
        raise CodeError(f"{file}: the name {name} is reserved for results")
    if name in sys.stdlib_module_names or PathFinder.find_spec(name):
        raise CodeError(f"{file}: would hide the module {name}, which is installed")


def _fitting(kind: str, name: str) -> str:
    """Return a question with a similar allowed name; "" without such a name."""
    plain = re.sub("[^a-z0-9_]", "_", name.lower())
    for candidate in (plain, f"my_{plain}"):
        with suppress(CodeError):
            check_name("", kind, candidate[:60])
            return f'; did you mean "{candidate[:60]}"?'
    return ""
