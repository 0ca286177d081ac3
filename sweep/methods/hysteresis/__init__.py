"""Hysteresis: loops between the way up and the way down of chains.

analysis  loops, and their area
report    the same as a report
"""

from sweep.methods.hysteresis.analysis import (
    FoundLoop,
    find_loops,
    loop_rows,
)
from sweep.methods.hysteresis.report import (
    hysteresis_report,
)

__all__ = ["FoundLoop", "find_loops", "hysteresis_report", "loop_rows"]
