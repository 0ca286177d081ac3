"""Which models let their boids measure and hear, which drive them and lead them to
several goals, and what others have to change.
"""

import ast
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from kernels.goals import goal_of
from kernels.lanes.calls import calls, named_by, plain_of
from kernels.lanes.syntax import tree_of
from kernels.robots.actuation import drive
from kernels.robots.sensing import publish
from kernels.state import remember


def publishes(advance: Callable[..., bool]) -> bool:
    """Whether the `advance` of a model, or what it calls, calls `publish`."""
    return calls(advance, publish)


def drives(advance: Callable[..., bool]) -> bool:
    """Whether the `advance` of a model, or what it calls, calls `drive`."""
    return calls(advance, drive)


def goes_in_turn(advance: Callable[..., bool]) -> bool:
    """Whether the `advance` of a model, or what it calls, calls `goal_of`."""
    return calls(advance, goal_of)


def to_publish(advance: Callable[..., bool]) -> str:
    """Where `advance` calls `remember`, and what is to stand there; "" where it does
    not.
    """
    plain = plain_of(advance)
    for node in ast.walk(tree_of(plain)):
        if isinstance(node, ast.Call):
            called = plain_of(named_by(node.func, plain.__globals__))
            if called is plain_of(remember):
                line = plain.__code__.co_firstlineno + node.lineno - 1
                flock, seen = map(ast.unparse, _in_order(node, called))
                return (
                    f"in {Path(plain.__code__.co_filename).name}:{line} write"
                    f" publish({flock}, {seen}, work) for {ast.unparse(node)}"
                )
    return ""


def _in_order(call: ast.Call, function: Callable[..., Any]) -> list[ast.expr]:
    """The arguments of a call in the order of the function, which names some."""
    names = inspect.signature(function).parameters
    given = dict(zip(names, call.args, strict=False))
    given |= {one.arg: one.value for one in call.keywords if one.arg}
    return [given[name] for name in names]
