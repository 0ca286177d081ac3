"""The tests that are nearest to a module."""

import re
from functools import cache
from pathlib import Path

from tests.mutants.drawing import package_of

MOST_FILES = 8
OURS = re.compile(r"^\s*(?:from|import) ((?:sweep|kernels)[\w.]*)", re.MULTILINE)


def nearest(folder: Path, path: str) -> list[str]:
    """Files of tests that import a module, at most `MOST_FILES`; if none does, all of
    its package.

    Those in the folder of its package are first, and among them those that import the
    fewest modules of ours.
    """
    module = path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
    package = package_of(path)
    mirror = folder / "tests" if package == "sweep" else folder / "tests" / package
    found = [file for file in files_of_tests(folder) if _imports(file, module)]
    found.sort(key=lambda file: (file.parent != mirror, _so_many(file), file))
    chosen = found[:MOST_FILES] or sorted(mirror.glob("test_*.py"))
    return [file.relative_to(folder).as_posix() for file in chosen]


def files_of_tests(folder: Path) -> list[Path]:
    """All files of tests of a checkout, but for those of mutants."""
    files = sorted((folder / "tests").glob("**/test_*.py"))
    return [file for file in files if file.parent.name != "mutants"]


def is_there(folder: Path, test: str) -> bool:
    """Whether a checkout has a test: its file and its name, without values."""
    file, *_, name = test.split("::")
    place = folder / file
    return place.exists() and f"def {name}(" in _text(place)


def _imports(file: Path, module: str) -> bool:
    text = _text(file)
    if re.search(rf"(?<![\w.]){re.escape(module)}(?![\w.])", text):
        return True
    parent, _, name = module.rpartition(".")
    names = re.findall(rf"from {re.escape(parent)} import (\([^)]*\)|.*)", text)
    return bool(parent) and any(re.search(rf"\b{name}\b", one) for one in names)


def _so_many(file: Path) -> int:
    return len(set(OURS.findall(_text(file))))


@cache
def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8")
