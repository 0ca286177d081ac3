"""The GPU device, with a driver of which this process is the GPU.

The driver has the functions of cuda.bindings that are called, its types and its errors.
Memory is that of this process, an address the number that the driver has given, and a
launch runs the kernel for each thread whose trial there is.
"""

# ruff: noqa: N802 (the driver's functions have the names that NVIDIA gave them)

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from kernels.device.batch import BOID_STEPS_A_CALL, Batch, DeviceError
from kernels.device.host import Host
from kernels.device.kernel import Kernel
from sweep.design.jobs import Job
from sweep.trial import on_device
from sweep.trial.on_device import flown
from sweep.trial.simulation import run
from tests.builders import fingerprint, job

real: Any = pytest.importorskip(
    "cuda.bindings.driver", reason="the extra `gpu` is not installed"
)
gpu: Any = pytest.importorskip("kernels.device.gpu")
ptx: Any = pytest.importorskip("kernels.device.ptx")
assembly: Any = pytest.importorskip("kernels.device.assembly")

ERROR = real.CUresult
DONE = ERROR.CUDA_SUCCESS
CONTEXT, MODULES, PROGRAMS, DEVICE = 0x1234, 0x5000, 0x6000, 7
FIRST, APART = 2**40, 2**32
"""The first address, and how far apart those of memories are."""
NEEDS = assembly.Needs(registers=255, stack=0, spilled=0, read_back=0)
EXACT = "// remainders of floats: 0\n.visible .entry kernel{}(\n"
FUSED = f"{EXACT}fma.rn.f64 %fd4, %fd2, %fd1, %fd3;\n"


@dataclass
class Driver:
    """A driver of a GPU with so many bytes of memory. A function named in `fails` gives
    that error; `calls` are the names of those called.
    """

    memory: int = 2**28
    gpus: int = 1
    version: int = 1000 * assembly.TOOLKIT
    fails: dict[str, Any] = field(default_factory=dict)
    calls: list[str] = field(default_factory=list)
    held: dict[int, np.ndarray] = field(default_factory=dict)
    kernels: list[Kernel] = field(default_factory=list)
    blocks: list[tuple[int, int]] = field(default_factory=list)

    CUresult, CUdevice_attribute = real.CUresult, real.CUdevice_attribute

    def __getattribute__(self, name: str) -> Any:
        if not name.startswith("cu") or name == "cuGetErrorString":
            return super().__getattribute__(name)
        self.calls.append(name)
        if name in self.fails:
            return lambda *_: (self.fails[name], *[None] * (name != "cuInit"))
        return super().__getattribute__(name)

    def cuInit(self, flags: int) -> tuple[Any]:
        assert flags == 0
        return (DONE,)

    def cuGetErrorString(self, error: Any) -> tuple[Any, bytes]:
        return DONE, f"words of {error.name}".encode()

    def cuDeviceGetCount(self) -> tuple[Any, int]:
        return DONE, self.gpus

    def cuDeviceGet(self, number: int) -> tuple[Any, Any]:
        return DONE, real.CUdevice(DEVICE + number)

    def cuDeviceGetName(self, length: int, device: Any) -> tuple[Any, bytes]:
        assert int(device) == DEVICE
        return DONE, b"Test GPU".ljust(length, b"\0")

    def cuDeviceGetAttribute(self, which: Any, device: Any) -> tuple[Any, int]:
        assert int(device) == DEVICE
        return DONE, {gpu.MAJOR: 9, gpu.MINOR: 0}[which]

    def cuDriverGetVersion(self) -> tuple[Any, int]:
        return DONE, self.version

    def cuDevicePrimaryCtxSetFlags(self, device: Any, flags: int) -> tuple[Any]:
        assert int(device) == DEVICE
        assert flags == gpu.SLEEPS
        return (DONE,)

    def cuDevicePrimaryCtxRetain(self, device: Any) -> tuple[Any, Any]:
        assert int(device) == DEVICE
        return DONE, real.CUcontext(CONTEXT)

    def cuCtxSetCurrent(self, context: Any) -> tuple[Any]:
        assert int(context) == CONTEXT
        return (DONE,)

    def cuMemGetInfo(self) -> tuple[Any, int, int]:
        taken = sum(one.nbytes for one in self.held.values())
        return DONE, self.memory - taken, self.memory

    def cuModuleLoadData(self, image: bytes) -> tuple[Any, Any]:
        return DONE, real.CUmodule(MODULES + int(image.removeprefix(b"code ")))

    def cuModuleGetFunction(self, module: Any, name: bytes) -> tuple[Any, Any]:
        number = int(module) - MODULES
        assert name == f"kernel{number}".encode()
        return DONE, real.CUfunction(PROGRAMS + number)

    def cuMemAlloc(self, size: int) -> tuple[Any, Any]:
        assert size > 0
        if size > self.cuMemGetInfo()[1]:
            return ERROR.CUDA_ERROR_OUT_OF_MEMORY, None
        address = max(self.held, default=FIRST) + APART
        self.held[address] = np.full(size, 0xA5, np.uint8)
        return DONE, real.CUdeviceptr(address)

    def cuMemFree(self, address: int) -> tuple[Any]:
        del self.held[int(address)]
        return (DONE,)

    def _bytes(self, address: int, size: int) -> np.ndarray:
        begin = max(one for one in self.held if one <= address)
        part = self.held[begin][address - begin :][:size]
        assert part.size == size, "beyond the memory that was taken"
        return part

    def cuMemcpyHtoD(self, there: int, here: int, size: int) -> tuple[Any]:
        self._bytes(there, size)[:] = np.frombuffer(ctypes.string_at(here, size), "u1")
        return (DONE,)

    def cuMemcpyDtoH(self, here: int, there: int, size: int) -> tuple[Any]:
        ctypes.memmove(here, self._bytes(there, size).tobytes(), size)
        return (DONE,)

    def cuLaunchKernel(self, program: Any, *given: Any) -> tuple[Any]:
        *sizes, shared, stream, (values, kinds), extra = given
        blocks, threads = sizes[0], sizes[3]
        assert sizes == [blocks, 1, 1, threads, 1, 1]
        assert (shared, stream, extra) == (0, 0, 0)
        self.blocks.append((blocks, threads))
        kernel = self.kernels[int(program) - PROGRAMS]
        held = [kind(value).value for value, kind in zip(values, kinds, strict=True)]
        numbers = held[: len(kernel.numbers)]
        meant = [
            ctypes.c_double if one is float else ctypes.c_int64
            for one in kernel.numbers.values()
        ]
        assert list(kinds) == meant + [ctypes.c_void_p] * len(kernel.arrays)
        addresses = held[len(numbers) :]
        arrays = [
            self.held[address].view(np.dtype(one))
            for address, one in zip(addresses, kernel.arrays.values(), strict=True)
        ]
        fly, count = Host().load(kernel), numbers[list(kernel.numbers).index("count")]
        assert blocks * threads >= count > (blocks - 1) * threads
        for trial in range(count):
            fly(trial, *numbers, *arrays)
        return (DONE,)

    def cuCtxSynchronize(self) -> tuple[Any]:
        return (DONE,)


Make = Callable[..., Driver]


@pytest.fixture
def there(monkeypatch: pytest.MonkeyPatch) -> Make:
    """What makes a driver and puts it in the place of the real one. Kernels are not
    compiled: their machine code is their number.
    """

    def put(text: str = EXACT, **about: Any) -> Driver:
        made = Driver(**about)

        def text_of(kernel: Kernel, capability: tuple[int, int]) -> Any:
            assert capability == (9, 0)
            if kernel not in made.kernels:
                made.kernels.append(kernel)
            return ptx.Compiled(text.format(made.kernels.index(kernel)))

        def code_of(text: str, capability: tuple[int, int], registers: int) -> Any:
            assert capability == (9, 0)
            assert registers in (128, 255)
            number = text.partition("kernel")[2][:1]
            return assembly.Assembled(f"code {number}".encode(), NEEDS)

        monkeypatch.setattr(gpu, "driver", made)
        monkeypatch.setattr(gpu, "ptx_of", text_of)
        monkeypatch.setattr(gpu, "assembled", code_of)
        return made

    return put


def some(count: int, **changes: Any) -> list[Job]:
    """Jobs that differ in a weight and in their seeds."""
    wanted = {"metrics": ("polarization",), "series": ("polarization",)}
    about = {"n": 12, "steps": 20, "every": 3} | wanted | changes
    base = job("vicsek1995", "as_run", **about)
    settings = [base.settings | {"noise": 0.1 * k} for k in range(count)]
    return [
        replace(base, settings=one, seed=base.seed + k, replicate=k)
        for k, one in enumerate(settings)
    ]


def bits(results: Sequence[Any]) -> list[str]:
    return [fingerprint(one) for one in results]


@pytest.mark.parametrize(
    "changes", [{}, {"heatmaps": True, "metrics": ("polarization", "flock_count")}]
)
def test_a_batch_has_the_bits_of_processors(
    there: Make, changes: dict[str, Any]
) -> None:
    """Of more trials than a block has threads, measured there or from frames."""
    driver, jobs = there(), some(70, **changes)
    found = flown(jobs, gpu.Gpu())
    assert bits(found) == bits([run(one) for one in jobs])
    assert set(driver.blocks) == {(2, gpu.THREADS)}
    assert not driver.held


def test_all_calls_of_a_long_flight_are_of_one_program(there: Make) -> None:
    driver, steps = there(), 2 * BOID_STEPS_A_CALL // 12
    device, jobs = gpu.Gpu(), some(2, steps=steps, every=100)
    for _ in range(2):
        assert bits(flown(jobs, device)) == bits([run(one) for one in jobs])
    assert driver.calls.count("cuModuleLoadData") == 1
    assert driver.calls.count("cuModuleGetFunction") == 1
    assert driver.calls.count("cuLaunchKernel") > 2 * 3


def test_a_gpu_says_what_it_is(there: Make) -> None:
    driver = there(memory=1000)
    found = gpu.Gpu()
    about = found.name, found.capability, found.driver, found.free_bytes()
    assert about == ("Test GPU", (9, 0), driver.version, 1000)


def test_blocks_and_registers_may_be_others(there: Make) -> None:
    driver, jobs = there(), some(70)
    device = gpu.Gpu()
    whole = flown(jobs, device)
    device.threads, device.registers = 32, 128
    assert bits(flown(jobs, device)) == bits(whole)
    assert set(driver.blocks) == {(2, 64), (3, 32)}
    assert driver.calls.count("cuModuleLoadData") == 2


def test_without_memory_fewer_fly_at_once(there: Make) -> None:
    """A GPU that says that it has more than it has: batches are halved until they fit,
    and what was taken for those that did not is given back.
    """
    driver, jobs = there(), some(9)
    device = gpu.Gpu()
    whole = flown(jobs, device)
    driver.blocks.clear()
    driver.memory = _batch(jobs[:4]).bytes
    assert bits(flown(jobs, Says(device, 10**9))) == bits(whole)
    assert driver.blocks
    assert driver.calls.count("cuMemAlloc") > driver.calls.count("cuMemFree")
    assert not driver.held


class Says:
    """A device that says that it has so many bytes."""

    def __init__(self, device: Any, free: int) -> None:
        self.device, self.free = device, free

    def __getattr__(self, name: str) -> Any:
        return getattr(self.device, name)

    def free_bytes(self) -> int:
        return self.free


def test_an_error_of_the_driver_has_its_words(there: Make) -> None:
    driver = there(fails={"cuCtxSynchronize": ERROR.CUDA_ERROR_ILLEGAL_ADDRESS})
    with pytest.raises(DeviceError) as error:
        list(_flying(some(3), gpu.Gpu()))
    words = "cuCtxSynchronize: words of CUDA_ERROR_ILLEGAL_ADDRESS"
    assert str(error.value) == words
    assert not driver.held


def test_an_error_at_launch_is_raised(there: Make) -> None:
    driver = there(fails={"cuLaunchKernel": ERROR.CUDA_ERROR_LAUNCH_FAILED})
    with pytest.raises(DeviceError, match="cuLaunchKernel: words of CUDA_ERROR_LAUNCH"):
        list(_flying(some(3), gpu.Gpu()))
    assert not driver.held


def test_memory_that_a_launch_lacks_is_an_error_of_the_device(there: Make) -> None:
    there(fails={"cuLaunchKernel": ERROR.CUDA_ERROR_OUT_OF_MEMORY})
    with pytest.raises(DeviceError, match="cuLaunchKernel: words of"):
        list(_flying(some(3), gpu.Gpu()))


def _batch(jobs: Sequence[Job]) -> Batch:
    prepared = [one for job in jobs if (one := on_device._prepared(job))]
    return on_device._batch(prepared)


def _flying(jobs: Sequence[Job], device: Any) -> Any:
    return _batch(jobs).fly(device, maps=False)


def test_without_a_gpu_there_is_none(there: Make) -> None:
    there(gpus=0)
    with pytest.raises(DeviceError, match="0 GPUs are seen by this process"):
        gpu.Gpu()
    there(fails={"cuInit": ERROR.CUDA_ERROR_NO_DEVICE})
    with pytest.raises(DeviceError, match="cuInit: words of CUDA_ERROR_NO_DEVICE"):
        gpu.Gpu()


def test_an_old_driver_is_refused(there: Make) -> None:
    there(version=12080)
    words = r"Test GPU is of CUDA 12\.8; it must be of CUDA \d+\.0 or later"
    with pytest.raises(DeviceError, match=words):
        gpu.Gpu()


def test_without_a_driver_it_is_said(
    there: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(_self: Driver, _flags: int) -> None:
        raise RuntimeError("libcuda.so.1 cannot be opened")

    there()
    monkeypatch.setattr(Driver, "cuInit", missing)
    with pytest.raises(DeviceError, match=r"no driver .* libcuda.so.1 cannot be"):
        gpu.Gpu()


def test_a_kernel_with_other_bits_is_not_loaded(there: Make) -> None:
    driver = there(text=FUSED)
    with pytest.raises(DeviceError, match="vicsek1995: 1 fused operations"):
        list(_flying(some(1), gpu.Gpu()))
    assert "cuModuleLoadData" not in driver.calls
