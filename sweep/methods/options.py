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
    Over, typer.Option(help="The last frame, or the mean over the last half.")
]
Metrics = Annotated[
    list[str] | None, typer.Option(help="A metric to show; may be repeated.")
]
Confidence = Annotated[
    float, typer.Option(help="With which all intervals hold together.")
]
Margin = Annotated[
    float | None,
    typer.Option(
        help="Test whether B - A lies within +-margin, in the unit of the metric."
    ),
]
Correction = Annotated[
    Together, typer.Option(help="Correction for many rows; max_t resamples pairs.")
]
