"""Trials among polygons, and among obstacles that move."""

import math
from dataclasses import replace
from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from kernels.events import COLLISIONS
from kernels.inspection import velocities_after
from kernels.lanes.vectors import WIDTH
from kernels.models import MODELS
from kernels.moving import place_obstacles
from kernels.shapes import Obstacle, Polygon
from kernels.worlds import MAPS, Map, build_reach, inside_any
from sweep.design.jobs import Job, stream
from sweep.trial.lanes import fly, in_groups
from sweep.trial.simulation import Simulation, run
from sweep.trial.state import different
from sweep.trial.world import world_of
from tests import builders, naive
from tests.cases import slow_but
from tests.interpreter import interpreted

HOOK = (0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.6, 0.9), (0.6, 0.6), (0.1, 0.6)
TRIANGLE = (0.3, 0.3), (0.4, 0.3), (0.35, 0.4)


def obstacles(width: float, height: float, speed: float) -> tuple[Obstacle, ...]:
    """An arena, a disc and a triangle in a world of this size; the triangle has a
    velocity of its own, if there is a speed.
    """
    hook, triangle = (
        tuple((x * width, y * height) for x, y in shape) for shape in (HOOK, TRIANGLE)
    )
    size = 0.03 * width
    return (
        (0.75 * width, 0.3 * height, size, size, 1.0),
        Polygon(hook, is_arena=True),
        Polygon(triangle, velocity=(speed, -0.5 * speed) if speed else None),
    )


def among(model: str, speed: float = 0.0, **changes: Any) -> Job:
    """A short trial of a model among these. Obstacles go a hundredth of the world in a
    step, times `speed`.
    """
    usual = {"n": 8, "steps": 8, "metrics": ("collisions",)}
    job = builders.job(model, **(usual | changes))
    width, height, dt = (
        float(job.settings[name]) for name in ("width", "height", "dt")
    )
    fast = 0.01 * speed * width / dt
    wanted = {"obstacle_speed": fast, "start_radius": 0.0, "start_free": True}
    return replace(
        job, settings=job.settings | wanted, obstacles=obstacles(width, height, fast)
    )


def flown(simulation: Simulation, steps: int) -> np.ndarray:
    assert simulation.advance(steps)
    simulation.take_frames()
    return builders.state(simulation.flock)


MOVING = [name for name, model in MODELS.items() if model.occupancy is None]
COMPILED = [
    (model, speed)
    for model in MODELS
    for speed in (0.0, 1.0)
    if speed == 0.0 or model in MOVING
]


@pytest.mark.parametrize(("model", "speed"), slow_but([("nguyen2024", 1.0)], COMPILED))
def test_every_model_flies_among_them_and_goes_on_with_the_same_bits(
    model: str, speed: float
) -> None:
    """Boids start in the arena. Obstacles are where their paths say, in arrays of the
    flight's own.
    """
    job = among(model, speed)
    whole, part, again = (Simulation(job) for _ in range(3))
    contact = whole.flight.scenery.contact
    assert not any(
        inside_any(whole.world, contact, x, y)
        for x, y in zip(whole.flock.x, whole.flock.y, strict=True)
    )
    flown(part, 3)
    again.restore(part.state().copied())
    wanted = flown(whole, 8)
    assert np.isfinite(wanted).all()
    assert (flown(again, 5) == wanted).all()
    assert different(whole.state(), again.state()) == ""
    known = world_of(job).at(8)
    assert (np.array(known.obstacles[:, 0]) == whole.world.obstacle_x).all()
    assert (np.array(known.obstacles[:, 1]) == whole.world.obstacle_y).all()
    assert whole.world.corners is not None
    corners = np.concatenate([one.vertices for one in known.polygons.values()])
    places = np.stack([whole.world.corners.x, whole.world.corners.y], axis=1)
    assert (corners == places).all()
    moved = (known.obstacles != world_of(job).obstacles).any(axis=1)
    assert moved.tolist() == ([True, False, True] if speed else [False] * 3)


@pytest.mark.parametrize(
    "model", slow_but(["nguyen2024", "nanobot", "dorsogna2006"], MODELS)
)
def test_every_model_does_in_the_interpreter(model: str) -> None:
    """Nothing is compiled there. Obstacles at rest are another kernel."""
    code = (
        "from tests.trial import test_obstacles as t\n"
        f"for speed in {(0.0, 1.0) if model in MOVING else (0.0,)}:\n"
        "    t.test_every_model_flies_among_them_and_goes_on_with_the_same_bits("
        f"{model!r}, speed)"
    )
    interpreted(code)


TWINS: dict[str, Any] = {"n": 14, "steps": 20, **builders.IDEAL}
PUSHED = ("nguyen2024", "aziel_chen2025", "patel2023")
"""Models whose boids are pushed by obstacles, with twins that know polygons."""


@pytest.mark.parametrize(
    ("speed", "model"),
    slow_but([(1.0, PUSHED[0])], [(0.0, PUSHED[0]), (1.0, PUSHED[0])]),
)
def test_a_flight_among_polygons_is_that_of_a_slow_twin(
    speed: float, model: str
) -> None:
    """For 20 steps, by `test_a_model_does_what_its_slow_twin_does`, whose bound it has.
    The twin sees obstacles where the step has moved them before boids look round.
    """
    job = among(model, speed, **TWINS)
    simulation, ahead = Simulation(job), Simulation(job)
    birds = naive.birds(simulation.flock)
    rng = np.random.default_rng(stream(job, "noise"))
    for step in range(1, 21):
        place_obstacles(ahead.flight.work.motion, step)
        birds = getattr(naive, model)(job.settings, ahead.world, birds, rng)
        found = flown(simulation, 1)
        slow = np.array([[*bird.position, *bird.velocity] for bird in birds]).T
        np.testing.assert_allclose(found, slow, rtol=0, atol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "model"), [(0.0, PUSHED[0])])
def test_without_polygons_boids_are_elsewhere(speed: float, model: str) -> None:
    """So that what they do is seen in the test before."""
    job = among(model, speed, **TWINS)
    fewer = among(model, speed, metrics=(), **TWINS)
    bare = Simulation(replace(fewer, obstacles=(job.obstacles or ())[:1]))
    bare.go_on_from(Simulation(job))
    found = flown(Simulation(job), 20)
    assert np.abs(flown(bare, 20) - found).max() > 1e-3


def test_other_models_fly_as_their_twins_in_the_interpreter() -> None:
    code = (
        "from tests.trial import test_obstacles as t\n"
        "for model in t.PUSHED:\n"
        "  for speed in (0.0, 1.0):\n"
        "    t.test_a_flight_among_polygons_is_that_of_a_slow_twin(speed, model)\n"
        "    t.test_without_polygons_boids_are_elsewhere(speed, model)"
    )
    interpreted(code)


def digests() -> str:
    """Where boids are after a few trials, as hashes."""
    jobs = [
        among("nguyen2024", speed, occlusion=hides, obstacle_range=1e9)
        for speed in (0.0, 1.0)
        for hides in ("none", "obstacles")
    ]
    ends = (flown(Simulation(job), 8).tobytes() for job in jobs)
    return " ".join(sha256(end).hexdigest() for end in ends)


@pytest.mark.slow
def test_the_interpreter_gives_the_same_bits() -> None:
    code = "from tests.trial import test_obstacles as t\nprint(t.digests())"
    found = digests()
    assert interpreted(code).strip() == found
    assert len(set(found.split())) == 4


def towards(**changes: Any) -> Job:
    """One boid that stays at (100, 100), a disc of radius 5 that begins 10 away and
    comes nearer by 1 in each step, and a triangle that stays far away.
    """
    still = {"wander_weight": 0.0, "obstacle_weight": 0.0, "start_speed": 0.0}
    size = {"width": 300, "height": 200, "n": 1, "steps": 30}
    job = builders.job(
        "nguyen2024",
        metrics=("collisions", "clearance", "depth_outside"),
        **(still | size | changes),
    )
    disc = (90.0, 100.0, 5.0, 5.0, 1.0, 1.0, 0.0)
    triangle = Polygon(((250.0, 150.0), (260.0, 150.0), (255.0, 160.0)))
    return replace(job, obstacles=(disc, triangle))


@pytest.mark.slow
def test_events_and_metrics_of_a_frame_see_obstacles_where_they_are_then() -> None:
    """Whatever frames are measured together, and from a checkpoint too. The first frame
    is from before the boid was placed.
    """
    simulation, again = Simulation(towards()), Simulation(towards())
    places = (np.array([one]) for one in (100.0, 100.0, 0.0, 0.0))
    builders.place(simulation, *places)
    assert simulation.advance(4)
    early = simulation.take_frames()
    again.restore(simulation.state().copied())
    assert again.advance(26)
    found = np.concatenate([early.values, again.take_frames().values], axis=1)
    away = np.abs(10.0 - np.arange(31)) - 5
    hits, clearance, depth = found
    assert hits.tolist() == (np.arange(31) >= 6).astype(float).tolist()
    assert clearance[1:].tolist() == away[1:].tolist()
    assert depth[1:].tolist() == np.maximum(-away, 0)[1:].tolist()


def test_they_do_in_the_interpreter() -> None:
    """Both metrics are compiled once more for obstacles that move."""
    interpreted(
        "from tests.trial import test_obstacles as t\n"
        "t.test_events_and_metrics_of_a_frame_see_obstacles_where_they_are_then()"
    )


@pytest.mark.parametrize("borders", ["torus", "bounded"])
def test_no_bit_depends_on_which_obstacles_are_looked_at(borders: str) -> None:
    """Of a flight that finds obstacles by the cells they are in, and of one that looks
    at all of them in each step; and of one that goes on from the first.
    """
    rng = np.random.default_rng(3)
    places = rng.uniform(0, 300, (40, 2)).tolist()
    job = builders.job(
        "nguyen2024",
        metrics=("collisions",),
        **{"n": 30, "steps": 120, "width": 300, "height": 300, "start_radius": 0},
        **{"borders": borders, "obstacle_range": 8.0},
    )
    shapes = [
        (x, y, 4.0, 4.0, 1.0)
        if k % 2
        else Polygon(((x, y), (x + 9.0, y), (x + 9.0, y + 7.0)))
        for k, (x, y) in enumerate(places)
    ]
    moving = job.settings | {"obstacle_speed": 1.5}
    job = replace(job, settings=moving, obstacles=tuple(shapes))
    found, part, again, looking = (Simulation(job) for _ in range(4))
    flight = looking.flight
    motion = flight.work.motion
    assert motion is not None
    everywhere = build_reach(flight.world, math.inf)
    flight.work = flight.work._replace(
        motion=motion._replace(margin=math.inf), reach=everywhere
    )
    watch = flight.record.watch._replace(contact=everywhere)
    flight.record = flight.record._replace(watch=watch)
    assert found.flight.work.reach.obstacle.size > everywhere.obstacle.size
    flown(part, 50)
    again.restore(part.state().copied())
    wanted = flown(looking, 120)
    assert (flown(found, 120) == wanted).all()
    assert (flown(again, 70) == wanted).all()
    events = [one.flight.record.watch.events for one in (found, again, looking)]
    assert (events[0] == events[2]).all()
    assert (events[1] == events[2]).all()
    assert events[0][COLLISIONS] > 0


def test_what_is_only_looked_at_moves_nothing() -> None:
    job = among("nguyen2024", 1.0)
    one, other = Simulation(job), Simulation(job)
    flown(one, 4), flown(other, 4)
    before = one.world.obstacle_x.copy()
    reach = [part.copy() for part in one.flight.work.reach[-2:]]
    with one.noise.lent() as rng:
        velocities_after(one.flight, one.flight.params, rng)
    assert (one.world.obstacle_x == before).all()
    for now, then in zip(one.flight.work.reach[-2:], reach, strict=True):
        assert (now == then).all()


def test_a_flight_takes_the_place_of_another_among_obstacles_that_move() -> None:
    job = among("nguyen2024", 1.0)
    whole, part, other = (Simulation(job) for _ in range(3))
    flown(part, 3)
    other.go_on_from(part)
    assert (other.world.obstacle_x == part.world.obstacle_x).all()
    assert (flown(other, 5) == flown(whole, 8)).all()


def test_directions_are_of_the_trial() -> None:
    """They come from the stream `made`; what has a velocity of its own keeps it."""
    job = among("nguyen2024", 1.0)
    one, same, other = (world_of(replace(job, replicate=k)).paths for k in (0, 0, 1))
    assert one
    assert same
    assert other
    assert (one.velocities == same.velocities).all()
    assert ((one.velocities != other.velocities).any(axis=0)).tolist() == [
        True,
        False,
        False,
    ]
    speed = float(job.settings["obstacle_speed"])
    assert np.hypot(*one.velocities[:, 0]) == pytest.approx(speed, rel=1e-14)


def drifting(settings: Any, _rng: np.random.Generator) -> np.ndarray:
    """A disc that goes along x."""
    return np.array([[0.5 * settings.width, 50.0, 5.0, 5.0, 1.0, 0.5, 0.0]])


@pytest.mark.parametrize(
    ("model", "metrics", "words"),
    [
        ("nguyen2024", ("coverage",), "visits are counted by pixels"),
        ("rustamani2024", (), "an occupancy grid has one of the start"),
    ],
)
def test_a_map_whose_obstacles_move_fails_where_that_means_nothing(
    model: str, metrics: tuple[str, ...], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MAPS, "drifting", Map(drifting, "a disc", "this test"))
    job = builders.job(model, metrics=metrics, n=3, steps=2)
    result = run(replace(job, settings=job.settings | {"map": "drifting"}))
    assert result.status == "failed"
    assert words in result.error


def test_trials_that_cannot_fly_in_lanes_fly_alone(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """And nobody is told that this is a defect."""
    jobs = [
        replace(among("nguyen2024", 1.0), replicate=replicate)
        for replicate in range(WIDTH)
    ]
    alone = [run(job) for job in jobs]
    together = in_groups(jobs, run, lambda some: fly(*_begun(some)))
    for one, other in zip(alone, together, strict=True):
        assert builders.fingerprint(one) == builders.fingerprint(other)
    assert not caplog.records


def _begun(jobs: Any) -> tuple[list[Simulation], float]:
    return [Simulation(job, together=True) for job in jobs], 0.0


@pytest.mark.slow
def test_trials_among_polygons_fly_in_lanes_with_the_same_bits() -> None:
    jobs = [
        replace(among("aziel_chen2025", metrics=("collisions",)), replicate=replicate)
        for replicate in range(WIDTH)
    ]
    together = fly(*_begun(jobs))
    for job, result in zip(jobs, together, strict=True):
        assert builders.fingerprint(run(job)) == builders.fingerprint(result)
