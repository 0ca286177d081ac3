"""A model's `advance` for one of several threads, from its own text.

All threads run the same text, step by step. A loop over boids becomes one over the
slice of the thread. `observe` becomes that of kernels.threads.observing, and `move_all`
is called by the last thread; both at once where nothing is between them, since one
reads only the flock and the other writes only the grid. After each of these parts the
threads wait for each other.

So a boid is updated by the same operations as by one thread, and has the same bits, if
a loop over boids has no order: if it reads of the others only what it does not write.
That is what a model says with `at_once`. The text must let it be seen what is done once
and what is done for each boid, or it is refused.
"""

import ast
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

from kernels import neighbours, recording, state
from kernels.jit import jit_as
from kernels.lanes.calls import named_by, plain_of
from kernels.lanes.syntax import names_in, stores_in, tree_of
from kernels.lanes.texts import function_of
from kernels.robots import sensing
from kernels.state import Flock
from kernels.threads import observing
from kernels.threads.barrier import wait

REMEMBER, PUBLISH, MOVE_ALL, OBSERVE = map(
    plain_of,
    (state.remember, sensing.publish, neighbours.move_all, recording.observe),
)
KEEPS = REMEMBER, PUBLISH
"""The functions that keep the flock before a step: of boids that know all that they
see, the second one does what the first one does.
"""
TEAM, WAIT, OF_TEAM, OF_SLICE = "_team", "_wait", "_observe", "_remember"
OURS = {TEAM, WAIT, OF_TEAM, OF_SLICE}
FIXED = (
    ast.Name,
    ast.Attribute,
    ast.Constant,
    ast.Compare,
    ast.cmpop,
    ast.BoolOp,
    ast.boolop,
    ast.UnaryOp,
    ast.unaryop,
    ast.expr_context,
)
"""Of tests that have the same value in all threads."""


class NotForThreadsError(RuntimeError):
    """The boids of a model cannot be divided among threads; it says why."""


@cache
def kernel_of(advance: Callable[..., bool]) -> Callable[..., bool]:
    """The kernel that takes the steps of `advance` in one thread of several: it takes a
    Team after the arguments of `advance`, and `work` and `record` of its own.

    Raises NotForThreadsError where its text cannot be written so.
    """
    plain = plain_of(advance)
    scope = dict(plain.__globals__)
    tree = tree_of(plain)
    ast.increment_lineno(tree, plain.__code__.co_firstlineno - 1)
    text = _Text(tree, scope).written()
    scope |= {WAIT: wait, OF_TEAM: observing.observe, OF_SLICE: _remember()}
    kernel: Callable[..., bool] = jit_as(function_of(text, scope), plain)
    return kernel


@cache
def _remember() -> Callable[..., Any]:
    """`remember` for the boids of a slice."""
    tree = tree_of(REMEMBER)
    for node in ast.walk(tree):
        if isinstance(node, ast.For):
            node.iter = _slice()
    _finish(tree)
    return jit_as(function_of(ast.unparse(tree), dict(REMEMBER.__globals__)), REMEMBER)


def _finish(tree: ast.FunctionDef) -> None:
    """Add the team to the arguments of a function, and leave out what only readers
    need.
    """
    tree.decorator_list, tree.returns = [], None
    tree.args.args.append(ast.arg(TEAM))
    for one in tree.args.args:
        one.annotation = None
    ast.fix_missing_locations(tree)


def _slice() -> ast.expr:
    return _expression(f"range({TEAM}.first, {TEAM}.last)")


def _expression(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body


def _statements(text: str) -> list[ast.stmt]:
    return ast.parse(text).body


class _Text:
    """The text of one `advance`, with the globals `names` that it sees."""

    def __init__(self, tree: ast.FunctionDef, names: dict[str, Any]) -> None:
        self._tree, self._names = tree, names
        self._given = [one.arg for one in tree.args.args]
        self._parts: list[ast.stmt] = []
        self._once: set[str] = set()

    def written(self) -> str:
        """The text for one thread. Raises NotForThreadsError."""
        before, steps, after = self._divided()
        self._check(before, steps, after)
        self._parts = list(self._parts_of(steps.body))
        self._check_parts()
        steps.body = self._block(steps.body)
        self._tree.body = [*before, *_gate(), steps, after]
        _finish(self._tree)
        return ast.unparse(self._tree)

    # ---- what there is

    def _divided(self) -> tuple[list[ast.stmt], ast.For, ast.stmt]:
        """What stands before the loop over steps, that loop, and the return."""
        match self._tree.body:
            case [*before, ast.For() as steps, ast.Return() as after]:
                return [one for one in before if not _is_text(one)], steps, after
        raise self._refused(self._tree, "it does not end with a loop over steps")

    def _check(
        self, before: Sequence[ast.stmt], steps: ast.For, after: ast.stmt
    ) -> None:
        """Refuse what stands around the steps if it is more than names for values."""
        for one in before:
            if not isinstance(one, ast.Assign) or not _gives_names(one):
                raise self._refused(one, "it does more than name values before")
        if ast.unparse(steps.iter) != f"range({self._given[-1]})" or steps.orelse:
            raise self._refused(steps, "its last loop is not over all steps")
        if ast.unparse(after) != "return True":
            raise self._refused(after, "it does not end with `return True`")
        if OURS & names_in(self._tree):
            raise self._refused(self._tree, "it has names that texts for threads have")
        if self._given[5] in names_in(self._tree):
            said = "its boids draw random numbers one after the other"
            raise self._refused(self._tree, said)
        self._once = set(stores_in(*before, steps.target))

    def _parts_of(self, body: Sequence[ast.stmt]) -> Iterator[ast.stmt]:
        """The parts of a step in their order: loops over boids, and what is called
        once.
        """
        for one in body:
            if isinstance(one, ast.If) and not self._is_observed(one):
                if not all(isinstance(part, FIXED) for part in ast.walk(one.test)):
                    raise self._refused(one, "it has a test that boids could change")
                yield from self._parts_of([*one.body, *one.orelse])
            else:
                yield one

    def _check_parts(self) -> None:
        """Refuse parts of which it cannot be told how often they are to be done."""
        called = [self._called_by(one) for one in self._parts]
        for functions, name in ((KEEPS, "publish"), ((OBSERVE,), "observe")):
            if sum(map(called.count, functions)) != 1:
                raise self._refused(self._tree, f"it does not call {name} once a step")
        for one, function in zip(self._parts, called, strict=True):
            if isinstance(one, ast.For):
                self._check_loop(one)
            elif function is None:
                said = "between loops over boids it does more than publish, move_all"
                raise self._refused(one, f"{said} and observe")

    def _check_loop(self, loop: ast.For) -> None:
        """Refuse a loop that is not over all boids, and one that leaves anything."""
        if ast.unparse(loop.iter) not in {
            f"range({self._given[0]}.{field}.size)" for field in Flock._fields
        }:
            raise self._refused(loop, "it has a loop that is not over all boids")
        if loop.orelse or _leaves(loop.body):
            raise self._refused(loop, "it leaves a loop over boids")
        if kept := set(stores_in(loop)) & self._once:
            name = min(kept)
            raise self._refused(loop, f"{name} changes from boid to boid")

    def _called_by(self, part: ast.stmt) -> Any:
        """Which of the functions that are called once a step a part calls."""
        if isinstance(part, ast.If):
            return OBSERVE
        if isinstance(part, ast.Expr) and isinstance(part.value, ast.Call):
            found = plain_of(named_by(part.value.func, self._names))
            return found if found in (*KEEPS, MOVE_ALL) else None
        return None

    def _is_observed(self, node: ast.If) -> bool:
        """Whether this is `if not observe(...): return False`."""
        match node:
            case ast.If(
                ast.UnaryOp(ast.Not(), ast.Call() as call),
                [ast.Return(ast.Constant(value=False))],
                [],
            ):
                return plain_of(named_by(call.func, self._names)) is OBSERVE
        return False

    def _refused(self, node: ast.stmt, why: str) -> NotForThreadsError:
        return NotForThreadsError(
            f"its boids cannot be divided among threads: {why} (line {node.lineno})"
        )

    # ---- what becomes of it

    def _block(self, body: Sequence[ast.stmt]) -> list[ast.stmt]:
        return [made for one in body for made in self._written(one)]

    def _written(self, one: ast.stmt) -> Iterator[ast.stmt]:
        if one not in self._parts:
            assert isinstance(one, ast.If)
            one.body, one.orelse = self._block(one.body), self._block(one.orelse)
            yield one
        elif isinstance(one, ast.For):
            one.iter = _slice()
            yield from (one, *_gate())
        elif isinstance(one, ast.If):
            yield _observed(one)
        elif isinstance(one, ast.Expr) and isinstance(one.value, ast.Call):
            yield from self._call(one, one.value)

    def _call(self, one: ast.Expr, call: ast.Call) -> Iterator[ast.stmt]:
        if self._called_by(one) in KEEPS:
            call.func = ast.Name(OF_SLICE, ast.Load())
            given, call.args[2:] = call.args[2:], [ast.Name(TEAM, ast.Load())]
            for work in given:
                tick = f"{ast.unparse(work)}.robots.clock[0] += 1"
                yield ast.If(_expression(f"{TEAM}.rank == 0"), _statements(tick), [])
            yield from (one, *_gate())
            return
        yield ast.If(_expression(f"{TEAM}.rank == {TEAM}.size - 1"), [one], [])
        following = self._parts[self._parts.index(one) + 1 :]
        if not (following and isinstance(following[0], ast.If)):
            yield from _gate()


def _gate() -> list[ast.stmt]:
    return _statements(f"if not {WAIT}({TEAM}): return False")


def _observed(node: ast.If) -> ast.If:
    """`if not observe(...): return False`, for all threads of the team."""
    assert isinstance(node.test, ast.UnaryOp)
    call = node.test.operand
    assert isinstance(call, ast.Call)
    call.func = ast.Name(OF_TEAM, ast.Load())
    call.args.append(ast.Name(TEAM, ast.Load()))
    return node


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _gives_names(node: ast.Assign) -> bool:
    """Whether a statement gives values to names, and to nothing else."""
    return not any(
        isinstance(part, ast.Subscript | ast.Attribute)
        for target in node.targets
        for part in ast.walk(target)
    )


def _leaves(body: Sequence[ast.stmt]) -> bool:
    """Whether statements of a loop end it before its last turn."""
    for one in body:
        if isinstance(one, ast.Break | ast.Return):
            return True
        if any(isinstance(part, ast.Return) for part in ast.walk(one)):
            return True
        if isinstance(one, ast.If) and _leaves([*one.body, *one.orelse]):
            return True
    return False
