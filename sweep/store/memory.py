"""What becomes of memory that was used and freed.

Arrow and the C library keep what is freed, for what comes next. After the plan of a
million trials that is a hundred megabytes, and what comes next, to run them, is small:
a launch gives it back. What comes next in a page is as large: it is kept.
"""

import ctypes
import sys

import pyarrow as pa


def keep() -> None:
    """From now on Arrow takes memory from the C library, and so again the memory that
    it has freed. Its own allocator asks the system for new pages, which takes as long
    as reading a study.
    """
    pa.set_memory_pool(pa.system_memory_pool())


def give_back() -> None:
    """Give back what Arrow and, on Linux, the C library keep for later."""
    pa.default_memory_pool().release_unused()
    if sys.platform == "linux":
        trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc has it
        if trim:
            trim(0)
