"""A device that is an NVIDIA GPU, by the driver's own functions.

Each process has one. Calls are begun one after the other, and return before they are
over. After an error of the driver nothing more can be done in this process.
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
"""In a block. A flight needs all registers of a thread, so that few blocks fit."""
DONE = driver.CUresult.CUDA_SUCCESS
NO_ROOM = driver.CUresult.CUDA_ERROR_OUT_OF_MEMORY
MAJOR = driver.CUdevice_attribute.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR
MINOR = driver.CUdevice_attribute.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR
SLEEPS = driver.CUctx_flags.CU_CTX_SCHED_BLOCKING_SYNC.value
"""A process that waits for the GPU leaves its core to others, which prepare trials."""
NAME_LENGTH = 256
KINDS = {int: ctypes.c_int64, float: ctypes.c_double}


class There(NamedTuple):
    """Memory of a GPU: where it begins, and the bytes of a number."""

    address: int
    itemsize: int


class Gpu:
    """The GPU `number` of those that this process sees. Kernels are run with so many
    `threads` in a block, and so many `registers` of a thread at most. Raises
    DeviceError where there is none.
    """

    threads, registers = THREADS, MOST_REGISTERS

    def __init__(self, number: int = 0) -> None:
        try:
            self._ask("cuInit", 0)
        except RuntimeError as error:  # how cuda.bindings says that it finds no driver
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
            int(self._ask("cuDeviceGetAttribute", one, device))
            for one in (MAJOR, MINOR)
        )
        self.capability = major, minor
        self._device, self._is_ready = device, False
        self._programs = dict[tuple[str, int], Any]()

    def _begin(self) -> None:
        """Have the GPU know this process, which takes some memory of it; who only asks
        what it is does not need that.
        """
        if not self._is_ready:
            self._ask("cuDevicePrimaryCtxSetFlags", self._device, SLEEPS)
            context = self._ask("cuDevicePrimaryCtxRetain", self._device)
            self._ask("cuCtxSetCurrent", context)
            self._is_ready = True

    def free_bytes(self) -> int:
        self._begin()
        free, _total = self._ask("cuMemGetInfo")
        return int(free)

    def load(self, kernel: Kernel) -> Any:
        """Raises NotForDeviceError also for a kernel that would not have the bits of a
        processor.
        """
        self._begin()
        compiled = ptx_of(kernel, self.capability)
        if compiled.refusal:
            raise NotForDeviceError(f"model {kernel.model.name}: {compiled.refusal}")
        key = compiled.text, self.registers
        if key not in self._programs:
            made = assembled(compiled.text, self.capability, self.registers)
            module = self._ask("cuModuleLoadData", made.code)
            entry = compiled.entry.encode()
            self._programs[key] = self._ask("cuModuleGetFunction", module, entry)
        return self._programs[key]

    def take(self, size: int, kind: Type) -> There:
        self._begin()
        return There(int(self._ask("cuMemAlloc", size * kind.itemsize)), kind.itemsize)

    def give_back(self, room: There) -> None:
        driver.cuMemFree(room.address)  # after an error it goes with the process

    def send(self, array: NDArray[Any], room: There, first: int = 0) -> None:
        array = np.ascontiguousarray(array)
        if array.size:
            there = room.address + first * room.itemsize
            self._ask("cuMemcpyHtoD", there, array.ctypes.data, array.nbytes)

    def bring(self, room: There, array: NDArray[Any], first: int = 0) -> None:
        if array.size:
            there = room.address + first * room.itemsize
            self._ask("cuMemcpyDtoH", array.ctypes.data, there, array.nbytes)

    def call(
        self,
        program: Any,
        numbers: Sequence[float],
        rooms: Sequence[There],
        count: int,
    ) -> None:
        given = (*numbers, *(room.address for room in rooms))
        kinds = *(KINDS[type(one)] for one in numbers), *[ctypes.c_void_p] * len(rooms)
        blocks = -(-count // self.threads)
        where = *(blocks, 1, 1), *(self.threads, 1, 1), 0, 0
        self._ask("cuLaunchKernel", program, *where, (given, kinds), 0)

    def wait(self) -> None:
        self._ask("cuCtxSynchronize")

    def _ask(self, function: str, *given: Any) -> Any:
        """What a function of the driver gives back besides its error."""
        error, *found = getattr(driver, function)(*given)
        if error == NO_ROOM and function == "cuMemAlloc":
            raise NoRoomError("the GPU has no memory left")
        if error != DONE:
            _, words = driver.cuGetErrorString(error)
            raise DeviceError(f"{function}: {words.decode() if words else error}")
        return found[0] if len(found) == 1 else tuple(found)
