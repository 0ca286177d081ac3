"""What B has more or less than A: its entry, and its command."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method
from sweep.methods.options import (
    Confidence,
    Correction,
    Margin,
    Over,
    OverOption,
    Together,
)

if TYPE_CHECKING:
    from sweep.store.locations import Location
    from sweep.tables.reports import Report


def compare(
    a: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help="STUDY, STUDY:setting=value[,setting=value], or STUDY:PRESET.",
        ),
    ],
    b: Annotated[
        str,
        typer.Argument(metavar="B", help="What is compared with it, written alike."),
    ],
    results: "Location" = Path("results"),
    metric: Annotated[
        list[str] | None, typer.Option(help="A metric to compare; may be repeated.")
    ] = None,
    over: OverOption = Over.last,
    margin: Margin = None,
    confidence: Confidence = 0.95,
    together: Correction = Together.holm,
) -> "Report":
    """What B has more or less than A, point by point: differences with intervals, p and
    a verdict.

    Points that agree in all that varies are compared, their trials in pairs where they
    share random numbers.
    """
    from sweep.methods.comparison.analysis import Inference, compare_sides
    from sweep.methods.comparison.report import comparison_report
    from sweep.methods.comparison.sides import read_side

    inference = Inference(confidence, together.value, margin)
    found = compare_sides(
        read_side(a, results),
        read_side(b, results),
        metric or (),
        half=over == Over.half,
        method=inference,
    )
    return comparison_report(found)


METHOD = Method(reports_of_results=(compare,))
