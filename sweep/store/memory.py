"""Memory that was used and freed.

Arrow and the C library keep what is freed, for what comes next. After the plan of a
million trials that is a hundred megabytes, and what comes next, to run them, is small:
a launch gives it back. What comes next in the results explorer is as large: it is kept.
"""

import ctypes
import sys

import pyarrow as pa


def keep() -> None:
    """Let Arrow take memory from the C library from now on.

    So it takes the memory again that it has freed. Its own allocator asks the system
    for new pages, which takes as long as reading a study.
    """
    pa.set_memory_pool(pa.system_memory_pool())


def give_back() -> None:
    """Give back what Arrow and, on Linux, the C library keep for later."""
    pa.default_memory_pool().release_unused()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc has it
        if trim:
            trim(0)
