"""What the instructions of a GPU's text are assembled to: its machine code.

A driver could assemble the text too. But it knows no text of a compiler that is newer
than itself, while it runs the machine code of any toolkit of its major version; and
each process would have it assembled anew. NVIDIA's linker, nvJitLink, needs neither a
GPU nor its driver, so that this is tested anywhere, and what is tested is what flies.
It may not change what an operation gives: the text says how each is rounded.
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
"""Of the assembler: that it says what it has made."""
TOOLKIT: int = nvjitlink.version()[0]
"""The major version of CUDA of which the assembler is: drivers of earlier ones do not
run its code.
"""
MOST_REGISTERS = 255
"""Of a thread, of 32 bits each, in all GPUs that there are."""
NEEDS = re.compile(
    r"(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads"
)
REGISTERS = re.compile(r"Used (\d+) registers")


class AssemblyError(DeviceError):
    """The assembler refuses a text; the message is its own."""


class Needs(NamedTuple):
    """What a thread needs, in the assembler's own words: its registers; the bytes of
    its stack; and the bytes that its text writes there and reads again since it has no
    register for them (spills).
    """

    registers: int
    stack: int
    spilled: int
    read_back: int


class Assembled(NamedTuple):
    """Machine code, and what a thread needs to run it."""

    code: bytes
    needs: Needs


def assembled(
    text: str, capability: tuple[int, int], registers: int = MOST_REGISTERS
) -> Assembled:
    """The machine code of a text for GPUs of this kind, which is kept. A thread has so
    many registers at most; with fewer, more threads fly at once, and each has more in
    its memory. Raises AssemblyError.
    """
    parts = text, capability, registers, OPTIONS, nvjitlink.version()
    name = hashlib.sha256(repr(parts).encode()).hexdigest()[:48]

    def make() -> bytes:
        made = assemble(text, capability, registers)
        return b"%d %d %d %d\n" % made.needs + made.code

    needs, _, code = kept(f"{name}.cubin", make).partition(b"\n")
    return Assembled(code, Needs(*map(int, needs.split())))


def assemble(
    text: str, capability: tuple[int, int], registers: int = MOST_REGISTERS
) -> Assembled:
    """What is kept by `assembled`, made now: some seconds."""
    given = ["-arch=sm_{}{}".format(*capability), f"-maxrregcount={registers}"]
    given += OPTIONS
    ptx = text.encode("ascii")
    try:
        handle = nvjitlink.create(len(given), given)
    except nvjitlink.nvJitLinkError as error:
        raise AssemblyError(f"{given[0]}: {error}") from error
    try:
        kind = nvjitlink.InputType.PTX
        nvjitlink.add_data(handle, kind, ptx, len(ptx), "kernel.ptx")
        nvjitlink.complete(handle)
        code = np.empty(nvjitlink.get_linked_cubin_size(handle), np.uint8)
        nvjitlink.get_linked_cubin(handle, code)
        said = np.empty(nvjitlink.get_info_log_size(handle), np.uint8)
        nvjitlink.get_info_log(handle, said)
    except nvjitlink.nvJitLinkError as error:
        said = np.empty(nvjitlink.get_error_log_size(handle), np.uint8)
        nvjitlink.get_error_log(handle, said)
        raise AssemblyError(f"{error}: {_words(said)}") from error
    finally:
        nvjitlink.destroy(handle)
    return Assembled(code.tobytes(), _needs(_words(said)))


def _words(said: NDArray[np.uint8]) -> str:
    return said.tobytes().rstrip(b"\0").decode(errors="replace").strip()


def _needs(said: str) -> Needs:
    """Of all functions of a text together, so that no call of one is missed: it has one
    where the compiler has put all others into it.
    """
    registers = max(map(int, REGISTERS.findall(said)))
    frames = [tuple(map(int, one)) for one in NEEDS.findall(said)]
    return Needs(registers, *map(sum, zip(*frames, strict=True)))
