"""Names say what a thing is, a line has one fact, docstrings open with their subject.

Files whose docstrings ruff does not check, in pyproject.toml, are left out here too. So
are names and lines of kernels that are a part of the ids of trials.
"""

import ast
import tomllib
from collections.abc import Callable, Iterable, Iterator
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
_TOP = (
    "angles chance coverage elementary events fetching flight fours generator "
    "goals groups indices model moving near neighbours occupancy polygons "
    "recording settings shapes starts state topology workspace worlds"
)
IN_IDS = (
    *("kernels/metrics/*", "kernels/models/*", "kernels/robots/*", "kernels/rules/*"),
    *(f"kernels/{name}.py" for name in _TOP.split()),
)
"""Kernels whose code is a part of the ids of trials, by patterns.

A new name there gives trials new ids, so that names and lines change together with what
changes ids anyway. The list only becomes shorter.
"""
RELATIVE = {"Of", "That", "What", "Whether", "Which", "Who", "Whom", "Whose", "Those"}
Rule = Callable[[Module], Iterator[Finding]]
MOST_POSITIONAL = 4
FEW_PARAMETERS = 3
SECTION = "\n----"
COMMANDS = ("app.command(", "report_command")
"""Decorators of commands: the docstring is the help, and each option has its own."""


def modules_are_plain(checkout: Checkout) -> Iterator[Finding]:
    not_public = _not_public(checkout)
    for name, module in checkout.modules.items():
        if not _is_among(name, not_public):
            yield from _findings(module, OF_DOCSTRINGS)
            if not _is_among(name, IN_IDS):
                yield from _findings(module, OF_CODE)


def what_is_plain_is_not_listed(checkout: Checkout) -> Iterator[Finding]:
    for pattern in IN_IDS:
        listed = [
            module
            for name, module in checkout.modules.items()
            if fnmatchcase(name, pattern)
        ]
        if listed and not any(any(_findings(module, OF_CODE)) for module in listed):
            what = f"{pattern} keeps the rules: take it out of IN_IDS"
            yield listed[0].finding(1, what)


def _not_public(checkout: Checkout) -> list[str]:
    """Return the patterns of files whose docstrings ruff does not check."""
    project = tomllib.loads(checkout.document(LIST).text)
    lint = project.get("tool", {}).get("ruff", {}).get("lint", {})
    ignored = lint.get("per-file-ignores", {})
    return [pattern for pattern, rules in ignored.items() if "D" in rules]


def _is_among(name: str, patterns: Iterable[str]) -> bool:
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _findings(module: Module, rules: Iterable[Rule]) -> Iterator[Finding]:
    return chain.from_iterable(rule(module) for rule in rules)


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


OF_CODE = (
    _names_fit_any_value,
    _lines_have_several_facts,
    _arguments_have_no_names,
)
OF_DOCSTRINGS = (_docstrings_open_with_a_clause, _parameters_are_not_described)
RULES = (modules_are_plain, what_is_plain_is_not_listed)
