"""Trials of the reference, which start as ours do. The structures are those of
trial.hpp.
"""

import time
from ctypes import CDLL, POINTER, Structure, byref, c_double, c_int64, c_void_p
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.occupancy import Occupancy
from kernels.worlds import Reach
from sweep.trial.simulation import Simulation

NOTHING, PIXELS, VISITS = 0, 1, 2
BLOCKED = -(2**30)
ROOM_BEHIND = 64
LOW_WORD = 2**64 - 1


def _fields(**names: str) -> list[tuple[str, type]]:
    kinds = {"i": c_int64, "d": c_double, "p": c_void_p}
    return [
        (name, kinds[kind]) for kind, all_ in names.items() for name in all_.split()
    ]


class CppReach(Structure):
    _fields_ = [
        *_fields(i="columns rows", d="columns_per_length rows_per_length"),
        *_fields(p="first obstacle"),
    ]


class CppWorld(Structure):
    _fields_ = [
        *_fields(d="width height goal_x goal_y goal_radius"),
        *_fields(p="obstacle_x obstacle_y half_width half_height is_round"),
        ("contact", CppReach),
        ("reach", CppReach),
    ]


class CppOccupancy(Structure):
    _fields_ = _fields(i="rows columns", d="per_length", p="taken")


class CppRecord(Structure):
    _fields_ = _fields(i="covering counting rows columns", p="visits seen sums events")


class CppTrial(Structure):
    _fields_ = [
        *_fields(i="n steps", p="x y vx vy"),
        *_fields(i="number_of_settings", p="settings random"),
        ("world", CppWorld),
        ("occupancy", CppOccupancy),
        ("record", CppRecord),
    ]


class End(NamedTuple):
    """What a trial leaves: the flock (4, N), the visits of pixels, -1 in obstacles, or
    none; the sums of coverage (3,) and the events (11,).
    """

    flock: NDArray[np.float64]
    visits: NDArray[np.int32]
    sums: NDArray[np.int64]
    events: NDArray[np.int64]


class Start:
    """The start of a trial, taken from a simulation that has not begun. Its arrays
    become those of the end.
    """

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.kept: list[NDArray[Any]] = []
        self.flock = np.stack(simulation.flock[:4])
        blocked = np.where(simulation.visits.ravel() < 0, BLOCKED, 0)
        self.visits = np.append(blocked, np.zeros(ROOM_BEHIND)).astype(np.int32)
        self.seen = (self.visits < 0).astype(np.uint8)
        self.sums = np.zeros(3, np.int64)
        self.events = simulation.flight.record.watch.events.copy()
        self.trial = self._trial()

    @property
    def covering(self) -> int:
        """What is counted of pixels: where coverage alone is recorded, which of them
        were visited is enough.
        """
        if not self.simulation.flight.record.covering:
            return NOTHING
        metrics = set(self.simulation.job.record.metrics)
        return PIXELS if metrics <= {"coverage"} else VISITS

    def end(self) -> End:
        """What the trial has left, once it has flown."""
        visits = np.where(self.visits < 0, -1, self.visits)[:-ROOM_BEHIND]
        return End(self.flock, visits, self.sums, self.events)

    def _trial(self) -> CppTrial:
        flight, job = self.simulation.flight, self.simulation.job
        settings = np.array([float(value) for value in flight.params])
        trial = CppTrial(
            n=self.flock.shape[1],
            steps=int(job.settings["steps"]),
            number_of_settings=settings.size,
            settings=self._address(settings),
            random=self._address(_words(self.simulation)),
            world=self._world(),
            occupancy=self._occupancy(flight.scenery.occupancy),
            record=self._record(),
        )
        trial.x, trial.y, trial.vx, trial.vy = map(self._address, self.flock)
        return trial

    def _world(self) -> CppWorld:
        flight = self.simulation.flight
        world, scenery = flight.world, flight.scenery
        columns = ("obstacle_x", "obstacle_y", "half_width", "half_height", "is_round")
        return CppWorld(
            world.width,
            world.height,
            world.goal_x,
            world.goal_y,
            flight.observation.goal_radius,
            *(self._address(getattr(world, name)) for name in columns),
            self._reach(scenery.contact),
            self._reach(scenery.reach),
        )

    def _reach(self, reach: Reach) -> CppReach:
        *shape, first, obstacle = reach
        lists = (self._address(np.asarray(one, np.int64)) for one in (first, obstacle))
        return CppReach(*shape, *lists)

    def _occupancy(self, grid: Occupancy) -> CppOccupancy:
        rows, columns = grid.taken.shape
        return CppOccupancy(rows, columns, grid.per_length, self._address(grid.taken))

    def _record(self) -> CppRecord:
        record = self.simulation.flight.record
        arrays = (self.visits, self.seen, self.sums, self.events)
        return CppRecord(
            self.covering,
            record.watch.counting,
            record.coverage.rows,
            record.coverage.columns,
            *map(self._address, arrays),
        )

    def _address(self, array: NDArray[Any]) -> int:
        """The address of an array, which is kept."""
        self.kept.append(np.ascontiguousarray(array))
        return self.kept[-1].ctypes.data


def _words(simulation: Simulation) -> NDArray[np.uint64]:
    """State and increment of the random numbers, high words first."""
    state = simulation.noise.state["state"]
    words = [(state[k] >> 64, state[k] & LOW_WORD) for k in ("state", "inc")]
    return np.array(words, np.uint64).ravel()


def fly(library: CDLL, start: Start) -> tuple[float, End]:
    """Seconds of processor time that the reference takes from the first step of a trial
    to its last, and what it leaves.

    Raises RuntimeError for a trial that diverges, or whose model has other settings.
    """
    model = start.simulation.job.model
    begin = getattr(library, model)
    begin.argtypes, begin.restype = [POINTER(CppTrial)], c_void_p
    library.fly.argtypes, library.end.argtypes = [c_void_p], [c_void_p]
    flight = begin(byref(start.trial))
    if flight is None:
        raise RuntimeError(f"{model} in C++ has other settings")
    began = time.thread_time()
    is_finite = library.fly(flight)
    seconds = time.thread_time() - began
    library.end(flight)
    if not is_finite:
        raise RuntimeError(f"{model} in C++ diverges")
    return seconds, start.end()
