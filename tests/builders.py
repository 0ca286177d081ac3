"""Jobs, worlds and flocks for the tests, made in one line."""

import hashlib
import math
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import product
from typing import Any

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN
from kernels.events import note_start
from kernels.flight import search_range
from kernels.metrics import METRICS, Metric
from kernels.model import Model
from kernels.models import MODELS
from kernels.settings import COMMON, OPEN, Observation, RobotSettings, Sensing
from kernels.state import Flock, World, empty_flock
from kernels.workspace import build_workspace
from kernels.worlds import MAPS
from sweep.design.jobs import Job, point_id
from sweep.spec.recorded import lacks_boids
from sweep.spec.settings import preset_settings, settings_of, usual_settings
from sweep.spec.study import RecordSpec, Streams
from sweep.trial.result import Result
from sweep.trial.robots import robots_of
from sweep.trial.simulation import Simulation

UPDATES = ("sequential", "synchronous")
BORDERS = (
    {"borders": "open"},
    {"borders": "torus"},
    {"borders": "torus", "minimum_image": True},
    {"borders": "bounded"},
)
TOPOLOGY = "neighbours", "nearest"
PRESETS = [(model, preset) for model in MODELS for preset in MODELS[model].presets]
FIRST_PRESETS = [(name, next(iter(one.presets))) for name, one in MODELS.items()]
LAST_PRESETS = [(name, list(one.presets)[-1]) for name, one in MODELS.items()]
"""One of each model. The presets of a model share its kernels."""
IDEAL = {name: COMMON[name] for name in Sensing._fields if name not in TOPOLOGY} | {
    "motor_noise": 0.0
}
"""The changes by which boids know all that they see, and motors have no noise."""
ALL_FORCES = {
    "map": "random_obstacles",
    "n_obstacles": 4,
    "n": 14,
    "steps": 20,
    "width": 300,
    "height": 280,
    "obstacle_margin": 60,
    "obstacle_radius": 15,
    "wander_weight": 0.0,
    "cohesion_weight": 0.2,
    "alignment_weight": 0.3,
    "separation_weight": 0.05,
}
"""Of a short trial of nguyen2024 or aziel_chen2025 in which all forces act, and nothing
of the model is random; a step takes the time 1.
"""
COMPILED_AS_ROBOTS = [
    model if model == "nguyen2024" else pytest.param(model, marks=pytest.mark.slow)
    for model in MODELS
]
"""Kernels for robots are others: the first takes 12 s to be compiled, and each other
model five seconds or more. In the interpreter all models are tested.
"""
OBSERVATION = Observation(
    flock_range=50.0,
    goal_radius=50.0,
    contact_distance=5.0,
    equilibrium_tolerance=0.1,
    equilibrium_steps=3,
    pixel=1.0,
    footprint=0,
    footprint_radius=2.0,
    coverage_cv_ddof=0,
)


def every_metric(model: str) -> tuple[str, ...]:
    """The metrics that a trial of a model may record: all but those of boids that it
    has not.
    """
    about = MODELS[model]
    return tuple(name for name, one in METRICS.items() if not lacks_boids(about, one))


SCALES = {"strombom2014": 0.5}
"""Of models that have a unit of length in common with others, but not their size: a
field, where others have rooms.
"""


def job(
    model: str = "nguyen2024",
    preset: str = "as_run",
    *,
    metrics: tuple[str, ...] | None = None,
    series: tuple[str, ...] = (),
    every: int = 1,
    heatmaps: bool = False,
    seed: int = 1,
    literal: bool = False,
    replicate: int = 0,
    time_limit: float | None = None,
    **changes: Any,
) -> Job:
    """A job with the settings of a preset but for `changes`; those that the model does
    not have are left out. Worlds of tests are small: boids may start close together.
    """
    known = settings_of(model, BUILT_IN).of_study(())
    changes = {"start_distance": 0} | changes
    changed = {
        name: known[name].coerce(value)
        for name, value in changes.items()
        if name in known
    }
    defaults = preset_settings(model, preset, BUILT_IN)
    settings = defaults | changed
    recorded = MODELS[model].metrics if metrics is None else metrics
    return Job(
        trial_id="",
        point=point_id(
            model, preset, settings, usual_settings(model, preset, BUILT_IN)
        ),
        replicate=replicate,
        seed=seed,
        literal=literal,
        model=model,
        preset=preset,
        settings=settings,
        record=RecordSpec(
            tuple(dict.fromkeys((*recorded, *series))), series, every, heatmaps
        ),
        streams=Streams(),
        time_limit=time_limit,
    )


def a_sensing(**changes: Any) -> Sensing:
    """The settings of sensing of ideal boids but for `changes`."""
    return robots(**changes).sensing


def robots(**changes: Any) -> RobotSettings:
    """The settings of ideal boids but for `changes`."""
    return robots_of(job(**changes))


def maps_of(model: str) -> list[str]:
    """The maps that go with a model: those in its unit of length, and those without a
    unit.
    """
    return [
        name for name, entry in MAPS.items() if entry.unit in ("", MODELS[model].length)
    ]


def scale(model: str) -> float:
    """How many of a model's units of length stand for a pixel, where a test's world is
    measured in pixels.
    """
    if model in SCALES:
        return SCALES[model]
    return {"px": 1, "m": 0.02, "r": 0.02, "l": 0.02}[MODELS[model].length]


def scaled(model: str, **lengths: float) -> dict[str, float]:
    """Settings that are lengths, given in pixels, in the model's own unit."""
    return {name: length * scale(model) for name, length in lengths.items()}


PRESETS_ON_MAPS = [
    (model, preset, name) for model, preset in PRESETS for name in maps_of(model)
]


def map_size(model: str, name: str) -> dict[str, float]:
    """The width and height that a map has, or of 800 by 600 px where it has none of its
    own.
    """
    size = MAPS[name].size
    return (
        {"width": size[0], "height": size[1]}
        if size
        else scaled(model, width=800, height=600)
    )


def _without_borders(model: str) -> dict[str, Any]:
    """The changes by which borders of the world add nothing to velocities."""
    off = {"border_adds_velocity": "never", "walls": False}
    known = settings_of(model, BUILT_IN)
    return {name: value for name, value in off.items() if name in known}


def weightless(model: str) -> dict[str, Any]:
    """The changes that switch off every force of a model, and what else would change
    its velocities.
    """
    off = {
        name: 0.0 for name in settings_of(model, BUILT_IN) if name.endswith("_weight")
    }
    off |= {
        name: 0.0
        for name in (
            *("border_turn", "min_speed", "noise", "interaction_range"),
            *("repulsion_range", "orientation_width", "attraction_width"),
            *("attraction_strength", "flight_strength", "dog_noise"),
            "target_radius",
        )
        if name in settings_of(model, BUILT_IN)
    } | IDEAL
    if "detection_range" in settings_of(model, BUILT_IN):
        off["detection_range"] = math.inf
    return off | _without_borders(model)


def isotropic(model: str) -> dict[str, Any]:
    """The changes that leave a model with only the forces between boids, which know
    neither place nor direction.
    """
    others = (
        "wander_weight",
        "wall_weight",
        "goal_weight",
        "obstacle_weight",
        "border_turn",
    )
    others += ("seek_weight", "arrival_weight", "noise")
    off = (
        IDEAL
        | {"map": "empty"}
        | {name: 0.0 for name in others if name in settings_of(model, BUILT_IN)}
    )
    return off | _without_borders(model)


@contextmanager
def entered(model: Model, **metrics: Metric) -> Iterator[None]:
    """Inside, a model and metrics are among those that there are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(MODELS, model.name, model)
        for name, metric in metrics.items():
            patch.setitem(METRICS, name, metric)
        settings_of.cache_clear()
        yield
    settings_of.cache_clear()


def place(simulation: Simulation, x: Any, y: Any, vx: Any, vy: Any) -> Simulation:
    """The simulation with its boids put elsewhere before the first step."""
    for array, values in zip(simulation.flock, (x, y, vx, vy), strict=False):
        array[:] = values
    flight, there = simulation.flight, simulation.flight.scenery
    work = flight.work
    reach = search_range(flight.model, flight.params, work.robots.rows)
    simulation.flight.work = build_workspace(
        simulation.flock,
        simulation.world,
        reach,
        work.near.topology,
        work.reach,
        there.occupancy,
        work.state,
        work.kind,
        work.robots,
        work.near.senses,
        work.goals,
        work.motion,
    )._replace(state_before=work.state_before)
    watch = simulation.flight.record.watch
    for state in (
        watch.outside,
        watch.inside,
        watch.touching,
        watch.arrived,
        watch.events,
    ):
        state[:] = 0
    if work.goals is not None:
        work.goals.reached[:] = 0
    note_start(simulation.flock, simulation.world, watch)
    return simulation


def to_end(simulation: Simulation, steps_a_call: int = 1000) -> Simulation:
    """The simulation after its last step, or the one that diverged, with all its
    frames.
    """
    assert (
        simulation.schedule.steps
        < len(simulation.flight.record.frames.step) * simulation.flight.record.every
    )
    while simulation.steps_left > 0 and simulation.advance(steps_a_call):
        pass
    return simulation


def state(flock: Flock) -> np.ndarray:
    """x, y, vx and vy as an array (4, N)."""
    return np.stack(flock[:4])


def trajectory(simulation: Simulation) -> np.ndarray:
    """The frames of a simulation with every frame still
    there, as an array (F, 6, N).
    """
    return simulation.flight.record.frames.bodies[
        : simulation.flight.record.progress[1]
    ]


def a_flock(x: Any, y: Any, vx: Any = 0.0, vy: Any = 0.0) -> Flock:
    """A flock from its coordinates."""
    flock = empty_flock(len(x))
    for array, values in zip(flock, (x, y, vx, vy, vx, vy), strict=True):
        array[:] = values
    return flock


def a_world(
    width: float = 800.0,
    height: float = 600.0,
    borders: int = OPEN,
    minimum_image: bool = False,
    obstacles: Any = (),
) -> World:
    """A world; each of the obstacles is x, y, half width,
    half height and 1 for a disc.
    """
    columns = np.array(obstacles, float).reshape(-1, 5).T.copy()
    return World(
        width,
        height,
        borders,
        minimum_image,
        *columns[:4],
        columns[4] == 1.0,
        width / 2,
        height / 2,
    )


def fingerprint(result: Result) -> str:
    """A hash of every number of a result but the seconds it took."""
    digest = hashlib.sha256(f"{result.status} {result.step}".encode())
    numbers = [*result.last.values(), *result.mean.values()]
    for array in (
        np.array(numbers),
        *result.series.values(),
        result.frames,
        result.heatmap,
    ):
        digest.update(
            b"none" if array is None else np.ascontiguousarray(array).tobytes()
        )
    return digest.hexdigest()


def bits(a_job: Job) -> str:
    """A hash of every number of a trial: its result, and the whole state at its end."""
    simulation = Simulation(a_job)
    digest = hashlib.sha256(fingerprint(simulation.result(began=0.0)).encode())
    for array in (
        *simulation.flock,
        simulation.flight.record.watch.events,
        simulation.flight.record.coverage.sums,
    ):
        digest.update(array.tobytes())
    return digest.hexdigest()


def exact_jobs(model: str) -> Iterator[Job]:
    """Small jobs of a model, which together take every path: presets, updates, borders,
    maps, metrics.

    Pixels are large, since without compilation the 480,000 of a whole world take a
    second.
    """
    metrics = every_metric(model)
    small = {"map": "random_obstacles", "n_obstacles": 3, "n": 14, "steps": 10}
    small |= scaled(
        model, width=240, height=210, obstacle_radius=12, obstacle_margin=30, pixel=2
    )
    wanted = {"metrics": metrics, "heatmaps": True, "seed": 27}
    for preset, update, borders in product(MODELS[model].presets, UPDATES, BORDERS):
        yield job(
            model,
            preset,
            series=metrics,
            every=3,
            update=update,
            **borders,
            **small,
            **wanted,
        )
    for name in maps_of(model):
        size = map_size(model, name) | scaled(model, pixel=4)
        yield job(model, "as_run", series=("speed",), map=name, **size, n=20, steps=6)
