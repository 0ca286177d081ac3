"""Evaluation of a checked expression for whole columns of points."""

import ast
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.spec.settings import Values

Rows = NDArray[np.intp]

BLOCK = 2**16
"""Number of points that are computed at once.

Each level of an expression needs memory for a few columns of this length.
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


class Function(NamedTuple):
    """A function of expressions.

    Attributes
    ----------
    compute : callable
        Takes and returns columns of numbers.
    least, most : int, default 1
        Least and greatest number of arguments.
    unit : {"same", "root", "none"}, default "same"
        Unit of the value: the unit of all arguments, the square root of the unit, or no
        unit. With "none" the arguments also have no unit.
    """

    compute: Callable[..., Values]
    least: int = 1
    most: int = 1
    unit: Literal["same", "root", "none"] = "same"


FUNCTIONS: dict[str, Function] = {
    "min": Function(_least, 2, 20),
    "max": Function(_greatest, 2, 20),
    "abs": Function(np.abs),
    "sqrt": Function(np.sqrt, unit="root"),
    "floor": Function(np.floor),
    "ceil": Function(np.ceil),
    "round": Function(np.rint),
    "log": Function(np.log, unit="none"),
    "exp": Function(np.exp, unit="none"),
}


class ExpressionError(ValueError):
    """A mistake in an expression.

    `point` is the index of the first point with the mistake, if values were computed,
    and otherwise 0.
    """

    def __init__(self, message: str, point: int = 0) -> None:
        super().__init__(message)
        self.point = point


Undefined = Callable[[ast.expr, Values, NDArray[np.bool_], Rows], Values]
"""Replacement of undefined values: `undefined(node, values, wrong, rows)`.

`node` computed `values`, (rows,), at the points `rows`. Values are undefined where
`wrong` is true.
"""


def refused(
    node: ast.expr, values: Values, wrong: NDArray[np.bool_], rows: Rows
) -> Values:
    """Return the values, or raise ExpressionError for an undefined value.

    Parameters
    ----------
    node : ast.expr
        Part of an expression that computed the values.
    values : array, shape (k,)
    wrong : array of bool, shape (k,)
        True for undefined values.
    rows : array of int, shape (k,)
        Indices of the points.

    Returns
    -------
    array, shape (k,)

    Raises
    ------
    ExpressionError
        If a value is undefined. `point` is the first point with an undefined value.
    """
    if wrong.any():
        raise ExpressionError(
            f'"{ast.unparse(node)}" is not a finite number', int(rows[wrong.argmax()])
        )
    return values


def left_open(
    _node: ast.expr, values: Values, wrong: NDArray[np.bool_], _rows: Rows
) -> Values:
    """Return values with NaN in place of undefined values.

    Parameters
    ----------
    values : array, shape (k,)
    wrong : array of bool, shape (k,)
        True for undefined values.

    Returns
    -------
    array, shape (k,)
    """
    return np.where(wrong, np.nan, values)


def evaluate(
    tree: ast.expr,
    columns: Mapping[str, Values],
    n_points: int,
    undefined: Undefined = refused,
) -> Values:
    """Return the value of a checked expression at every point.

    All numbers are float64, so that no power can grow without bound. A part that an
    `if`, `and`, `or` or chained comparison does not need at a point is not computed at
    this point. No part is computed twice.

    Parameters
    ----------
    tree : ast.expr
        The checked expression.
    columns : mapping of arrays, shape (n_points,)
        Values by name.
    n_points : int
    undefined : Undefined, default `refused`
        Replaces values that are not finite, or raises ExpressionError.

    Returns
    -------
    array, shape (n_points,)
        float64, bool, or object for strings.

    Raises
    ------
    ExpressionError
        By default, if a part has no finite value at a point.
    """
    firsts = range(0, max(n_points, 1), BLOCK)
    blocks = [
        _block(tree, columns, n, min(n + BLOCK, n_points), undefined=undefined)
        for n in firsts
    ]
    return np.concatenate(blocks)


def _block(
    tree: ast.expr,
    columns: Mapping[str, Values],
    first: int,
    last: int,
    undefined: Undefined,
) -> Values:
    """Return the values at the points from `first` up to `last`, not included."""
    among = {name: column[first:last] for name, column in columns.items()}
    try:
        with np.errstate(all="ignore"):
            return _Evaluation(among, undefined).value(tree, np.arange(last - first))
    except ExpressionError as error:
        raise ExpressionError(str(error), first + error.point) from None


@dataclass(frozen=True)
class _Evaluation:
    """Evaluation of the parts of an expression at some rows of the columns."""

    columns: Mapping[str, Values]
    undefined: Undefined

    def value(self, node: ast.expr, rows: Rows) -> Values:
        """Return the value of a part at some points.

        Parameters
        ----------
        node : ast.expr
        rows : array of int, shape (k,)
            Distinct indices of points, ascending.

        Returns
        -------
        array, shape (k,)
        """
        match node:
            case ast.Constant(value=constant):
                return _constant(constant, len(rows))
            case ast.Name(id=name):
                return (
                    _constant(CONSTANTS[name], len(rows))
                    if name in CONSTANTS
                    else _named(self.columns[name], rows)
                )
            case ast.UnaryOp(op=operator, operand=operand):
                inner = self.value(operand, rows)
                if isinstance(operator, ast.Not):
                    return ~inner
                return -inner if isinstance(operator, ast.USub) else inner
            case ast.BinOp(left=left, op=operator, right=right):
                return self._number(
                    node, ARITHMETIC[type(operator)], [left, right], rows
                )
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self._number(node, FUNCTIONS[name].compute, arguments, rows)
            case ast.Compare():
                return self._comparison(node, rows)
            case ast.BoolOp(op=operator, values=conditions):
                return self._junction(isinstance(operator, ast.And), conditions, rows)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                chosen = self.value(test, rows)
                yes = self.value(body, rows[chosen])
                no = self.value(orelse, rows[~chosen])
                result = np.empty(len(rows), dtype=yes.dtype)
                result[chosen] = yes
                result[~chosen] = no
                return result
        raise AssertionError(f"unchecked expression {ast.dump(node)}")

    def _number(
        self,
        node: ast.expr,
        function: Callable[..., Values],
        arguments: list[ast.expr],
        rows: Rows,
    ) -> Values:
        """Return the value of a function of numbers.

        Infinity is a value only at points where an argument is infinite.
        """
        operands = [self.value(argument, rows) for argument in arguments]
        result = function(*operands)
        if np.isfinite(result).all():
            return result
        infinite = np.any([np.isinf(operand) for operand in operands], axis=0)
        wrong = np.isnan(result) | (np.isinf(result) & ~infinite)
        return self.undefined(node, result, wrong, rows)

    def _comparison(self, node: ast.Compare, rows: Rows) -> Values:
        """Return the value of `a < b < c`.

        Each term is computed once, and only where all earlier comparisons are true.
        """
        result = np.full(len(rows), True)
        left = self.value(node.left, rows)
        for operator, term in zip(node.ops, node.comparators, strict=True):
            right = self.value(term, rows[result])
            holds = (ORDER | EQUALITY)[type(operator)](left, right)
            result[result] = holds
            left = right[holds]
        return result

    def _junction(self, every: bool, conditions: list[ast.expr], rows: Rows) -> Values:
        """Return the value of `and` (`every` is true) or `or`.

        Each condition is computed only where the earlier conditions do not decide.
        """
        result = np.full(len(rows), every)
        for condition in conditions:
            undecided = result if every else ~result
            result[undecided] = self.value(condition, rows[undecided])
        return result


def _constant(constant: object, length: int) -> Values:
    number = isinstance(constant, int | float) and not isinstance(constant, bool)
    dtype = (
        np.float64 if number else np.bool_ if isinstance(constant, bool) else np.object_
    )
    return np.full(length, constant, dtype=dtype)


def _named(column: Values, rows: Rows) -> Values:
    # Rows are distinct and ascending, so an equal length means all points.
    picked = column if len(rows) == len(column) else column[rows]
    return picked.astype(np.float64) if picked.dtype.kind == "i" else picked
