"""A device that is this processor: flights fly there as on a GPU, from the same large
arrays, one after the other. Tests use it, and whoever looks for a defect.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.device.batch import NoRoomError
from kernels.device.kernel import Kernel
from kernels.device.layout import Type

MEMORY = 2**31
"""The bytes that this device has by default."""


class Host:
    """A device of so many bytes of `memory`; see kernels.device.batch.Device."""

    name = "this processor"

    def __init__(self, memory: int = MEMORY) -> None:
        self.memory = memory
        self._held = 0

    def free_bytes(self) -> int:
        return self.memory - self._held

    def load(self, kernel: Kernel) -> Callable[..., None]:
        return kernel.of_trial

    def take(self, size: int, kind: Type) -> NDArray[Any]:
        room = np.empty(size, kind)
        if room.nbytes > self.free_bytes():
            raise NoRoomError(f"{room.nbytes} bytes of {self.free_bytes()}")
        self._held += room.nbytes
        return room

    def give_back(self, room: NDArray[Any]) -> None:
        self._held -= room.nbytes

    def send(self, array: NDArray[Any], room: NDArray[Any], first: int = 0) -> None:
        room[first : first + array.size] = array.reshape(-1)

    def bring(self, room: NDArray[Any], array: NDArray[Any], first: int = 0) -> None:
        array.reshape(-1)[:] = room[first : first + array.size]

    def call(
        self,
        program: Callable[..., None],
        numbers: Sequence[float],
        rooms: Sequence[NDArray[Any]],
        count: int,
    ) -> None:
        for trial in range(count):
            program(trial, *numbers, *rooms)

    def wait(self) -> None:
        """Calls are over when they return."""
