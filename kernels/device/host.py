"""A device that is this processor, for tests and for debugging.

Trials run in sequence, from large arrays as on a GPU.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.device.batch import NoRoomError
from kernels.device.kernel import Kernel
from kernels.device.layout import Type

MEMORY = 2**31
"""Bytes of memory of this device by default."""


class Host:
    """Device with `memory` bytes; see kernels.device.batch.Device."""

    name = "this processor"

    def __init__(self, memory: int = MEMORY) -> None:
        self.memory = memory
        self._held = 0

    def free_bytes(self) -> int:
        """Return the bytes that are not taken."""
        return self.memory - self._held

    def load(self, kernel: Kernel) -> Callable[..., None]:
        """Return the function that runs one trial."""
        return kernel.of_trial

    def take(self, size: int, kind: Type) -> NDArray[Any]:
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
        room = np.empty(size, kind)
        if room.nbytes > self.free_bytes():
            raise NoRoomError(f"{room.nbytes} bytes of {self.free_bytes()}")
        self._held += room.nbytes
        return room

    def give_back(self, room: NDArray[Any]) -> None:
        """Free memory."""
        self._held -= room.nbytes

    def send(self, array: NDArray[Any], room: NDArray[Any], first: int = 0) -> None:
        """Copy an array into memory.

        Parameters
        ----------
        array : array
        room : array (E,)
            Memory from `take`.
        first : int, default 0
            Index in `room` of the first element.
        """
        room[first : first + array.size] = array.reshape(-1)

    def bring(self, room: NDArray[Any], array: NDArray[Any], first: int = 0) -> None:
        """Copy memory into an array.

        Parameters
        ----------
        room : array (E,)
            Memory from `take`.
        array : array
        first : int, default 0
            Index in `room` of the first element.
        """
        array.reshape(-1)[:] = room[first : first + array.size]

    def call(
        self,
        program: Callable[..., None],
        numbers: Sequence[float],
        rooms: Sequence[NDArray[Any]],
        count: int,
    ) -> None:
        """Run a program for each trial.

        Parameters
        ----------
        program : function
            Result of `load`.
        numbers : sequence of float or int
            Numbers for all trials.
        rooms : sequence of array
            Memories for all trials.
        count : int
            Number of trials.
        """
        for trial in range(count):
            program(trial, *numbers, *rooms)

    def wait(self) -> None:
        """Return at once, because each call returns after completion."""
