"""The memory of a device before the first step of a trial.

The module of a kernel and an image are sufficient to run the trial. A program takes the
rooms in order, and writes the pieces. Then the program calls `fly` with the numbers of
the image, and once more with the task TAKE for each portion of steps. Elements without
a piece are 0.
"""

from typing import NamedTuple

from kernels.device.batch import Batch
from kernels.device.kernel import ENTER, Kernel


class MemoryRoom(NamedTuple):
    """Memory for an array of a kernel: `size` numbers of `itemsize` bytes."""

    size: int
    itemsize: int


class Piece(NamedTuple):
    """Content of the room `place` from the element `first` on, in bytes."""

    place: int
    first: int
    content: bytes


class MemoryImage(NamedTuple):
    """Memory of a device before the first step of a trial.

    Attributes
    ----------
    kernel : Kernel
        Kernel that runs the trial.
    rooms : tuple of MemoryRoom
        Memory for each array of the kernel, in order.
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
        """Return the bytes of a room, by its index."""
        size, itemsize = self.rooms[place]
        content = bytearray(size * itemsize)
        for piece in self.pieces:
            if piece.place == place:
                begin = piece.first * itemsize
                content[begin : begin + len(piece.content)] = piece.content
        return bytes(content)


def image_of(batch: Batch) -> MemoryImage:
    """Return the memory of a device that has received a batch."""
    arrays = batch.kernel.arrays
    places = {name: place for place, name in enumerate(arrays)}
    received = (
        Piece(places[name], first, array.tobytes())
        for name, first, array in batch.contents()
    )
    return MemoryImage(
        kernel=batch.kernel,
        rooms=tuple(
            MemoryRoom(batch.size(name), kind.itemsize) for name, kind in arrays.items()
        ),
        # Compared as bytes: -0.0 is not zero there.
        pieces=tuple(piece for piece in received if piece.content.strip(b"\0")),
        numbers=batch.numbers(ENTER),
    )
