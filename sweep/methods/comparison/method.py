"""The entry of the comparison, with its command."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method
from sweep.methods import (
    Confidence,
    Correction,
    Margin,
    Over,
    OverOption,
    Together,
)

if TYPE_CHECKING:
    from sweep.store import Location
    from sweep.tables import Report


def compare(
    a: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help="Side A: STUDY, STUDY:parameter=value[,parameter=value], or"
            " STUDY:PRESET.",
        ),
    ],
    b: Annotated[
        str,
        typer.Argument(
            metavar="B", help="Side B, in the form of A. Differences are B - A."
        ),
    ],
    results: "Location" = Path("results"),
    metric: Annotated[
        list[str] | None,
        typer.Option(
            help="Metric to compare; by default all shared metrics. Repeatable."
        ),
    ] = None,
    over: OverOption = Over.last,
    margin: Margin = None,
    confidence: Confidence = 0.95,
    together: Correction = Together.holm,
) -> "Report":
    """Compare two studies or groups of points by each metric.

    Prints differences B - A with simultaneous confidence intervals, adjusted p-values,
    effect sizes and verdicts. Points are matched by the parameters that vary. Trials
    are compared in pairs if they share random numbers.

    Parameters
    ----------
    a, b : str
        The two sides, see `sweep.methods.comparison.side_of`.
    results : Location, default Path("results")
        Folder of stored studies.
    metric : list of str, optional
        By default all metrics that the two sides recorded.
    over : Over, default Over.last
        Last frames, or means over the second half of each trial.
    margin : float, optional
        Equivalence margin, in the unit of the metric.
    confidence : float, default 0.95
        Simultaneous confidence of all intervals.
    together : Together, default Together.holm
        Correction for multiple comparisons.

    Returns
    -------
    Report

    Examples
    --------
    sweep compare my/first:separation_weight=0.5 my/first:separation_weight=2
    sweep compare my/first my/second --metric speed --margin 0.1
    """
    from sweep.methods.comparison.analysis import Inference, compare_sides
    from sweep.methods.comparison.report import comparison_report
    from sweep.methods.comparison.sides import read_side

    inference = Inference(confidence, together.value, margin)
    comparison = compare_sides(
        read_side(a, results),
        read_side(b, results),
        metric or (),
        half=over == Over.half,
        method=inference,
    )
    return comparison_report(comparison)


METHOD = Method(reports_of_results=(compare,))
