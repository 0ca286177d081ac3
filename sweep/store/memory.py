"""Memory that a launch has used and freed goes back to the system.

Arrow and the C library keep what is freed, for what comes next. After the plan of a
million trials that is a hundred megabytes, and what comes next, to run them, is small.
"""

import ctypes
import sys

import pyarrow as pa


def give_back() -> None:
    """Give back what Arrow and, on Linux, the C library keep for later."""
    pa.default_memory_pool().release_unused()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc has it
        if trim:
            trim(0)
