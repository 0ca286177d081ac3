"""One run of a flock: setup, advance call by call, and measurement.

The caller decides the number of steps and passes the sources of random numbers.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from kernels.coverage import Coverage
from kernels.events import build_watch, note_start
from kernels.goals import Route, at_last_goal, build_goals, build_route, go_on_to
from kernels.metrics import Ground, Metric
from kernels.metrics.parts import members
from kernels.model import NO_POTENTIAL, Model, OccupancySettings, kind_counts
from kernels.moving import (
    Motion,
    build_motion,
    given_velocities,
    move_obstacles,
    place_obstacles,
    velocities_of,
)
from kernels.neighbours import build_grid
from kernels.occupancy import Occupancy, build_occupancy, no_occupancy
from kernels.recording import (
    FILLED,
    FIRST_STATE,
    STEP,
    Frames,
    Record,
    build_frames,
    keep_frame,
)
from kernels.robots.robots import ChanceKeys, build_robots
from kernels.robots.senses import build_senses, go_on_with
from kernels.robots.spreads import Rows
from kernels.robots.wind import go_on_blowing
from kernels.settings import Observation, RobotSettings, Schedule, WorldSettings
from kernels.shapes import Obstacles
from kernels.state import Floats, Flock, Kinds, World, laid_out
from kernels.topology import topology_of
from kernels.workspace import Workspace, build_workspace
from kernels.worlds import Reach, build_moving_reach, build_reach, build_world

MOST_FRAMES, FRAME_BYTES = 4096, 4 * 2**20
"""Largest number and size of the frames that a run keeps in memory."""
NO_GRID = "a model that looks at an occupancy grid has one of the start"
NO_PIXELS = "visits are counted by pixels, which are free for a while or not at all"
"""Reasons why some settings exclude moving obstacles."""


class Scenery(NamedTuple):
    """Environment of boids, which several runs may share.

    The environment has the world, the reach of the obstacle surfaces, the reach of the
    obstacle forces, the occupancy grid of the model, and the route of several goals.
    Runs that differ only in the boids may share a scenery.

    If obstacles move, `velocities` (2, M) are the result of `given_velocities`, and
    `speed` is the speed of obstacles without a given velocity. Any obstacle may then
    act at any position, so each run has a separate reach.
    """

    world: World
    contact: Reach
    reach: Reach
    occupancy: Occupancy
    route: Route | None
    velocities: Floats | None = None
    speed: float = 0.0


class Memory(NamedTuple):
    """Recorded parts of a run.

    A run records the inputs of the `metrics`, with a frame per `every` steps, and on
    request `visits` by pixel and `bodies`. The memory holds at most `frames` frames
    until the caller takes the frames.
    """

    metrics: tuple[Metric, ...]
    every: int = 1
    visits: bool = False
    bodies: bool = False
    frames: int = MOST_FRAMES

    @property
    def covering(self) -> bool:
        """True if visits must be counted."""
        return self.visits or any(metric.covers for metric in self.metrics)


class Calls(NamedTuple):
    """Numbers of observed steps, of calls of publish, and of driven boids."""

    steps: int
    published: int
    driven: int


@dataclass
class Flight:
    """Flock, world and all further inputs of the `advance` of a model.

    `work` is replaced when the grid is rebuilt.
    """

    model: Model
    params: Any
    schedule: Schedule
    observation: Observation
    scenery: Scenery
    flock: Flock
    work: Workspace
    record: Record
    ground: Ground

    @property
    def world(self) -> World:
        """World of the scenery, with the present positions of obstacles."""
        return self.scenery.world

    @property
    def step(self) -> int:
        """Number of steps done."""
        return int(self.record.progress[STEP])

    @property
    def filled(self) -> int:
        """Number of frames in memory since the caller last took frames."""
        return int(self.record.progress[FILLED])


def build_scenery(
    settings: WorldSettings,
    obstacles: Obstacles,
    reach: float = 0.0,
    grid: OccupancySettings | None = None,
) -> Scenery:
    """Return the environment of the boids: a world with obstacles.

    Parameters
    ----------
    settings : WorldSettings
        Size, borders, goals and speed of obstacles.
    obstacles : Obstacles
        Obstacles of the map.
    reach : float, default 0
        Distance from the surface up to which an obstacle acts on boids.
    grid : OccupancySettings, optional
        Occupancy grid of the model; by default no grid.

    Returns
    -------
    Scenery

    Raises
    ------
    ValueError
        If there is a grid and obstacles move.
    """
    world, speed = build_world(settings, obstacles), settings.obstacle_speed
    velocities, route = given_velocities(obstacles, speed), build_route(settings)
    if velocities is not None:
        if grid:
            raise ValueError(f"obstacles move, and {NO_GRID}")
        everywhere = build_reach(world, math.inf)
        free = no_occupancy()
        return Scenery(world, everywhere, everywhere, free, route, velocities, speed)
    occupancy = build_occupancy(world, grid) if grid else no_occupancy()
    contact, acting = build_reach(world, 0.0), build_reach(world, reach)
    return Scenery(world, contact, acting, occupancy, route)


def begin(
    model: Model,
    params: Any,
    schedule: Schedule,
    robots: RobotSettings,
    observation: Observation,
    scenery: Scenery,
    flock: Flock,
    memory: Memory,
    coverage: Coverage,
    rng: Generator,
    keys: ChanceKeys,
) -> Flight:
    """Return a run in its initial state, which is the first frame.

    Parameters
    ----------
    model : Model
    params : Params
        Parameters of the model.
    schedule : Schedule
        Numbers of boids and steps.
    robots : RobotSettings
        Sensing, actuation, failures and medium.
    observation : Observation
        Distances and tolerances of metrics.
    scenery : Scenery
    flock : Flock
        Boids at the start; the run takes and changes this object.
    memory : Memory
        Recorded parts of the run.
    coverage : Coverage
        Coverage of the world without visits, see kernels.coverage; without pixels if
        `memory` is not covering. The run takes and changes this object.
    rng : Generator
        Generator that has drawn the flock and draws the initial state of boids.
    keys : ChanceKeys
        Keys of random numbers of the robots and of moving obstacles.

    Returns
    -------
    Flight

    Raises
    ------
    RuntimeError
        If the kinds of the model do not fit the number of boids, if the initial state
        is not finite, or if `memory` is covering and obstacles move.
    """
    potential = model.pair_potential(params) if model.pair_potential else NO_POTENTIAL
    flock = laid_out(flock)
    counts = kind_counts(model, params, schedule.n)
    kind = np.repeat(np.arange(len(counts)), counts)
    dt = params.dt
    layers = build_robots(robots, keys, schedule.n, dt, scenery.world, params)
    margin = _margin(model, params, layers.rows)
    motion = _motion(scenery, memory, keys, dt, margin)
    if motion is not None:
        moving = build_moving_reach(motion.world, margin)
        scenery = scenery._replace(world=motion.world, contact=moving, reach=moving)
    elif layers.rows:
        scenery = scenery._replace(reach=build_reach(scenery.world, margin))
    work = build_workspace(
        flock,
        scenery.world,
        search_range(model, params, layers.rows),
        topology_of(robots.sensing, schedule.n, scenery.world),
        scenery.reach,
        scenery.occupancy,
        _begun(model, params, flock, kind, rng),
        kind,
        layers,
        build_senses(
            robots.sensing,
            schedule.n,
            params.dt,
            scenery.world,
            keys.flown,
            layers.failing.silent_from(),
            layers.failing.blind_from(),
        ),
        build_goals(scenery.route, schedule.n),
        motion,
    )
    flight = Flight(
        model,
        params,
        schedule,
        observation,
        scenery,
        flock,
        work,
        _record(schedule, observation, scenery, memory, coverage, work),
        Ground(
            at_last_goal(scenery.world, scenery.route),
            schedule.n,
            coverage.traversable,
            coverage.visits.size,
            params.dt,
            potential,
            kind,
            motion,
        ),
    )
    note_start(flock, scenery.world, flight.record.watch)
    keep_frame(flock, flight.record)
    return flight


def search_range(model: Model, params: Any, rows: Rows) -> float:
    """Return the largest perception range of all boids.

    Parameters
    ----------
    model : Model
    params : Params
        Parameters of the model.
    rows : Rows
        Parameters of each boid; empty if all boids are equal.

    Returns
    -------
    float
        Range in the unit of length of the model.
    """
    seen = map(model.sight, rows[0] if rows else [params])
    return max(float(one.range) for one in seen)


def _margin(model: Model, params: Any, rows: Rows) -> float:
    """Return the largest distance from a surface at which obstacles act on a boid."""
    return float(max(map(model.obstacle_reach, rows[0] if rows else [params])))


def _motion(
    scenery: Scenery, memory: Memory, keys: ChanceKeys, dt: float, margin: float
) -> Motion | None:
    """Return the motion of the obstacles of a run; None if no obstacle moves.

    An obstacle acts up to `margin` beyond its surface.
    """
    if scenery.velocities is None:
        return None
    if memory.covering:
        raise RuntimeError(f"obstacles move, and {NO_PIXELS}")
    velocities = velocities_of(scenery.velocities, scenery.speed, keys.made)
    return build_motion(scenery.world, velocities, dt, margin)


def _begun(
    model: Model, params: Any, flock: Flock, kind: Kinds, rng: Generator
) -> Floats:
    """Return the initial state (S, N) of the boids of `flock`."""
    state = np.zeros((len(model.state), flock.x.size))
    if model.begin_state:
        model.begin_state(params, flock, kind, rng, state)
    for name, row in zip(model.state, state, strict=True):
        if not np.isfinite(row).all():
            words = f"model {model.name}: begin_state gives boids a {name} that is"
            raise RuntimeError(f"{words} not a finite number")
    return state


def _record(
    schedule: Schedule,
    observation: Observation,
    scenery: Scenery,
    memory: Memory,
    coverage: Coverage,
    work: Workspace,
) -> Record:
    """Return an empty record.

    The record has room for FRAME_BYTES of frames, and for at least two frames: one on
    time and the last.
    """
    metrics = memory.metrics
    looks = memory.bodies or any(metric.looks for metric in metrics)
    n = schedule.n if looks else 0
    states = len(work.state)
    room = FRAME_BYTES // (8 * (FIRST_STATE + states) * n + 48)
    return Record(
        frames=build_frames(max(2, min(memory.frames, room)), n, states),
        progress=np.zeros(2, np.int64),
        every=memory.every,
        last=schedule.steps,
        covering=memory.covering,
        coverage=coverage,
        watch=build_watch(
            schedule.n,
            any(metric.counts for metric in metrics),
            any(metric.pairs for metric in metrics),
            any(metric.integrates for metric in metrics),
            any(metric.follows for metric in metrics),
            scenery.contact,
            observation,
            work.goals,
        ),
        state=work.state,
        state_before=work.state_before,
    )


def advance(flight: Flight, rng: Generator, steps: int) -> bool:
    """Advance a run by up to `steps` steps; return whether the state stays finite.

    The run stops at its last step, and when the memory for frames is full.

    Parameters
    ----------
    flight : Flight
        Changed in place.
    rng : Generator
        Source of the model's random numbers.
    steps : int
        Largest number of steps.

    Returns
    -------
    bool
        False if the state is not finite.

    Raises
    ------
    RuntimeError
        If the model has taken a wrong number of steps or returns no bool. Also if the
        model has not called publish in each step although a layer needs the call, or
        has not driven each boid.
    """
    free = len(flight.record.frames.step) - flight.filled - 1
    room = max(0, free * flight.record.every)
    before, left = calls_of(flight), flight.schedule.steps - flight.step
    wanted = min(steps, left, room)
    going = flight.model.advance(
        flight.flock,
        flight.world,
        flight.params,
        flight.work,
        flight.record,
        rng,
        wanted,
    )
    if not isinstance(going, bool | np.bool_):
        raise RuntimeError(
            f"advance returns {going}: it must return True, or False after a step whose"
            " numbers are not finite, as observe says"
        )
    check_calls(flight, before)
    taken = flight.step - before.steps
    if going and taken != wanted:
        raise RuntimeError(
            f"advance took {taken} steps of {wanted}; call observe once in each"
        )
    return going


def calls_of(flight: Flight) -> Calls:
    """Return the numbers of calls by the model so far."""
    robots = flight.work.robots
    return Calls(flight.step, int(robots.clock[0]), int(robots.driven[0]))


def check_calls(flight: Flight, before: Calls) -> None:
    """Raise RuntimeError if a model has left out calls since `before`.

    Robots need a call of publish at the beginning of each step, and a call of drive per
    boid and step.
    """
    now, work = calls_of(flight), flight.work
    taken, robots = now.steps - before.steps, work.robots
    layers = work.near.senses, robots.motors, robots.wind, work.motion
    published = now.published - before.published
    if any(one is not None for one in layers) and published != taken:
        raise RuntimeError(
            f"advance called publish in {published} of {taken}"
            " steps; call it at the beginning of each"
        )
    driven = now.driven - before.driven
    if robots.motors is not None and driven != taken * flight.schedule.n:
        raise RuntimeError(
            f"advance called drive {driven} times in {taken} steps of"
            f" {flight.schedule.n} boids; call it once for each boid in each step"
        )


def rebuild_grid(flight: Flight, room: int = 0) -> None:
    """Enter the whole flock into a new grid.

    The blocks of the grid have `room`, see kernels.neighbours.build_grid.
    """
    rows, topology = flight.work.robots.rows, flight.work.near.topology
    reach = search_range(flight.model, flight.params, rows)
    reach = min(reach, topology.around)
    published = flight.work.near.senses is not None
    known = flight.work.before if published else flight.flock
    grid = build_grid(known, flight.world, reach, room, published)
    flight.work = flight.work._replace(grid=grid)


def measure(
    flight: Flight, metrics: Sequence[Metric], blank: float = math.nan
) -> NDArray[np.float64]:
    """Return the values of metrics in the frames in memory.

    Parameters
    ----------
    flight : Flight
    metrics : sequence of Metric
    blank : float, default NaN
        Value of frames for which a metric has written no value.

    Returns
    -------
    array of float64, shape (number of metrics, F)
    """
    values = np.full((len(metrics), flight.filled), blank)
    for row, metric in zip(values, metrics, strict=True):
        if metric.part:
            _measure_part(flight, metric, row)
        else:
            metric.measure(
                flight.record.frames,
                flight.filled,
                flight.ground,
                flight.observation,
                row,
            )
    place_obstacles(flight.work.motion, flight.step)
    return values


def _measure_part(flight: Flight, metric: Metric, values: NDArray[np.float64]) -> None:
    """Write the values of a metric of a part of the boids; NaN for an empty part.

    The metric gets frames and a ground with only the boids of the part.
    """
    if not flight.filled:
        return
    frames, ground = flight.record.frames, flight.ground
    of = members(
        metric.part,
        flight.model.kinds,
        ground.kind,
        flight.work.robots.failing.fails_at,
        frames.step[: flight.filled],
    )
    changes = (of[1:] != of[:-1]).any(axis=1)
    for alike in np.split(np.arange(flight.filled), np.flatnonzero(changes) + 1):
        first, end = int(alike[0]), int(alike[-1]) + 1
        who = np.flatnonzero(of[first])
        if not who.size:
            values[first:end] = math.nan
            continue
        metric.measure(
            Frames(
                frames.bodies[first:end].take(who, axis=2),
                frames.counts[first:end],
                frames.step[first:end],
                frames.integrals[first:end],
            ),
            end - first,
            ground._replace(boids=who.size, kind=ground.kind[who]),
            flight.observation,
            values[first:end],
        )


def forget_frames(flight: Flight) -> None:
    """Make room for new frames."""
    flight.record.progress[FILLED] = 0


def go_on_from(flight: Flight, earlier: Flight) -> None:
    """Make `flight` continue the run `earlier` with an equal number of boids.

    `flight` takes the flock, the steps and the counts of `earlier`. The caller must
    have taken all frames. `flight` also takes the state of boids if the two runs have
    equal state rows, and the visits if the two runs have equal pixels outside
    obstacles.
    """
    flight.record.progress[:] = earlier.record.progress
    watches = zip(flight.record.watch, earlier.record.watch, strict=True)
    for mine, theirs in (*zip(flight.flock, earlier.flock, strict=True), *watches):
        if isinstance(mine, np.ndarray) and isinstance(theirs, np.ndarray):
            mine[:] = theirs
    flight.work.robots.clock[:] = earlier.work.robots.clock
    flight.work.heading_x[:] = earlier.work.heading_x
    flight.work.heading_y[:] = earlier.work.heading_y
    if list(flight.model.state) == list(earlier.model.state):
        flight.work.state[:] = flight.work.state_before[:] = earlier.work.state
    if go_on_with(flight.work.near.senses, earlier.work.near.senses):
        for here, there in zip(flight.work.before, earlier.work.before, strict=True):
            here[:] = there
    go_on_to(flight.work.goals, earlier.work.goals)
    go_on_blowing(flight.work.robots.wind, earlier.work.robots.wind)
    rebuild_grid(flight)
    move_obstacles(flight.work.motion, flight.work.reach, flight.step)
    coverage, before = flight.record.coverage, earlier.record.coverage
    if np.array_equal(coverage.visits < 0, before.visits < 0):
        coverage.visits[:], coverage.sums[:] = before.visits, before.sums
