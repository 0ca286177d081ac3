"""The memory that a process has held at most."""

import resource
import sys
from pathlib import Path

STATUS = Path("/proc/self/status")


def most_megabytes() -> int:
    """Of this process, in MB. What `resource` says counts, on Linux, what the process
    that has started it held then.
    """
    if STATUS.exists():
        [line] = [one for one in STATUS.read_text().split("\n") if "VmHWM" in one]
        return int(line.split()[1]) // 1024
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most // (1024 * 1024 if sys.platform == "darwin" else 1024)
