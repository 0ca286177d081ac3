"""The memory of a device before the first step of a trial.

A program that has the module of a kernel and an image needs nothing else to run the
trial. The program takes the rooms in order, and writes the pieces. Then the program
calls `fly` with the numbers of the image, and again with the task TAKE for each portion
of steps. Elements without a piece are 0.
"""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.device.batch import Batch
from kernels.device.kernel import Kernel
from kernels.device.layout import Type


class Room(NamedTuple):
    """Array of a kernel in the memory of a device: `size` numbers of `itemsize` bytes.

    `place` is the index among the arrays of the kernel.
    """

    place: int
    size: int
    itemsize: int


class Piece(NamedTuple):
    """Content of a room from the element `first` on, in bytes."""

    room: Room
    first: int
    content: bytes


class Image(NamedTuple):
    """Memory of a device before the first step of a trial.

    Attributes
    ----------
    kernel : Kernel
        Kernel that runs the trial.
    rooms : tuple of Room
        Arrays of the kernel, in order.
    pieces : tuple of Piece
        Contents that are not zero.
    numbers : tuple of int or float
        Numbers of the first call. The first two are the task and the number of steps.
    """

    kernel: Kernel
    rooms: tuple[Room, ...]
    pieces: tuple[Piece, ...]
    numbers: tuple[float, ...]


def image_of(batch: Batch) -> Image:
    """Return the memory of a device that has received a batch."""
    recorder = _Recorder()
    with suppress(_ReceivedError):
        next(batch.fly(recorder, maps=False))
    return Image(
        batch.kernel, tuple(recorder.rooms), tuple(recorder.pieces), recorder.numbers
    )


class _ReceivedError(Exception):
    """The first call of a program: the device has received everything."""


class _Recorder:
    """Device that records what it receives; see kernels.device.batch.Device."""

    name = "an image of memory"

    def __init__(self) -> None:
        self.rooms = list[Room]()
        self.pieces = list[Piece]()
        self.numbers: tuple[float, ...] = ()

    def free_bytes(self) -> int:
        """Return 0, which no batch asks for here."""
        return 0

    def load(self, _kernel: Kernel) -> None:
        """Do nothing: nothing runs here."""

    def take(self, size: int, kind: Type) -> Room:
        """Return a room."""
        self.rooms.append(Room(len(self.rooms), size, kind.itemsize))
        return self.rooms[-1]

    def give_back(self, room: Room) -> None:
        """Do nothing: an image keeps all rooms."""

    def send(self, array: NDArray[Any], room: Room, first: int = 0) -> None:
        """Record an array, if a byte is not zero: -0.0 is not zero."""
        content = np.ascontiguousarray(array).tobytes()
        if content.strip(b"\0"):
            self.pieces.append(Piece(room, first, content))

    def bring(self, _room: Room, _array: NDArray[Any], _first: int = 0) -> None:
        """Do nothing: nothing comes back."""

    def call(
        self,
        _program: None,
        numbers: Sequence[float],
        _rooms: Sequence[Room],
        _count: int,
    ) -> None:
        """Record the numbers, and end the transfer with _ReceivedError."""
        self.numbers = tuple(numbers)
        raise _ReceivedError

    def wait(self) -> None:
        """Do nothing."""
