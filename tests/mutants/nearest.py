"""The tests that are nearest to a module."""

import re
from functools import cache
from pathlib import Path

from tests.mutants.drawing import package_of

MOST_FILES = 8
OURS = re.compile(r"^\s*(?:from|import) ((?:sweep|kernels)[\w.]*)", re.MULTILINE)


def nearest(folder: Path, path: str) -> list[str]:
    """Files of tests that have the name of a module or import it, at most `MOST_FILES`.

    That of its name is first, then those in the folder of its package, and among them
    those that import the fewest modules of ours.
    """
    module = _module(path)
    own = f"test_{module.rpartition('.')[2]}"
    found = [
        file
        for file in files_of_tests(folder)
        if file.stem == own or _imports(file, module)
    ]
    mirror = _mirror(folder, path)
    found.sort(
        key=lambda file: (file.stem != own, file.parent != mirror, _so_many(file), file)
    )
    return [file.relative_to(folder).as_posix() for file in found[:MOST_FILES]]


def of_package(folder: Path, path: str) -> list[str]:
    """All files of tests of the package of a module."""
    files = sorted(_mirror(folder, path).glob("test_*.py"))
    return [file.relative_to(folder).as_posix() for file in files]


def _module(path: str) -> str:
    return path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


def _mirror(folder: Path, path: str) -> Path:
    package = package_of(path)
    return folder / "tests" if package == "sweep" else folder / "tests" / package


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
