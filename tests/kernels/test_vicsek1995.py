"""vicsek1995: what is known of it without computing, and its bits."""

import ast
import inspect
import math
from collections.abc import Callable, Iterator
from decimal import Decimal, localcontext
from itertools import count, takewhile
from typing import Any

import numpy as np
import pytest

from kernels import angles, starts
from kernels.angles import cosine_sine
from kernels.models import MODELS, vicsek1995
from kernels.rules import headings
from kernels.starts import STARTS
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, run
from tests import builders

PRESETS = {
    name: values
    for name, values in MODELS["vicsek1995"].presets.items()
    if name != "as_run"
}


def job(preset: str = "as_written", **changes: Any) -> builders.Job:
    return builders.job(
        "vicsek1995", preset, metrics=(), series=("polarization",), **changes
    )


def flown(preset: str = "as_written", **changes: Any) -> Result:
    result = run(job(preset, **changes))
    assert result.status == "done", result.error
    return result


def density4(n: int) -> dict[str, float]:
    """The size of figure 2a: four boids a square of the range."""
    return {"n": n, "width": math.sqrt(n / 4), "height": math.sqrt(n / 4)}


# ---- what is known without computing


def test_without_noise_all_headings_become_one() -> None:
    """The rounding of unit vectors is all that is left."""
    for moves_with in ("old_heading", "new_heading"):
        order = flown(noise=0, moves_with=moves_with, **density4(40)).last
        assert order["polarization"] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("n", [40, 100, 400])
def test_at_full_noise_headings_are_independent(n: int) -> None:
    """N times the square of the order of N independent headings has the mean 1, and the
    mean order is sqrt(pi / (4 N)) but for one part in 16 N. Frames are independent
    too: so the means of 2000 of them are within 4 standard errors, those of the
    Rayleigh distribution. Two-sided, one of both fails by chance for one of 8000 seeds.
    """
    order = flown(noise=math.tau, **density4(n)).series["polarization"][1:]
    mean = math.sqrt(math.pi / (4 * n))
    error = math.sqrt((1 - math.pi / 4) / n / len(order))
    assert abs(order.mean() - mean) < 4 * error + mean / (16 * n)
    assert abs((order**2).mean() * n - 1) < 4 / math.sqrt(len(order))


def test_a_lone_boid_turns_by_the_noise() -> None:
    """Uniformly within +-noise / 2, so the mean cosine of its turns is 2 sin(noise / 2)
    / noise. Two-sided at 4 standard errors: by chance in one of 16,000 seeds.
    """
    simulation, turns = (
        Simulation(job(noise=2, interaction_range=0, steps=50)),
        [],
    )
    for _ in range(50):
        before = simulation.flock.vx.copy() + 1j * simulation.flock.vy
        simulation.advance(1)
        after = simulation.flock.vx + 1j * simulation.flock.vy
        turns.append(np.angle(after / before))
    cosine = np.cos(turns)
    assert 0.99 < np.abs(turns).max() <= 1.0 + 1e-12
    error = cosine.std() / math.sqrt(cosine.size)
    assert abs(cosine.mean() - math.sin(1)) < 4 * error


def test_a_lone_boid_with_vectorial_noise_turns_by_that_of_its_sum() -> None:
    """The heading is along 1 + eta e. For eta < 1 it never turns by more than
    arcsin(eta), which it nearly reaches in 4000 turns; for eta = 1 the turn is half of
    the uniform angle of e.
    """
    for eta, most in ((0.5, math.asin(0.5)), (1.0, math.pi / 2)):
        a_job = job(
            "gregoire_chate2004",
            noise=eta,
            interaction_range=0,
            n=4000,
            steps=1,
            start_speed=0.3,
        )
        simulation = Simulation(a_job)
        before = simulation.flock.vx.copy() + 1j * simulation.flock.vy
        simulation.advance(1)
        turns = np.angle((simulation.flock.vx + 1j * simulation.flock.vy) / before)
        assert 0.99 * most < np.abs(turns).max() <= most + 1e-12
    # A uniform angle within +-pi / 2: its square has the mean (pi / 2)^2 / 3. Two-sided
    # at 4 standard errors.
    square = turns**2
    error = square.std() / math.sqrt(square.size)
    assert abs(square.mean() - math.pi**2 / 12) < 4 * error


@pytest.mark.parametrize(
    ("moves_with", "x"), [("old_heading", 1.03), ("new_heading", 1.0)]
)
def test_a_boid_moves_with_the_heading_that_is_said(moves_with: str, x: float) -> None:
    """Two boids just in range, one to the east, one to the north-west: their mean is
    north by north-east, and a third is out of reach.
    """
    start = [1.0, 2.0, 3.5], [1.0, 1.0, 1.0], [0.03, -0.03, 0.03], [0.0, 0.0, 0.0]
    simulation = Simulation(job(noise=0, n=3, steps=1, moves_with=moves_with))
    builders.place(simulation, *start).advance(1)
    flock = simulation.flock
    # The first two sum to zero, and keep their headings; the third one sees nobody.
    assert flock.vx == pytest.approx([0.03, -0.03, 0.03], rel=1e-15)
    simulation = Simulation(job(noise=0, n=2, steps=1, moves_with=moves_with))
    start = [1.0, 2.0], [1.0, 1.0], [0.03, 0.0], [0.0, 0.03]
    flock = builders.place(simulation, *start).flock
    simulation.advance(1)
    half = 0.03 / math.sqrt(2)
    assert flock.vx == pytest.approx([half, half], rel=1e-14)
    moved = 1.0 + half if moves_with == "new_heading" else x
    assert flock.x[0] == pytest.approx(moved, rel=1e-15)


def test_a_boid_at_the_range_is_a_neighbour_also_across_the_border() -> None:
    for x, seen in ((4.5, True), (4.5 - 1e-9, False)):
        simulation = Simulation(job(noise=0, n=2, steps=1))
        flock = builders.place(
            simulation, [0.5, x], [1.0, 1.0], [0.03, 0.0], [0.0, 0.03]
        ).flock
        simulation.advance(1)
        assert (flock.vy[0] > 0.0) == seen


@pytest.mark.parametrize("preset", PRESETS)
def test_the_speed_is_the_same_in_every_step(preset: str) -> None:
    """To the rounding of a unit vector that is turned."""
    path = builders.trajectory(
        builders.to_end(Simulation(job(preset, steps=100, n=60)))
    )
    speed = np.hypot(path[:, 2], path[:, 3])
    assert speed == pytest.approx(PRESETS[preset]["max_speed"], rel=1e-14)


def test_presets_differ_in_what_their_papers_do() -> None:
    noise = {name: values["noise_type"] for name, values in PRESETS.items()}
    assert noise == {
        "as_written": "scalar",
        "gregoire_chate2004": "vectorial",
        "nagy2007": "scalar",
    }
    assert PRESETS["as_written"]["moves_with"] == "old_heading"
    assert {values["update"] for values in PRESETS.values()} == {"synchronous"}
    densities = {
        name: values["n"] / (values["width"] * values["height"])
        for name, values in PRESETS.items()
    }
    assert densities == {"as_written": 4, "gregoire_chate2004": 2, "nagy2007": 4}


# ---- bits


def exact(angle: float) -> tuple[Decimal, Decimal]:
    """Cosine and sine to 40 digits, by their series."""

    def terms(first: Decimal, power: int) -> Iterator[Decimal]:
        term = first
        for k in count(power, 2):
            yield term
            term *= -square / ((k + 1) * (k + 2))

    with localcontext() as context:
        context.prec = 50
        square = Decimal(angle) ** 2

        def total(first: Decimal, power: int) -> Decimal:
            return sum(
                takewhile(lambda one: abs(one) > Decimal("1e-45"), terms(first, power)),
                Decimal(0),
            )

        return total(Decimal(1), 0), total(Decimal(angle), 1)


def test_cosine_and_sine_are_those_of_the_angle() -> None:
    """Over the whole circle, at its ends and where the series are folded."""
    ends = [math.pi, math.pi / 2, math.nextafter(math.pi / 2, 4), 1e-300, 0.0]
    drawn = np.random.default_rng(1).uniform(-math.pi, math.pi, 500).tolist()
    for angle in [*drawn, *ends, *(-one for one in ends)]:
        for ours, true in zip(cosine_sine(angle), exact(angle), strict=True):
            assert abs(Decimal(ours) - true) < Decimal("4e-16")
    assert cosine_sine(0.0) == (1.0, 0.0)


@pytest.mark.parametrize(
    "module", [vicsek1995, headings, angles], ids=lambda one: one.__name__
)
def test_no_function_of_a_mathematics_library_is_called(module: Any) -> None:
    """IEEE 754 says what a root gives, and no more of `math`."""
    named = math_in(ast.parse(inspect.getsource(module)))
    assert named <= {"sqrt", "pi", "tau", "factorial"}


def test_its_start_calls_none_either() -> None:
    draw: Callable[..., Any] = STARTS[PRESETS["as_written"]["start_draws"]].draw
    assert draw is starts.start_portable
    assert math_in(ast.parse(inspect.getsource(draw))) == {"pi"}
    assert {values["start_draws"] for values in PRESETS.values()} == {"portable"}


def math_in(tree: ast.AST) -> set[str]:
    """What is taken of `math` and of the functions of numpy."""
    return {
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "math"
    }


BITS = {
    "as_written": [
        "0x1.429c819a92350p-1",
        "0x1.1fc7c465207dcp-1",
        "-0x1.d94d4a5c15d3bp-6",
        "0x1.09287a6307985p-7",
    ],
    "gregoire_chate2004": [
        "0x1.5e89e75a5bdeap-1",
        "0x1.af630bdac0430p-3",
        "-0x1.c4930cbc35223p-2",
        "0x1.ded565da9e8abp-3",
    ],
    "nagy2007": [
        "0x1.4f3b0eb2b38afp-1",
        "0x1.f013630d6746ap-2",
        "0x1.3d803dd94bea0p-6",
        "0x1.91d5e04ca5384p-4",
    ],
}
"""x, y, vx and vy of the first of three boids after 30 steps, on any system."""


@pytest.mark.parametrize("preset", PRESETS)
def test_the_bits_are_those_of_every_system(preset: str) -> None:
    small = {"n": 3, "width": 2, "height": 2, "steps": 30, "seed": 7, "literal": True}
    simulation = builders.to_end(Simulation(job(preset, **small)))
    state = builders.state(simulation.flock)
    assert [value.hex() for value in state[:, 0].tolist()] == BITS[preset]
