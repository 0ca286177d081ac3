"""Up to eight flights advanced at once, each with the bits that it has alone.

A call has two parts. First all flocks take some steps, one in each lane; where they are
after each step is kept. Then each flight is observed step by step, as a single one is:
lane after lane, so that only the visits of one map at a time must be near.

Where the numbers of a lane are no longer finite, the first part ends. This lane is
observed no more, and goes on as another one: what is not finite may lead beyond an
array, or into a loop without end.
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
"""What a kernel for lanes raises that cannot be compiled."""
MOST_BOIDS, MOST_FAR_SIGHTED = 200, 110
"""Every boid looks at everyone, in lanes: larger flocks are faster alone. In processor
time, eight trials of 256 boids in 1024 cells were 0.98 times as fast as alone, and of
200 boids in 784 cells 1.11 times. The second number is for searches that look at
everyone alone too: with 18 cells 100 boids were 1.12 times as fast as alone, 127 boids
0.96 times and 200 boids 0.91 times.
"""
TRAIL_BYTES, TRAIL_VISITS = 2**23, MOST * 3 // 4
"""What is kept of steps until they are observed, and how many boid-steps of a trial.
Each trial's map of visits is brought near once for them: 4 MB took 5 ns a boid-step
more. More boid-steps would leave narrow maps no room.
"""
MANY_PIXELS = 16
"""To make a narrow map takes about 1 ns a pixel, and saves some 20 ns a boid-step."""
FIELDS = len(Flock._fields)
PREVIOUS = FIELDS - 2
"""The first of the velocities before a step, which are the last fields of a flock."""
HEADINGS = 2 * FIELDS
"""The first of the headings, which follow two flocks."""
FINITE, NOT_FINITE, FORGETFUL = range(3)


def can_fly_together(model: Model, n: int, share: float) -> bool:
    """Whether flights of a model, of `n` boids each, may fly in lanes, and are faster
    so. `share` is the part of the world that a search looks through alone.
    """
    most = MOST_FAR_SIGHTED if share * CROWDED >= 1.0 else MOST_BOIDS
    return n <= most and not model.state and not is_noted_alone(model.advance)


def is_kept_for_lanes(model: Model) -> bool:
    """Whether the kernel of a model for lanes is compiled already."""
    kernels = (kernel_of(model, alike) for alike in (True, False))
    return any(map(is_kept, kernels))


class Room(NamedTuple):
    """The memory of a kernel for lanes, of N boids: `bodies` (14, N, WIDTH) has the
    flock, the flock before a step, and the headings; `ways` (4, N + 1, WIDTH), `who`
    and `marks` (N + 1,) are for neighbours; `weights` (P, WIDTH); `trail` (WIDTH, 1 +
    S, 4, M) with `late` (1,), see kernels.lanes.kernel; `counted` (N_EVENTS, WIDTH).
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
    """Flights of one model that differ in their start, their random numbers, their
    weights and perhaps their obstacles.

    Flights that are missing to WIDTH are made up by the first one once more, which
    nobody observes.
    """

    def __init__(self, flights: Sequence[Flight]) -> None:
        self.flights = flights
        self.going = [True] * len(flights)
        first = flights[0]
        self._lanes = [*flights, *[first] * (WIDTH - len(flights))]
        names = weights_of(first.model)
        if len({one.work.kind.tobytes() for one in flights}) > 1:
            raise ValueError("flights differ in the kinds of their boids")
        if any(one.work.near.topology.kind != METRIC for one in flights):
            raise ValueError("boids do not interact with all in sight")
        if any(one.work.near.senses is not None for one in flights):
            raise ValueError("boids do not know all that they see")
        if any(one.work.motion is not None for one in flights):
            raise NotForLanesError("obstacles move")
        self._publishes = calls(first.model.advance, publish)
        alike = all(one.scenery is first.scenery for one in flights)
        self._kernel = kernel_of(first.model, alike)
        n = first.flock.x.size
        whole = -(-n // WIDTH) * WIDTH
        self._most = max(
            1, min(TRAIL_BYTES // (4 * whole * WIDTH * 8), TRAIL_VISITS // n)
        )
        self._rows = Room(
            _aligned(2 * FIELDS + 2, whole)[:, :n],
            _aligned(4, n + 1),
            np.zeros(n + 1, np.uint32),
            np.zeros(n + 1, np.uint8),
            np.array(
                [[getattr(one.params, name) for one in self._lanes] for name in names],
                np.float64,
            ).reshape(-1, WIDTH),
            np.zeros((WIDTH, 1 + self._most, 4, whole)),
            np.zeros(1, np.int64),
            np.zeros((self._most * N_EVENTS, WIDTH), np.int64),
            np.zeros(self._most, np.uint8),
            np.zeros((N_EVENTS, WIDTH), np.int64),
        )
        reach = first.model.sight(first.params).range
        self._places = build_places(n, reach)
        self._scenery = first.scenery
        if not alike:
            self._scenery = _joint([one.scenery for one in self._lanes])
        self._marks = _marks_of(flights, alike)
        self._enter()

    @property
    def steps_at_once(self) -> int:
        """How many steps a call may take."""
        first = self.flights[0]
        free = len(first.record.frames.step) - first.filled - 1
        return min(self._most, max(0, free * first.record.every))

    def advance(self, rngs: Sequence[Generator], steps: int) -> None:
        """Take so many steps, at most `steps_at_once`; `going` says which flights have
        finite numbers. `rngs` are those of the WIDTH lanes.
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
        """Take at most so many steps, and return how many. It ends after one in which
        the numbers of a lane are not finite.
        """
        rows, first = self._rows, self.flights[0]
        rows.late[0] = 0
        self._fly(
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
        taken = int(rows.late[0])
        is_all = taken == steps
        if not (is_all or (0 < taken < steps and rows.finite[taken - 1] != ALL)):
            raise RuntimeError("a model does not observe each step once")
        return taken

    def _observe(self, lane: int, flight: Flight, steps: int) -> bool:
        """Observe the last steps of a lane; False where its numbers are not finite."""
        work = flight.work
        self._make_room(lane, steps * flight.schedule.n)
        marks = self._marks[lane]
        found = _observe_all(
            flight.flock,
            flight.scenery.world,
            flight.record._replace(coverage=marks.coverage),
            marks,
            self._rows,
            lane,
            steps,
            (work.heading_x, work.heading_y),
        )
        if self._publishes:
            work.robots.clock[:] = flight.step
        if found == FORGETFUL:
            raise RuntimeError("a model does not keep the velocities before a step")
        return bool(found == FINITE)

    def _replace_lost(self, finite: int) -> None:
        """Let lanes whose numbers are not finite go on as one whose numbers are."""
        fit = [lane for lane in range(WIDTH) if finite >> lane & 1]
        lost = set(range(WIDTH)) - set(fit) if fit else set[int]()
        for lane in lost:
            for array in self._stacks():
                array[lane] = array[fit[0]]
            self._rows.bodies[:, :, lane] = self._rows.bodies[:, :, fit[0]]
            self._rows.weights[:, lane] = self._rows.weights[:, fit[0]]

    def _stacks(self) -> list[NDArray[Any]]:
        """The arrays (WIDTH, ...) of lanes that differ in their obstacles."""
        there = self._scenery
        if there is self.flights[0].scenery:
            return []
        parts = (*there.world, *there.reach, *there.occupancy)
        return [one for one in parts if isinstance(one, np.ndarray)]

    def _fly(self, *arguments: Any) -> None:
        """Call the kernel. One that cannot be compiled is noted, so that no other
        process tries it.
        """
        try:
            self._kernel(*arguments)
        except REFUSALS:
            note_alone(self.flights[0].model.advance)
            raise

    def land(self) -> None:
        """Bring the visits into the flights' records."""
        for flight, marks in zip(self.flights, self._marks, strict=True):
            if marks.is_narrow:
                flight.record = flight.record._replace(coverage=widened(marks))

    def _make_room(self, lane: int, visits: int) -> None:
        """Let a map have room for so many more visits of one pixel."""
        marks, flight = self._marks[lane], self.flights[lane]
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
    """Marks on narrow maps; on maps as single flights have them where few pixels are
    visited.
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
    """Zeros (*shape, WIDTH) that begin where a vector may."""
    size = int(np.prod(shape)) * WIDTH
    room = np.zeros(size + WIDTH)
    skipped = -(room.ctypes.data // 8) % WIDTH
    return room[skipped : skipped + size].reshape(*shape, WIDTH)


def _joint(sceneries: Sequence[Scenery]) -> Scenery:
    """The sceneries of lanes that differ in their obstacles: the arrays of all (WIDTH,
    ...), filled up with zeros which nothing reads. Raises ValueError where something
    else differs.
    """
    first = sceneries[0]
    if any(one.world.corners is not None for one in sceneries):
        raise NotForLanesError("flights differ in their polygons")
    if len({one.world.obstacle_x.size for one in sceneries}) > 1:
        raise ValueError("flights differ in the number of their obstacles")
    return first._replace(
        world=_stacked([one.world for one in sceneries]),
        reach=_stacked([one.reach for one in sceneries]),
        occupancy=_stacked([one.occupancy for one in sceneries]),
    )


def _stacked(parts: Sequence[Any]) -> Any:
    made = {}
    for name, values in zip(parts[0]._fields, zip(*parts, strict=True), strict=True):
        if isinstance(values[0], np.ndarray):
            shape = WIDTH, max(map(len, values)), *values[0].shape[1:]
            whole = np.zeros(shape, values[0].dtype)
            for row, value in zip(whole, values, strict=True):
                row[: len(value)] = value
            made[name] = whole
        elif any(value != values[0] for value in values):
            raise ValueError(f"flights differ in the {name} of their sceneries")
    return parts[0]._replace(**made)


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
    """Observe the steps of one lane, as kernels.recording.observe does, and keep its
    headings. NOT_FINITE after the first step of which that is true; FORGETFUL where the
    model has not kept the velocities before the last step.
    """
    n = flock.x.size
    trail = room.trail[lane]
    for step in range(steps):
        record.progress[STEP] += 1
        here, last = trail[step + 1], trail[step]
        after = Flock(
            here[0, :n], here[1, :n], here[2, :n], here[3, :n], last[2, :n], last[3, :n]
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
    kept = True
    for k in range(2):
        for i in range(n):
            kept &= flock[PREVIOUS + k][i] == room.bodies[PREVIOUS + k, i, lane]
            headings[k][i] = room.bodies[HEADINGS + k, i, lane]
    return FINITE if kept else FORGETFUL
