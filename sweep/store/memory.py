"""Freed memory: kept for later use, or returned to the system.

Arrow and the C library keep freed memory for later use. The plan of a million trials
leaves a hundred megabytes. A launch returns this memory, because running the trials
needs little. The results explorer keeps the memory, because its next step needs as much
again.
"""

import ctypes
import sys

import pyarrow as pa


def keep() -> None:
    """Let Arrow take memory from the C library from now on.

    So Arrow uses freed memory again. The default allocator of Arrow asks the system for
    new pages, which takes as long as reading a study.
    """
    pa.set_memory_pool(pa.system_memory_pool())


def give_back() -> None:
    """Return the unused memory of Arrow and, on Linux, of the C library."""
    pa.default_memory_pool().release_unused()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc has it
        if trim:
            trim(0)
