"""Finite-size scaling: what flocks of several sizes tell of a transition.

analysis  what each size tells, crossings, collapse
report    the same as a report
"""

from sweep.methods.scaling.analysis import (
    CURVES,
    DRIFTS,
    LENGTHS,
    Scaling,
    finite_size_scaling,
)
from sweep.methods.scaling.report import (
    scaling_report,
)

__all__ = [
    "CURVES",
    "DRIFTS",
    "LENGTHS",
    "Scaling",
    "finite_size_scaling",
    "scaling_report",
]
