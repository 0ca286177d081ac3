"""Which parameters a model reads robot by robot, as its text says in many ways."""

from collections.abc import Callable
from typing import Any

import pytest

from kernels.jit import jit
from kernels.models import MODELS
from kernels.robots import differing
from kernels.robots.abilities import (
    Abilities,
    abilities,
    in_source,
    to_declare,
    why_not,
)
from kernels.robots.differing import params_of
from kernels.robots.readers import parameters_read, potential_of
from kernels.stamps import DECLARED

ANY = MODELS["nanobot"]
"""Any model, whose `advance` is replaced."""


@jit
def steered(work: Any, given: Any) -> float:
    return float(work.x + given.deep + turned(given, 1.0))


@jit
def turned(given: Any, other: float) -> float:
    return float(given.deeper * other)


@jit
def loops_back(given: Any, left: int) -> float:
    return float(given.round) if left == 0 else loops_back(given, left - 1)


def unknown(given: Any) -> float:
    return float(given.not_seen)


@jit
def direct(_flock: Any, _world: Any, params: Any, work: Any) -> float:
    total = params.shared + params.both
    for i in range(3):
        robot = params_of(params, work, i)
        total += robot.own + robot.both
    return float(total)


@jit
def through_calls(_flock: Any, _world: Any, params: Any, work: Any) -> float:
    total = turned(params, 1.0)
    for i in range(3):
        robot, x = params_of(params, work, i), 1.0
        mine = robot
        total += steered(work, given=mine) + x + mine.alias
    return float(total)


@jit
def at_once(_flock: Any, _world: Any, settings: Any, work: Any) -> float:
    return steered(work, differing.params_of(settings, work, 0))


@jit
def in_a_circle(_flock: Any, _world: Any, params: Any, work: Any) -> float:
    return loops_back(params_of(params, work, 0), 2)


@jit
def by_another_name(_flock: Any, _world: Any, params: Any, work: Any) -> float:
    return unknown(params_of(params, work, 0))


def not_compiled(_flock: Any, _world: Any, params: Any, work: Any) -> float:
    return float(params_of(params, work, 0).own)


@pytest.mark.parametrize(
    ("advance", "robot", "flock"),
    [
        (direct, {"own", "both"}, {"shared", "both"}),
        (through_calls, {"deep", "deeper", "alias"}, {"deeper"}),
        (at_once, {"deep", "deeper"}, set()),
        (in_a_circle, {"round"}, set()),
        (by_another_name, set(), set()),
        (not_compiled, set(), set()),
    ],
)
def test_the_text_says_who_reads_what(
    advance: Callable[..., Any], robot: set[str], flock: set[str]
) -> None:
    """What a function reads that is not ours is not followed: it cannot be compiled.
    Flights read `dt` of whatever model is ours.
    """
    read = parameters_read(ANY._replace(advance=advance))
    assert read.robot == robot
    assert read.flock - {"dt"} == flock
    assert ("dt" in read.flock) == (advance is not not_compiled)


@pytest.mark.parametrize("model", MODELS)
def test_every_model_reads_all_of_its_parameters(model: str) -> None:
    """For one robot, for the flock, or where obstacles are entered into a grid."""
    read = parameters_read(MODELS[model])
    rest = set(MODELS[model].params._fields) - read.robot - read.flock
    assert rest <= {"grid_cell", "inflation"}
    assert len(read.robot) > len(read.flock)


def test_a_potential_is_made_of_parameters_that_are_there() -> None:
    assert "cohesion_weight" in potential_of(MODELS["patel2023"])
    assert potential_of(MODELS["nguyen2024"]) == frozenset()
    for model in MODELS.values():
        assert potential_of(model) <= set(model.params._fields)


@pytest.mark.parametrize("model", MODELS)
def test_every_model_declares_what_its_source_says(model: str) -> None:
    assert to_declare(MODELS[model]) == ""
    assert abilities(MODELS[model]) == in_source(MODELS[model])


def test_a_model_that_declares_nothing_can_do_what_its_source_says() -> None:
    bare = MODELS["nanobot"]._replace(
        publishes=None, drives=None, goals_in_turn=None, shared=None
    )
    assert abilities(bare) == abilities(MODELS["nanobot"])
    assert to_declare(bare) == (
        "publishes=True, drives=True, goals_in_turn=False, shared=('dt',)"
    )
    assert to_declare(bare._replace(drives=True, shared=())) == (
        "publishes=True, goals_in_turn=False"
    )


def test_stamps_leave_out_what_a_model_declares_and_nothing_else() -> None:
    """A further ability would otherwise make stored trials of its model invalid."""
    assert set(Abilities._fields) == DECLARED
    assert set(MODELS["nanobot"]._fields) >= DECLARED


def test_a_declaration_only_narrows_what_the_source_does() -> None:
    narrowed = MODELS["nanobot"]._replace(
        drives=False, goals_in_turn=True, shared=("max_speed",)
    )
    assert abilities(narrowed) == Abilities(True, False, False, ("max_speed", "dt"))
    assert why_not(narrowed, "publishes") == ""
    assert why_not(narrowed, "drives") == "nanobot declares drives=False"
    assert why_not(narrowed, "goals_in_turn") == "nanobot calls no `goal_of`"
