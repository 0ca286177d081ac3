"""Flights that are sent to a device, advanced there, and brought back.

They have the bits that they have alone: the kernel is made of the same functions, and
nothing of one flight depends on another. What a batch needs of a device is a Device.
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

FRAMES_THERE, FRAME_BYTES = 8, 2**18
"""So many frames of a flight are kept on a device until they are measured there; and so
many bytes of them until they are brought back.
"""
BOID_STEPS_A_CALL = 10_000
"""Of each flight: so that a call ends soon, as systems with a screen demand, and other
processes have their turn.
"""
NARROW, WIDE = np.dtype(np.int16), np.dtype(np.int32)
"""The numbers of the pixels of a map: narrow where no pixel can have more visits."""


class Device(Protocol):
    """What runs kernels of thousands of flights. `name` is for people.

    `take` gives memory for so many numbers of a kind, whose content is anything, and
    raises NoRoomError where there is none; `send` and `bring` copy there, from the
    element `first` on, and back. `load` makes a program of a kernel. `call` begins to
    run it once for each trial below `count`, with these `numbers` and memories, after
    all that was asked for before; `wait` returns when all is over. All may raise
    DeviceError.
    """

    name: str

    def free_bytes(self) -> int: ...

    def load(self, kernel: Kernel) -> Any: ...

    def take(self, size: int, kind: Type) -> Any: ...

    def give_back(self, room: Any) -> None: ...

    def send(self, array: NDArray[Any], room: Any, first: int = 0) -> None: ...

    def bring(self, room: Any, array: NDArray[Any], first: int = 0) -> None: ...

    def call(
        self, program: Any, numbers: Sequence[float], rooms: Sequence[Any], count: int
    ) -> None: ...

    def wait(self) -> None: ...


class NoRoomError(Exception):
    """A device has too little memory for what was asked of `take`."""


class DeviceError(Exception):
    """A device has failed, and not a flight: what it has done so far is lost."""


class KeptFrames(NamedTuple):
    """The frames that a flight has kept on a device: their steps (F,) and what was
    measured in them (number of metrics, F).
    """

    steps: NDArray[np.int64]
    values: NDArray[np.float64]


class Batch:
    """Flights of one model and one `form`, whose first frame was taken.

    Their frames are measured by `metrics` on the device; with None they are brought
    back, call by call. `shared` says that all have the same scenery.
    """

    def __init__(
        self,
        flights: Sequence[Flight],
        streams: Sequence[Stream],
        metrics: Sequence[Metric] | None,
        shared: bool,
    ) -> None:
        self.flights, self._metrics = flights, metrics
        self.states = np.full(len(flights), GOING)
        self._trees = [
            tree_of(flight, stream)
            for flight, stream in zip(flights, streams, strict=True)
        ]
        first = flights[0]
        coverage, schedule = first.record.coverage, first.schedule
        self._n, self._left = schedule.n, schedule.steps - first.step
        places = {id(one): k for k, one in enumerate(leaves_of(self._trees[0]))}
        self._maps = places[id(coverage.visits)]
        self._frames = [places[id(one)] for one in first.record.frames]
        narrow = schedule.n * schedule.steps < np.iinfo(NARROW).max
        rooms = {
            self._maps: Space(coverage.visits.shape, NARROW if narrow else WIDE, False)
        }
        self._room = self._frame_room(first)
        for place, array in zip(self._frames, first.record.frames, strict=True):
            shape = self._room, *array.shape[1:]
            rooms[place] = Space(shape, array.dtype, beside=metrics is not None)
        self.layout = lay_out(self._trees, _parts(first), shared, rooms)
        measures = None if metrics is None else tuple(one.measure for one in metrics)
        self.kernel = kernel_of(first.model, measures, self.layout, self._maps)

    @property
    def bytes(self) -> int:
        """The memory of a device that the flights need."""
        tables = sum(
            kind.itemsize * self._size(name)
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
        """Of a flight, that are measured on the device."""
        if self._metrics is None:
            return 0
        return self._left // self.flights[0].record.every + 2

    def _size(self, name: str) -> int:
        """The elements of an array that is given to the kernel."""
        layout, count = self.layout, self.layout.count
        if name.startswith(SENT) and (kind := name.removeprefix(SENT)) in layout.sizes:
            return layout.rows.get(kind, 0) * count
        sizes = layout.sizes | {
            SENT_MAPS: self._n_maps * self._n_pixels,
            "marks": N_MARKS * count,
            "steps_of": self._most_frames * count,
            "values": self._most_frames * count * len(self._metrics or ()),
            "facts": layout.facts.size,
            "numbers": layout.numbers.size,
        }
        return int(sizes[name])

    @property
    def _n_pixels(self) -> int:
        return self.flights[0].record.coverage.visits.size

    @property
    def _n_maps(self) -> int:
        """The maps that are sent: one, if all flights have the same pixels."""
        first = self.flights[0].record.coverage.visits
        alike = all(one.record.coverage.visits is first for one in self.flights)
        return 1 if alike else len(self.flights)

    def fly(self, device: Device, maps: bool) -> Iterator[list[KeptFrames]]:
        """Take all steps. Yields what each flight has kept since before, once where it
        is measured there; else the flights' own frames are filled each time. After the
        last, flights are where they ended, and so are their visits if `maps` are
        wanted. Raises NoRoomError and DeviceError.
        """
        with ExitStack() as stack:
            yield from _Aboard(self, device, stack).fly(maps)


class _Aboard:
    """A batch on a device."""

    def __init__(self, batch: Batch, device: Device, stack: ExitStack) -> None:
        self.batch, self.device, self.layout = batch, device, batch.layout
        self.program = device.load(batch.kernel)
        self.rooms = dict[str, Any]()
        for name, kind in batch.kernel.arrays.items():
            room = device.take(max(1, batch._size(name)), kind)
            stack.callback(device.give_back, room)
            self.rooms[name] = room

    def fly(self, maps: bool) -> Iterator[list[KeptFrames]]:
        batch, device = self.batch, self.device
        self._enter()
        left, n = batch._left, max(1, batch._n)
        at_once = max(1, BOID_STEPS_A_CALL // n)
        if batch._metrics is None:
            every = batch.flights[0].record.every
            at_once = min(at_once, (batch._room - 1) * every)
        while left > 0:
            self._call(TAKE, min(left, at_once))
            left -= at_once
            if batch._metrics is None:
                yield self._bring_frames()
        self._call(LEAVE)
        device.wait()
        self._leave(maps)
        if batch._metrics is not None:
            yield self._measured()

    def _call(self, task: int, steps: int = 0) -> None:
        batch, count = self.batch, self.layout.count
        lengths = count, batch._n_maps, batch._n_pixels, batch._most_frames
        rooms = list(self.rooms.values())
        numbers = task, steps, *lengths, *self.layout.given, *self.layout.alike
        self.device.call(self.program, numbers, rooms, count)

    def _enter(self) -> None:
        layout, device, batch = self.layout, self.device, self.batch
        for numbers, array in layout.sent(batch._trees).items():
            device.send(array, self.rooms[SENT + numbers])
        for numbers, first, array in layout.apart():
            device.send(np.ascontiguousarray(array), self.rooms[numbers], first)
        device.send(layout.facts, self.rooms["facts"])
        device.send(layout.numbers, self.rooms["numbers"])
        device.send(np.zeros((N_MARKS, layout.count), np.int64), self.rooms["marks"])
        device.send(self._maps(), self.rooms[SENT_MAPS])
        self._call(ENTER)

    def _maps(self) -> NDArray[Any]:
        """The maps that are sent, with the lowest number in obstacles."""
        numbers, batch = self.batch.kernel.maps, self.batch
        kept = [one.record.coverage.visits for one in batch.flights[: batch._n_maps]]
        least = np.iinfo(numbers).min
        maps = np.stack(kept)
        return np.where(maps < 0, least, maps).astype(numbers)

    def _bring_marks(self) -> NDArray[np.int64]:
        marks = np.empty((N_MARKS, self.layout.count), np.int64)
        self.device.bring(self.rooms["marks"], marks)
        self.batch.states = marks[STATE]
        return marks

    def _bring_frames(self) -> list[KeptFrames]:
        """Give each flight the frames that it has kept since the last call."""
        self.device.wait()
        brought = [self._bring_block(place) for place in self.batch._frames]
        kept = self._bring_marks()[KEPT]
        for k, flight in enumerate(self.batch.flights):
            frames = Frames(*(one[k] for one in brought))
            flight.record = flight.record._replace(frames=frames)
            flight.record.progress[FILLED] = kept[k]
        return []

    def _bring_block(self, place: int) -> NDArray[Any]:
        block = self.layout.blocks[place]
        array = np.empty(block.shape, self.layout.types[block.numbers])
        self.device.bring(self.rooms[block.numbers], array, block.first)
        return array

    def _leave(self, maps: bool) -> None:
        """Bring flights to where they ended."""
        batch, layout = self.batch, self.layout
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
        batch, count = self.batch, self.layout.count
        most, metrics = batch._most_frames, len(batch._metrics or ())
        steps = np.empty((count, most), np.int64)
        values = np.empty((count, metrics, most))
        self.device.bring(self.rooms["steps_of"], steps)
        self.device.bring(self.rooms["values"], values)
        kept = self._bring_marks()[KEPT]
        return [
            KeptFrames(steps[k, : kept[k]], values[k, :, : kept[k]])
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
    """What flights have in common that can fly together."""
    return form_of(tree_of(flight, stream), _parts(flight))


def tree_of(flight: Flight, stream: Stream) -> tuple[Any, ...]:
    """All of a flight that a kernel reads or writes."""
    return (
        *(flight.flock, flight.world, flight.params, flight.work, flight.record),
        *(flight.ground, flight.observation, stream),
    )
