"""Refinement: where the mean of a metric crosses a level.

analysis  where the mean crosses a level
report    the same as a report
"""

from sweep.methods.refinement.analysis import (
    Boundary,
    find_boundary,
)
from sweep.methods.refinement.report import (
    boundary_report,
)

__all__ = ["Boundary", "boundary_report", "find_boundary"]
