"""The text of the files of custom code.

The files are named by a spec, or are next to a named file, which imports them.
The text is read once, before any code runs. Every worker and the store get the text. So
all trials are computed by equal code, even if a file changes later.
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
from sweep.spec import PLAN
from sweep.text import similar

SUFFIX = ".py"
"""Ending of files of code; other files are data."""
PACKAGE = "__init__.py"
MOST_BYTES = 2_000_000
MOST_FILES = 100
KEPT = (
    ", a folder of results: `sweep code STUDY --to FOLDER` writes spec and code of a"
    " study into a folder, to launch there"
)
"""Hint for a spec that is launched from a folder of results, without its files."""


@dataclass(frozen=True)
class Sources:
    """The texts of files by path from one folder, such as `rules/pull.py`."""

    files: tuple[tuple[str, str], ...]

    @cached_property
    def texts(self) -> dict[str, str]:
        """The text of each file by path."""
        return dict(self.files)

    @cached_property
    def sha(self) -> str:
        """The sha256 of the paths and texts of all files."""
        return hashlib.sha256(json.dumps(self.files).encode()).hexdigest()

    @property
    def code(self) -> tuple[str, ...]:
        """The files that run."""
        return tuple(file for file in self.texts if file.endswith(SUFFIX))

    @property
    def package(self) -> str:
        """The package name of the folder in imports."""
        return f"own_{self.sha[:16]}"

    def also(self, file: str, text: str) -> "Sources":
        """Return the files and one more.

        Parameters
        ----------
        file : str
            Path of the further file.
        text : str
            Text of the further file.
        """
        return Sources(tuple(sorted({**self.texts, file: text}.items())))

    def module(self, file: str) -> str:
        """Return the full module name of a file."""
        parts = PurePosixPath(file).with_suffix("").parts
        inner = parts[:-1] if file.endswith(PACKAGE) else parts
        return ".".join([self.package, *inner])


def gather(folder: Path, files: Iterable[str]) -> Sources:
    """Read files, with paths from `folder`, and all relatively imported files.

    Raises CodeError, which names file and line, for a file outside the folder, a file
    that cannot be read or is no Python, and an import without a file. More than
    MOST_FILES files or MOST_BYTES bytes are also a CodeError.
    """
    texts = dict[str, str]()
    waiting = list(dict.fromkeys(files))
    while waiting:
        file = waiting.pop()
        if file not in texts:
            texts[file] = _text(folder, file)
            if file.endswith(SUFFIX):
                waiting += _imported(folder, file, texts[file])
        if len(texts) > MOST_FILES:
            raise CodeError(f"{file}: more than {MOST_FILES} files import each other")
        if sum(map(len, texts.values())) > MOST_BYTES:
            raise CodeError(f"{file}: the files have more than {MOST_BYTES:,} bytes")
    return Sources(tuple(sorted(texts.items())))


def _text(folder: Path, file: str) -> str:
    path = folder / file
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        if not path.is_file():
            hint = similar(file, list(_alike(folder, path)))
            hint = hint or (KEPT if (folder / PLAN).is_file() else "")
            raise CodeError(f'there is no file "{file}" in {folder}{hint}')
        content = path.read_bytes() if path.stat().st_size <= MOST_BYTES else None
    except (OSError, RuntimeError, ValueError) as error:
        raise CodeError(f"{file} cannot be read: {error}") from None
    if not inside:
        raise CodeError(
            f"{file} is outside the folder of the spec, {folder}: copy the file there,"
            " or turn it into a package"
        )
    if content is None:
        raise CodeError(f"{file} has more than {MOST_BYTES:,} bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise CodeError(f"{file} is not text in UTF-8: {error}") from None


def _alike(folder: Path, path: Path) -> Iterator[str]:
    """Yield the files next to a missing file with an equal ending.

    The files are paths from `folder`.
    """
    for file in sorted(path.parent.glob(f"*{path.suffix}"))[:MOST_FILES]:
        yield file.relative_to(folder).as_posix()


def _imported(folder: Path, file: str, text: str) -> Iterator[str]:
    """Yield the files that a file imports relatively, as paths from the folder."""
    try:
        nodes = _imports(text)
    except (SyntaxError, ValueError, RecursionError) as error:
        line = getattr(error, "lineno", None) or 1
        message = getattr(error, "msg", str(error))
        raise CodeError(f"{file}, line {line}: not Python: {message}") from None
    for node in nodes:
        if isinstance(node, ast.ImportFrom) and node.level:
            yield from _relative(folder, file, node)
        else:
            _check_absolute(folder, file, node)


@lru_cache(maxsize=MOST_FILES)
def _imports(text: str) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """Return the imports of a file, which several entries of a spec name."""
    nodes = ast.walk(ast.parse(text))
    return tuple(
        node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)
    )


def _relative(folder: Path, file: str, node: ast.ImportFrom) -> Iterator[str]:
    above = PurePosixPath(file).parts[: -node.level]
    if node.level > len(PurePosixPath(file).parts):
        raise CodeError(
            f"{file}, line {node.lineno}: imports from above the folder of the spec"
        )
    for end in range(1, len(above) + 1):  # importing a.b.c also runs a and a.b
        yield from _package(folder, PurePosixPath(*above[:end]))
    base = PurePosixPath(*above, *(node.module or "").split("."))
    files = list(_module(folder, base)) if node.module else []
    yield from files
    for alias in node.names:
        submodule = list(_module(folder, base / alias.name))
        yield from submodule
        if not submodule and not files and not any(_package(folder, base)):
            missing = f"{base / alias.name if not node.module else base}{SUFFIX}"
            raise CodeError(
                f"{file}, line {node.lineno}: there is no {missing} to import"
            )


def _module(folder: Path, path: PurePosixPath) -> Iterator[str]:
    """Yield the file of a module, if there is one."""
    file = path.with_name(path.name + SUFFIX)
    if (folder / file).is_file():
        yield file.as_posix()
    else:
        yield from _package(folder, path)


def _package(folder: Path, path: PurePosixPath) -> Iterator[str]:
    """Yield the first file of a package, if there is one."""
    if (folder / path / PACKAGE).is_file():
        yield (path / PACKAGE).as_posix()


def _check_absolute(folder: Path, file: str, node: ast.Import | ast.ImportFrom) -> None:
    """Raise CodeError for an absolute import of a file next to this one."""
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
                f'{file}, line {node.lineno}: "{name}" is a file in the folder of this'
                f" file; import it relatively: from . import {first}"
            )
