"""Options of several reports."""

from enum import StrEnum
from typing import Annotated

import typer


class Over(StrEnum):
    """The value of a metric: at the last frame, or the mean over the second half."""

    last = "last"
    half = "half"


class Together(StrEnum):
    """The correction for the many rows of a comparison."""

    holm = "holm"
    bonferroni = "bonferroni"
    max_t = "max_t"


OverOption = Annotated[
    Over,
    typer.Option(
        help="Value of a metric: last frame, or mean over the second half of a trial"
        " (over all frames of an event of a recording)."
    ),
]
Metrics = Annotated[
    list[str] | None,
    typer.Option(help="Metric to report; by default all metrics. Repeatable."),
]
Confidence = Annotated[
    float, typer.Option(help="Simultaneous confidence level of all rows.")
]
Margin = Annotated[
    float | None,
    typer.Option(
        help="Equivalence margin in the unit of the metric: tests whether B - A is"
        " between -margin and +margin."
    ),
]
Correction = Annotated[
    Together,
    typer.Option(
        "--together",
        "--correction",
        help="Correction for multiple comparisons; max_t is a bootstrap of pairs.",
    ),
]
