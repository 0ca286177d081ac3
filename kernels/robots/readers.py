"""The parameters that a model reads robot by robot, from the source of the model."""

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from typing import Any, Literal, NamedTuple

from kernels import flight
from kernels.lanes.calls import is_ours, named_by, plain_of
from kernels.lanes.syntax import tree_of
from kernels.model import Model
from kernels.robots.differing import params_of

Whose = Literal["robot", "flock"]


class Read(NamedTuple):
    """Parameters that functions read per robot, and per flock."""

    robot: frozenset[str]
    flock: frozenset[str]


def parameters_read(model: Model) -> Read:
    """Return the parameters that a model reads robot by robot, and of the flock.

    The `advance` of the model reads parameters of a robot from `params_of`, and
    parameters of the flock from the third argument. Compiled functions that `advance`
    calls count too. Each trial also reads some parameters of the flock directly.
    """
    return _read(model.advance)


@cache
def _read(advance: Callable[..., bool]) -> Read:
    plain = plain_of(advance)
    if not is_ours(plain):
        return Read(frozenset(), frozenset())
    robot = set[str]()
    flock = set[str]()
    reads = [*_attributes(plain, _third(plain), set())]
    reads += _attributes(flight.begin, {"params": "flock"}, set())
    for name, whose in reads:
        (robot if whose == "robot" else flock).add(name)
    return Read(frozenset(robot), frozenset(flock))


def _third(plain: Callable[..., bool]) -> dict[str, Whose]:
    """Return the name of the third argument of `advance`, the parameters."""
    return dict.fromkeys(plain.__code__.co_varnames[2:3], "flock")


def potential_of(model: Model) -> frozenset[str]:
    """Return the parameters on which the pair potential of a model depends."""
    if model.pair_potential is None:
        return frozenset()
    plain = plain_of(model.pair_potential)
    params = plain.__code__.co_varnames[0]
    return frozenset(name for name, _ in _attributes(plain, {params: "flock"}, set()))


LINE = "robot = params_of(params, work, i)"
Met = set[tuple[Callable[..., Any], frozenset[tuple[str, Whose]]]]


def _attributes(
    plain: Callable[..., Any], arguments: Mapping[str, Whose], met: Met
) -> Iterator[tuple[str, Whose]]:
    """Yield all parameters that a plain function reads, each with the owner.

    `arguments` are the arguments that hold parameters. `met` are the visited functions.
    """
    key = plain, frozenset(arguments.items())
    if key in met:
        return
    met.add(key)
    assignments, attributes_and_calls = _nodes(plain)
    known = dict(arguments)
    while more := {*_bound(assignments, plain, known)} - known.items():
        known.update(more)
    for node in attributes_and_calls:
        match node:
            case ast.Attribute(ast.Name(name), read) if name in known:
                yield read, known[name]
            case ast.Call(function):
                called = plain_of(named_by(function, plain.__globals__))
                if is_ours(called) and called is not plain_of(params_of):
                    passed = dict(_passed(called, node, plain, known))
                    yield from _attributes(called, passed, met)


@cache
def _nodes(
    plain: Callable[..., Any],
) -> tuple[list[ast.Assign], list[ast.Attribute | ast.Call]]:
    """Return the assignments of a function, and the attributes and calls in it.

    The result is cached, because models have most functions in common.
    """
    nodes = list(ast.walk(tree_of(plain)))
    return (
        [node for node in nodes if isinstance(node, ast.Assign)],
        [node for node in nodes if isinstance(node, ast.Attribute | ast.Call)],
    )


def _whose(
    node: ast.expr, plain: Callable[..., Any], known: Mapping[str, Whose]
) -> Whose | None:
    """Return the owner of the parameters in an expression, None without parameters."""
    match node:
        case ast.Name(name):
            return known.get(name)
        case ast.Call(function):
            called = plain_of(named_by(function, plain.__globals__))
            return "robot" if called is plain_of(params_of) else None
    return None


def _bound(
    assignments: Iterable[ast.Assign],
    plain: Callable[..., Any],
    known: Mapping[str, Whose],
) -> Iterator[tuple[str, Whose]]:
    """Yield the names to which a function assigns parameters, each with the owner."""
    for node in assignments:
        for target in node.targets:
            for name, value in _pairs(target, node.value):
                if whose := _whose(value, plain, known):
                    yield name, whose


def _pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    match target, value:
        case ast.Name(name), _:
            yield name, value
        case ast.Tuple(targets), ast.Tuple(values):
            for inner_target, inner_value in zip(targets, values, strict=False):
                yield from _pairs(inner_target, inner_value)


def _passed(
    called: Callable[..., Any],
    node: ast.Call,
    plain: Callable[..., Any],
    known: Mapping[str, Whose],
) -> Iterator[tuple[str, Whose]]:
    """Yield the arguments of a called function that are parameters, with the owner."""
    names = called.__code__.co_varnames[: called.__code__.co_argcount]
    arguments = [*zip(names, node.args, strict=False)]
    arguments += [(word.arg, word.value) for word in node.keywords if word.arg]
    for name, value in arguments:
        if whose := _whose(value, plain, known):
            yield name, whose
