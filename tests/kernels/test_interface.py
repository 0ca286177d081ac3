"""The public interface: what its page lists is there as listed, and is all that models
use, ours and the examples.
"""

import ast
import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import kernels
from kernels.models import MODELS
from tests import ROOT

PAGE = (ROOT / "docs" / "own-models.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| `([\w.]*\.\w+)` \| `(\w+)([^`]*)` \| .+ \|$", re.MULTILINE)
LISTED = {
    (f"kernels{module}" if module.startswith(".") else module, name): rest
    for module, name, rest in ROW.findall(PAGE)
}
"""What follows a name on the page: `(its, arguments=...)`, or `: some, fields`, or
nothing.
"""
WRITTEN = [
    *(ROOT / "kernels" / "models" / f"{name}.py" for name in MODELS),
    *sorted((ROOT / "examples").glob("*.py")),
]
FIELDS = {
    name: rest.removeprefix(": ").split(", ")
    for (_, name), rest in LISTED.items()
    if rest.startswith(": ")
}
"""Those that may be read of what is handed to models, metrics, maps and starts."""


def found(module: str, name: str) -> Any:
    """What is listed; of a compiled function the plain one."""
    entry = getattr(import_module(module), name)
    return getattr(entry, "py_func", entry)


def arguments(entry: Any) -> str:
    parameters = inspect.signature(entry).parameters.values()
    return ", ".join(
        one.name + ("" if one.default is one.empty else "=...") for one in parameters
    )


def is_called(entry: Any) -> bool:
    """Whether users call it: a function, or a class that is no alias of a type."""
    return inspect.isfunction(entry) or inspect.isclass(entry)


def test_the_page_lists_names() -> None:
    """Else the pattern of a row has become one that finds none."""
    assert len(LISTED) > 50
    assert len(LISTED) == len(re.findall(r"^\| `\.|^\| `sweep\.", PAGE, re.MULTILINE))


@pytest.mark.parametrize(("module", "name"), LISTED)
def test_what_is_listed_is_there_with_these_arguments(module: str, name: str) -> None:
    entry, rest = found(module, name), LISTED[module, name]
    if name in FIELDS:
        assert set(FIELDS[name]) <= set(dir(entry)) | set(
            inspect.get_annotations(entry)
        )
    elif rest:
        assert rest == f"({arguments(entry)})"
    else:
        assert not is_called(entry)


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """The modules of `kernels` that a file imports from, each with a name."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert not any(one.name.startswith("kernels") for one in node.names)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith(
            "kernels"
        ):
            yield from ((node.module, one.name) for one in node.names)


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.stem)
def test_models_import_what_is_listed_and_nothing_else(path: Path) -> None:
    assert set(imports(path)) <= LISTED.keys()


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.stem)
def test_models_read_the_fields_that_are_listed(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            kinds = {
                one.arg: ast.unparse(one.annotation)
                for one in function.args.args
                if one.annotation
            }
            for node in ast.walk(function):
                if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                    kind = kinds.get(node.value.id)
                    assert node.attr in FIELDS.get(kind, [node.attr]), node.lineno


def test_the_page_is_of_this_version() -> None:
    assert f"It is interface {kernels.INTERFACE} (`kernels.INTERFACE`)." in PAGE
