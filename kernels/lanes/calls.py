"""What functions of ours do, together with those that they call."""

import ast
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from kernels.caching import OURS
from kernels.lanes.syntax import tree_of, writes_elements
from kernels.neighbours import search


def plain_of(function: Any) -> Any:
    """What a compiled function is compiled from; anything else as it is."""
    return getattr(function, "py_func", function)


SEARCH = plain_of(search)


def is_ours(function: Any) -> bool:
    """Whether a function is compiled by `kernels.jit`."""
    return callable(function) and plain_of(function) in OURS


def named_by(node: ast.expr, names: Mapping[str, Any]) -> Any:
    """What a name, or a name in a module, stands for among the globals `names`; None
    where it is none of these.
    """
    match node:
        case ast.Name(name):
            return names.get(name)
        case ast.Attribute(ast.Name(module), name):
            return getattr(names.get(module), name, None)
    return None


def searches(function: Any) -> bool:
    """Whether a function of ours searches for neighbours, itself or by another one."""
    return calls(function, search)


def calls(function: Any, other: Any) -> bool:
    """Whether a function of ours calls another one, itself or by others."""
    return plain_of(other) in _reached(function)


@cache
def writes(function: Any) -> bool:
    """Whether a function of ours, or one that it calls, writes into an array. What a
    search writes is read by masks, which say in which lanes it counts.
    """
    return any(map(writes_elements, _trees(function)))


@cache
def needs_its_test(function: Any) -> bool:
    """Whether a function of ours may not end, or may read beyond an array, where a
    single trial does not call it.
    """
    return any(
        isinstance(one, ast.While) or _looks_up(one)
        for tree in _trees(function)
        for one in ast.walk(tree)
    )


def _looks_up(node: ast.AST) -> bool:
    """Whether a node is an element at a place that is computed by a call."""
    return isinstance(node, ast.Subscript) and any(
        isinstance(one, ast.Call) for one in ast.walk(node.slice)
    )


def _trees(function: Any) -> list[ast.FunctionDef]:
    """The text of a function of ours, and of those that it calls but for `search`."""
    return [tree_of(one) for one in _reached(function) - {SEARCH}]


@cache
def _reached(function: Any) -> frozenset[Callable[..., Any]]:
    """A function of ours and those that it calls, as plain Python; none for others.
    What `search` calls is not looked at.
    """
    met, waiting = set[Callable[..., Any]](), [function]
    while waiting:
        plain = plain_of(waiting.pop())
        if not is_ours(plain) or plain in met:
            continue
        met.add(plain)
        if plain is not SEARCH:
            waiting += [
                named_by(one.func, plain.__globals__)
                for one in ast.walk(tree_of(plain))
                if isinstance(one, ast.Call)
            ]
    return frozenset(met)
