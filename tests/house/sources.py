"""A checkout whose files are read and parsed once, whatever number of rules looks at
them.
"""

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from tests import ROOT

Function = ast.FunctionDef | ast.AsyncFunctionDef


class Finding(NamedTuple):
    """A place that breaks a rule."""

    file: str
    line: int
    what: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.what}"


class Module:
    """A Python file."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.tree = ast.parse(text, name)

    @cached_property
    def nodes(self) -> list[ast.AST]:
        return list(ast.walk(self.tree))

    @cached_property
    def imports(self) -> list[tuple[int, str]]:
        """The lines of imports anywhere, and what is imported with its module; of a
        relative import with its dots.
        """
        found = []
        for node in self.nodes:
            if isinstance(node, ast.Import):
                found += [(node.lineno, alias.name) for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                origin = "." * node.level + (node.module or "")
                found += [(node.lineno, f"{origin}.{one.name}") for one in node.names]
        return found

    @cached_property
    def texts(self) -> dict[str, int]:
        """The texts in the code without its docstrings, and their first lines."""
        said = {id(node.value) for node in self.nodes if isinstance(node, ast.Expr)}
        found: dict[str, int] = {}
        for node in self.nodes:
            is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
            if is_text and id(node) not in said:
                found.setdefault(node.value, node.lineno)
        return found

    @cached_property
    def public(self) -> list[Function | ast.ClassDef]:
        """Its functions and classes for others."""
        return [
            node
            for node in self.tree.body
            if isinstance(node, Function | ast.ClassDef) and node.name[0] != "_"
        ]

    def finding(self, place: int | ast.AST, what: str) -> Finding:
        line = place if isinstance(place, int) else place.lineno
        return Finding(self.name, line, what)


class Document:
    """A file of text."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.text = text

    def finding(self, place: int, what: str) -> Finding:
        """At a place in the text, counted in signs."""
        return Finding(self.name, self.text.count("\n", 0, place) + 1, what)


class Checkout:
    """The files below a folder. Names of files are relative to it."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._modules: dict[str, Module] = {}
        self._documents: dict[str, Document] = {}

    def files(self, *patterns: str) -> list[str]:
        """The files that match one of the patterns."""
        found = {path for pattern in patterns for path in self.root.glob(pattern)}
        return sorted(path.relative_to(self.root).as_posix() for path in found)

    def document(self, name: str) -> Document:
        if name not in self._documents:
            path = self.root / name
            text = path.read_text(encoding="utf-8") if path.exists() else ""
            self._documents[name] = Document(name, text)
        return self._documents[name]

    def module(self, name: str) -> Module:
        if name not in self._modules:
            self._modules[name] = Module(name, self.document(name).text)
        return self._modules[name]

    @cached_property
    def modules(self) -> dict[str, Module]:
        """Those of `kernels` and `sweep`."""
        names = self.files("kernels/**/*.py", "sweep/**/*.py")
        return {name: self.module(name) for name in names}

    def part(self, beginning: str) -> list[Module]:
        """The modules whose names begin so."""
        return [
            module
            for name, module in self.modules.items()
            if name.startswith(beginning)
        ]


def called(call: ast.Call) -> str:
    """The name of the function or method that is called."""
    bare = isinstance(call.func, ast.Name)
    return call.func.id if bare else getattr(call.func, "attr", "")


def without_a_reason(
    modules: Iterable[Module],
    uses: Callable[[Module], Iterable[tuple[str, ast.AST]]],
    reasons: Mapping[str, str],
    what: str,
) -> Iterator[Finding]:
    """Uses of names for which there is no reason under `file name`, and reasons for
    what is not used any more.
    """
    seen = set()
    for module in modules:
        for name, node in uses(module):
            place = f"{module.name} {name}"
            seen.add(place)
            if place not in reasons:
                yield module.finding(node, f"{what} {name}, for no reason that is said")
    for place in reasons.keys() - seen:
        file, _, name = place.partition(" ")
        yield Finding(file, 1, f"no longer {what} {name}, for which a reason is said")


Rule = Callable[[Checkout], Iterator[Finding]]
HERE = Checkout(ROOT)
"""The checkout in which this file lies."""
