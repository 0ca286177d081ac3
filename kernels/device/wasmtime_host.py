"""A device that runs WebAssembly on this processor, by wasmtime.

Trials run in sequence. Each batch has a separate memory, which ends with the batch.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import wasmtime
from numpy.typing import NDArray

from kernels.device.batch import DeviceError, NoRoomError
from kernels.device.kernel import Kernel
from kernels.device.layout import Type
from kernels.device.wasm import NoModuleError, module_of

PAGE = 2**16
RETURNED = 0, -2
"""Statuses of a compiled function that has returned, with or without a value."""
MEMORY = 2**31
"""Most bytes of memory of a module with addresses of 32 bits, as signed integers."""
FINE = 64
"""Arrays begin at multiples of this address."""


class WasmArray(NamedTuple):
    """An array in the memory of a module: the address, and the bytes per number."""

    address: int
    itemsize: int


class Program(NamedTuple):
    """A module with its memory."""

    store: wasmtime.Store
    memory: wasmtime.Memory
    fly: wasmtime.Func
    scratch: int


class Wasm:
    """WebAssembly on this processor; see kernels.device.batch.Device.

    `load` begins with an empty memory: arrays belong to the program that was loaded
    last.
    """

    name = "WebAssembly"

    def __init__(self) -> None:
        config = wasmtime.Config()
        config.wasm_relaxed_simd = False
        self._engine = wasmtime.Engine(config)
        self._modules = dict[bytes, wasmtime.Module]()
        self._program: Program | None = None
        self._top = 0

    def free_bytes(self) -> int:
        """Return the bytes of memory that the next program has."""
        return MEMORY

    def load(self, kernel: Kernel) -> Program:
        """Return the program of a kernel, with an empty memory.

        Raises NoModuleError if the kernel cannot be compiled, or if results may differ
        from the results of a processor.
        """
        module = module_of(kernel)
        if module.refusal:
            raise NoModuleError(f"model {kernel.model.name}: {module.refusal}")
        if module.code not in self._modules:
            self._modules[module.code] = wasmtime.Module(self._engine, module.code)
        store = wasmtime.Store(self._engine)
        needed: Any = self._modules[module.code].imports[0]  # the memory
        limits = wasmtime.Limits(needed.type.limits.min, MEMORY // PAGE)
        memory = wasmtime.Memory(store, wasmtime.MemoryType(limits))
        instance = wasmtime.Instance(store, self._modules[module.code], [memory])
        exports: Any = instance.exports(store)
        self._top = exports["__heap_base"].value(store)
        program = Program(store, memory, exports["fly"], scratch=0)
        self._program = program
        scratch = self.take(2, np.dtype(np.int64)).address
        self._program = program._replace(scratch=scratch)
        return self._program

    def take(self, size: int, kind: Type) -> WasmArray:
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
        store, memory, *_ = self._loaded
        first = -(-self._top // FINE) * FINE
        last = first + size * kind.itemsize
        lacking = last - memory.data_len(store)
        if lacking > 0:
            try:
                memory.grow(store, -(-lacking // PAGE))
            except wasmtime.WasmtimeError as error:
                raise NoRoomError(f"{last:,} bytes of {MEMORY:,}") from error
        self._top = last
        return WasmArray(first, kind.itemsize)

    def give_back(self, room: WasmArray) -> None:
        """Do nothing: the memory ends with its program."""

    def send(self, array: NDArray[Any], room: WasmArray, first: int = 0) -> None:
        """Copy an array into memory.

        Parameters
        ----------
        array : array
        room : WasmArray
            Result of `take`.
        first : int, default 0
            Index in `room` of the first element.
        """
        store, memory, *_ = self._loaded
        memory.write(store, array.tobytes(), room.address + first * room.itemsize)

    def bring(self, room: WasmArray, array: NDArray[Any], first: int = 0) -> None:
        """Copy memory into an array.

        Parameters
        ----------
        room : WasmArray
            Result of `take`.
        array : array
        first : int, default 0
            Index in `room` of the first element.
        """
        store, memory, *_ = self._loaded
        begin = room.address + first * room.itemsize
        content = memory.read(store, begin, begin + array.nbytes)
        array.reshape(-1)[:] = np.frombuffer(content, array.dtype)

    def call(
        self,
        program: Program,
        numbers: Sequence[float],
        rooms: Sequence[WasmArray],
        count: int,
    ) -> None:
        """Run a program for each trial.

        Parameters
        ----------
        program : Program
            Result of `load`.
        numbers : sequence of float or int
            Numbers for all trials.
        rooms : sequence of WasmArray
            Memories for all trials.
        count : int
            Number of trials.
        """
        addresses = [room.address for room in rooms]
        written = (program.scratch, program.scratch + 8)
        for trial in range(count):
            arguments = (*written, trial, *numbers, *addresses)
            try:
                status = program.fly(program.store, *arguments)
            except (wasmtime.Trap, wasmtime.WasmtimeError) as error:
                raise DeviceError(f"WebAssembly: {error}") from error
            if status not in RETURNED:
                raise DeviceError(f"WebAssembly: numba reports the status {status}")

    def wait(self) -> None:
        """Return at once, because each call returns after completion."""

    @property
    def _loaded(self) -> Program:
        if self._program is None:
            raise DeviceError("WebAssembly has no memory before a program is loaded")
        return self._program
