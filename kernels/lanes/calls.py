"""Properties of our functions, together with those that they call."""

import ast
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from kernels.caching import OURS
from kernels.lanes.syntax import tree_of, writes_elements
from kernels.neighbours import search


def plain_of(function: Any) -> Any:
    """Return the plain function of a compiled one; anything else as it is."""
    return getattr(function, "py_func", function)


SEARCH = plain_of(search)


def is_ours(function: Any) -> bool:
    """Return whether a function is compiled by `kernels.jit`."""
    return callable(function) and plain_of(function) in OURS


def named_by(node: ast.expr, names: Mapping[str, Any]) -> Any:
    """Return the object to which a name, or a name in a module, refers.

    `names` are the globals; None if the node is no such name or the name is unknown.
    """
    match node:
        case ast.Name(name):
            return names.get(name)
        case ast.Attribute(ast.Name(module), name):
            return getattr(names.get(module), name, None)
    return None


def searches(function: Any) -> bool:
    """Return whether a function of ours searches for neighbours, even indirectly."""
    return calls(function, search)


def calls(function: Any, other: Any) -> bool:
    """Return whether a function of ours calls another one, even indirectly."""
    return plain_of(other) in _reached(function)


@cache
def writes(function: Any) -> bool:
    """Return whether a function of ours, or one that it calls, writes into an array.

    Writes of a search do not count: masks read them, which say in which lanes they
    count.
    """
    return any(map(writes_elements, _trees(function)))


@cache
def needs_its_test(function: Any) -> bool:
    """Return whether a function of ours is unsafe where one trial does not call it.

    It may not end, or it may read beyond an array.
    """
    return any(
        isinstance(node, ast.While) or _looks_up(node)
        for tree in _trees(function)
        for node in ast.walk(tree)
    )


def _looks_up(node: ast.AST) -> bool:
    """Return whether a node is an element whose index a call computes."""
    return isinstance(node, ast.Subscript) and any(
        isinstance(part, ast.Call) for part in ast.walk(node.slice)
    )


def _trees(function: Any) -> list[ast.FunctionDef]:
    """Return the trees of a function of ours and of its callees but `search`."""
    return [tree_of(plain) for plain in _reached(function) - {SEARCH}]


@cache
def _reached(function: Any) -> frozenset[Callable[..., Any]]:
    """Return a function of ours and those that it calls, as plain Python.

    The set is empty for other functions. Callees of `search` are left out.
    """
    met = set[Callable[..., Any]]()
    waiting = [function]
    while waiting:
        plain = plain_of(waiting.pop())
        if not is_ours(plain) or plain in met:
            continue
        met.add(plain)
        if plain is not SEARCH:
            waiting += [
                named_by(node.func, plain.__globals__)
                for node in ast.walk(tree_of(plain))
                if isinstance(node, ast.Call)
            ]
    return frozenset(met)
