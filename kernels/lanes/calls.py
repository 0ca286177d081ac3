"""Properties of compiled functions, including the functions that they call.

A compiled function is a function that `kernels.jit` compiles.
"""

import ast
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from kernels.caching import OURS
from kernels.lanes.syntax import tree_of, writes_elements
from kernels.neighbours import search


def plain_of(function: Any) -> Any:
    """Return the plain function of a compiled function; other objects unchanged."""
    return getattr(function, "py_func", function)


SEARCH = plain_of(search)


def is_ours(function: Any) -> bool:
    """Return whether a function is compiled by `kernels.jit`."""
    return callable(function) and plain_of(function) in OURS


def named_by(node: ast.expr, names: Mapping[str, Any]) -> Any:
    """Return the object to which a name, or a name in a module, refers.

    `names` are the globals. Returns None if the node is not a name in either form, or
    if the name is unknown.
    """
    match node:
        case ast.Name(name):
            return names.get(name)
        case ast.Attribute(ast.Name(module), name):
            return getattr(names.get(module), name, None)
    return None


def searches(function: Any) -> bool:
    """Return whether a compiled function searches for neighbours, even indirectly."""
    return calls(function, search)


def calls(function: Any, other: Any) -> bool:
    """Return whether a compiled function calls `other`, even indirectly."""
    return plain_of(other) in _reached(function)


@cache
def writes(function: Any) -> bool:
    """Return whether a compiled function writes into an array, even indirectly.

    Writes of a search do not count: the results of a search have masks, which select
    the lanes.
    """
    return any(map(writes_elements, _trees(function)))


@cache
def needs_its_test(function: Any) -> bool:
    """Return whether a call is unsafe in lanes in which a single trial skips the call.

    An unsafe function may not end, or may read beyond an array.
    """
    return any(
        isinstance(node, ast.While) or _looks_up(node)
        for tree in _trees(function)
        for node in ast.walk(tree)
    )


def _looks_up(node: ast.AST) -> bool:
    """Return whether a node is an element with an index that a call computes."""
    return isinstance(node, ast.Subscript) and any(
        isinstance(part, ast.Call) for part in ast.walk(node.slice)
    )


def _trees(function: Any) -> list[ast.FunctionDef]:
    """Return the trees of a compiled function and of its callees, except `search`."""
    return [tree_of(plain) for plain in _reached(function) - {SEARCH}]


@cache
def _reached(function: Any) -> frozenset[Callable[..., Any]]:
    """Return a compiled function and all compiled callees, as plain Python.

    The set is empty if the function is not compiled. Callees of `search` are excluded.
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
