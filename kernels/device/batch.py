"""Trials that are sent to a device, advanced there, and brought back.

Results are bitwise identical to the results of trials that run alone. The kernel
consists of the functions that single trials call, and trials are independent. The class
Device lists the functions that a batch needs.
"""

from collections.abc import Hashable, Iterator, Sequence
from contextlib import ExitStack
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from kernels.device.kernel import (
    ENTER,
    GOING,
    KEPT,
    LEAVE,
    N_MARKS,
    SENT,
    SENT_MAPS,
    STATE,
    TAKE,
    Kernel,
    kernel_of,
)
from kernels.device.layout import Parts, Space, Type, form_of, lay_out, leaves_of
from kernels.flight import Flight
from kernels.generator import Stream
from kernels.metrics import Metric
from kernels.recording import FILLED, Frames

FRAMES_THERE = 8
"""Frames per trial that a device keeps before the measurement."""
FRAME_BYTES = 2**18
"""Bytes of frames per trial that a device keeps before the transfer back."""
BOID_STEPS_A_CALL = 10_000
"""Boid-steps per trial in a call.

Calls are short, because systems with a screen limit the duration of a call, and more
processes may wait for the device.
"""
NARROW = np.dtype(np.int16)
"""Type of the pixels of a map of visits, if all counts fit."""
WIDE = np.dtype(np.int32)
"""Type of the pixels of a map of visits, if counts may exceed NARROW."""


class Device(Protocol):
    """Runner of kernels of thousands of trials.

    `name` is for people. Calls run in sequence. All methods may raise DeviceError.
    """

    name: str

    def free_bytes(self) -> int:
        """Return the bytes of memory that are free."""

    def load(self, kernel: Kernel) -> Any:
        """Return the program of a kernel."""

    def take(self, size: int, kind: Type) -> Any:
        """Return memory with arbitrary content.

        Parameters
        ----------
        size : int
            Number of numbers.
        kind : Type
            Type of the numbers.

        Raises
        ------
        NoRoomError
            If there is too little memory.
        """

    def give_back(self, room: Any) -> None:
        """Free memory."""

    def send(self, array: NDArray[Any], room: Any, first: int = 0) -> None:
        """Copy an array into memory of the device.

        Parameters
        ----------
        array : array
        room : memory
            Result of `take`.
        first : int, default 0
            Index in `room` of the first element.
        """

    def bring(self, room: Any, array: NDArray[Any], first: int = 0) -> None:
        """Copy memory of the device into an array.

        Parameters
        ----------
        room : memory
            Result of `take`.
        array : array
        first : int, default 0
            Index in `room` of the first element.
        """

    def call(
        self, program: Any, numbers: Sequence[float], rooms: Sequence[Any], count: int
    ) -> None:
        """Begin to run a program for each trial, after all earlier calls.

        Parameters
        ----------
        program : program
            Result of `load`.
        numbers : sequence of float or int
            Numbers for all trials.
        rooms : sequence of memory
            Memories for all trials.
        count : int
            Number of trials.
        """

    def wait(self) -> None:
        """Return when all calls are complete."""


class NoRoomError(Exception):
    """Error of a device that has too little memory for a request."""


class DeviceError(Exception):
    """Failure of a device, not of a trial; work in progress is lost."""


class KeptFrames(NamedTuple):
    """Frames of a trial that a device measured.

    `steps` (F,) are the steps of the frames. `values` (number of metrics, F) are the
    metrics.
    """

    steps: NDArray[np.int64]
    values: NDArray[np.float64]


class Batch:
    """Trials of equal model and `form`, after the first frame.

    The device measures the frames by `metrics`. If `metrics` is None, each call
    transfers frames to the processor. `shared` means that all trials use one scenery.
    """

    def __init__(
        self,
        flights: Sequence[Flight],
        streams: Sequence[Stream],
        metrics: Sequence[Metric] | None,
        shared: bool,
    ) -> None:
        self.flights = flights
        self._metrics = metrics
        self.states = np.full(len(flights), GOING)
        self._trees = [
            tree_of(flight, stream)
            for flight, stream in zip(flights, streams, strict=True)
        ]
        first = flights[0]
        coverage = first.record.coverage
        schedule = first.schedule
        self._n = schedule.n
        self._left = schedule.steps - first.step
        places = {id(leaf): k for k, leaf in enumerate(leaves_of(self._trees[0]))}
        self._maps = places[id(coverage.visits)]
        self._frames = [places[id(array)] for array in first.record.frames]
        narrow = schedule.n * schedule.steps < np.iinfo(NARROW).max
        rooms = {
            self._maps: Space(coverage.visits.shape, NARROW if narrow else WIDE, False)
        }
        self._room = self._frame_room(first)
        for place, array in zip(self._frames, first.record.frames, strict=True):
            shape = self._room, *array.shape[1:]
            rooms[place] = Space(shape, array.dtype, beside=metrics is not None)
        self.layout = lay_out(self._trees, _parts(first), shared, rooms)
        measures = (
            None if metrics is None else tuple(metric.measure for metric in metrics)
        )
        self.kernel = kernel_of(first.model, measures, self.layout, self._maps)

    @property
    def bytes(self) -> int:
        """Bytes of memory of a device that the trials need."""
        tables = sum(
            kind.itemsize * self.size(name)
            for name, kind in self.kernel.arrays.items()
            if name not in self.layout.sizes
        )
        return self.layout.bytes + tables

    def _frame_room(self, flight: Flight) -> int:
        if self._metrics is not None:
            return FRAMES_THERE
        states = len(flight.work.state)
        bytes_each = 8 * ((6 + states) * flight.record.frames.bodies.shape[2] + 24)
        return int(max(2, FRAME_BYTES // bytes_each))

    @property
    def _most_frames(self) -> int:
        """Maximum number of frames per trial that the device measures."""
        if self._metrics is None:
            return 0
        return self._left // self.flights[0].record.every + 2

    def size(self, name: str) -> int:
        """Return the number of elements of an array of the kernel, at least 1."""
        layout = self.layout
        count = layout.count
        if name.startswith(SENT) and (kind := name.removeprefix(SENT)) in layout.sizes:
            return max(1, layout.rows.get(kind, 0) * count)
        sizes = layout.sizes | {
            SENT_MAPS: self._n_maps * self._n_pixels,
            "marks": N_MARKS * count,
            "steps_of": self._most_frames * count,
            "values": self._most_frames * count * len(self._metrics or ()),
            "facts": layout.facts.size,
            "numbers": layout.numbers.size,
        }
        return max(1, int(sizes[name]))

    def numbers(self, task: int, steps: int = 0) -> tuple[float, ...]:
        """Return the numbers of a call.

        Parameters
        ----------
        task : int
            TAKE, ENTER or LEAVE.
        steps : int, default 0
            Number of steps to take.
        """
        layout = self.layout
        lengths = layout.count, self._n_maps, self._n_pixels, self._most_frames
        common = *layout.common_integers, *layout.common_floats
        return task, steps, *lengths, *common

    def contents(self) -> Iterator[tuple[str, int, NDArray[Any]]]:
        """Yield what a device must have before the call with the task ENTER.

        Yields
        ------
        name : str
            Array of the kernel.
        first : int
            Index of the first element.
        array : array
        """
        layout = self.layout
        for kind, array in layout.sent(self._trees).items():
            yield SENT + kind, 0, array
        for kind, first, array in layout.apart():
            yield kind, first, np.ascontiguousarray(array)
        yield "facts", 0, layout.facts
        yield "numbers", 0, layout.numbers
        yield "marks", 0, np.zeros((N_MARKS, layout.count), np.int64)
        yield SENT_MAPS, 0, self._visits()

    def _visits(self) -> NDArray[Any]:
        """Return the maps to send, with the lowest number in pixels of obstacles."""
        kind = self.kernel.maps
        flights = self.flights[: self._n_maps]
        least = np.iinfo(kind).min
        maps = np.stack([flight.record.coverage.visits for flight in flights])
        return np.where(maps < 0, least, maps).astype(kind)

    @property
    def _n_pixels(self) -> int:
        return self.flights[0].record.coverage.visits.size

    @property
    def _n_maps(self) -> int:
        """Number of maps to send: 1 if all trials share the pixels."""
        first = self.flights[0].record.coverage.visits
        alike = all(flight.record.coverage.visits is first for flight in self.flights)
        return 1 if alike else len(self.flights)

    def fly(self, device: Device, maps: bool) -> Iterator[list[KeptFrames]]:
        """Run all steps on a device, and yield the frames of each call.

        Afterwards each trial has the final state.

        Parameters
        ----------
        device : Device
        maps : bool
            Whether to transfer the maps of visits back too.

        Yields
        ------
        list of KeptFrames
            If the device measures frames: one item per trial, yielded once at the end.
            Else an empty list per call, after the frames of the trials are filled.

        Raises
        ------
        NoRoomError
            If the device has too little memory.
        DeviceError
            If the device fails.
        """
        with ExitStack() as stack:
            yield from _Aboard(self, device, stack).fly(maps)


class _Aboard:
    """Batch on a device."""

    def __init__(self, batch: Batch, device: Device, stack: ExitStack) -> None:
        self.batch = batch
        self.device = device
        self.layout = batch.layout
        self.program = device.load(batch.kernel)
        self.rooms = dict[str, Any]()
        for name, kind in batch.kernel.arrays.items():
            room = device.take(batch.size(name), kind)
            stack.callback(device.give_back, room)
            self.rooms[name] = room

    def fly(self, maps: bool) -> Iterator[list[KeptFrames]]:
        """Run all steps; see `Batch.fly`."""
        batch = self.batch
        self._enter()
        left = batch._left
        at_once = max(1, BOID_STEPS_A_CALL // max(1, batch._n))
        if batch._metrics is None:
            every = batch.flights[0].record.every
            at_once = min(at_once, (batch._room - 1) * every)
        while left > 0:
            self._call(TAKE, min(left, at_once))
            left -= at_once
            if batch._metrics is None:
                yield self._bring_frames()
        self._call(LEAVE)
        self.device.wait()
        self._leave(maps)
        if batch._metrics is not None:
            yield self._measured()

    def _call(self, task: int, steps: int = 0) -> None:
        numbers = self.batch.numbers(task, steps)
        rooms = list(self.rooms.values())
        self.device.call(self.program, numbers, rooms, self.layout.count)

    def _enter(self) -> None:
        for name, first, array in self.batch.contents():
            self.device.send(array, self.rooms[name], first)
        self._call(ENTER)

    def _bring_marks(self) -> NDArray[np.int64]:
        marks = np.empty((N_MARKS, self.layout.count), np.int64)
        self.device.bring(self.rooms["marks"], marks)
        self.batch.states = marks[STATE]
        return marks

    def _bring_frames(self) -> list[KeptFrames]:
        """Fill each trial with the frames since the last call; return an empty list."""
        self.device.wait()
        brought = [self._bring_block(place) for place in self.batch._frames]
        counts = self._bring_marks()[KEPT]
        for k, flight in enumerate(self.batch.flights):
            frames = Frames(*(block[k] for block in brought))
            flight.record = flight.record._replace(frames=frames)
            flight.record.progress[FILLED] = counts[k]
        return []

    def _bring_block(self, place: int) -> NDArray[Any]:
        block = self.layout.blocks[place]
        array = np.empty(block.shape, self.layout.types[block.numbers])
        self.device.bring(self.rooms[block.numbers], array, block.first)
        return array

    def _leave(self, maps: bool) -> None:
        """Write the final state into each trial."""
        batch = self.batch
        layout = self.layout
        sent = layout.room_for_sent()
        for numbers, array in sent.items():
            self.device.bring(self.rooms[SENT + numbers], array)
        layout.bring(sent, batch._trees)
        self._bring_marks()
        visits = self._bring_block(batch._maps) if maps else None
        for k, flight in enumerate(batch.flights):
            flight.record.progress[FILLED] = 0
            if visits is not None:
                coverage = flight.record.coverage._replace(visits=visits[k])
                flight.record = flight.record._replace(coverage=coverage)

    def _measured(self) -> list[KeptFrames]:
        batch = self.batch
        count = self.layout.count
        most = batch._most_frames
        steps = np.empty((count, most), np.int64)
        values = np.empty((count, len(batch._metrics or ()), most))
        self.device.bring(self.rooms["steps_of"], steps)
        self.device.bring(self.rooms["values"], values)
        counts = self._bring_marks()[KEPT]
        return [
            KeptFrames(steps[k, : counts[k]], values[k, :, : counts[k]])
            for k in range(count)
        ]


def _parts(flight: Flight) -> Parts:
    record = flight.record
    return Parts(
        fixed=(flight.scenery, record.coverage.stamp),
        loose=(flight.work.grid,),
        common=(flight.world, flight.observation, record, record.watch),
    )


def form(flight: Flight, stream: Stream) -> Hashable:
    """Return a key that is equal for trials that can run in one batch."""
    return form_of(tree_of(flight, stream), _parts(flight))


def tree_of(flight: Flight, stream: Stream) -> tuple[Any, ...]:
    """Return all parts of a trial that a kernel reads or writes."""
    return (
        *(flight.flock, flight.world, flight.params, flight.work, flight.record),
        *(flight.ground, flight.observation, stream),
    )
