"""Expressions in the form for lanes.

Python computes some expressions only on demand, such as the second side of `and`. Lanes
compute all expressions, and `where` selects the lanes that need the result. So an
expression on demand may neither draw a random number nor write into an array: in
unselected lanes, a single trial would skip the expression.
"""

import ast
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from kernels.lanes import vectors
from kernels.lanes.calls import is_ours, needs_its_test, plain_of, writes
from kernels.lanes.facts import Facts, NotForLanesError
from kernels.lanes.rows import is_each
from kernels.lanes.stubs import in_each_lane, method_in_each_lane, text_in_each_lane
from kernels.lanes.syntax import call_of, load
from kernels.near import Near
from kernels.neighbours import Grid

VECTORIAL = {math.sqrt, abs, max, min}
"""Functions of Python that take vectors."""
KINDS = {float: vectors.as_float, int: vectors.as_int, bool: vectors.as_bool}


class Expressions:
    """The expressions of one function, described by `facts`.

    `hidden` are names that have a value in some lanes only, and `places` the indices of
    loops over neighbours. `conditions` counts the conditions on which the current
    statement and expressions depend and which may differ from lane to lane. `added_to`
    is the element to which the current statement adds a number. `tools` are the stubs
    that the expressions call, by name.
    """

    def __init__(self, facts: Facts) -> None:
        self.facts = facts
        self.hidden: set[str] = set()
        self.places: set[str] = set()
        self.conditions = 0
        self.added_to: ast.expr | None = None
        self.tools: dict[str, Any] = {}

    def value(self, node: Any) -> Any:
        """Return an expression, or a part of an expression, in the form for lanes.

        Raises NotForLanesError if no form for lanes exists.
        """
        if not isinstance(node, ast.expr):
            return node
        self._refuse(node)
        if isinstance(node, ast.Call):
            return self._call(node)
        if self.is_of_neighbour(node):
            return node
        for_lanes = self._by_lanes(node)
        return self._as_it_is(node) if for_lanes is None else for_lanes

    def _refuse(self, node: ast.expr) -> None:
        """Raise NotForLanesError for expressions without a meaning in several lanes."""
        match node:
            case ast.Lambda() | ast.ListComp() | ast.GeneratorExp():
                raise NotForLanesError("it makes a function or a list")
            case ast.NamedExpr():
                raise NotForLanesError("it has a `:=` in an expression")
            case ast.Name(name) if name in self.places:
                raise NotForLanesError("each lane lists other neighbours at a place")
            case ast.Name(name) if name in self.hidden:
                raise NotForLanesError(f"{name} has a value in some lanes only")
            case ast.Attribute() if self.facts.holds(node.value, Grid, Near):
                raise NotForLanesError("a grid and a list of neighbours are of no lane")
            case ast.Subscript(ctx=ast.Load()) if not self.is_of_neighbour(node):
                if self.facts.differs(node.slice):
                    raise NotForLanesError("each lane reads at another index")
                if is_each(self.facts.kind(node.value)):
                    raise NotForLanesError("each lane has an array of its own")
                if self.facts.counts(node.value) and node is not self.added_to:
                    raise NotForLanesError("it reads the events that it counts")

    def is_of_neighbour(self, node: ast.expr) -> bool:
        """Return whether an expression is like `near.dx[k]`, in a loop over neighbours.

        The index of the loop has no other use there, because lanes list different
        neighbours.
        """
        match node:
            case ast.Subscript(ast.Attribute(near), ast.Name(place)):
                return place in self.places and self.facts.holds(near, Near)
        return False

    def _by_lanes(self, node: ast.expr) -> Any:
        """Return the substitute of an expression that lanes compute differently.

        Returns None for an expression with operators that have a meaning for vectors.
        """
        if isinstance(node, ast.IfExp) and self.facts.differs(node.test):
            test = self.value(node.test)
            return call_of("where", test, *self._if_needed([node.body, node.orelse]))
        if not self.facts.differs(node):
            return None
        match node:
            case ast.BoolOp(operator, [first, *rest]):
                name = "both" if isinstance(operator, ast.And) else "either"
                return _joined(name, [self.value(first), *self._if_needed(rest)])
            case ast.UnaryOp(ast.Not(), operand):
                return call_of("negated", self.value(operand))
            case ast.Compare(ops=[_, _, *_]):
                return self._chain(node)
            case ast.BinOp(op=ast.Pow() | ast.FloorDiv() | ast.Mod()):
                return self._in_each_lane(node)
        return None

    def _as_it_is(self, node: ast.expr) -> ast.expr:
        """Return the expression with all parts in the form for lanes."""
        kind: Any = type(node)
        changed: ast.expr = kind(
            **{
                name: [self.value(element) for element in part]
                if isinstance(part, list)
                else self.value(part)
                for name, part in ast.iter_fields(node)
            }
        )
        return changed

    def _if_needed(self, nodes: Sequence[ast.expr]) -> list[Any]:
        """Return expressions that a single trial computes only on demand."""
        self.conditions += 1
        values = [self.value(node) for node in nodes]
        self.conditions -= 1
        return values

    def _chain(self, node: ast.Compare) -> Any:
        """Return `a < b < c` as all comparisons, although Python may skip the last.

        The middle is computed twice, so that the middle may not draw random numbers.
        """
        sides = pairwise(self._if_needed([node.left, *node.comparators]))
        return _joined(
            "both",
            [
                ast.Compare(left, [sign], [right])
                for (left, right), sign in zip(sides, node.ops, strict=True)
            ],
        )

    def _in_each_lane(self, node: ast.BinOp) -> ast.Call:
        """Return the call that computes `a ** b` and similar in each lane.

        Constants stay in the text, because numba computes constant and variable powers
        differently.
        """
        sides = [node.left, node.right]
        free = [side for side in sides if not isinstance(side, ast.Constant)]
        names = iter(["first", "second"])
        parts = [
            side if isinstance(side, ast.Constant) else load(next(names))
            for side in sides
        ]
        text = ast.unparse(ast.BinOp(parts[0], node.op, parts[1]))
        name = f"_{type(node.op).__name__.lower()}_{len(self.tools)}"
        self.tools[name] = text_in_each_lane(text, len(free))
        return ast.Call(load(name), [self.value(side) for side in free], [])

    def _call(self, node: ast.Call) -> Any:
        if node.keywords:
            raise NotForLanesError("it names arguments of a call")
        function = self.facts.called(node)
        method = node.func
        if self.conditions:
            self._refuse_for_some(node, function)
        if isinstance(method, ast.Attribute) and self.facts.draws(node):
            return self._draw(method, node.args)
        arguments = [self.value(argument) for argument in node.args]
        plain = plain_of(function)
        if not is_ours(plain) and any(map(self.facts.differs, node.args)):
            if plain in KINDS:
                return call_of(KINDS[plain].__name__, *arguments)
            if plain not in VECTORIAL and not _makes_tuples(plain):
                return self._call_in_each_lane(plain, arguments)
        if isinstance(method, ast.Attribute) and self.facts.differs(method.value):
            raise NotForLanesError("it calls a method of what differs between lanes")
        if isinstance(method, ast.Attribute) and is_ours(function):
            return self._call_in_module(method, function, arguments)
        if plain in (max, min):
            return _in_pairs(method, arguments)
        return ast.Call(method, arguments, [])

    def _refuse_for_some(self, node: ast.Call, function: Any) -> None:
        """Raise NotForLanesError for a call with effects that one trial may skip."""
        draws = self.facts.draws(node) or any(map(self.facts.is_random, node.args))
        if draws or writes(function):
            raise NotForLanesError(
                "it draws or writes where only some lanes would do so"
            )
        if needs_its_test(function):
            raise NotForLanesError("it calls what only some lanes may call")

    def _call_in_module(
        self, method: ast.Attribute, function: Any, arguments: list[Any]
    ) -> ast.Call:
        """Return the call of a compiled function in the form `module.name`."""
        name = f"_of_{ast.unparse(method.value)}_{method.attr}"
        self.tools[name] = function
        return ast.Call(load(name), arguments, [])

    def _call_in_each_lane(self, plain: Any, arguments: list[Any]) -> ast.Call:
        """Return the call, in each lane, of a function that takes no vectors."""
        if getattr(plain, "__module__", "") != "math":
            raise NotForLanesError("it calls a function that is not known for lanes")
        name = f"_each_{plain.__name__}"
        self.tools[name] = in_each_lane(plain, len(arguments))
        return ast.Call(load(name), arguments, [])

    def _draw(self, method: ast.Attribute, arguments: Sequence[ast.expr]) -> ast.Call:
        """Return the call that draws from the generator of each lane."""
        name = f"_draw_{method.attr}_{len(arguments)}"
        self.tools[name] = method_in_each_lane(method.attr, len(arguments))
        return ast.Call(load(name), [method.value, *map(self.value, arguments)], [])


def _joined(name: str, parts: Sequence[Any]) -> Any:
    """Return `both` or `either` of several parts, from the left."""
    joined, *rest = parts
    for part in rest:
        joined = call_of(name, joined, part)
    return joined


def _in_pairs(function: ast.expr, arguments: list[Any]) -> Any:
    """Return `max` or `min` of numbers, from the left, two at a time."""
    if len(arguments) <= 2:
        return ast.Call(function, arguments, [])
    extreme, *rest = arguments
    for argument in rest:
        extreme = ast.Call(function, [extreme, argument], [])
    return extreme


def _makes_tuples(function: Any) -> bool:
    return isinstance(function, type) and issubclass(function, tuple)
