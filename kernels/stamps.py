"""What code computes, as a hash: a function, and all that it uses.

The stamp of a function covers its own code and that of every definition of ours whose
name occurs in it, and so on: functions, classes and constants, in whatever file.
Comments, docstrings, annotations and layout are left out, so that a better explanation
leaves results valid. A stamp changes with whatever may change a number, and with
nothing that only others use.

Ours is `kernels`, whose names are read from the sources: a name that is put together
while a program runs is not seen. In other packages, and in files of the user's own, a
module counts as a whole, with all modules of the package that it imports.
"""

import ast
import hashlib
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

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


OURS = "kernels"
QUOTES = ("'", '"', '"""', "'''")
WHOLE = "*"
"""The name that stands for a module as a whole. Modules that are not ours are not taken
apart: their statements may act on each other in ways that nobody foresees.
"""


ENTRIES = ("MODEL", "METRICS", "MAPS", "STARTS", "SAMPLERS", "FIGURES")
"""What a module calls its entries."""
KINDS = {"Model", "Metric", "Map", "Start", "Sampler", "FigureKind"}
"""And what these are."""
MODEL = "Model"
DECLARED = {"publishes", "drives", "goals_in_turn", "shared"}
"""Fields of a Model on which no number of a trial depends: they declare what its source
says. So an author may add them, and stored trials stay valid.
"""


class Definition(NamedTuple):
    """A name at the top of a module; "" stands for the statements that define none."""

    module: str
    name: str


class Said(NamedTuple):
    """The code of a statement, the names in it with the attributes that follow them,
    and what it imports within.
    """

    code: str
    names: frozenset[str]
    imported: dict[str, str]


class Statement:
    """A statement at the top of a module. Its tree is read when a stamp needs it, as
    few do, and then forgotten: it takes far more memory.
    """

    def __init__(self, tree: ast.stmt, module: str) -> None:
        self._tree, self._module = tree, module

    @cached_property
    def said(self) -> Said:
        bare = _Bare().visit(self._tree)
        nodes = list(ast.walk(bare))
        names = frozenset(_names(nodes))
        imported = dict(_imported(nodes, self._module))
        del self._tree
        return Said(written_out(bare), names, imported)


@dataclass
class Source:
    """The top of a module: the statements that define each name, the dotted names of
    what is imported, and the modules of which everything is, by `import *`.
    """

    statements: dict[str, list[Statement]] = field(default_factory=dict)
    imported: dict[str, str] = field(default_factory=dict)
    whole: list[str] = field(default_factory=list)


@cache
def stamp(
    function: Callable[..., Any], of_code: Callable[..., str] | None = None
) -> str:
    """The sha256, in hexadecimal, of what a function computes, compiled or not; of a
    partial one, with the numbers and texts that it is given. `of_code` finds its
    `code_stamp`, where that may be known already.

    Of a function that is not ours it covers the modules that it reaches, and the
    numbers and texts that these hold. Raises ValueError for a function that is made
    within another one, and for a partial one that is given anything else: what they
    take along is in no source.
    """
    given = ""
    if isinstance(function, partial):
        if not _is_plain([*function.args, dict(function.keywords)]):
            raise ValueError(f"{function} is given more than numbers and texts")
        given = _written([*function.args, dict(sorted(function.keywords.items()))])
        function = function.func
    plain = getattr(function, "py_func", function)
    held = values(_at_once(plain.__module__))
    content = f"{(of_code or code_stamp)(plain)} {plain.__qualname__} {held} {given}"
    return hashlib.sha256(content.encode()).hexdigest()


@cache
def code_stamp(function: Callable[..., Any]) -> str:
    """The sha256, in hexadecimal, of the code of a function and of all that it uses.
    Raises ValueError as `stamp`.
    """
    _check_place(function)
    module, name = function.__module__, function.__name__
    named = _read(module).statements
    roots = {Definition(module, one) for one in ([name] if name in named else named)}
    lines = sorted(
        f"{_called(one.module)} {one.name} {_hash(one)}\n" for one in closure(roots)
    )
    return hashlib.sha256("".join(lines).encode()).hexdigest()


@cache
def text_hash(package: str) -> str:
    """The sha256, in hexadecimal, of all sources of a package as they stand, and of the
    version of Python: what `code_stamp` makes of these follows from both.
    """
    digest = hashlib.sha256(sys.version.encode())
    for name, text in texts_of(package):
        digest.update(f"{name} {len(text)}\n{text}".encode())
    return digest.hexdigest()


def texts_of(package: str) -> Iterator[tuple[str, str]]:
    """The sources of a package as this process has read them, by the names of their
    files within it.
    """
    for folder in map(Path, sys.modules[package].__path__):
        for path in sorted(folder.rglob("*.py")):
            inner = path.relative_to(folder)
            module = ".".join([package, *inner.with_suffix("").parts])
            text, _ = _known_text(module.removesuffix(".__init__"))
            yield inner.as_posix(), text


def note_sources(function: Callable[..., Any]) -> None:
    """Read the sources of all that a function may use, which are imported before it: a
    stamp that is asked for later is that of what runs, also after an edit of a file.
    Raises ValueError for a function that can have no stamp.
    """
    _check_place(function)
    _known_text(function.__module__)
    _read_texts(function.__module__)


@cache
def _read_texts(module: str) -> None:
    packages = (OURS, module.partition(".")[0])
    for name in list(sys.modules):
        if name.partition(".")[0] in packages:
            _found_text(name)


def _check_place(function: Callable[..., Any]) -> None:
    if not at_the_top(function):
        raise ValueError(f"{function} is no function at the top of a module")


def values(modules: Iterable[str]) -> str:
    """The numbers, texts and arrays at the top of modules, as a hash: they may come
    from files, and compiled code holds them.
    """
    digest = hashlib.sha256()
    for name in sorted(modules):
        for key, value in sorted(vars(sys.modules[name]).items()):
            if not key.startswith("__") and _is_plain(value):
                digest.update(f"{_called(name)} {key} {_written(value)}\n".encode())
    return digest.hexdigest()


def _is_plain(value: Any) -> bool:
    if type(value) in (tuple, list):
        return all(map(_is_plain, value))
    if type(value) is dict:
        return all(map(_is_plain, (*value, *value.values())))
    if isinstance(value, np.ndarray):
        return not value.dtype.hasobject
    plain = int | float | complex | str | bytes | np.generic
    return value is None or isinstance(value, plain)


def _written(value: Any) -> str:
    """A plain value in full, which `repr` of an array is not."""
    if isinstance(value, np.ndarray):
        content = hashlib.sha256(value.tobytes()).hexdigest()
        return f"{value.dtype} {value.shape} {content}"
    if type(value) is dict:
        return f"{{{_written([one for item in value.items() for one in item])}}}"
    if type(value) in (tuple, list):
        return f"({', '.join(map(_written, value))})"
    return repr(value)


LATER = ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda
"""What is inside runs when it is called."""


@cache
def _at_once(module: str) -> frozenset[str]:
    """The modules that are imported with one that is not ours, itself among them; those
    that a function imports when it is called are not. None for one of ours.
    """
    package, found, waiting = module.partition(".")[0], set[str](), [module]
    while waiting and package != OURS:
        one = waiting.pop()
        if one in found or one not in sys.modules or not _found_text(one):
            continue
        found.add(one)
        text, _ = _known_text(one)
        nodes = list[ast.AST]()
        inner = list[ast.AST](ast.parse(text).body)
        while inner:
            node = inner.pop()
            if not isinstance(node, LATER):
                nodes.append(node)
                inner += ast.iter_child_nodes(node)
        for _, meant in _imported(nodes, one):
            if meant.partition(".")[0] == package:
                parts = meant.split(".")
                waiting += (".".join(parts[:end]) for end in range(1, len(parts) + 1))
    return frozenset(found)


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


def stamp_of_all(*places: Path) -> str:
    """The sha256 of Python sources, all below folders, or single files: their names and
    code.
    """
    folders = [place if place.is_dir() else place.parent for place in places]
    return stamp_of_texts(
        (path.relative_to(folder).as_posix(), path.read_bytes())
        for place, folder in zip(places, folders, strict=True)
        for path in (sorted(place.rglob("*.py")) if place.is_dir() else [place])
    )


def stamp_of_texts(texts: Iterable[tuple[str, str | bytes]]) -> str:
    """The sha256 of the names of Python sources and of their code."""
    digest = hashlib.sha256()
    for name, text in texts:
        code = written_out(_Bare().visit(ast.parse(text)))
        digest.update(f"{name} {len(code)}\n{code}".encode())
    return digest.hexdigest()


def closure(roots: Iterable[Definition]) -> set[Definition]:
    """`roots` and all definitions that they use, directly or through others."""
    found, waiting = set[Definition](), [_as_followed(one) for one in roots]
    while waiting:
        one = waiting.pop()
        if one not in found and ".".join(one) not in NOT_FOLLOWED:
            found.add(one)
            waiting += map(_as_followed, _used(one))
    return found


def _as_followed(one: Definition) -> Definition:
    """A definition of ours, or the whole module of another one."""
    ours = one.module.partition(".")[0] == OURS
    return one if ours else Definition(one.module, WHOLE)


@cache
def _used(definition: Definition) -> frozenset[Definition]:
    """The definitions of ours whose names occur in the code of one. A module that is
    not ours uses all that it imports.
    """
    module, name = definition
    source = _read(module)
    if name == WHOLE:
        return frozenset(_reached(module))
    found = {Definition(module, "")}
    for statement in source.statements.get(name, []):
        imported = source.imported | statement.said.imported
        for used in statement.said.names:
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


def _reached(module: str) -> set[Definition]:
    """What a module imports anywhere: modules of its own package, and definitions of
    ours.
    """
    text, _ = _known_text(module)
    nodes = list(ast.walk(_Bare().visit(ast.parse(text))))
    names, found = set(_names(nodes)), set[Definition]()
    for name, meant in _imported(nodes, module):
        found |= _aimed(meant, module)
        for used in names:
            first, _, rest = used.partition(".")
            if first == name and rest:
                found |= _aimed(f"{meant}.{rest}", module)
    return found


def _aimed(dotted: str, user: str) -> set[Definition]:
    """What a dotted name that is imported by a module that is not ours stands for."""
    package, parts = user.partition(".")[0], dotted.split(".")
    if parts[0] == OURS:
        for end in range(1, len(parts) + 1):
            with suppress(ImportError):
                import_module(".".join(parts[:end]))
        return _meant(dotted, user)
    if parts[0] != package:
        return set()
    prefixes = [".".join(parts[:end]) for end in range(1, len(parts) + 1)]
    return {Definition(one, WHOLE) for one in prefixes if _found_text(one)}


def _meant(
    dotted: str, user: str, met: frozenset[str] = frozenset()
) -> set[Definition]:
    """The definitions for which a dotted name stands in the module `user`; none where
    they are not ours. A module without a name stands for all that it defines.

    `met` are the names that have led to it, as modules may import each other.
    """
    package = dotted.partition(".")[0]
    if package not in (OURS, user.partition(".")[0]) or dotted in met:
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
    """What the source of a module says."""
    source, (text, _) = Source(), _known_text(module)
    for statement in ast.parse(text).body:
        if _is_constant(statement):
            continue
        if not isinstance(statement, ast.FunctionDef | ast.ClassDef):
            for name, meant in _imported(ast.walk(statement), module):
                if name == "*":
                    source.whole.append(meant)
                else:
                    source.imported[name] = meant
        if not isinstance(statement, ast.Import | ast.ImportFrom):
            kept = Statement(statement, module)
            for name in _bound(statement) or [""]:
                source.statements.setdefault(name, []).append(kept)
    return source


def _known_text(module: str) -> tuple[str, bool]:
    found = _found_text(module)
    if found is None:
        raise ValueError(f"{module} has no source")
    return found


@cache
def _found_text(module: str) -> tuple[str, bool] | None:
    """The source of a module, and whether it is a package; None where there is none.

    It need not have been imported yet. A package that was made from texts has them as
    `__sources__`, by the names of its modules.
    """
    package, *inner = module.split(".")
    whole = sys.modules[package]
    sources: dict[str, tuple[str, bool]] | None = getattr(whole, "__sources__", None)
    if sources is not None:
        return sources.get(module)
    folders = [Path(folder, *inner) for folder in getattr(whole, "__path__", ())]
    files = [(folder / "__init__.py", True) for folder in folders]
    files += [(folder.with_suffix(".py"), False) for folder in folders if inner]
    if not inner and not folders and whole.__file__:
        files = [(Path(whole.__file__), False)]
    for file, is_package in files:
        if file.is_file():
            return file.read_text("utf-8"), is_package
    return None


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
    _, is_package = _known_text(module)
    parts = module.split(".")
    kept = len(parts) - node.level + is_package
    return ".".join(parts[: max(0, kept)])


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
        body = [part for part in node.body if not _is_constant(part)]
        if isinstance(node, ast.ClassDef) and node.name == MODEL:
            body = [part for part in body if not _is_declared(part)]
        node.body = body or [ast.Pass()]
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if isinstance(node.func, ast.Name) and node.func.id == MODEL:
            node.keywords = [word for word in node.keywords if word.arg not in DECLARED]
        return self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        node.annotation = ast.Constant(None)
        return self.generic_visit(node)


def _is_declared(part: ast.stmt) -> bool:
    """Return whether a statement of the class Model is a field of DECLARED."""
    return (
        isinstance(part, ast.AnnAssign)
        and isinstance(part.target, ast.Name)
        and part.target.id in DECLARED
    )


def written_out(tree: ast.AST) -> str:
    """Code as text, the same from every version of Python. This changes the tree.

    Since 3.12 Python may write the quotes of an f-string within it, too.
    """
    if any(isinstance(node, ast.JoinedStr) for node in ast.walk(tree)):
        tree = _Quoted().visit(tree)
    return ast.unparse(tree)


class _Quoted(ast.NodeTransformer):
    """Puts f-strings into quotes that do not occur in them, as Python 3.11 does."""

    def visit_FormattedValue(self, node: ast.FormattedValue) -> ast.AST:
        node.value = self.visit(node.value)
        return node

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        self.generic_visit(node)
        text = ast.unparse(node)
        outer = text[1:4] if text[1:4] in QUOTES else text[1]
        inner = text[1 + len(outer) : -len(outer)]
        for quote in QUOTES:
            if quote not in inner and (len(quote) == 3 or "\n" not in inner):
                return ast.Name(f"f{quote}{inner}{quote}")  # is written as it stands
        return node


def _is_constant(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _enters(statement: ast.stmt) -> bool:
    """Whether a statement enters functions in a table of entries, and computes nothing:
    what it says of them beside is no code, and ids cover what matters of it.
    """
    if not (
        isinstance(statement, ast.Assign)
        and isinstance(statement.targets[0], ast.Name)
        and statement.targets[0].id in ENTRIES
    ):
        return False
    nodes = list(ast.walk(statement.value))
    calls = {ast.unparse(node.func) for node in nodes if isinstance(node, ast.Call)}
    made = any(isinstance(node, ast.Lambda | ast.comprehension) for node in nodes)
    return not made and calls <= KINDS


@cache
def _hash(definition: Definition) -> str:
    if definition.name == WHOLE:
        text, _ = _known_text(definition.module)
        tree = _Bare().visit(ast.parse(text))
        tree.body = [one for one in tree.body if not _enters(one)]
        code = written_out(tree)
    else:
        statements = _read(definition.module).statements.get(definition.name, [])
        code = "\n".join(statement.said.code for statement in statements)
    return hashlib.sha256(code.encode()).hexdigest()
