"""Stamps: hashes of the code of a function and of all definitions it uses.

The stamp of a function covers the code of the function. The stamp also covers every
definition of `kernels` with a name in this code: functions, classes and constants, in
any file. The code of these definitions is searched for names in turn. Comments,
docstrings, annotations and layout are left out, so a better explanation leaves results
valid. A stamp changes with everything that may change a result of the function, and
with nothing else.

Names of `kernels` are read from the sources, so a name that a running program composes
is not found. In custom packages and files, a module counts as a whole, with all
imported modules of the package.
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
    "kernels.profiles.PROFILES",
    "kernels.starts.STARTS",
    "kernels.worlds.MAPS",
)
"""Definitions that no stamp covers.

Some definitions are tables of entries that a trial looks up by name; each entry has a
separate stamp. The remaining definitions store compiled code, which does not depend on
the place of storage.
"""


OURS = "kernels"
"""Package with definitions that are followed one by one."""
QUOTES = ("'", '"', '"""', "'''")
"""Quotes of an f-string, in the order in which Python 3.11 tries them."""
WHOLE = "*"
"""Name that denotes a module as a whole.

Modules of custom packages are not split, since their statements may interact in
unforeseeable ways.
"""


ENTRIES = ("MODEL", "METRICS", "MAPS", "STARTS", "PROFILES", "SAMPLERS", "FIGURES")
"""Names of the tables of entries in a module."""
KINDS = {"Model", "Metric", "Map", "Start", "Profile", "Sampler", "FigureKind"}
"""Classes of these entries."""
MODEL = "Model"
DECLARED = {"publishes", "drives", "goals_in_turn", "shared"}
"""Fields of a Model without an effect on any result of a trial.

The fields declare facts about the source of the model. So an author may add the fields,
and stored trials stay valid.
"""


class Definition(NamedTuple):
    """Name at the top of a module; "" denotes the statements that define no name."""

    module: str
    name: str


class StatementContent(NamedTuple):
    """Code of a statement, with the names and the imports in the code.

    `names` include the attributes after a name. `imported` has the dotted origin of
    each name that the statement imports.
    """

    code: str
    names: frozenset[str]
    imported: dict[str, str]


class Statement:
    """Statement at the top of a module.

    The tree is read when a stamp needs the content, which is rare. Then the tree is
    dropped, since a tree takes far more memory than the content.
    """

    def __init__(self, tree: ast.stmt, module: str) -> None:
        self._tree = tree
        self._module = module

    @cached_property
    def content(self) -> StatementContent:
        """Code, names and imports of the statement."""
        bare = _Bare().visit(self._tree)
        nodes = list(ast.walk(bare))
        names = frozenset(_names(nodes))
        imported = dict(_imported(nodes, self._module))
        del self._tree
        return StatementContent(written_out(bare), names, imported)


@dataclass
class Source:
    """Statements and imports at the top of a module.

    `statements` has the statements that define each name, and `imported` the dotted
    origin of each imported name. `star_imports` are the modules of statements `from
    module import *`.
    """

    statements: dict[str, list[Statement]] = field(default_factory=dict)
    imported: dict[str, str] = field(default_factory=dict)
    star_imports: list[str] = field(default_factory=list)


@cache
def stamp(
    function: Callable[..., Any], of_code: Callable[..., str] | None = None
) -> str:
    """Return the sha256, in hexadecimal, of all code that a function runs.

    The stamp of a partial function covers the bound numbers and strings. The stamp of a
    custom function covers the imported modules of the package, with their numbers and
    strings. The function may be compiled or not.

    Parameters
    ----------
    function : callable
        Function at the top level of a module, or a partial function.
    of_code : callable, optional
        Function that returns the `code_stamp`, for example from a cache; by default
        `code_stamp`.

    Raises
    ------
    ValueError
        If the function is defined within another function, or if a partial function
        binds values that are neither numbers nor strings. The source code does not
        contain these values.
    """
    arguments = ""
    if isinstance(function, partial):
        if not _is_plain([*function.args, dict(function.keywords)]):
            raise ValueError(f"{function} is given more than numbers and texts")
        arguments = _written([*function.args, dict(sorted(function.keywords.items()))])
        function = function.func
    plain = getattr(function, "py_func", function)
    held = values(_at_once(plain.__module__))
    code = (of_code or code_stamp)(plain)
    content = f"{code} {plain.__qualname__} {held} {arguments}"
    return hashlib.sha256(content.encode()).hexdigest()


@cache
def code_stamp(function: Callable[..., Any]) -> str:
    """Return the sha256 of the code of a function and of all definitions it uses.

    Raises
    ------
    ValueError
                If the function is not at the top level of a module.
    """
    _check_place(function)
    module = function.__module__
    name = function.__name__
    statements = _read(module).statements
    names = [name] if name in statements else statements
    lines = sorted(
        f"{_called(used.module)} {used.name} {_hash(used)}\n"
        for used in closure(Definition(module, root) for root in names)
    )
    return hashlib.sha256("".join(lines).encode()).hexdigest()


@cache
def text_hash(package: str) -> str:
    """Return the sha256 of all sources of a package and of the version of Python.

    The `code_stamp` of each function of the package follows from this hash.
    """
    digest = hashlib.sha256(sys.version.encode())
    for name, text in texts_of(package):
        digest.update(f"{name} {len(text)}\n{text}".encode())
    return digest.hexdigest()


def texts_of(package: str) -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each source file of a package.

    The texts are the sources that this process has read. The names are paths within the
    package.
    """
    for folder in map(Path, sys.modules[package].__path__):
        for path in sorted(folder.rglob("*.py")):
            inner = path.relative_to(folder)
            module = ".".join([package, *inner.with_suffix("").parts])
            text, _ = _known_text(module.removesuffix(".__init__"))
            yield inner.as_posix(), text


def note_sources(function: Callable[..., Any]) -> None:
    """Read the sources of all modules that a function may use.

    The modules must be imported already. A later stamp is then the stamp of the running
    code, also after an edit of a file.

    Raises
    ------
    ValueError
        If the function cannot have a stamp.
    """
    _check_place(function)
    _known_text(function.__module__)
    _read_texts(function.__module__)


@cache
def _read_texts(module: str) -> None:
    """Read the sources of all loaded modules of `kernels` and of a custom package."""
    packages = (OURS, module.partition(".")[0])
    for name in list(sys.modules):
        if name.partition(".")[0] in packages:
            _found_text(name)


def _check_place(function: Callable[..., Any]) -> None:
    """Raise ValueError if a function is not at the top level of a module."""
    if not at_the_top(function):
        raise ValueError(f"{function} is no function at the top of a module")


def values(modules: Iterable[str]) -> str:
    """Return a hash of the numbers, strings and arrays at the top level of modules.

    The values may come from files, and compiled code contains the values.
    """
    digest = hashlib.sha256()
    for name in sorted(modules):
        for key, value in sorted(vars(sys.modules[name]).items()):
            if not key.startswith("__") and _is_plain(value):
                digest.update(f"{_called(name)} {key} {_written(value)}\n".encode())
    return digest.hexdigest()


def _is_plain(value: Any) -> bool:
    """Return whether a value is a number, a string, an array, or a plain collection."""
    if type(value) in (tuple, list):
        return all(map(_is_plain, value))
    if type(value) is dict:
        return all(map(_is_plain, (*value, *value.values())))
    if isinstance(value, np.ndarray):
        return not value.dtype.hasobject
    plain = int | float | complex | str | bytes | np.generic
    return value is None or isinstance(value, plain)


def _written(value: Any) -> str:
    """Return a plain value in full; `repr` shortens arrays."""
    if isinstance(value, np.ndarray):
        content = hashlib.sha256(value.tobytes()).hexdigest()
        return f"{value.dtype} {value.shape} {content}"
    if type(value) is dict:
        return f"{{{_written([part for item in value.items() for part in item])}}}"
    if type(value) in (tuple, list):
        return f"({', '.join(map(_written, value))})"
    return repr(value)


LATER = ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda
"""Nodes with code that runs only when called."""


@cache
def _at_once(module: str) -> frozenset[str]:
    """Return a custom module and the modules of the package that its import imports.

    Modules that a called function imports are left out. The set of a module of
    `kernels` is empty.
    """
    package = module.partition(".")[0]
    loaded = set[str]()
    waiting = [module]
    while waiting and package != OURS:
        name = waiting.pop()
        if name in loaded or name not in sys.modules or not _found_text(name):
            continue
        loaded.add(name)
        text, _ = _known_text(name)
        nodes = list[ast.AST]()
        inner = list[ast.AST](ast.parse(text).body)
        while inner:
            node = inner.pop()
            if not isinstance(node, LATER):
                nodes.append(node)
                inner += ast.iter_child_nodes(node)
        for _, meant in _imported(nodes, name):
            if meant.partition(".")[0] == package:
                parts = meant.split(".")
                waiting += (".".join(parts[:end]) for end in range(1, len(parts) + 1))
    return frozenset(loaded)


def at_the_top(function: Callable[..., Any]) -> bool:
    """Return whether a function is at the top level of a module, as stamps require."""
    if isinstance(function, partial):
        return at_the_top(function.func)
    plain = getattr(function, "py_func", function)
    return "." not in getattr(plain, "__qualname__", ".")


def _called(module: str) -> str:
    """Return the name of a module in stamps.

    A package may replace the name of the package in stamps by `__stamped__`.
    """
    package, dot, inner = module.partition(".")
    return f"{getattr(sys.modules[package], '__stamped__', package)}{dot}{inner}"


def stamp_of_all(*places: Path) -> str:
    """Return the sha256 of Python sources: of all files in folders, or single files.

    The hash covers the names and the code of the files.
    """
    folders = [place if place.is_dir() else place.parent for place in places]
    return stamp_of_texts(
        (path.relative_to(folder).as_posix(), path.read_bytes())
        for place, folder in zip(places, folders, strict=True)
        for path in (sorted(place.rglob("*.py")) if place.is_dir() else [place])
    )


def stamp_of_texts(texts: Iterable[tuple[str, str | bytes]]) -> str:
    """Return the sha256 of the names of Python sources and of their code."""
    digest = hashlib.sha256()
    for name, text in texts:
        code = written_out(_Bare().visit(ast.parse(text)))
        digest.update(f"{name} {len(code)}\n{code}".encode())
    return digest.hexdigest()


def closure(roots: Iterable[Definition]) -> set[Definition]:
    """Return `roots` and all definitions that the roots use, directly or indirectly."""
    closed = set[Definition]()
    waiting = [_as_followed(root) for root in roots]
    while waiting:
        definition = waiting.pop()
        if definition not in closed and ".".join(definition) not in NOT_FOLLOWED:
            closed.add(definition)
            waiting += map(_as_followed, _used(definition))
    return closed


def _as_followed(definition: Definition) -> Definition:
    """Return a definition of `kernels` unchanged, else the whole module."""
    ours = definition.module.partition(".")[0] == OURS
    return definition if ours else Definition(definition.module, WHOLE)


@cache
def _used(definition: Definition) -> frozenset[Definition]:
    """Return the definitions with names in the code of a definition.

    A custom module uses everything that the module imports.
    """
    module, name = definition
    source = _read(module)
    if name == WHOLE:
        return frozenset(_reached(module))
    definitions = {Definition(module, "")}
    for statement in source.statements.get(name, []):
        imported = source.imported | statement.content.imported
        for used in statement.content.names:
            first, _, rest = used.partition(".")
            if first in imported:
                meant = f"{imported[first]}.{rest}" if rest else imported[first]
                definitions |= _meant(meant, module)
            elif first in source.statements:
                definitions.add(Definition(module, first))
            else:
                for origin in source.star_imports:
                    definitions |= _meant(f"{origin}.{used}", module)
    return frozenset(definitions)


def _reached(module: str) -> set[Definition]:
    """Return the modules and definitions of `kernels` that a custom module imports.

    The modules are from the package of the custom module. Imports within functions
    count too.
    """
    text, _ = _known_text(module)
    nodes = list(ast.walk(_Bare().visit(ast.parse(text))))
    names = set(_names(nodes))
    reached = set[Definition]()
    for name, meant in _imported(nodes, module):
        reached |= _aimed(meant, module)
        for used in names:
            first, _, rest = used.partition(".")
            if first == name and rest:
                reached |= _aimed(f"{meant}.{rest}", module)
    return reached


def _aimed(dotted: str, user: str) -> set[Definition]:
    """Return the definitions of a dotted name that a custom module imports."""
    package = user.partition(".")[0]
    parts = dotted.split(".")
    if parts[0] == OURS:
        for end in range(1, len(parts) + 1):
            with suppress(ImportError):
                import_module(".".join(parts[:end]))
        return _meant(dotted, user)
    if parts[0] != package:
        return set()
    prefixes = [".".join(parts[:end]) for end in range(1, len(parts) + 1)]
    return {Definition(name, WHOLE) for name in prefixes if _found_text(name)}


def _meant(
    dotted: str, user: str, met: frozenset[str] = frozenset()
) -> set[Definition]:
    """Return the definitions that a dotted name denotes in the module `user`.

    The set is empty for packages besides `kernels` and the package of `user`. A module
    without a name denotes all definitions of the module. `met` are the dotted names on
    the path so far, since imports of modules may be circular.
    """
    package = dotted.partition(".")[0]
    if package not in (OURS, user.partition(".")[0]) or dotted in met:
        return set()
    met |= {dotted}
    module = dotted
    name = ""
    while module not in sys.modules and module:
        module, _, last = module.rpartition(".")
        name = f"{last}.{name}" if name else last
    source = _read(module)
    first = name.partition(".")[0]
    if first in source.imported:
        return _meant(source.imported[first], module, met)
    names = [first] if first else source.statements
    definitions = {Definition(module, defined) for defined in names}
    if first not in source.statements:
        for origin in source.star_imports:
            definitions |= _meant(f"{origin}.{name}".rstrip("."), module, met)
    return definitions


@cache
def _read(module: str) -> Source:
    """Return the statements and imports of a module."""
    source = Source()
    text, _ = _known_text(module)
    for statement in ast.parse(text).body:
        if _is_constant(statement):
            continue
        if not isinstance(statement, ast.FunctionDef | ast.ClassDef):
            for name, meant in _imported(ast.walk(statement), module):
                if name == "*":
                    source.star_imports.append(meant)
                else:
                    source.imported[name] = meant
        if not isinstance(statement, ast.Import | ast.ImportFrom):
            defining = Statement(statement, module)
            for name in _bound(statement) or [""]:
                source.statements.setdefault(name, []).append(defining)
    return source


def _known_text(module: str) -> tuple[str, bool]:
    """Return the source of a module, and whether it is a package.

    Raises ValueError if there is no source.
    """
    source = _found_text(module)
    if source is None:
        raise ValueError(f"{module} has no source")
    return source


@cache
def _found_text(module: str) -> tuple[str, bool] | None:
    """Return the source of a module, and whether the module is a package, or None.

    The result is None without a source. The module need not have been imported yet. A
    package that was built from source texts has the texts as `__sources__`, by module
    name.
    """
    package, *inner = module.split(".")
    loaded = sys.modules[package]
    sources: dict[str, tuple[str, bool]] | None = getattr(loaded, "__sources__", None)
    if sources is not None:
        return sources.get(module)
    folders = [Path(folder, *inner) for folder in getattr(loaded, "__path__", ())]
    files = [(folder / "__init__.py", True) for folder in folders]
    files += [(folder.with_suffix(".py"), False) for folder in folders if inner]
    if not inner and not folders and loaded.__file__:
        files = [(Path(loaded.__file__), False)]
    for file, is_package in files:
        if file.is_file():
            return file.read_text("utf-8"), is_package
    return None


def _bound(statement: ast.stmt) -> set[str]:
    """Return the names that a statement defines, or changes such as `NAME[0] = 1`."""
    bound = set[str]()
    waiting = list[Any]([statement])
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            bound.add(node.name)
            continue
        if isinstance(node, ast.comprehension):  # has a separate scope
            continue
        if isinstance(getattr(node, "ctx", None), ast.Store):
            while isinstance(node, ast.Attribute | ast.Subscript):
                node = node.value
            bound |= {node.id} if isinstance(node, ast.Name) else set()
        waiting += ast.iter_child_nodes(node)
    return bound


def _imported(nodes: Iterable[ast.AST], module: str) -> Iterator[tuple[str, str]]:
    """Yield the imported names among `nodes`, with the dotted origins.

    The name "*" denotes all names of a module.
    """
    for node in nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                first = alias.name.partition(".")[0]
                yield alias.asname or first, alias.name if alias.asname else first
        elif isinstance(node, ast.ImportFrom):
            origin = ".".join(filter(None, [_origin(node, module), node.module]))
            for alias in node.names:
                meant = origin if alias.name == "*" else f"{origin}.{alias.name}"
                yield alias.asname or alias.name, meant


def _origin(node: ast.ImportFrom, module: str) -> str:
    """Return the base package of a relative import; "" for an absolute import."""
    if node.level == 0:
        return ""
    _, is_package = _known_text(module)
    parts = module.split(".")
    length = len(parts) - node.level + is_package
    return ".".join(parts[: max(0, length)])


def _names(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Yield the names among `nodes`, with the attributes after each name.

    The order of the nodes must be from the outside to the inside.
    """
    within = set[ast.AST]()
    for node in nodes:
        dotted = list[str]()
        inner = node
        while isinstance(inner, ast.Attribute):
            dotted.append(inner.attr)
            inner = inner.value
            within.add(inner)
        if isinstance(inner, ast.Name) and node not in within:
            yield ".".join([inner.id, *reversed(dotted)])


class _Bare(ast.NodeTransformer):
    """Remover of annotations, docstrings and declared fields from a tree."""

    def visit_arg(self, node: ast.arg) -> ast.AST:
        """Remove the annotation of a parameter."""
        node.annotation = None
        return node

    def visit_Module(self, node: ast.Module) -> ast.AST:
        """Remove the docstrings of a module."""
        return self.visit_ClassDef(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Remove the annotations and docstrings of a function."""
        node.returns = None
        return self.visit_ClassDef(node)

    def visit_ClassDef(
        self, node: ast.Module | ast.FunctionDef | ast.ClassDef
    ) -> ast.AST:
        """Remove docstrings from a body, and declared fields from the class Model."""
        body = [part for part in node.body if not _is_constant(part)]
        if isinstance(node, ast.ClassDef) and node.name == MODEL:
            body = [part for part in body if not _is_declared(part)]
        node.body = body or [ast.Pass()]
        return self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Remove declared fields from the arguments of Model."""
        if isinstance(node.func, ast.Name) and node.func.id == MODEL:
            node.keywords = [word for word in node.keywords if word.arg not in DECLARED]
        return self.generic_visit(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        """Replace the annotation of an assignment by None."""
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
    """Return code as text, identical for all versions of Python.

    The function changes the tree. Since Python 3.12 an f-string may contain its own
    quotes.
    """
    if any(isinstance(node, ast.JoinedStr) for node in ast.walk(tree)):
        tree = _Quoted().visit(tree)
    return ast.unparse(tree)


class _Quoted(ast.NodeTransformer):
    """Writer of f-strings with quotes that the f-string lacks, as in Python 3.11."""

    def visit_FormattedValue(self, node: ast.FormattedValue) -> ast.AST:
        """Convert the f-strings within a value of an f-string."""
        node.value = self.visit(node.value)
        return node

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        """Replace an f-string by its source text, in the first quotes that fit."""
        self.generic_visit(node)
        text = ast.unparse(node)
        outer = text[1:4] if text[1:4] in QUOTES else text[1]
        inner = text[1 + len(outer) : -len(outer)]
        for quote in QUOTES:
            if quote not in inner and (len(quote) == 3 or "\n" not in inner):
                return ast.Name(f"f{quote}{inner}{quote}")  # is written unchanged
        return node


def _is_constant(statement: ast.stmt) -> bool:
    """Return whether a statement is only a constant, such as a docstring."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _enters(statement: ast.stmt) -> bool:
    """Return whether a statement fills a table of entries, and computes nothing.

    The descriptions in a table are not code. Ids cover the relevant facts of an entry.
    """
    if not (
        isinstance(statement, ast.Assign)
        and isinstance(statement.targets[0], ast.Name)
        and statement.targets[0].id in ENTRIES
    ):
        return False
    nodes = list(ast.walk(statement.value))
    calls = {ast.unparse(node.func) for node in nodes if isinstance(node, ast.Call)}
    computes = any(isinstance(node, ast.Lambda | ast.comprehension) for node in nodes)
    return not computes and calls <= KINDS


@cache
def _hash(definition: Definition) -> str:
    """Return the sha256, in hexadecimal, of the code of a definition."""
    if definition.name == WHOLE:
        text, _ = _known_text(definition.module)
        tree = _Bare().visit(ast.parse(text))
        tree.body = [part for part in tree.body if not _enters(part)]
        code = written_out(tree)
    else:
        statements = _read(definition.module).statements.get(definition.name, [])
        code = "\n".join(statement.content.code for statement in statements)
    return hashlib.sha256(code.encode()).hexdigest()
