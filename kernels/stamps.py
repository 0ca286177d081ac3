"""What code computes, as a hash: a function, and all that it uses.

The stamp of a function covers its own code and that of every definition of ours whose
name occurs in it, and so on: functions, classes and constants, in whatever file.
Comments, docstrings, annotations and layout are left out, so that a better explanation
leaves results valid. A stamp changes with whatever may change a number, and with
nothing that only others use.

Ours is the package of the function, and `kernels`. Names are read from the sources: a
name that is put together while a program runs is not seen.
"""

import ast
import hashlib
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

NOT_FOLLOWED = (
    "kernels.caching.ByClasses",
    "kernels.caching.OURS",
    "kernels.metrics.METRICS",
    "kernels.models.MODELS",
    "kernels.starts.STARTS",
    "kernels.worlds.MAPS",
)
"""Tables of what a trial looks up by name, which has a stamp of its own; and of what
numba caches, which is the same wherever it is kept.
"""


class Definition(NamedTuple):
    """A name at the top of a module; "" stands for the statements that define none."""

    module: str
    name: str


class Statement(NamedTuple):
    """A statement at the top of a module: its code, the names in it with the attributes
    that follow them, and what it imports within. Its tree would take far more memory.
    """

    code: str
    names: frozenset[str]
    imported: dict[str, str]


@dataclass
class Source:
    """The top of a module: the statements that define each name, the dotted names of
    what is imported, and the modules of which everything is, by `import *`.
    """

    statements: dict[str, list[Statement]] = field(default_factory=dict)
    imported: dict[str, str] = field(default_factory=dict)
    whole: list[str] = field(default_factory=list)


@cache
def stamp(function: Callable[..., Any]) -> str:
    """The sha256, in hexadecimal, of what a function computes, compiled or not; of a
    partial one, with the numbers and texts that it is given. A lambda has no name: its
    stamp covers all of its module.

    Raises ValueError for a function that is made within another one: the values that
    it takes from there are in no source.
    """
    if not at_the_top(function):
        raise ValueError(f"{function} is no function at the top of a module")
    if isinstance(function, partial):
        given = f"{stamp(function.func)} {function.args!r} {function.keywords!r}"
        return hashlib.sha256(given.encode()).hexdigest()
    plain = getattr(function, "py_func", function)
    module, name = plain.__module__, plain.__name__
    named = _read(module).statements
    roots = {Definition(module, one) for one in ([name] if name in named else named)}
    lines = sorted(
        f"{_called(one.module)} {one.name} {_hash(one)}\n" for one in closure(roots)
    )
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def at_the_top(function: Callable[..., Any]) -> bool:
    """Whether a function stands at the top of a module, as one with a stamp must."""
    if isinstance(function, partial):
        return at_the_top(function.func)
    plain = getattr(function, "py_func", function)
    return "." not in getattr(plain, "__qualname__", ".")


def _called(module: str) -> str:
    """The name of a module; a package may say what stamps call it, as `__stamped__`."""
    package, dot, inner = module.partition(".")
    return f"{getattr(sys.modules[package], '__stamped__', package)}{dot}{inner}"


def stamp_of_all(folder: Path) -> str:
    """The sha256 of all Python sources below `folder`: their names and code."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        code = ast.unparse(_Bare().visit(ast.parse(path.read_bytes())))
        name = path.relative_to(folder).as_posix()
        digest.update(f"{name} {len(code)}\n{code}".encode())
    return digest.hexdigest()


def closure(roots: Iterable[Definition]) -> set[Definition]:
    """`roots` and all definitions that they use, directly or through others."""
    found, waiting = set[Definition](), [*roots]
    while waiting:
        one = waiting.pop()
        if one not in found and ".".join(one) not in NOT_FOLLOWED:
            found.add(one)
            waiting += _used(one)
    return found


@cache
def _used(definition: Definition) -> frozenset[Definition]:
    """The definitions of ours whose names occur in the code of one."""
    module, name = definition
    source = _read(module)
    found = {Definition(module, "")}
    for statement in source.statements.get(name, []):
        imported = source.imported | statement.imported
        for used in statement.names:
            first, _, rest = used.partition(".")
            if first in imported:
                meant = f"{imported[first]}.{rest}" if rest else imported[first]
                found |= _meant(meant, module)
            elif first in source.statements:
                found.add(Definition(module, first))
            else:
                for other in source.whole:
                    found |= _meant(f"{other}.{used}", module)
    return frozenset(found)


def _meant(
    dotted: str, user: str, met: frozenset[str] = frozenset()
) -> set[Definition]:
    """The definitions for which a dotted name stands in the module `user`; none where
    they are not ours. A module without a name stands for all that it defines.

    `met` are the names that have led to it, as modules may import each other.
    """
    package = dotted.partition(".")[0]
    if package not in ("kernels", user.partition(".")[0]) or dotted in met:
        return set()
    met |= {dotted}
    module, name = dotted, ""
    while module not in sys.modules and module:
        module, _, last = module.rpartition(".")
        name = f"{last}.{name}" if name else last
    source, first = _read(module), name.partition(".")[0]
    if first in source.imported:
        return _meant(source.imported[first], module, met)
    found = {
        Definition(module, one) for one in ([first] if first else source.statements)
    }
    if first not in source.statements:
        for other in source.whole:
            found |= _meant(f"{other}.{name}".rstrip("."), module, met)
    return found


@cache
def _read(module: str) -> Source:
    """What the source of a module that has been imported says."""
    source = Source()
    for statement in ast.parse(_text(sys.modules[module])).body:
        if _is_constant(statement):
            continue
        if not isinstance(statement, ast.FunctionDef | ast.ClassDef):
            for name, meant in _imported(ast.walk(statement), module):
                if name == "*":
                    source.whole.append(meant)
                else:
                    source.imported[name] = meant
        if not isinstance(statement, ast.Import | ast.ImportFrom):
            said = _said(statement, module)
            for name in _bound(statement) or [""]:
                source.statements.setdefault(name, []).append(said)
    return source


def _text(module: ModuleType) -> str | bytes:
    """The source of a module; one that was made from a text has it as `__source__`."""
    if text := getattr(module, "__source__", ""):
        return str(text)
    assert module.__file__ is not None
    return Path(module.__file__).read_bytes()


def _said(statement: ast.stmt, module: str) -> Statement:
    bare = _Bare().visit(statement)
    nodes = list(ast.walk(bare))
    names = frozenset(_names(nodes))
    return Statement(ast.unparse(bare), names, dict(_imported(nodes, module)))


def _bound(statement: ast.stmt) -> set[str]:
    """The names that a statement defines, or changes as `NAME[0] = 1` does."""
    found, waiting = set[str](), list[Any]([statement])
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
            continue
        if isinstance(node, ast.comprehension):  # its names are its own
            continue
        if isinstance(getattr(node, "ctx", None), ast.Store):
            while isinstance(node, ast.Attribute | ast.Subscript):
                node = node.value
            found |= {node.id} if isinstance(node, ast.Name) else set()
        waiting += ast.iter_child_nodes(node)
    return found


def _imported(nodes: Iterable[ast.AST], module: str) -> Iterator[tuple[str, str]]:
    """The names that are imported among `nodes`, and what they stand for: "*" stands
    for all of a module.
    """
    for node in nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                first = alias.name.partition(".")[0]
                yield alias.asname or first, alias.name if alias.asname else first
        elif isinstance(node, ast.ImportFrom):
            origin = ".".join(filter(None, [_origin(node, module), node.module]))
            for alias in node.names:
                whole = alias.name == "*"
                meant = origin if whole else f"{origin}.{alias.name}"
                yield alias.asname or alias.name, meant


def _origin(node: ast.ImportFrom, module: str) -> str:
    """The package from which a relative import counts, "" for an absolute one."""
    if node.level == 0:
        return ""
    path = sys.modules[module].__package__ or ""
    return ".".join(path.split(".")[: len(path.split(".")) - node.level + 1])


def _names(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """The names among `nodes`, which go from the outside to the inside, each with the
    attributes that follow it.
    """
    within = set[ast.AST]()
    for node in nodes:
        dotted, inner = list[str](), node
        while isinstance(inner, ast.Attribute):
            dotted.append(inner.attr)
            inner = inner.value
            within.add(inner)
        if isinstance(inner, ast.Name) and node not in within:
            yield ".".join([inner.id, *reversed(dotted)])


class _Bare(ast.NodeTransformer):
    """Takes annotations and docstrings out of a tree."""

    def visit_arg(self, node: ast.arg) -> ast.AST:
        node.annotation = None
        return node

    def visit_Module(self, node: ast.Module) -> ast.AST:
        return self.visit_ClassDef(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        node.returns = None
        return self.visit_ClassDef(node)

    def visit_ClassDef(
        self, node: ast.Module | ast.FunctionDef | ast.ClassDef
    ) -> ast.AST:
        kept = [part for part in node.body if not _is_constant(part)]
        node.body = kept or [ast.Pass()]
        return self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        node.annotation = ast.Constant(None)
        return self.generic_visit(node)


def _is_constant(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


@cache
def _hash(definition: Definition) -> str:
    statements = _read(definition.module).statements.get(definition.name, [])
    code = "\n".join(statement.code for statement in statements)
    return hashlib.sha256(code.encode()).hexdigest()
