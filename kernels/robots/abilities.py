"""Abilities of robots: sensing, communication, actuation, several goals, heterogeneity.

A model declares abilities. A declaration can only restrict the abilities in the source
of the model: further abilities would give wrong numbers. `sweep check` reports
differences between declaration and source. Without a declaration, the source decides.

The source of a built-in model is not read, because tests compare the declaration with
the source. Reading takes 0.15 s, an eighth of a short command.
"""

import ast
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, get_args, get_type_hints

from kernels.caching import OUR_PACKAGE
from kernels.goals import goal_of
from kernels.lanes.calls import calls, named_by, plain_of
from kernels.lanes.syntax import tree_of
from kernels.model import Model
from kernels.robots.actuation import drive
from kernels.robots.readers import parameters_read
from kernels.robots.sensing import publish
from kernels.state import remember


class Abilities(NamedTuple):
    """Abilities of the robots of a model; each ability is a field of `Model`.

    Attributes
    ----------
    publishes
        Whether sensing and communication are possible: `advance` calls `publish`.
    drives
        Whether actuation and failures are possible: `advance` calls `drive`.
    goals_in_turn
        Whether boids can go to several goals: `advance` calls `goal_of`.
    shared
        Parameters of type float that all boids have in common, in the order of the
        parameters. All further parameters may differ from robot to robot, because
        `advance` reads these parameters from `params_of` alone.
    """

    publishes: bool
    drives: bool
    goals_in_turn: bool
    shared: tuple[str, ...]


CALLS = {"publishes": "publish", "drives": "drive", "goals_in_turn": "goal_of"}
"""The function that `advance` calls, by the ability."""


def abilities(model: Model) -> Abilities:
    """Return the abilities in the source of a model that no declaration excludes."""
    source = _tested(model) or in_source(model)
    shared = {*source.shared, *(model.shared or ())}
    return Abilities(
        source.publishes and model.publishes is not False,
        source.drives and model.drives is not False,
        source.goals_in_turn and model.goals_in_turn is not False,
        tuple(name for name in model.params._fields if name in shared),
    )


def why_not(model: Model, ability: str) -> str:
    """Return the reason why robots of a model lack an ability of CALLS, or ""."""
    if not getattr(in_source(model), ability):
        return f"{model.name} calls no `{CALLS[ability]}`"
    if not getattr(abilities(model), ability):
        return f"{model.name} declares {ability}=False"
    return ""


def remedy(model: Model, ability: str, call: str) -> str:
    """Return the change that gives robots of a model a missing ability.

    Parameters
    ----------
    model : Model
    ability : str
        Name of an ability of CALLS.
    call : str
        Change of the source, for a source without the call.

    Returns
    -------
    str
        `call`, or the declaration if the source has the call.
    """
    has_call = getattr(in_source(model), ability)
    return f"declare {ability}=True in its Model" if has_call else call


def _tested(model: Model) -> Abilities | None:
    """Return the declaration of a built-in model, None for further models."""
    from kernels.models import MODELS  # imported late: models import this package

    is_ours = model.advance.__module__.partition(".")[0] == OUR_PACKAGE
    is_changed = MODELS.get(model.name) is not model
    return None if is_changed or not is_ours else Abilities(**declared(model))


def declared(model: Model) -> dict[str, Any]:
    """Return the declarations of a model by ability; None without a declaration."""
    return {name: getattr(model, name) for name in Abilities._fields}


def in_source(model: Model) -> Abilities:
    """Return the abilities in the `advance` of a model and in called functions."""
    read = parameters_read(model)
    hints = get_type_hints(model.params, include_extras=True)
    return Abilities(
        calls(model.advance, publish),
        calls(model.advance, drive),
        calls(model.advance, goal_of),
        tuple(
            name
            for name in model.params._fields
            if _is_float(hints[name]) and name not in read.robot - read.flock
        ),
    )


def to_declare(model: Model) -> str:
    """Return the declarations that are missing in a `Model`, as text, or ""."""
    missing = [name for name, value in declared(model).items() if value is None]
    if not missing:
        return ""
    source = in_source(model)._asdict()
    return ", ".join(f"{name}={source[name]!r}" for name in missing)


def _is_float(hint: Any) -> bool:
    return (get_args(hint) or (hint,))[0] is float


def to_publish(advance: Callable[..., bool]) -> str:
    """Return the location of a call of `remember` in `advance`, with a replacement.

    The result is "" if `advance` does not call `remember`.
    """
    plain = plain_of(advance)
    for node in ast.walk(tree_of(plain)):
        if isinstance(node, ast.Call):
            called = plain_of(named_by(node.func, plain.__globals__))
            if called is plain_of(remember):
                line = plain.__code__.co_firstlineno + node.lineno - 1
                flock, copy = map(ast.unparse, _in_order(node, called))
                return (
                    f"in {Path(plain.__code__.co_filename).name}:{line} write"
                    f" publish({flock}, {copy}, work) for {ast.unparse(node)}"
                )
    return ""


def _in_order(call: ast.Call, function: Callable[..., Any]) -> list[ast.expr]:
    """Return the arguments of a call in the order of the function's parameters."""
    names = inspect.signature(function).parameters
    arguments = dict(zip(names, call.args, strict=False))
    arguments |= {word.arg: word.value for word in call.keywords if word.arg}
    return [arguments[name] for name in names]
