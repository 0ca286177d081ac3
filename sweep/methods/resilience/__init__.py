"""Resilience: what failures of boids do to recorded series.

analysis  what is kept, and who comes back
report    the same as a report
"""

from sweep.methods.resilience.analysis import (
    resilience_rows,
)
from sweep.methods.resilience.report import (
    resilience_report,
)

__all__ = ["resilience_report", "resilience_rows"]
