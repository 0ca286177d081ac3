"""Up to eight trials at once, each bitwise identical to a trial that runs alone.

A call has two parts. First, all flocks take some steps, one flock per lane, and the
positions after each step are kept. Then each trial is observed step by step, as a
single trial is. Observation proceeds lane by lane, so that only one map of visits at a
time must be in the cache.

The first part ends if the numbers of a lane are not finite. The lane is not observed
any more, and continues as a copy of a finite lane. Otherwise numbers that are not
finite could cause reads beyond an array, or an endless loop.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numba.core.errors import NumbaError
from numpy.random import Generator
from numpy.typing import NDArray

from kernels.caching import is_kept, is_noted_alone, note_alone
from kernels.coverage import unvisited
from kernels.events import N_EVENTS, count
from kernels.flight import Flight, Scenery
from kernels.jit import jit
from kernels.lanes.calls import calls
from kernels.lanes.facts import NotForLanesError
from kernels.lanes.kernel import ALL, kernel_of, weights_of
from kernels.lanes.marks import (
    MOST,
    Marks,
    free_obstacles,
    mark_step,
    narrow_marks,
    room_left,
    wide_marks,
    widened,
)
from kernels.lanes.rows import Each
from kernels.lanes.search import build_places
from kernels.lanes.vectors import WIDTH
from kernels.model import Model
from kernels.neighbours import CROWDED
from kernels.recording import STEP, Record, keep_frame
from kernels.robots.sensing import publish
from kernels.settings import METRIC
from kernels.state import Floats, Flock, World

REFUSALS = NumbaError, NotForLanesError
"""Exceptions of a kernel for lanes that cannot be compiled."""
MOST_BOIDS = 200
"""Maximum number of boids per trial in lanes, where a search tests all boids.

Measured in processor time, against trials alone: eight trials of 256 boids in 1024
cells were 0.98 times as fast. Eight trials of 200 boids in 784 cells were 1.11 times as
fast.
"""
MOST_FAR_SIGHTED = 110
"""Maximum number of boids if the search of a trial alone tests all boids too.

With 18 cells, trials of 100 boids were 1.12 times as fast as trials alone, trials of
127 boids 0.96 times and trials of 200 boids 0.91 times.
"""
TRAIL_BYTES = 2**23
"""Bytes of steps that are kept until the observation.

The observation of these steps loads each map of visits into the cache once. With 4 MB,
a boid-step took 5 ns more.
"""
TRAIL_VISITS = MOST * 3 // 4
"""Boid-steps per trial that are kept; more boid-steps would fill narrow maps."""
MANY_PIXELS = 16
"""Maximum number of pixels per boid-step of a narrow map.

A narrow map costs about 1 ns per pixel, and saves about 20 ns per boid-step.
"""
FIELDS = len(Flock._fields)
PREVIOUS = FIELDS - 2
"""Index of the first velocities before a step, the last fields of a flock."""
HEADINGS = 2 * FIELDS
"""Index of the first heading; headings follow two flocks."""
FINITE, NOT_FINITE, FORGETFUL = range(3)


def can_fly_together(model: Model, n: int, share: float) -> bool:
    """Return whether trials of a model may run in lanes, and are faster in lanes.

    Parameters
    ----------
    model : Model
    n : int
        Number of boids per trial.
    share : float
        Fraction of the world that a search reads if the trial runs alone.
    """
    most = MOST_FAR_SIGHTED if share * CROWDED >= 1.0 else MOST_BOIDS
    return n <= most and not model.state and not is_noted_alone(model.advance)


def is_kept_for_lanes(model: Model) -> bool:
    """Return whether the kernel of a model for lanes is compiled already."""
    kernels = (kernel_of(model, alike) for alike in (True, False))
    return any(map(is_kept, kernels))


class Room(NamedTuple):
    """Memory of a kernel for lanes, for N boids.

    `bodies` (14, N, WIDTH) has the flock, the flock before a step, and the headings.
    `ways` (4, N + 1, WIDTH), `who` and `marks` (N + 1,) are for neighbours. `weights`
    is (P, WIDTH). `trail` (WIDTH, 1 + S, 4, M), `late` (1,) and `finite` (S,) are
    fields of `kernels.lanes.kernel.LanesRecord`. `counted` (S * N_EVENTS, WIDTH) has
    the events of each step, and `events` (N_EVENTS, WIDTH) the events of the current
    step.
    """

    bodies: NDArray[np.float64]
    ways: NDArray[np.float64]
    who: NDArray[np.uint32]
    marks: NDArray[np.uint8]
    weights: NDArray[np.float64]
    trail: NDArray[np.float64]
    late: NDArray[np.int64]
    counted: NDArray[np.int64]
    finite: NDArray[np.uint8]
    events: NDArray[np.int64]


class Formation:
    """Vectorised batch: trials of one model that run together.

    The trials differ in initial conditions, random numbers, weights and perhaps
    obstacles. Copies of the first trial fill up the WIDTH lanes; copies are not
    observed.
    """

    def __init__(self, flights: Sequence[Flight]) -> None:
        self.flights = flights
        self.going = [True] * len(flights)
        first = flights[0]
        self._lanes = [*flights, *[first] * (WIDTH - len(flights))]
        names = weights_of(first.model)
        if len({flight.work.kind.tobytes() for flight in flights}) > 1:
            raise ValueError("flights differ in the kinds of their boids")
        if any(flight.work.near.topology.kind != METRIC for flight in flights):
            raise ValueError("boids do not interact with all in sight")
        if any(flight.work.near.senses is not None for flight in flights):
            raise ValueError("boids do not know all that they see")
        if any(flight.work.motion is not None for flight in flights):
            raise NotForLanesError("obstacles move")
        self._publishes = calls(first.model.advance, publish)
        alike = all(flight.scenery is first.scenery for flight in flights)
        self._kernel = kernel_of(first.model, alike)
        n = first.flock.x.size
        padded = -(-n // WIDTH) * WIDTH
        self._most = max(
            1, min(TRAIL_BYTES // (4 * padded * WIDTH * 8), TRAIL_VISITS // n)
        )
        weights = [
            [getattr(flight.params, name) for flight in self._lanes] for name in names
        ]
        self._rows = Room(
            bodies=_aligned(2 * FIELDS + 2, padded)[:, :n],
            ways=_aligned(4, n + 1),
            who=np.zeros(n + 1, np.uint32),
            marks=np.zeros(n + 1, np.uint8),
            weights=np.array(weights, np.float64).reshape(-1, WIDTH),
            trail=np.zeros((WIDTH, 1 + self._most, 4, padded)),
            late=np.zeros(1, np.int64),
            counted=np.zeros((self._most * N_EVENTS, WIDTH), np.int64),
            finite=np.zeros(self._most, np.uint8),
            events=np.zeros((N_EVENTS, WIDTH), np.int64),
        )
        reach = first.model.sight(first.params).range
        self._places = build_places(n, reach)
        self._scenery = first.scenery
        if not alike:
            self._scenery = _joint([flight.scenery for flight in self._lanes])
        self._marks = _marks_of(flights, alike)
        self._enter()

    @property
    def steps_at_once(self) -> int:
        """Maximum number of steps of a call."""
        first = self.flights[0]
        free = len(first.record.frames.step) - first.filled - 1
        return min(self._most, max(0, free * first.record.every))

    def advance(self, rngs: Sequence[Generator], steps: int) -> None:
        """Take steps, and note in `going` the trials with finite numbers.

        Parameters
        ----------
        rngs : sequence of Generator
            Generators of the WIDTH lanes.
        steps : int
            Number of steps, at most `steps_at_once`.
        """
        while steps > 0 and any(self.going):
            taken = self._take_steps(rngs, steps)
            for lane, flight in enumerate(self.flights):
                if self.going[lane]:
                    self.going[lane] = self._observe(lane, flight, taken)
            self._replace_lost(int(self._rows.finite[taken - 1]))
            self._rows.trail[:, 0] = self._rows.trail[:, taken]
            steps -= taken

    def _take_steps(self, rngs: Sequence[Generator], steps: int) -> int:
        """Take at most `steps` steps, and return the number of steps.

        The last step is the first step in which the numbers of a lane are not finite.
        """
        rows = self._rows
        first = self.flights[0]
        rows.late[0] = 0
        arguments = (
            rows,
            self._scenery.world,
            first.params,
            self._places,
            self._scenery.reach,
            self._scenery.occupancy,
            first.work.kind,
            Each(*rngs),
            steps,
        )
        self._fly(*arguments)
        taken = int(rows.late[0])
        is_all = taken == steps
        if not (is_all or (0 < taken < steps and rows.finite[taken - 1] != ALL)):
            raise RuntimeError("a model does not observe each step once")
        return taken

    def _observe(self, lane: int, flight: Flight, steps: int) -> bool:
        """Observe the last steps of a lane; return whether the numbers are finite."""
        work = flight.work
        self._make_room(lane, steps * flight.schedule.n)
        marks = self._marks[lane]
        outcome = _observe_all(
            flight.flock,
            flight.scenery.world,
            flight.record._replace(coverage=marks.coverage),
            marks,
            room=self._rows,
            lane=lane,
            steps=steps,
            headings=(work.heading_x, work.heading_y),
        )
        if self._publishes:
            work.robots.clock[:] = flight.step
        if outcome == FORGETFUL:
            raise RuntimeError("a model does not keep the velocities before a step")
        return bool(outcome == FINITE)

    def _replace_lost(self, finite: int) -> None:
        """Replace each lane with numbers that are not finite by a finite lane."""
        fit = [lane for lane in range(WIDTH) if finite >> lane & 1]
        lost = set(range(WIDTH)) - set(fit) if fit else set[int]()
        for lane in lost:
            for array in self._stacks():
                array[lane] = array[fit[0]]
            self._rows.bodies[:, :, lane] = self._rows.bodies[:, :, fit[0]]
            self._rows.weights[:, lane] = self._rows.weights[:, fit[0]]

    def _stacks(self) -> list[NDArray[Any]]:
        """Return the arrays (WIDTH, ...) of lanes that differ in their obstacles."""
        scenery = self._scenery
        if scenery is self.flights[0].scenery:
            return []
        parts = (*scenery.world, *scenery.reach, *scenery.occupancy)
        return [part for part in parts if isinstance(part, np.ndarray)]

    def _fly(self, *arguments: Any) -> None:
        """Call the kernel.

        A kernel that cannot be compiled is noted, so that no further process tries to.
        """
        try:
            self._kernel(*arguments)
        except REFUSALS:
            note_alone(self.flights[0].model.advance)
            raise

    def land(self) -> None:
        """Write the visits into the records of the trials."""
        for flight, marks in zip(self.flights, self._marks, strict=True):
            if marks.is_narrow:
                flight.record = flight.record._replace(coverage=widened(marks))

    def _make_room(self, lane: int, visits: int) -> None:
        """Ensure that a map has room for `visits` more visits of one pixel."""
        marks = self._marks[lane]
        flight = self.flights[lane]
        if marks.is_narrow and room_left(marks) < visits:
            flight.record = flight.record._replace(coverage=widened(marks))
            self._marks[lane] = wide_marks(flight.record.coverage)
        elif marks.is_narrow:
            free_obstacles(marks, visits)

    def _enter(self) -> None:
        for lane, flight in enumerate(self._lanes):
            for row, numbers in zip(self._rows.bodies, flight.flock, strict=False):
                row[:, lane] = numbers
            for line, numbers in zip(
                self._rows.trail[lane, 0], flight.flock, strict=False
            ):
                line[: numbers.size] = numbers
            headings = flight.work.heading_x, flight.work.heading_y
            for row, numbers in enumerate(headings, HEADINGS):
                self._rows.bodies[row, :, lane] = numbers


def _marks_of(flights: Sequence[Flight], alike: bool) -> list[Marks]:
    """Return marks on narrow maps.

    If few pixels are visited, the maps have the format of single trials instead.
    """
    schedule = flights[0].schedule
    coverages = [flight.record.coverage for flight in flights]
    if coverages[0].visits.size <= MANY_PIXELS * schedule.n * schedule.steps:
        return narrow_marks(coverages, alike)
    for flight, coverage in zip(flights, coverages, strict=True):
        if not coverage.visits.flags.writeable:
            flight.record = flight.record._replace(coverage=unvisited(coverage))
    return [wide_marks(flight.record.coverage) for flight in flights]


def _aligned(*shape: int) -> NDArray[np.float64]:
    """Return zeros (*shape, WIDTH) at an address that is aligned for vectors."""
    size = int(np.prod(shape)) * WIDTH
    room = np.zeros(size + WIDTH)
    skipped = -(room.ctypes.data // 8) % WIDTH
    return room[skipped : skipped + size].reshape(*shape, WIDTH)


def _joint(sceneries: Sequence[Scenery]) -> Scenery:
    """Return the sceneries of lanes that differ in obstacles, as one scenery.

    The arrays are (WIDTH, ...), padded with zeros that no code reads. Raises ValueError
    if the number of obstacles or a scalar field differs, and NotForLanesError for
    polygons.
    """
    first = sceneries[0]
    if any(scenery.world.corners is not None for scenery in sceneries):
        raise NotForLanesError("flights differ in their polygons")
    if len({scenery.world.obstacle_x.size for scenery in sceneries}) > 1:
        raise ValueError("flights differ in the number of their obstacles")
    return first._replace(
        world=_stacked([scenery.world for scenery in sceneries]),
        reach=_stacked([scenery.reach for scenery in sceneries]),
        occupancy=_stacked([scenery.occupancy for scenery in sceneries]),
    )


def _stacked(parts: Sequence[Any]) -> Any:
    stacks = {}
    for name, values in zip(parts[0]._fields, zip(*parts, strict=True), strict=True):
        if isinstance(values[0], np.ndarray):
            shape = WIDTH, max(map(len, values)), *values[0].shape[1:]
            stack = np.zeros(shape, values[0].dtype)
            for row, value in zip(stack, values, strict=True):
                row[: len(value)] = value
            stacks[name] = stack
        elif any(value != values[0] for value in values):
            raise ValueError(f"flights differ in the {name} of their sceneries")
    return parts[0]._replace(**stacks)


@jit
def _observe_all(
    flock: Flock,
    world: World,
    record: Record,
    marks: Marks,
    room: Room,
    lane: int,
    steps: int,
    headings: tuple[Floats, Floats],
) -> int:
    """Observe the steps of one lane, and keep the headings of the lane.

    The result is equal to the result of `kernels.recording.observe` for each step. The
    function returns NOT_FINITE after the first step with numbers that are not finite,
    and FORGETFUL if the model has not kept the velocities before the last step.
    """
    n = flock.x.size
    trail = room.trail[lane]
    for step in range(steps):
        record.progress[STEP] += 1
        here = trail[step + 1]
        last = trail[step]
        after = Flock(
            x=here[0, :n],
            y=here[1, :n],
            vx=here[2, :n],
            vy=here[3, :n],
            previous_vx=last[2, :n],
            previous_vy=last[3, :n],
        )
        finite = (room.finite[step] >> lane) & 1 == 1
        if not finite or step == steps - 1:
            for k in range(FIELDS):
                for i in range(n):
                    flock[k][i] = after[k][i]
        if not finite:
            return NOT_FINITE
        if record.covering:
            mark_step(marks, after.x, after.y)
        for k in range(N_EVENTS):
            record.watch.events[k] += room.counted[step * N_EVENTS + k, lane]
        count(after, world, record.watch, record.progress[STEP])
        keep_frame(after, record)
    is_kept = True
    for k in range(2):
        for i in range(n):
            is_kept &= flock[PREVIOUS + k][i] == room.bodies[PREVIOUS + k, i, lane]
            headings[k][i] = room.bodies[HEADINGS + k, i, lane]
    return FINITE if is_kept else FORGETFUL
