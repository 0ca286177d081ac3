"""Computing a checked expression for whole columns of points."""

import ast
import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from sweep.spec.settings import Values

Rows = NDArray[np.intp]

BLOCK = 2**16
"""Points that are computed at once, as each level of an expression holds a few columns
in memory.
"""

CONSTANTS: dict[str, float | bool] = {"pi": math.pi, "true": True, "false": False}

ARITHMETIC: dict[type[ast.operator], Callable[..., Values]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.FloorDiv: np.floor_divide,
    ast.Mod: np.remainder,
    ast.Pow: np.float_power,
}
ORDER: dict[type[ast.cmpop], Callable[..., Values]] = {
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
}
EQUALITY: dict[type[ast.cmpop], Callable[..., Values]] = {
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}


def _least(*values: Values) -> Values:
    return np.asarray(np.minimum.reduce(values))


def _greatest(*values: Values) -> Values:
    return np.asarray(np.maximum.reduce(values))


FUNCTIONS: dict[str, tuple[Callable[..., Values], int, int]] = {
    "min": (_least, 2, 20),
    "max": (_greatest, 2, 20),
    "abs": (np.abs, 1, 1),
    "sqrt": (np.sqrt, 1, 1),
    "floor": (np.floor, 1, 1),
    "ceil": (np.ceil, 1, 1),
    "round": (np.rint, 1, 1),
    "log": (np.log, 1, 1),
    "exp": (np.exp, 1, 1),
}
"""What computes each function, and how many arguments it takes at least and at most."""


class ExpressionError(ValueError):
    """What is wrong with an expression; `point` is the first point where it is, if it
    has been computed.
    """

    def __init__(self, message: str, point: int = 0) -> None:
        super().__init__(message)
        self.point = point


def evaluate(tree: ast.expr, columns: Mapping[str, Values], n_points: int) -> Values:
    """The value of a checked expression at every point, shape (n_points,): float64,
    bool, or object of texts.

    `columns` has an array of that shape for each name. Numbers are float64 throughout,
    so that no power can grow without bound. What an `if`, `and`, `or` or chained
    comparison does not need at a point is not computed there, and nothing is computed
    twice. Raises ExpressionError at a point without a finite value.
    """
    firsts = range(0, max(n_points, 1), BLOCK)
    blocks = (_block(tree, columns, n, min(n + BLOCK, n_points)) for n in firsts)
    return np.concatenate(list(blocks))


def _block(
    tree: ast.expr,
    columns: Mapping[str, Values],
    first: int,
    last: int,
) -> Values:
    """The value at the points from `first` up to `last`."""
    among = {name: column[first:last] for name, column in columns.items()}
    try:
        with np.errstate(all="ignore"):
            return _value(tree, among, np.arange(last - first))
    except ExpressionError as error:
        raise ExpressionError(str(error), first + error.point) from None


def _value(node: ast.expr, columns: Mapping[str, Values], rows: Rows) -> Values:
    def value(child: ast.expr, among: Rows = rows) -> Values:
        return _value(child, columns, among)

    match node:
        case ast.Constant(value=constant):
            return _constant(constant, len(rows))
        case ast.Name(id=name):
            return (
                _constant(CONSTANTS[name], len(rows))
                if name in CONSTANTS
                else _named(columns[name], rows)
            )
        case ast.UnaryOp(op=operator, operand=operand):
            inner = value(operand)
            if isinstance(operator, ast.Not):
                return ~inner
            return -inner if isinstance(operator, ast.USub) else inner
        case ast.BinOp(left=left, op=operator, right=right):
            return _finite(
                node, ARITHMETIC[type(operator)], [value(left), value(right)], rows
            )
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _finite(
                node,
                FUNCTIONS[name][0],
                [value(argument) for argument in arguments],
                rows,
            )
        case ast.Compare():
            return _comparison(node, columns, rows)
        case ast.BoolOp(op=operator, values=conditions):
            return _junction(isinstance(operator, ast.And), conditions, columns, rows)
        case ast.IfExp(test=test, body=body, orelse=orelse):
            chosen = value(test)
            yes, no = value(body, rows[chosen]), value(orelse, rows[~chosen])
            result = np.empty(len(rows), dtype=yes.dtype)
            result[chosen], result[~chosen] = yes, no
            return result
    raise AssertionError(f"unchecked expression {ast.dump(node)}")


def _constant(constant: object, length: int) -> Values:
    number = isinstance(constant, int | float) and not isinstance(constant, bool)
    dtype = (
        np.float64 if number else np.bool_ if isinstance(constant, bool) else np.object_
    )
    return np.full(length, constant, dtype=dtype)


def _named(column: Values, rows: Rows) -> Values:
    # Rows are distinct and ascending. So if there are as many as points, they are all
    # points.
    picked = column if len(rows) == len(column) else column[rows]
    return picked.astype(np.float64) if picked.dtype.kind == "i" else picked


def _finite(
    node: ast.expr, function: Callable[..., Values], operands: list[Values], rows: Rows
) -> Values:
    """What `function` makes of the operands; infinity is accepted only where it was
    given.
    """
    result = function(*operands)
    if not np.isfinite(result).all():
        given = np.any([np.isinf(operand) for operand in operands], axis=0)
        wrong = np.flatnonzero(np.isnan(result) | (np.isinf(result) & ~given))
        if len(wrong):
            raise ExpressionError(
                f'"{ast.unparse(node)}" is not a finite number', int(rows[wrong[0]])
            )
    return result


def _comparison(node: ast.Compare, columns: Mapping[str, Values], rows: Rows) -> Values:
    """`a < b < c`: each term is computed once, and only where the earlier ones hold."""
    result = np.full(len(rows), True)
    left = _value(node.left, columns, rows)
    for operator, term in zip(node.ops, node.comparators, strict=True):
        right = _value(term, columns, rows[result])
        holds = (ORDER | EQUALITY)[type(operator)](left, right)
        result[result] = holds
        left = right[holds]
    return result


def _junction(
    every: bool, conditions: list[ast.expr], columns: Mapping[str, Values], rows: Rows
) -> Values:
    """`and` (every) or `or`: each condition is computed only where the earlier ones
    leave it open.
    """
    result = np.full(len(rows), every)
    for condition in conditions:
        undecided = result if every else ~result
        result[undecided] = _value(condition, columns, rows[undecided])
    return result
