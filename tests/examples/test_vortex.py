"""What new code begins as: the model by a law of its motion, the others by numbers."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from sweep.own_code.reading import study_of, with_variants
from sweep.spec.settings import Value, settings_of
from sweep.trial.simulation import Simulation
from tests.cases import slow_but
from tests.examples.flown import EXAMPLES, flown, job, places
from tests.interpreter import interpreted


@pytest.mark.parametrize("swirl", slow_but([0.03], [0.001, 0.01, 0.03]))
def test_boids_circle_at_the_angle_and_radius_of_their_law(swirl: float) -> None:
    """With the weights c and s of cohesion and swirl, times N / (N - 1), boids at the
    speed limit turn by an angle a each step, with 4 sin(a/2)^2 = c - s tan(a/2). Their
    circle has the chord max_speed.
    """
    n, speed = 20, 3.0
    c, s = 0.01 * n / (n - 1), swirl * n / (n - 1)
    half = brentq(lambda a: 4 * math.sin(a) ** 2 - c + s * math.tan(a), 0, 1)
    start = {"start_radius": 60, "start_center_x": 200, "start_center_y": 200}
    metrics = ["speed", "flock_radius", "./rotation.py", "polarization"]
    last = flown(
        job("vortex", "standard", metrics, n=n, swirl_weight=swirl, steps=3000, **start)
    ).last
    assert last["speed"] == pytest.approx(speed, rel=1e-9)
    radius = speed / (2 * math.sin(half))
    assert last["flock_radius"] == pytest.approx(radius, rel=1e-9)
    # A velocity is the way that led to a place: a chord, half of `a` off the tangent.
    assert last["rotation"] == pytest.approx(math.cos(half), rel=1e-9)
    assert last["polarization"] == pytest.approx(0, abs=1e-9)


def test_the_ring_and_the_pillars_are_where_they_say() -> None:
    circle = {"start_radius": 60, "start_center_x": 200, "start_center_y": 190}
    grid = {"n_obstacles": 10, "obstacle_radius": 7, "map": "./pillars.py"}
    start = {"start_draws": "./ring.py", "start_speed": 2} | circle
    simulation = Simulation(job("vortex", "standard", n=12, **start, **grid))
    way = places(simulation) - [200, 190]
    velocity = np.column_stack([simulation.flock.vx, simulation.flock.vy])
    np.testing.assert_allclose(np.hypot(*way.T), 60)
    np.testing.assert_allclose((way[:-1] * way[1:]).sum(axis=1), 3600 * np.sqrt(0.75))
    np.testing.assert_allclose(velocity, way[:, ::-1] * [-1, 1] / 30, atol=1e-12)
    world = simulation.world
    sides = np.array([1, 3, 5]) * 400 / 6
    np.testing.assert_allclose(world.obstacle_x, np.tile(sides, 3))
    np.testing.assert_allclose(world.obstacle_y, np.repeat(sides, 3))
    assert set(world.half_width) == {7}
    assert world.is_round.all()


def test_shorter_steps_come_nearer_to_the_equations() -> None:
    """In continuous time a circle of boids with the speed v has the radius v / sqrt(c),
    as its pull is what turns them and the limit takes away what the swirl adds. A step
    is an error of the first order, which half of it halves.
    """
    n, errors = 20, list[float]()
    c = 0.01 * n / (n - 1)
    start = {"start_radius": 60, "start_center_x": 200, "start_center_y": 200}
    a_job = job("vortex", "standard", ["flock_radius"], n=n, steps=3000, **start)
    settings = settings_of(a_job.model, a_job.catalogue)
    for parts in (1, 2, 4):
        cut = {
            name: setting.coerce(setting.in_parts(a_job.settings[name], parts))
            for name, setting in settings.items()
            if setting.in_steps or setting.each_step
        }
        assert cut["dt"] == 1.0 / parts
        last = flown(replace(a_job, settings=a_job.settings | cut)).last
        errors.append(abs(last["flock_radius"] - 3.0 / math.sqrt(c)))
    # Terms of the second order are a tenth of those of the first, or less.
    assert 0.45 < errors[1] / errors[0] < 0.55
    assert 0.45 < errors[2] / errors[1] < 0.55


@pytest.mark.parametrize("model", ["vortex", "predators", "swarmalators"])
def test_steps_of_models_that_are_continuous_in_time_can_be_cut(model: str) -> None:
    spec = {
        "study": "cut",
        "model": f"./{model}.py",
        "sweep": {"max_speed": [1, 2]},
        "replicates": 2,
        "record": {"metrics": ["speed"]},
        "validate": {"dt": ["1/2"]},
    }
    study, half = with_variants(study_of(spec, EXAMPLES / "spec.yaml"))
    usual = study.preset_settings
    assert half.fixed["dt"] == usual["dt"] / 2
    assert half.fixed["steps"] == usual["steps"] * 2


ROUND = {"borders": "torus", "steps": 60, "n": 20}


@pytest.mark.parametrize(
    ("preset", "changes", "pull"),
    [
        ("", {"borders": "torus"}, -0.1),
        ("", {"borders": "torus", "minimum_image": True}, -0.1),
        ("", {"borders": "torus", "minimum_image": False}, 0.0),
        ("", {"borders": "open"}, 0.0),
        ('"borders": "torus"', {}, -0.1),
        ('"borders": "torus", "minimum_image": False', {}, 0.0),
        ('"borders": "torus", "minimum_image": False', {"borders": "torus"}, -0.1),
        ('"borders": "torus"', {"borders": "bounded"}, 0.0),
    ],
)
def test_boids_pull_each_other_across_the_borders_of_a_torus(
    preset: str, changes: dict[str, Value], pull: float, tmp_path: Path
) -> None:
    """Two boids at rest are 10 px apart the short way, and see 50 px far. Nothing is
    compiled, as each preset makes another model.
    """
    text = (EXAMPLES / "vortex.py").read_text()
    edited = text.replace("COMMON  #", f"COMMON | {{{preset}}}  #", 1)
    (tmp_path / "vortex.py").write_text(edited)
    vx, vy = json.loads(
        interpreted(
            "import json\n"
            "from pathlib import Path\n"
            "from tests.examples.test_vortex import pulled\n"
            f"print(json.dumps(pulled(Path({str(tmp_path)!r}), {changes!r})))"
        )
    )
    assert vx == pytest.approx([pull, -pull], abs=1e-15)
    assert vy == [0, 0]


def pulled(folder: Path, changes: dict[str, Value]) -> tuple[list[float], list[float]]:
    """The velocities of two boids beside two borders after a step from rest."""
    settings = {"n": 2, "steps": 3, "perception_range": 50, "swirl_weight": 0} | changes
    simulation = Simulation(job("vortex", "standard", folder=folder, **settings))
    simulation.advance(1)
    simulation.take_frames()
    state = simulation.state().copied()
    placed = {"x": (5, 395), "y": 200, "vx": 0, "vy": 0}
    for name, values in placed.items():
        state.arrays[f"flock.{name}"][:] = values
    simulation.restore(state)
    simulation.advance(1)
    return simulation.flock.vx.tolist(), simulation.flock.vy.tolist()


def test_a_torus_of_an_own_model_is_the_periodic_one_to_the_bit(tmp_path: Path) -> None:
    text = (EXAMPLES / "vortex.py").read_text()
    edited = text.replace("COMMON  #", 'COMMON | {"borders": "torus"}  #', 1)
    (tmp_path / "vortex.py").write_text(edited)
    metrics = ["speed", "flock_radius", "polarization"]
    named = job("vortex", "standard", metrics, **ROUND)
    said = job("vortex", "standard", metrics, minimum_image=True, **ROUND)
    assert named.trial_id == said.trial_id
    only_wraps = job("vortex", "standard", metrics, minimum_image=False, **ROUND)
    own = {name: one for name, one in ROUND.items() if name != "borders"}
    of_preset = job("vortex", "standard", metrics, folder=tmp_path, **own)
    bits = [
        [flown(one).series[metric].tobytes() for metric in metrics]
        for one in (said, of_preset, only_wraps)
    ]
    assert bits[0] == bits[1]
    assert bits[0] != bits[2]
