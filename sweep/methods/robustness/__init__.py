"""Robustness of numerics: conclusions with other time steps, orders and searches.

analysis  each conclusion in each variant
report    the same as a report
"""

from sweep.methods.robustness.analysis import (
    AS_IT_IS,
    OPEN,
    SURVIVES,
    TURNS,
    UNJUDGED,
    Validity,
    check_conclusions,
    outcome_of,
)
from sweep.methods.robustness.report import (
    validity_report,
)

__all__ = [
    "AS_IT_IS",
    "OPEN",
    "SURVIVES",
    "TURNS",
    "UNJUDGED",
    "Validity",
    "check_conclusions",
    "outcome_of",
    "validity_report",
]
