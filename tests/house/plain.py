"""Names say what a thing is, a line has one fact, and docstrings begin with a verb."""

import ast
from collections.abc import Iterator

from tests.house.sources import Checkout, Finding, Function, Module

PLAIN: tuple[str, ...] = ()
"""The beginnings of the files that these rules hold for: packages, or parts of them."""

VAGUE = {
    *("about", "asked", "found", "given", "kept", "made", "one", "others", "said"),
    *("seen", "there", "these", "those", "told", "wanted", "what", "whole"),
}
RELATIVE = {"Of", "That", "What", "Whether", "Which", "Who", "Whom", "Whose", "Those"}
MOST_POSITIONAL = 4
FEW_PARAMETERS = 3
SECTION = "\n----"


def names_say_something(checkout: Checkout) -> Iterator[Finding]:
    for module in _plain(checkout):
        for node in module.nodes:
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                name = node.id
            elif isinstance(node, ast.arg):
                name = node.arg
            else:
                continue
            if name.strip("_") in VAGUE:
                yield module.finding(node, f"the name {name} says nothing")


def a_line_has_one_fact(checkout: Checkout) -> Iterator[Finding]:
    for module in _plain(checkout):
        for node in module.nodes:
            if isinstance(node, ast.Assign) and _packs(node.targets[0], node.value):
                yield module.finding(node, "several facts in one assignment")


def _packs(target: ast.expr, value: ast.expr) -> bool:
    """Return whether an assignment gives several values to names of several things.

    Names of one letter are coordinates of one thing. A swap is one fact too.
    """
    if not (isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)):
        return False
    names = [ast.unparse(element) for element in target.elts]
    values = [ast.unparse(element) for element in value.elts]
    return max(map(len, names)) > 1 and set(names) != set(values)


def few_arguments_have_no_name(checkout: Checkout) -> Iterator[Finding]:
    for module in _plain(checkout):
        for node in module.nodes:
            if isinstance(node, ast.Call) and len(node.args) > MOST_POSITIONAL:
                yield module.finding(node, f"{len(node.args)} arguments without names")


def docstrings_begin_with_their_subject(checkout: Checkout) -> Iterator[Finding]:
    for module in _plain(checkout):
        for node in module.nodes:
            words = _docstring(node).split()
            if words and words[0].strip(",.:") in RELATIVE:
                yield module.finding(_start(node), f'a docstring begins "{words[0]}"')


def parameters_are_described(checkout: Checkout) -> Iterator[Finding]:
    for module in _plain(checkout):
        for node in module.nodes:
            if not isinstance(node, Function) or node.name[0] == "_":
                continue
            count = len([*node.args.args, *node.args.kwonlyargs])
            described = SECTION in _docstring(node)
            if count >= FEW_PARAMETERS and _docstring(node) and not described:
                what = f"{node.name} does not describe its {count} parameters"
                yield module.finding(node, what)


def _plain(checkout: Checkout) -> list[Module]:
    files = checkout.files("kernels/**/*.py", "sweep/**/*.py")
    return [checkout.module(name) for name in files if name.startswith(PLAIN)]


def _docstring(node: ast.AST) -> str:
    if not isinstance(node, ast.Module | ast.ClassDef | Function):
        return ""
    return ast.get_docstring(node) or ""


def _start(node: ast.AST) -> int | ast.AST:
    return 1 if isinstance(node, ast.Module) else node


RULES = (
    names_say_something,
    a_line_has_one_fact,
    few_arguments_have_no_name,
    docstrings_begin_with_their_subject,
    parameters_are_described,
)
