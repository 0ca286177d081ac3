"""Machine code of a GPU, assembled from PTX.

NVIDIA's linker, nvJitLink, assembles. A driver could assemble too, with two drawbacks.
First, a driver does not know the PTX of a newer compiler, but runs machine code of any
toolkit of equal major version. Second, each process would assemble again. nvJitLink
needs neither a GPU nor a driver, so that any machine can test the code that GPUs run.
Assembling does not change results, because PTX states how each operation is rounded.
"""

import hashlib
import re
from typing import NamedTuple

import numpy as np
from cuda.bindings import nvjitlink
from numpy.typing import NDArray

from kernels.caching import kept
from kernels.device.batch import DeviceError

OPTIONS = ("-verbose", "-Xptxas=-v")
"""Options of the assembler: report the resources of the code."""
TOOLKIT: int = nvjitlink.version()[0]
"""Major version of CUDA of the assembler.

Drivers of earlier versions do not run the code.
"""
MOST_REGISTERS = 255
"""Maximum number of registers of a thread, of 32 bits each, on any GPU."""
NEEDS = re.compile(
    r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads"
)
REGISTERS = re.compile(r"Used (\d+) registers")


class AssemblyError(DeviceError):
    """Error of the assembler, with the message of the assembler."""


class Needs(NamedTuple):
    """Resources of a thread, as reported by the assembler.

    `stack` is the size of the stack in bytes. `spilled` and `read_back` are the bytes
    that the code writes to the stack and reads again for lack of registers (spills).
    """

    registers: int
    stack: int
    spilled: int
    read_back: int


class Assembled(NamedTuple):
    """Machine code, and the resources that a thread needs to run it."""

    code: bytes
    needs: Needs


def assembled(
    text: str, capability: tuple[int, int], registers: int = MOST_REGISTERS
) -> Assembled:
    """Return the machine code of PTX, stored in the folder of compiled kernels.

    Parameters
    ----------
    text : str
        PTX.
    capability : tuple of int
        Compute capability of the GPU, for example ``(9, 0)``.
    registers : int, default MOST_REGISTERS
        Maximum number of registers of a thread. With fewer registers, more trials run
        at once, and each trial keeps more values in memory.

    Raises
    ------
    AssemblyError
        If the assembler rejects the text.
    """
    parts = text, capability, registers, OPTIONS, nvjitlink.version()
    name = hashlib.sha256(repr(parts).encode()).hexdigest()[:48]

    def make() -> bytes:
        fresh = assemble(text, capability, registers)
        return b"%d %d %d %d\n" % fresh.needs + fresh.code

    needs, _, code = kept(f"{name}.cubin", make).partition(b"\n")
    return Assembled(code, Needs(*map(int, needs.split())))


def assemble(
    text: str, capability: tuple[int, int], registers: int = MOST_REGISTERS
) -> Assembled:
    """Assemble PTX, which takes seconds, and return the machine code.

    Parameters
    ----------
    text : str
        PTX.
    capability : tuple of int
        Compute capability of the GPU.
    registers : int, default MOST_REGISTERS
        Maximum number of registers of a thread.

    Raises
    ------
    AssemblyError
        If the assembler rejects the text.
    """
    options = ["-arch=sm_{}{}".format(*capability), f"-maxrregcount={registers}"]
    options += OPTIONS
    ptx = text.encode("ascii")
    try:
        handle = nvjitlink.create(len(options), options)
    except nvjitlink.nvJitLinkError as error:
        raise AssemblyError(f"{options[0]}: {error}") from error
    try:
        kind = nvjitlink.InputType.PTX
        nvjitlink.add_data(handle, kind, ptx, len(ptx), name="kernel.ptx")
        nvjitlink.complete(handle)
        code = np.empty(nvjitlink.get_linked_cubin_size(handle), np.uint8)
        nvjitlink.get_linked_cubin(handle, code)
        log = np.empty(nvjitlink.get_info_log_size(handle), np.uint8)
        nvjitlink.get_info_log(handle, log)
    except nvjitlink.nvJitLinkError as error:
        log = np.empty(nvjitlink.get_error_log_size(handle), np.uint8)
        nvjitlink.get_error_log(handle, log)
        raise AssemblyError(f"{error}: {_words(log)}") from error
    finally:
        nvjitlink.destroy(handle)
    return Assembled(code.tobytes(), _needs(_words(log)))


def _words(log: NDArray[np.uint8]) -> str:
    return log.tobytes().rstrip(b"\0").decode(errors="replace").strip()


def _needs(log: str) -> Needs:
    """Return the total resources of all functions of a text, calls included.

    The number of registers is the maximum, and the sizes are sums. Usually there is a
    single function, because the compiler inlines all calls.
    """
    registers = max(map(int, REGISTERS.findall(log)))
    frames = [tuple(map(int, frame)) for frame in NEEDS.findall(log)]
    return Needs(registers, *map(sum, zip(*frames, strict=True)))
