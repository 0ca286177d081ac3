"""The text of a user's own files: those that a spec names, and those beside them that
they import.

The text is read once, before anything runs. It goes to every worker and into the store,
so that each trial is computed by the same lines, whatever becomes of the files.
"""

import ast
import hashlib
import json
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path, PurePosixPath

from sweep.errors import CodeError
from sweep.spec.study_folder import PLAN
from sweep.text import similar

SUFFIX = ".py"
"""Of code; other files are data."""
PACKAGE = "__init__.py"
MOST_BYTES = 2_000_000
MOST_FILES = 100
KEPT = (
    ", where results are stored: `sweep code STUDY --to FOLDER` writes spec and code"
    " of a study into a folder, to launch there"
)
"""Of a spec that is launched from where a launch has put it, without its files."""


@dataclass(frozen=True)
class Sources:
    """Files by their paths from one folder, as `rules/pull.py`, each with its text."""

    files: tuple[tuple[str, str], ...]

    @cached_property
    def texts(self) -> dict[str, str]:
        """The text of each file by its path."""
        return dict(self.files)

    @cached_property
    def sha(self) -> str:
        """The sha256 of all files: of each path and text."""
        return hashlib.sha256(json.dumps(self.files).encode()).hexdigest()

    @property
    def code(self) -> tuple[str, ...]:
        """The files that run."""
        return tuple(file for file in self.texts if file.endswith(SUFFIX))

    @property
    def package(self) -> str:
        """The name of the package that the folder is when it is imported."""
        return f"own_{self.sha[:16]}"

    def module(self, file: str) -> str:
        """The full name of the module that a file is."""
        parts = PurePosixPath(file).with_suffix("").parts
        inner = parts[:-1] if file.endswith(PACKAGE) else parts
        return ".".join([self.package, *inner])


def gather(folder: Path, files: Iterable[str]) -> Sources:
    """These files, whose paths start in `folder`, and all that they import relatively.

    Raises CodeError, which names file and line, for a file that cannot be read or is no
    Python, for one outside the folder, and for an import that finds nothing.
    """
    found, waiting = dict[str, str](), list(dict.fromkeys(files))
    while waiting:
        file = waiting.pop()
        if file not in found:
            found[file] = _text(folder, file)
            if file.endswith(SUFFIX):
                waiting += _imported(folder, file, found[file])
        if len(found) > MOST_FILES:
            raise CodeError(f"{file}: more than {MOST_FILES} files import each other")
        if sum(map(len, found.values())) > MOST_BYTES:
            raise CodeError(f"{file}: the files have more than {MOST_BYTES:,} bytes")
    return Sources(tuple(sorted(found.items())))


def _text(folder: Path, file: str) -> str:
    path = folder / file
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        if not path.is_file():
            hint = similar(file, list(_alike(folder, path)))
            kept = KEPT if (folder / PLAN).is_file() else ""
            raise CodeError(f'there is no file "{file}" in {folder}{hint or kept}')
        content = path.read_bytes() if path.stat().st_size <= MOST_BYTES else None
    except (OSError, RuntimeError, ValueError) as error:
        raise CodeError(f"{file} cannot be read: {error}") from None
    if not inside:
        raise CodeError(
            f"{file} lies outside the folder of the spec, {folder}: put it there, or"
            " make a package of it"
        )
    if content is None:
        raise CodeError(f"{file} has more than {MOST_BYTES:,} bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CodeError(f"{file} is no text in UTF-8: {error}") from None


def _alike(folder: Path, path: Path) -> Iterator[str]:
    """The files with the same ending beside a file that is not there, by their paths
    from `folder`.
    """
    for one in sorted(path.parent.glob(f"*{path.suffix}"))[:MOST_FILES]:
        yield one.relative_to(folder).as_posix()


def _imported(folder: Path, file: str, text: str) -> Iterator[str]:
    """The files that a file imports relatively, by their paths from the folder."""
    try:
        nodes = _imports(text)
    except (SyntaxError, ValueError, RecursionError) as error:
        line = getattr(error, "lineno", None) or 1
        said = getattr(error, "msg", str(error))
        raise CodeError(f"{file}, line {line}: no Python: {said}") from None
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.level:
            yield from _relative(folder, file, node)
        else:
            _check_absolute(folder, file, node)


@lru_cache(maxsize=MOST_FILES)
def _imports(text: str) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """The imports of a file, which several entries of a spec name."""
    nodes = ast.walk(ast.parse(text))
    return tuple(one for one in nodes if isinstance(one, ast.Import | ast.ImportFrom))


def _relative(folder: Path, file: str, node: ast.ImportFrom) -> Iterator[str]:
    above = PurePosixPath(file).parts[: -node.level]
    if node.level > len(PurePosixPath(file).parts):
        raise CodeError(
            f"{file}, line {node.lineno}: imports from above the folder of the spec"
        )
    for end in range(1, len(above) + 1):  # importing a.b.c runs those of a and a.b too
        yield from _package(folder, PurePosixPath(*above[:end]))
    base = PurePosixPath(*above, *(node.module or "").split("."))
    whole = list(_module(folder, base)) if node.module else []
    yield from whole
    for alias in node.names:
        part = list(_module(folder, base / alias.name))
        yield from part
        if not part and not whole and not any(_package(folder, base)):
            wanted = f"{base / alias.name if not node.module else base}{SUFFIX}"
            raise CodeError(
                f"{file}, line {node.lineno}: there is no {wanted} to import"
            )


def _module(folder: Path, path: PurePosixPath) -> Iterator[str]:
    """The file of a module, if there is one."""
    file = path.with_name(path.name + SUFFIX)
    if (folder / file).is_file():
        yield file.as_posix()
    else:
        yield from _package(folder, path)


def _package(folder: Path, path: PurePosixPath) -> Iterator[str]:
    """The first file of a package, if it has one."""
    if (folder / path / PACKAGE).is_file():
        yield (path / PACKAGE).as_posix()


def _check_absolute(folder: Path, file: str, node: ast.Import | ast.ImportFrom) -> None:
    """Raise CodeError for an import that means a file beside, and does not say so."""
    named = (
        [alias.name for alias in node.names]
        if isinstance(node, ast.Import)
        else [node.module or ""]
    )
    beside = (folder / file).parent
    for name in named:
        first = name.partition(".")[0]
        if first in sys.stdlib_module_names:
            continue
        if (beside / f"{first}{SUFFIX}").is_file():
            raise CodeError(
                f'{file}, line {node.lineno}: "{name}" is a file beside it, which is'
                f" imported relatively: from . import {first}"
            )
