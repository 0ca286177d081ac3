"""Power: how many replicates a goal needs.

analysis  the replicates of each point
report    the same as a report
"""

from sweep.methods.power.analysis import (
    NOTHING,
    needed_replicates,
)
from sweep.methods.power.report import (
    power_report,
)

__all__ = ["NOTHING", "needed_replicates", "power_report"]
