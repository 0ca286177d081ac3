"""Every kernel of a rule against its slow twin, on drawn cases near and at the bounds
where rules change.
"""

import inspect
import math
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kernels
from kernels import arbitration
from kernels.arbitration import limit, serve
from kernels.caching import OURS
from kernels.indices import PIECE
from kernels.model import OccupancySettings
from kernels.near import EVERYBODY, Near
from kernels.occupancy import build_occupancy
from kernels.rules.borders import confine
from kernels.settings import BOUNDED, OPEN, TORUS
from kernels.worlds import build_reach
from tests import builders, naive
from tests.interpreter import interpreted

CASES, BOIDS = 60, 13
OBSTACLES = [
    [100, 100, 25, 25, 1],
    [140, 130, 10, 10, 0],
    [300, 200, 60, 20, 0],
    [700, 500, 40, 40, 1],
]
WORLD = builders.a_world(obstacles=OBSTACLES)
OCCUPANCY = build_occupancy(WORLD, OccupancySettings(2.0, 8.0))


def rules() -> dict[str, Callable[..., Any]]:
    """Every public kernel of the modules of rules, and of arbitration."""
    folder = Path(kernels.__file__).parent / "rules"
    names = [path.stem for path in sorted(folder.glob("[!_]*.py"))]
    modules = [arbitration, *(import_module(f"kernels.rules.{name}") for name in names)]
    return {
        name: member
        for module in modules
        for name, member in vars(module).items()
        if callable(member)
        and getattr(member, "py_func", member) in OURS
        and member.__module__ == module.__name__
        and not name.startswith("_")
    }


def scalar(name: str, rng: np.random.Generator) -> Any:
    """A number for a parameter of a rule, by its name; any other name is a length or
    force of either sign.
    """
    if name.endswith("2"):
        return rng.uniform(0, 60) ** 2
    if name in ("position", "x", "y"):
        return rng.choice(
            [rng.uniform(1, 799), rng.uniform(-50, 850), 0.0, 100.0, 800.0]
        )
    if name in ("crowd_apart", "has_room"):
        return bool(rng.random() < 0.5)
    known = {
        "length": 800.0,
        "epsilon": 1e-10,
        "margin": rng.choice([0.0, 10.0, 40.0, 1e6]),
        "i": 2,
        "m": 1,
        "turn": rng.choice([0.5, 0.1, math.pi / 4]),
        "look_ahead": rng.uniform(10, 60),
        "path_step": rng.uniform(1, 9),
    }
    positive = {"least", "most", "budget", "width", "stop", "slow"}
    return known.get(
        name, rng.exponential(1.0) if name in positive else rng.normal(0, 1.0)
    )


def arguments(rule: Callable[..., Any], seed: int) -> dict[str, Any]:
    """Arguments for a rule, by the names of its parameters:
    the same for the same seed.
    """
    rng = np.random.default_rng(seed)
    found = int(rng.choice([0, 1, 2, 7, 8, 12]))
    x, y = rng.normal(0, 30, (2, BOIDS + PIECE))
    x[0] = y[0] = 0.0
    given = {
        "near": Near(
            rng.permutation(BOIDS).astype(np.uint32),
            x,
            y,
            x * x + y * y,
            np.full(BOIDS + PIECE, np.nan),
            np.zeros(BOIDS, np.bool_),
            EVERYBODY,
            None,
        ),
        "found": found,
        "seen": builders.a_flock(*rng.normal(0, 3, (4, BOIDS))),
        "world": WORLD,
        "rng": np.random.default_rng(seed),
        "occupancy": OCCUPANCY,
        "borders": int(rng.choice([OPEN, TORUS, BOUNDED])),
    }
    names = list(inspect.signature(getattr(rule, "py_func", rule)).parameters)
    chosen = {
        name: given[name] if name in given else scalar(name, rng) for name in names
    }
    if "reach" in names:
        chosen["reach"] = build_reach(WORLD, chosen["margin"])
    return chosen


@pytest.mark.slow
@pytest.mark.parametrize("name", rules())
def test_a_rule_does_what_its_slow_twin_does(name: str) -> None:
    """Sums of a dozen terms differ by rounding: 1e-12 of their size leaves two digits
    for cancellation.
    """
    rule = rules()[name]
    for seed in range(CASES):
        fast = np.ravel(rule(*arguments(rule, seed).values()))
        slow = np.ravel(getattr(naive, name)(**arguments(rule, seed)))
        np.testing.assert_allclose(
            fast, slow, rtol=1e-12, atol=1e-12, err_msg=f"case {seed}"
        )


@pytest.mark.parametrize("name", rules())
def test_it_does_in_the_interpreter(name: str) -> None:
    """Where no rule has to be compiled for Python."""
    interpreted(
        "from tests.kernels import test_rules as t\n"
        f"t.test_a_rule_does_what_its_slow_twin_does({name!r})"
    )


def test_a_force_within_the_limit_keeps_its_bits() -> None:
    assert limit(0.3, 0.4, 0.51) == (0.3, 0.4)
    assert limit(0.0, 0.0, 0.0) == (0.0, 0.0)


def test_a_budget_is_served_in_full_then_cut_then_nothing() -> None:
    ax, ay, left = serve(0.0, 0.0, 0.3, 0.0, 0.5)
    assert (ax, ay, left) == (0.3, 0.0, pytest.approx(0.2))
    ax, ay, left = serve(ax, ay, 0.0, 1.0, left)
    assert (ax, ay, left) == (0.3, pytest.approx(0.2), 0.0)
    assert serve(ax, ay, 5.0, 5.0, left) == (ax, ay, 0.0)


def test_a_served_acceleration_never_exceeds_the_budget() -> None:
    """By more than the rounding of four additions, each of 1e-16 of a budget of 0.5."""
    rng = np.random.default_rng(3)
    for _ in range(300):
        ax, ay, left = 0.0, 0.0, 0.5
        for x, y in rng.normal(0, rng.exponential(0.5), (5, 2)):
            ax, ay, left = serve(ax, ay, x, y, left)
        assert np.hypot(ax, ay) <= 0.5 + 1e-15


@pytest.mark.parametrize(
    ("borders", "position", "after"),
    [
        (OPEN, -3.0, (-3.0, -1.0)),
        (TORUS, -3.0, (797.0, -1.0)),
        (TORUS, 800.0, (0.0, -1.0)),
        (BOUNDED, -3.0, (3.0, 1.0)),
        (BOUNDED, 803.0, (797.0, 1.0)),
        (BOUNDED, 800.0, (800.0, -1.0)),
    ],
)
def test_a_border_acts_as_its_kind_says(
    borders: int, position: float, after: tuple[float, float]
) -> None:
    assert confine(position, -1.0, 800.0, borders) == after


def test_an_obstacle_acts_up_to_its_margin_and_not_at_its_centre() -> None:
    repulsion = rules()["repulsion_unit"]
    reach = build_reach(WORLD, 10.0)
    assert repulsion(WORLD, reach, 10.0, 700.0, 500.0) == (0.0, 0.0)
    assert repulsion(WORLD, reach, 10.0, 749.9, 500.0) == (1.0, 0.0)
    assert repulsion(WORLD, reach, 10.0, 750.0, 500.0) == (0.0, 0.0)
