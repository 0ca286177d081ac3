"""Names say what a thing is, a line has one fact, docstrings open with their subject.

Files whose docstrings ruff does not check, in pyproject.toml, are left out here too.
"""

import ast
import tomllib
from collections.abc import Iterator
from fnmatch import fnmatchcase
from itertools import chain

from tests.house.sources import Checkout, Finding, Function, Module

LIST = "pyproject.toml"
VAGUE = {
    *("about", "asked", "found", "given", "kept", "made", "one", "others", "said"),
    *("seen", "there", "these", "those", "told", "wanted", "what", "whole"),
}
"""Names that fit any value, so that a reader must look for what they hold."""
PUBLIC = {"sweep/__init__.py": {"one"}}
"""Names of that list that are parameters of the public interface, kept for programs."""
RELATIVE = {"Of", "That", "What", "Whether", "Which", "Who", "Whom", "Whose", "Those"}
MOST_POSITIONAL = 4
FEW_PARAMETERS = 3
SECTION = "\n----"
COMMANDS = ("app.command(", "report_command")
"""Decorators of commands: the docstring is the help, and each option has its own."""


def modules_are_plain(checkout: Checkout) -> Iterator[Finding]:
    not_yet = _not_yet(checkout)
    for name, module in checkout.modules.items():
        if not any(fnmatchcase(name, pattern) for pattern in not_yet):
            yield from _findings(module)


def what_is_plain_is_not_listed(checkout: Checkout) -> Iterator[Finding]:
    for pattern in _not_yet(checkout):
        listed = [
            module
            for name, module in checkout.modules.items()
            if fnmatchcase(name, pattern)
        ]
        if listed and not any(map(_is_not_plain, listed)):
            text = checkout.document(LIST)
            place = text.text.index(f'"{pattern}"')
            yield text.finding(place, f"{pattern} keeps the rules: take it away")


def _not_yet(checkout: Checkout) -> list[str]:
    """Return the patterns of files whose docstrings ruff does not check."""
    project = tomllib.loads(checkout.document(LIST).text)
    lint = project.get("tool", {}).get("ruff", {}).get("lint", {})
    ignored = lint.get("per-file-ignores", {})
    return [pattern for pattern, rules in ignored.items() if "D" in rules]


def _is_not_plain(module: Module) -> bool:
    return any(_findings(module))


def _findings(module: Module) -> Iterator[Finding]:
    return chain.from_iterable(rule(module) for rule in OF_MODULES)


def _names_fit_any_value(module: Module) -> Iterator[Finding]:
    for node in module.nodes:
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            name = node.id
        elif isinstance(node, ast.arg):
            name = node.arg
        else:
            continue
        if name.strip("_") in VAGUE - PUBLIC.get(module.name, set()):
            what = f"the name {name} fits any value: name what it holds"
            yield module.finding(node, what)


def _lines_have_several_facts(module: Module) -> Iterator[Finding]:
    for node in module.nodes:
        if isinstance(node, ast.Assign) and _packs(node.targets[0], node.value):
            what = "several facts in one assignment: write a line for each"
            yield module.finding(node, what)


def _packs(target: ast.expr, value: ast.expr) -> bool:
    """Return whether an assignment gives several values to names of several things.

    Names of one letter are coordinates of one thing. A swap is one fact too.
    """
    if not (isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)):
        return False
    names = [ast.unparse(element) for element in target.elts]
    values = [ast.unparse(element) for element in value.elts]
    return max(map(len, names)) > 1 and set(names) != set(values)


def _arguments_have_no_names(module: Module) -> Iterator[Finding]:
    for node in module.nodes:
        if isinstance(node, ast.Call) and len(node.args) > MOST_POSITIONAL:
            what = f"{len(node.args)} arguments without names: at most"
            yield module.finding(node, f"{what} {MOST_POSITIONAL}")


def _docstrings_open_with_a_clause(module: Module) -> Iterator[Finding]:
    for node in module.nodes:
        words = _docstring(node).split()
        if words and words[0].strip(",.:") in RELATIVE:
            line = 1 if isinstance(node, ast.Module) else node
            what = f'a docstring opens with "{words[0]}": take a verb or a noun'
            yield module.finding(line, what)


def _parameters_are_not_described(module: Module) -> Iterator[Finding]:
    for node in module.nodes:
        if not isinstance(node, Function) or node.name[0] == "_":
            continue
        if any(ast.unparse(one).startswith(COMMANDS) for one in node.decorator_list):
            continue
        arguments = node.args
        named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
        docstring = _docstring(node)
        if len(named) >= FEW_PARAMETERS and docstring and SECTION not in docstring:
            what = f"{node.name} needs a section Parameters, as numpydoc has it"
            yield module.finding(node, what)


def _docstring(node: ast.AST) -> str:
    if not isinstance(node, ast.Module | ast.ClassDef | Function):
        return ""
    return ast.get_docstring(node) or ""


OF_MODULES = (
    _names_fit_any_value,
    _lines_have_several_facts,
    _arguments_have_no_names,
    _docstrings_open_with_a_clause,
    _parameters_are_not_described,
)
RULES = (modules_are_plain, what_is_plain_is_not_listed)
