"""Conversion of a function for a single trial into a function for lanes.

A test that differs from lane to lane cannot branch. So all lanes compute the dependent
code, and `where` selects the lanes in which the test is true. `a if test else b`
becomes `where(test, a, b)`. An assignment in an `if` or in a loop over neighbours
becomes `x = where(mask, new, x)`. Tests that are equal in all lanes still branch.

Some functions have no form for lanes, for example a function with a loop that differs
in length. A function without a form for lanes is called lane by lane.
"""

import ast
import inspect
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from typing import Any

from kernels.lanes.calls import is_ours, plain_of, searches, writes
from kernels.lanes.expressions import Expressions
from kernels.lanes.facts import Facts, NotForLanesError
from kernels.lanes.rows import Rows, holds_lanes
from kernels.lanes.stubs import TOOLS, lane_by_lane, stub
from kernels.lanes.syntax import call_of, is_costly, load, read_again, stored, stores_in
from kernels.lanes.texts import function_of

SUBSTITUTES: dict[Callable[..., Any], Callable[..., Any]] = {}
"""Substitutes in lanes for compiled functions that are not rules."""


@cache
def converted(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the substitute of a compiled function in a kernel for lanes.

    The substitute takes equal arguments, which may be vectors and rows.
    """
    if function in SUBSTITUTES:
        return SUBSTITUTES[function]
    plain = plain_of(function)
    names = list(inspect.signature(plain).parameters)
    return stub(plain.__name__, names, lambda kinds: _for_types(function, kinds))


def _for_types(function: Callable[..., Any], kinds: dict[str, Any]) -> Any:
    """Return the function to compile for arguments of the types `kinds`.

    Raises NotForLanesError for a function that can neither be converted nor be called
    lane by lane. A call lane by lane must not write, because all lanes would read the
    result.
    """
    plain = plain_of(function)
    if not any(map(holds_lanes, kinds.values())):
        return plain
    try:
        return _written(plain, kinds)
    except NotForLanesError as error:
        if writes(function):
            raise
        return lane_by_lane(function, kinds, str(error))


def _written(plain: Callable[..., Any], kinds: dict[str, Any]) -> Callable[..., Any]:
    """Return the function of the converted text.

    The conversion is repeated until no new name differs from lane to lane. Raises
    NotForLanesError if the function cannot be converted.
    """
    facts = Facts(plain, kinds)
    _refuse(facts)
    while True:
        before = set(facts.varying)
        statements = _Statements(facts)
        body = statements.block(facts.tree.body, None)
        if facts.varying == before:
            break
    if statements.tools.keys() & facts.names:
        raise NotForLanesError("it has names that texts for lanes have")
    scope = facts.globals | TOOLS | statements.tools
    for called in facts.names | statements.tools.keys():
        if is_ours(function := scope.get(called)):
            scope[called] = converted(function)
    text = _text(facts.tree.name, kinds, body)
    written: Callable[..., Any] = function_of(text, scope)
    return written


def _refuse(facts: Facts) -> None:
    """Raise NotForLanesError for functions that cannot be converted for any types."""
    if TOOLS.keys() & facts.names:
        raise NotForLanesError("it has names that texts for lanes have")
    calls = (node for node in ast.walk(facts.tree) if isinstance(node, ast.Call))
    if sum(searches(facts.called(node)) for node in calls) > 1:
        raise NotForLanesError("what one search has found, another one overwrites")


def _text(name: str, names: Iterable[str], body: list[ast.stmt]) -> str:
    """Return the text of a function with the statements `body`."""
    module = ast.parse(f"def {name}({', '.join(names)}): pass")
    (function,) = module.body
    assert isinstance(function, ast.FunctionDef)
    function.body = body
    return ast.unparse(ast.fix_missing_locations(module))


class _Statements:
    """The statements of one function, described by `facts`.

    Statements apply in the lanes of a `mask`, the name of a variable; None for all
    lanes. `returned` are masks of lanes that have returned, each with the name of the
    result. `defined` are the names that have a value in all lanes of the mask.
    """

    def __init__(self, facts: Facts) -> None:
        self._facts = facts
        self._expressions = Expressions(facts)
        self._returned: list[tuple[str, str]] = []
        self._defined = set(facts.kinds)
        self._fresh = 0

    @property
    def tools(self) -> dict[str, Any]:
        """Stubs that the statements call, by name."""
        return self._expressions.tools

    def block(self, body: Sequence[ast.stmt], mask: str | None) -> list[ast.stmt]:
        """Return statements in the form for lanes.

        Parameters
        ----------
        body : sequence of ast.stmt
        mask : str or None
            Name of the mask of lanes in which the statements apply; None for all lanes.
        """
        return [for_lanes for node in body for for_lanes in self._statement(node, mask)]

    def _statement(self, node: ast.stmt, mask: str | None) -> Iterator[ast.stmt]:
        self._expressions.conditions = int(mask is not None or bool(self._returned))
        self._expressions.added_to = None
        match node:
            case ast.Assign([target], value):
                yield from self._assign(target, value, mask)
            case ast.AugAssign(target, operator, value):
                value = ast.BinOp(read_again(target), operator, value)
                if isinstance(operator, ast.Add):
                    self._expressions.added_to = value.left
                yield from self._assign(target, value, mask)
            case ast.If():
                yield from self._branch(node, mask)
            case ast.For():
                yield from self._loop(node, mask)
            case ast.Return():
                yield from self._leave(node, mask)
            case ast.Pass():
                yield node
            case ast.Expr(ast.Constant()):  # a docstring
                pass
            case ast.Expr(value):
                if self._mask_of_stores(mask) is not None:
                    raise NotForLanesError("it calls for effect in some lanes only")
                yield ast.Expr(self._value(value))
            case _:
                name = type(node).__name__.lower()
                raise NotForLanesError(f"it has a statement `{name}`")

    def _value(self, node: Any) -> Any:
        return self._expressions.value(node)

    def _name(self, stem: str) -> str:
        self._fresh += 1
        name = f"_{stem}_{self._fresh}"
        return self._name(stem) if name in self._facts.names else name

    # ---- assignments

    def _assign(
        self, target: ast.expr, value: ast.expr, mask: str | None
    ) -> Iterator[ast.stmt]:
        """Yield `target = value`; in `a, b = b, a` all values are computed first."""
        if not (isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)):
            yield from self._store(target, value, self._value(value), mask)
            return
        held = []
        for element in value.elts:
            held.append(self._name("value"))
            yield stored(held[-1], self._value(element))
        for part, element, name in zip(target.elts, value.elts, held, strict=True):
            yield from self._store(part, element, load(name), mask)

    def _store(
        self, target: ast.expr, meant: ast.expr, value: Any, mask: str | None
    ) -> Iterator[ast.stmt]:
        """Yield the assignment of `value` to a target or to the parts of a target.

        `meant` is the expression of a single trial from which `value` was converted.
        """
        differs = self._facts.differs(meant)
        if isinstance(target, ast.Tuple):
            held = self._name("values")
            yield stored(held, value)
            for k, element in enumerate(target.elts):
                part = ast.Subscript(load(held), ast.Constant(k), ast.Load())
                yield from self._put(element, part, mask, differs)
            return
        if isinstance(target, ast.Name) and target.id in self._facts.once:
            kind = self._facts.kind(meant)
            if kind is not None and mask is None:
                self._facts.known[target.id] = kind
        yield from self._put(target, value, mask, differs)

    def _put(
        self, target: Any, value: Any, mask: str | None, differs: bool
    ) -> Iterator[ast.stmt]:
        """Yield the assignment of a value to one name, or to an element of an array."""
        if isinstance(target, ast.Name):
            yield self._put_name(target.id, value, mask, differs)
        elif isinstance(target, ast.Subscript):
            yield self._put_element(target, value, mask, differs)
        else:
            raise NotForLanesError("it stores into something else than a name or array")

    def _put_name(
        self, name: str, value: Any, mask: str | None, differs: bool
    ) -> ast.stmt:
        if differs or mask:
            self._facts.varying.add(name)
        self._expressions.hidden.discard(name)
        if mask and name in self._defined:
            value = call_of("where", load(mask), value, load(name))
        self._defined.add(name)
        return stored(name, value)

    def _put_element(
        self, target: ast.Subscript, value: Any, mask: str | None, differs: bool
    ) -> ast.stmt:
        """Return the assignment of a value to an element of an array.

        Only rows have room for values that differ. The index must be equal in all
        lanes.
        """
        if self._facts.differs(target.slice):
            raise NotForLanesError("each lane writes at another index")
        if self._facts.counts(target.value) and self._expressions.added_to is None:
            raise NotForLanesError("it sets the events that it counts")
        array = target.value
        index = target.slice
        if not self._expressions.is_of_neighbour(target):
            array = self._value(array)
            index = self._value(index)
        stores = self._mask_of_stores(mask)
        is_row = isinstance(self._facts.kind(target.value), Rows)
        if (differs or stores is not None) and not is_row:
            raise NotForLanesError("it writes into an array of all lanes")
        if stores is not None:
            old = ast.Subscript(array, index, ast.Load())
            value = call_of("where", stores, value, old)
        return ast.Assign([ast.Subscript(array, index, ast.Store())], value)

    def _mask_of_stores(self, mask: str | None) -> Any:
        """Return the lanes in which a store applies; None for all lanes.

        The lanes are the lanes of `mask` that have not returned.
        """
        lanes: Any = load(mask) if mask else None
        for left, _ in self._returned:
            stays = call_of("negated", load(left))
            lanes = call_of("both", lanes, stays) if lanes else stays
        return lanes

    # ---- branches

    def _branch(self, node: ast.If, mask: str | None) -> Iterator[ast.stmt]:
        if not self._facts.differs(node.test):
            yield self._real_branch(node, mask)
            return
        test = self._name("test")
        yield stored(test, self._value(node.test))
        before = set(self._defined)
        yield from self._under(node.body, mask, load(test), bool(node.orelse))
        first = self._defined - before
        if node.orelse:
            otherwise = call_of("negated", load(test))
            yield from self._under(node.orelse, mask, otherwise, True)
        self._hide(self._defined - before - (first & set(stores_in(*node.orelse))))

    def _real_branch(self, node: ast.If, mask: str | None) -> ast.stmt:
        """Return an `if` with a test that is equal in all lanes."""
        returned = len(self._returned)
        defined = set(self._defined)
        test = self._value(node.test)
        body = self.block(node.body, mask)
        after = self._defined
        self._defined = defined
        orelse = self.block(node.orelse, mask)
        in_one = self._defined ^ after
        self._defined |= after
        if mask:  # unmasked lanes may hold the value of an earlier step
            self._hide(in_one)
        if len(self._returned) > returned:
            raise NotForLanesError("some lanes return in a branch of all")
        return ast.If(test, body or [ast.Pass()], orelse)

    def _hide(self, names: set[str]) -> None:
        """Forbid reads of names, because they have a value in some lanes only."""
        self._defined -= names
        self._expressions.hidden |= names

    def _under(
        self, body: Sequence[ast.stmt], mask: str | None, test: Any, is_one_of_two: bool
    ) -> Iterator[ast.stmt]:
        """Yield statements that apply in lanes in which `mask` and `test` are true.

        Costly statements are skipped if no lane needs the results, except in an `if`
        with an `else`, because the other branch may need the names.
        """
        name = self._name("mask")
        yield stored(name, call_of("both", load(mask), test) if mask else test)
        block = self.block(body, name)
        leaves = any(isinstance(node, ast.Return) for node in body)
        if is_costly(body) and not leaves and not is_one_of_two:
            yield ast.If(call_of("any_lane", load(name)), block, [])
        else:
            yield from block

    # ---- loops and returns

    def _loop(self, node: ast.For, mask: str | None) -> Iterator[ast.stmt]:
        if node.orelse:
            raise NotForLanesError("it has a loop with `else`")
        returned = len(self._returned)
        over = node.iter
        is_range = isinstance(over, ast.Call) and self._facts.called(over) is range
        if is_range and self._facts.differs(over):
            yield from self._loop_over_neighbours(node, mask)
        else:
            yield self._loop_of_all(node, mask)
        if len(self._returned) > returned:
            raise NotForLanesError("some lanes return in a loop of all")

    def _loop_over_neighbours(
        self, node: ast.For, mask: str | None
    ) -> Iterator[ast.stmt]:
        """Yield a loop over the neighbours that a search found.

        The loop visits boids that are neighbours in any lane. The statements apply in
        the lanes in which the boid is a neighbour.
        """
        place = node.target
        over = node.iter
        assert isinstance(over, ast.Call)
        if len(over.args) != 1 or not isinstance(place, ast.Name):
            raise NotForLanesError("each lane has another range")
        held = self._name("found")
        yield stored(held, self._value(over.args[0]))
        marks = call_of("marked", load(held), load(place.id))
        known = set(self._defined)
        self._expressions.places.add(place.id)
        body = list(self._under(node.body, mask, marks, False))
        self._expressions.places.discard(place.id)
        self._hide(self._defined - known | {place.id})
        count = ast.Call(load("range"), [call_of("listed", load(held))], [])
        yield ast.For(place, count, body, [])

    def _loop_of_all(self, node: ast.For, mask: str | None) -> ast.stmt:
        """Return a loop of equal length in all lanes, over a range or a tuple."""
        differs = self._facts.differs(node.iter)
        over = self._value(node.iter)
        for name in stores_in(node.target):
            self._defined.add(name)
            if differs:
                self._facts.varying.add(name)
        return ast.For(node.target, over, self.block(node.body, mask), [])

    def _leave(self, node: ast.Return, mask: str | None) -> Iterator[ast.stmt]:
        """Yield a return; lanes that return early keep the result until all return."""
        if node.value is None:
            raise NotForLanesError("it returns nothing")
        value = self._value(node.value)
        if mask:
            held = self._name("result")
            yield stored(held, value)
            self._returned.append((mask, held))
            return
        for test, earlier in reversed(self._returned):
            value = call_of("where", load(test), load(earlier), value)
        yield ast.Return(value)
