"""Expressions over the parameters of a model, for `derive`, `when` and `require`.

Expressions below `record` may also contain metrics.

An expression is parsed, and checked against the kinds of the parameters, without
Python's eval. An expression may contain numbers, strings, names of parameters, pi and
functions. Operators are + - * / // % **, comparisons, `and`, `or`, `not`, and
`a if condition else b`.
"""

import ast
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from sweep.spec.evaluation import (
    ARITHMETIC,
    CONSTANTS,
    EQUALITY,
    FUNCTIONS,
    ORDER,
    ExpressionError,
    Undefined,
    evaluate,
    refused,
)
from sweep.spec.settings import NotAllowedError, Setting, Value, Values
from sweep.text import unknown

NUMBER = "a number"
CONDITION = "a condition"
TEXT = "a string"
KINDS = {
    "float": NUMBER,
    "int": NUMBER,
    "bool": CONDITION,
    "choice": TEXT,
    "places": TEXT,
}
MOST_CHARACTERS = 1000
MOST_LEVELS = 60


@dataclass(frozen=True)
class Expression:
    """A checked expression.

    Attributes
    ----------
    text : str
    kind : {"a number", "a condition", "a string"}
        Kind of the value.
    names : frozenset of str
        Parameters that the expression needs.
    operations : int
        Number of parts. Each part is computed at most once per point.
    tree : ast.expr
    """

    text: str
    kind: str
    names: frozenset[str]
    operations: int
    tree: ast.expr = field(repr=False, compare=False)

    def evaluate(
        self,
        columns: Mapping[str, Values | Value],
        n_points: int,
        undefined: Undefined = refused,
    ) -> Values:
        """Return the value of the expression at every point.

        Parameters
        ----------
        columns : mapping
            Values of each parameter: an array, (n_points,), or one value for all
            points.
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
            By default, if a part is not a finite number. `point` is the first point
            with the mistake.
        """
        needed = {
            name: np.broadcast_to(_array(columns[name]), n_points)
            for name in self.names
        }
        return evaluate(self.tree, needed, n_points, undefined)


def _array(values: Values | Value) -> Values:
    return np.asarray(values, dtype=np.object_ if isinstance(values, str) else None)


def parse(text: str, settings: Mapping[str, Setting]) -> Expression:
    """Return the checked expression of a string over the parameters `settings`.

    Raises ExpressionError if the string is not an expression, or is not allowed.
    """
    tree = _tree(text)
    checker = _Checker(settings)
    kind = checker.kind(tree)
    names = frozenset(checker.names)
    return Expression(text.strip(), kind, names, checker.parts, tree=tree)


@lru_cache(maxsize=256)
def _tree(text: str) -> ast.expr:
    """Return the parts of an expression.

    The parts are cached, because a search checks the requirements of a model at every
    point.
    """
    if len(text) > MOST_CHARACTERS:
        raise ExpressionError(f"an expression has at most {MOST_CHARACTERS} characters")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ExpressionError(f'"{text}" is not an expression') from None
    if _depth(tree) > MOST_LEVELS:
        raise ExpressionError("the expression is nested too deeply")
    return tree


def _depth(tree: ast.AST) -> int:
    depth = 0
    nodes = [tree]
    while nodes:
        depth += 1
        nodes = [child for node in nodes for child in ast.iter_child_nodes(node)]
    return depth


class _Checker:
    """Checker of the kind of every part of an expression.

    The methods raise ExpressionError for anything that is not allowed.
    """

    def __init__(self, settings: Mapping[str, Setting]) -> None:
        self.settings = settings
        self.names: set[str] = set()
        self.parts = 0

    def kind(self, node: ast.expr) -> str:
        self.parts += 1
        match node:
            case ast.Constant(value=bool()):
                return CONDITION
            case ast.Constant(value=str()):
                return TEXT
            case ast.Constant(value=int() | float() as number):
                return self._literal(number)
            case ast.Name(id=name):
                return self._name(name)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return self._all(CONDITION, [operand], "not")
            case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
                return self._all(NUMBER, [operand], "a sign")
            case ast.BinOp(left=left, op=operator, right=right) if (
                type(operator) in ARITHMETIC
            ):
                return self._all(NUMBER, [left, right], "arithmetic")
            case ast.BoolOp(op=operator, values=conditions):
                return self._all(
                    CONDITION,
                    conditions,
                    "and" if isinstance(operator, ast.And) else "or",
                )
            case ast.IfExp(test=test, body=body, orelse=orelse):
                self._all(CONDITION, [test], "if")
                return self._all(self.kind(body), [orelse], '"{}" before "if"', body)
            case ast.Compare(left=left, ops=operators, comparators=terms):
                return self._comparison(operators, [left, *terms])
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return self._call(name, arguments)
        raise ExpressionError(f'"{ast.unparse(node)}" is not allowed in an expression')

    def _literal(self, number: float) -> str:
        if not abs(number) < 1e300:
            raise ExpressionError("the expression contains a number that is too large")
        return NUMBER

    def _name(self, name: str) -> str:
        if name in CONSTANTS:
            return CONDITION if isinstance(CONSTANTS[name], bool) else NUMBER
        if name not in self.settings:
            raise ExpressionError(unknown("name", name, [*self.settings, *CONSTANTS]))
        self.names.add(name)
        return KINDS[self.settings[name].kind]

    def _all(
        self,
        kind: str,
        nodes: list[ast.expr],
        where: str,
        first: ast.expr | None = None,
    ) -> str:
        """Return the kind, which all nodes must have.

        An error has the text of `first` in place of the {} in `where`.
        """
        for node in nodes:
            actual = self.kind(node)
            if actual != kind:
                # Nodes are unparsed only here. Unparsing at each level would repeat
                # the work for all deeper levels.
                place = where.format(first and ast.unparse(first))
                text = ast.unparse(node)
                raise ExpressionError(f'{place} needs {kind}, but "{text}" is {actual}')
        return kind

    def _comparison(self, operators: list[ast.cmpop], terms: list[ast.expr]) -> str:
        kind = self.kind(terms[0])
        self._all(kind, terms[1:], 'comparison with "{}"', terms[0])
        allowed = EQUALITY | ORDER if kind == NUMBER else EQUALITY
        if any(type(operator) not in allowed for operator in operators):
            signs = "==, !=, <, <=, > and >=" if kind == NUMBER else "== and !="
            raise ExpressionError(f"{kind} can only be compared with {signs}")
        self._choices(terms)
        return CONDITION

    def _choices(self, terms: list[ast.expr]) -> None:
        """Raise ExpressionError for a comparison with an impossible value.

        A value is impossible if it is not a choice of the parameter, or not a string of
        positions as in tables.
        """
        settings = [
            self.settings[term.id]
            for term in terms
            if isinstance(term, ast.Name) and term.id in self.settings
        ]
        texts = [
            term.value
            for term in terms
            if isinstance(term, ast.Constant) and isinstance(term.value, str)
        ]
        for setting in settings:
            for text in texts:
                if setting.kind == "places":
                    _check_places(setting, text)
                elif text not in setting.choices:
                    raise ExpressionError(unknown(setting.name, text, setting.choices))

    def _call(self, name: str, arguments: list[ast.expr]) -> str:
        if name not in FUNCTIONS:
            raise ExpressionError(unknown("function", name, FUNCTIONS))
        least = FUNCTIONS[name].least
        most = FUNCTIONS[name].most
        if not least <= len(arguments) <= most:
            takes = f"{least} to {most} arguments" if most > least else "1 argument"
            raise ExpressionError(f"{name} takes {takes}, not {len(arguments)}")
        return self._all(NUMBER, arguments, name)


def _check_places(setting: Setting, text: str) -> None:
    """Raise ExpressionError if a parameter of positions never has this value."""
    try:
        value = setting.coerce(text)
    except NotAllowedError as error:
        raise ExpressionError(str(error)) from None
    if value != text:
        raise ExpressionError(
            f'{setting.name} has the value "{value}" in tables, not "{text}"'
        )
