"""Comparison: what one selection of trials has more or less than another.

sides     trials as a command names them
matching  points that belong together
analysis  what differs between sides
words     the same in words
report    the same as a report
"""

from sweep.methods.comparison.analysis import (
    Comparison,
    Method,
    Together,
    compare_sides,
    contrasts_of,
    judge,
    places_of,
    shared_metrics,
    streams_in_common,
)
from sweep.methods.comparison.matching import (
    Matching,
    match,
    telling,
)
from sweep.methods.comparison.report import (
    comparison_facts,
    comparison_report,
)
from sweep.methods.comparison.sides import (
    Side,
    read_side,
    side_of,
    study_named,
)
from sweep.methods.comparison.words import (
    cells,
    heading,
    notes,
    titles,
)

__all__ = [
    "Comparison",
    "Matching",
    "Method",
    "Side",
    "Together",
    "cells",
    "compare_sides",
    "comparison_facts",
    "comparison_report",
    "contrasts_of",
    "heading",
    "judge",
    "match",
    "notes",
    "places_of",
    "read_side",
    "shared_metrics",
    "side_of",
    "streams_in_common",
    "study_named",
    "telling",
    "titles",
]
