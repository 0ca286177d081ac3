"""The entry of conclusions with different numerics, with section and command."""

from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method
from sweep.methods import Confidence, Over, OverOption

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sweep.figures import FigureKind
    from sweep.spec import SpecSection
    from sweep.tables import Report, StoredStudy


def validity(
    study: "StoredStudy",
    metric: Annotated[
        list[str] | None,
        typer.Option(help="Metric to check; by default all metrics. Repeatable."),
    ] = None,
    over: OverOption = Over.last,
    confidence: Confidence = 0.95,
) -> "Report":
    """Check whether conclusions depend on the numerics.

    The spec needs `validate`: different time steps, neighbour search or update order.

    A conclusion is the sign of the difference between a point and the first point along
    an axis. Each conclusion survives, turns, or is not decided.

    Parameters
    ----------
    study : StoredStudy
    metric : list of str, optional
        By default all metrics of the study.
    over : Over, default Over.last
        Last frames, or means over the second half of each trial.
    confidence : float, default 0.95
        Simultaneous confidence of all intervals.

    Returns
    -------
    Report

    Examples
    --------
    sweep validity my/first
    sweep validity my/first --metric speed --over half
    """
    from sweep.methods.robustness.analysis import check_conclusions
    from sweep.methods.robustness.report import validity_report

    half = over == Over.half
    checked = check_conclusions(study, metric or (), half=half, confidence=confidence)
    return validity_report(checked)


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.robustness.figure import KIND as VALIDITY

    return {"validity": VALIDITY}


def sections() -> "Sequence[SpecSection]":
    """Return the section `validate`."""
    from sweep.methods.robustness.variants import SECTION

    return (SECTION,)


METHOD = Method(
    reports=(validity,),
    figures=figures,
    in_figures=("validity_figure",),
    sections=sections,
)
