"""A device that is an NVIDIA GPU, by functions of the driver.

Each process has one device. Calls begin in sequence, and return before completion.
After an error of the driver, the process cannot use the GPU any more.
"""

import ctypes
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from cuda.bindings import driver
from numpy.typing import NDArray

from kernels.device.assembly import MOST_REGISTERS, TOOLKIT, assembled
from kernels.device.batch import DeviceError, NoRoomError
from kernels.device.kernel import Kernel
from kernels.device.layout import Type
from kernels.device.ptx import VERSIONS, NotForDeviceError, ptx_of

THREADS = 64
"""Threads per block.

A trial needs all registers of a thread, so that few blocks fit on a GPU.
"""
DONE = driver.CUresult.CUDA_SUCCESS
NO_ROOM = driver.CUresult.CUDA_ERROR_OUT_OF_MEMORY
MAJOR = driver.CUdevice_attribute.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR
MINOR = driver.CUdevice_attribute.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR
SLEEPS = driver.CUctx_flags.CU_CTX_SCHED_BLOCKING_SYNC.value
"""Flag by which a process that waits for the GPU frees the core for other work."""
NAME_LENGTH = 256
KINDS = {int: ctypes.c_int64, float: ctypes.c_double}


class There(NamedTuple):
    """Memory of a GPU: the address, and the bytes per number."""

    address: int
    itemsize: int


class Gpu:
    """GPU `number` among the GPUs that are visible to this process.

    `threads` is the number of threads per block, and `registers` the maximum number of
    registers per thread. Raises DeviceError if the GPU does not exist, or if the driver
    is too old.
    """

    threads = THREADS
    registers = MOST_REGISTERS

    def __init__(self, number: int = 0) -> None:
        try:
            self._ask("cuInit", 0)
        except RuntimeError as error:  # cuda.bindings has found no driver
            raise DeviceError(f"no driver of a GPU is found: {error}") from error
        count = self._ask("cuDeviceGetCount")
        if number >= count:
            raise DeviceError(f"{count} GPUs are seen by this process")
        device = self._ask("cuDeviceGet", number)
        name: bytes = self._ask("cuDeviceGetName", NAME_LENGTH, device)
        self.versions = VERSIONS
        self.name = name.rstrip(b"\0").decode()
        self.driver = int(self._ask("cuDriverGetVersion"))
        if self.driver < 1000 * TOOLKIT:
            known = f"{self.driver // 1000}.{self.driver % 1000 // 10}"
            raise DeviceError(
                f"the driver of {self.name} is of CUDA {known}; it must be of CUDA"
                f" {TOOLKIT}.0 or later"
            )
        major, minor = (
            int(self._ask("cuDeviceGetAttribute", part, device))
            for part in (MAJOR, MINOR)
        )
        self.capability = major, minor
        self._device = device
        self._is_ready = False
        self._programs = dict[tuple[str, int], Any]()

    def _begin(self) -> None:
        """Open the context of this process on the GPU.

        The context takes memory of the GPU. Queries of properties need no context.
        """
        if not self._is_ready:
            self._ask("cuDevicePrimaryCtxSetFlags", self._device, SLEEPS)
            context = self._ask("cuDevicePrimaryCtxRetain", self._device)
            self._ask("cuCtxSetCurrent", context)
            self._is_ready = True

    def free_bytes(self) -> int:
        """Return the bytes of memory that are free."""
        self._begin()
        free, _total = self._ask("cuMemGetInfo")
        return int(free)

    def load(self, kernel: Kernel) -> Any:
        """Return the program of a kernel.

        Raises NotForDeviceError if the kernel has no PTX, or if results of the PTX may
        differ from the results of a processor.
        """
        self._begin()
        compiled = ptx_of(kernel, self.capability)
        if compiled.refusal:
            raise NotForDeviceError(f"model {kernel.model.name}: {compiled.refusal}")
        key = compiled.text, self.registers
        if key not in self._programs:
            machine = assembled(compiled.text, self.capability, self.registers)
            module = self._ask("cuModuleLoadData", machine.code)
            entry = compiled.entry.encode()
            self._programs[key] = self._ask("cuModuleGetFunction", module, entry)
        return self._programs[key]

    def take(self, size: int, kind: Type) -> There:
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
        self._begin()
        return There(int(self._ask("cuMemAlloc", size * kind.itemsize)), kind.itemsize)

    def give_back(self, room: There) -> None:
        """Free memory."""
        driver.cuMemFree(room.address)  # after an error, memory is freed at exit

    def send(self, array: NDArray[Any], room: There, first: int = 0) -> None:
        """Copy an array into memory of the GPU.

        Parameters
        ----------
        array : array
        room : There
            Result of `take`.
        first : int, default 0
            Index in `room` of the first element.
        """
        array = np.ascontiguousarray(array)
        if array.size:
            address = room.address + first * room.itemsize
            self._ask("cuMemcpyHtoD", address, array.ctypes.data, array.nbytes)

    def bring(self, room: There, array: NDArray[Any], first: int = 0) -> None:
        """Copy memory of the GPU into an array.

        Parameters
        ----------
        room : There
            Result of `take`.
        array : array
        first : int, default 0
            Index in `room` of the first element.
        """
        if array.size:
            address = room.address + first * room.itemsize
            self._ask("cuMemcpyDtoH", array.ctypes.data, address, array.nbytes)

    def call(
        self,
        program: Any,
        numbers: Sequence[float],
        rooms: Sequence[There],
        count: int,
    ) -> None:
        """Begin to run a program for each trial, after all earlier calls.

        Parameters
        ----------
        program : function of the driver
            Result of `load`.
        numbers : sequence of float or int
            Numbers for all trials.
        rooms : sequence of There
            Memories for all trials.
        count : int
            Number of trials.
        """
        arguments = (*numbers, *(room.address for room in rooms))
        kinds = (
            *(KINDS[type(number)] for number in numbers),
            *[ctypes.c_void_p] * len(rooms),
        )
        blocks = -(-count // self.threads)
        sizes = *(blocks, 1, 1), *(self.threads, 1, 1)
        launch = *sizes, 0, 0, (arguments, kinds), 0
        self._ask("cuLaunchKernel", program, *launch)

    def wait(self) -> None:
        """Return when all calls are complete."""
        self._ask("cuCtxSynchronize")

    def _ask(self, function: str, *arguments: Any) -> Any:
        """Call a function of the driver, and return the results without the error code.

        Raises NoRoomError or DeviceError after an error.
        """
        error, *results = getattr(driver, function)(*arguments)
        if error == NO_ROOM and function == "cuMemAlloc":
            raise NoRoomError("the GPU has no memory left")
        if error != DONE:
            _, words = driver.cuGetErrorString(error)
            raise DeviceError(f"{function}: {words.decode() if words else error}")
        return results[0] if len(results) == 1 else tuple(results)
