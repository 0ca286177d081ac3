"""The file and the line of a declaration of a model, for messages."""

import ast
import linecache
import os
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from kernels.model import Model
from sweep.trial import OTHERS, Place


def of_function(function: Callable[..., Any]) -> Place:
    """Return the line of `def`, not of a decorator."""
    code = getattr(function, "py_func", function).__code__
    for node in _nodes(code.co_filename):
        if isinstance(node, ast.FunctionDef) and node.name == code.co_name:
            return Place(code.co_filename, node.lineno)
    return Place(code.co_filename, code.co_firstlineno)


def of_field(model: Model, field: str) -> Place:
    """Return the line of a field in a Model.

    Without such a line, return the line of the Model.
    """
    file = _file_of(model)
    calls = [
        node
        for node in _nodes(file)
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("Model")
    ]
    for call in calls:
        for keyword in call.keywords:
            if keyword.arg == field:
                return Place(file, keyword.value.lineno)
    return Place(file, calls[0].lineno if calls else 1)


def of_setting(model: Model, name: str) -> Place:
    """Return the line of a parameter in the class Params."""
    file = _file_of(model)
    for node in _nodes(file):
        if isinstance(node, ast.ClassDef) and node.name == model.params.__name__:
            for part in node.body:
                if isinstance(part, ast.AnnAssign) and ast.unparse(part.target) == name:
                    return Place(file, part.lineno)
    return of_field(model, "params")


def of_value(model: Model, name: str) -> Place:
    """Return the last line at which a dictionary has a value of a parameter.

    Without such a line, return the line of the presets.
    """
    file = _file_of(model)
    lines = [
        key.lineno
        for node in _nodes(file)
        if isinstance(node, ast.Dict)
        for key in node.keys
        if isinstance(key, ast.Constant) and key.value == name
    ]
    return Place(file, max(lines)) if lines else of_field(model, "presets")


def of_error(error: BaseException) -> Place | None:
    """Return the innermost line of the author at which an error was raised.

    Return None for a traceback without a line of the author.
    """
    frames = traceback.extract_tb(error.__traceback__)
    return next(
        (
            Place(frame.filename, frame.lineno or 1)
            for frame in reversed(frames)
            if not frame.filename.startswith(FOREIGN)
        ),
        None,
    )


FOREIGN = (*OTHERS, f"{Path(__file__).parent.parent}{os.sep}")
"""Folders of files that the author has not written."""


def _file_of(model: Model) -> str:
    return of_function(model.advance).file


def _nodes(file: str) -> Iterator[ast.AST]:
    return ast.walk(ast.parse("".join(linecache.getlines(file))))
