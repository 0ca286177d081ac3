"""Pieces of Python's syntax trees that the conversion for lanes reads and makes."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator, Sequence
from typing import Any


def tree_of(function: Callable[..., Any]) -> ast.FunctionDef:
    """Return the tree of the source of a plain function."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
    assert isinstance(tree, ast.FunctionDef)
    return tree


def names_in(tree: ast.AST) -> set[str]:
    """Return all names in a tree."""
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


def stores_in(*parts: ast.AST) -> Iterator[str]:
    """Yield the names that trees assign, once per assignment."""
    for part in parts:
        for node in ast.walk(part):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                yield node.id


def writes_elements(tree: ast.AST) -> bool:
    """Return whether a tree writes into an array."""
    return any(
        isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store)
        for node in ast.walk(tree)
    )


def is_costly(body: Sequence[ast.stmt]) -> bool:
    """Return whether statements divide or call.

    If so, a branch skips the statements if no lane needs the results.
    """
    return any(
        isinstance(node, ast.Div | ast.Call) for part in body for node in ast.walk(part)
    )


def load(name: str) -> ast.Name:
    """Return a name that is read."""
    return ast.Name(name, ast.Load())


def stored(name: str, value: Any) -> ast.stmt:
    """Return the statement `name = value`."""
    return ast.Assign([ast.Name(name, ast.Store())], value)


def call_of(name: str, *arguments: Any) -> ast.Call:
    """Return a call of one of `kernels.lanes.stubs.TOOLS`."""
    return ast.Call(load(f"_{name}"), list(arguments), [])


def read_again(target: ast.expr) -> Any:
    """Return the target of an assignment as an expression that is read."""
    return type(target)(**(dict(ast.iter_fields(target)) | {"ctx": ast.Load()}))
