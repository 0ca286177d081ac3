"""Pieces of Python's syntax trees, as the conversion for lanes reads and makes them."""

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterator, Sequence
from typing import Any


def tree_of(function: Callable[..., Any]) -> ast.FunctionDef:
    """The tree of a plain function's own text."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
    assert isinstance(tree, ast.FunctionDef)
    return tree


def names_in(tree: ast.AST) -> set[str]:
    """All names in a tree."""
    return {one.id for one in ast.walk(tree) if isinstance(one, ast.Name)}


def stores_in(*parts: ast.AST) -> Iterator[str]:
    """The names to which trees give a value, each as often as they do."""
    for part in parts:
        for one in ast.walk(part):
            if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store):
                yield one.id


def writes_elements(tree: ast.AST) -> bool:
    """Whether a tree writes into an array."""
    return any(
        isinstance(one, ast.Subscript) and isinstance(one.ctx, ast.Store)
        for one in ast.walk(tree)
    )


def is_costly(body: Sequence[ast.stmt]) -> bool:
    """Whether statements divide or call: they are left out where no lane needs them."""
    return any(
        isinstance(one, ast.Div | ast.Call) for part in body for one in ast.walk(part)
    )


def load(name: str) -> ast.Name:
    """A name that is read."""
    return ast.Name(name, ast.Load())


def stored(name: str, value: Any) -> ast.stmt:
    """`name = value`."""
    return ast.Assign([ast.Name(name, ast.Store())], value)


def call_of(name: str, *arguments: Any) -> ast.Call:
    """A call of one of `kernels.lanes.stubs.TOOLS`."""
    return ast.Call(load(f"_{name}"), list(arguments), [])


def read_again(target: ast.expr) -> Any:
    """The target of an assignment as an expression that is read."""
    return type(target)(**(dict(ast.iter_fields(target)) | {"ctx": ast.Load()}))
