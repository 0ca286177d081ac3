"""The memory of a device before the first step of a trial.

The module of a kernel and an image are sufficient to run the trial. A program takes the
rooms in order, and writes the pieces. Then the program calls `fly` with the numbers of
the image, and once more with the task TAKE for each portion of steps. Elements without
a piece are 0.
"""

from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.device.batch import Batch
from kernels.device.kernel import Kernel
from kernels.device.layout import Type


class MemoryRoom(NamedTuple):
    """Array of a kernel in the memory of a device: `size` numbers of `itemsize` bytes.

    `place` is the index among the arrays of the kernel.
    """

    place: int
    size: int
    itemsize: int


class Piece(NamedTuple):
    """Content of a room from the element `first` on, in bytes."""

    room: MemoryRoom
    first: int
    content: bytes


class Image(NamedTuple):
    """Memory of a device before the first step of a trial.

    Attributes
    ----------
    kernel : Kernel
        Kernel that runs the trial.
    rooms : tuple of MemoryRoom
        Arrays of the kernel, in order.
    pieces : tuple of Piece
        Contents that are not zero.
    numbers : tuple of int or float
        Numbers of the first call. The first two are the task and the number of steps.
    """

    kernel: Kernel
    rooms: tuple[MemoryRoom, ...]
    pieces: tuple[Piece, ...]
    numbers: tuple[float, ...]

    def content(self, place: int) -> bytes:
        """Return the bytes of a room, by its place."""
        room = self.rooms[place]
        content = bytearray(room.size * room.itemsize)
        for piece in self.pieces:
            if piece.room.place == place:
                begin = piece.first * room.itemsize
                content[begin : begin + len(piece.content)] = piece.content
        return bytes(content)


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
    """Device that records received arrays; see kernels.device.batch.Device."""

    name = "an image of memory"

    def __init__(self) -> None:
        self.rooms = list[MemoryRoom]()
        self.pieces = list[Piece]()
        self.numbers: tuple[float, ...] = ()

    def free_bytes(self) -> int:
        """Return 0: a recorder has no memory."""
        return 0

    def load(self, _kernel: Kernel) -> None:
        """Do nothing, because no program runs."""

    def take(self, size: int, kind: Type) -> MemoryRoom:
        """Return a room.

        Parameters
        ----------
        size : int
            Number of numbers.
        kind : Type
            Type of the numbers.
        """
        self.rooms.append(MemoryRoom(len(self.rooms), size, kind.itemsize))
        return self.rooms[-1]

    def give_back(self, room: MemoryRoom) -> None:
        """Do nothing: an image keeps all rooms."""

    def send(self, array: NDArray[Any], room: MemoryRoom, first: int = 0) -> None:
        """Record an array with a byte other than zero, such as -0.0.

        Parameters
        ----------
        array : array
        room : MemoryRoom
            Result of `take`.
        first : int, default 0
            Index in `room` of the first element.
        """
        content = np.ascontiguousarray(array).tobytes()
        if content.strip(b"\0"):
            self.pieces.append(Piece(room, first, content))

    def bring(self, _room: MemoryRoom, _array: NDArray[Any], _first: int = 0) -> None:
        """Do nothing, because no program runs.

        Parameters
        ----------
        _room : MemoryRoom
        _array : array
        _first : int, default 0
        """

    def call(
        self,
        _program: None,
        numbers: Sequence[float],
        _rooms: Sequence[MemoryRoom],
        _count: int,
    ) -> None:
        """Record the numbers, and end the transfer with _ReceivedError.

        Parameters
        ----------
        _program : None
        numbers : sequence of float or int
            Numbers of the call.
        _rooms : sequence of MemoryRoom
        _count : int
        """
        self.numbers = tuple(numbers)
        raise _ReceivedError

    def wait(self) -> None:
        """Do nothing."""
