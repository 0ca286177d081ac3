"""The entry of realities, with section and command."""

from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method
from sweep.methods import Confidence, Over, OverOption

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sweep.figures import FigureKind
    from sweep.spec import SpecSection
    from sweep.tables import Report, StoredStudy


def gap(
    study: "StoredStudy",
    metric: Annotated[
        str | None,
        typer.Option(
            help="Metric that is the score; by default the first. coverage+ prefers"
            " high values, coverage- low values."
        ),
    ] = None,
    over: OverOption = Over.last,
    confidence: Confidence = 0.95,
) -> "Report":
    """Estimate the reality gap over sampled realities.

    The spec needs `realities`: imperfections, each with a distribution. A controller is
    a point of `sweep`.

    Prints for each controller the score in the design world and over the realities, the
    drop, the worst tenth of the realities, and the imperfections that explain the
    variance. Prints for each pair the probability that the rank changes.

    Parameters
    ----------
    study : StoredStudy
    metric : str, optional
        Metric that is the score, with the better direction if it is not the declared
        one: `coverage+`, `coverage-`. By default the first recorded metric.
    over : Over, default Over.last
        Last frames, or means over the second half of each trial.
    confidence : float, default 0.95
        Simultaneous confidence of drops and of advantages, and confidence of the other
        intervals.

    Returns
    -------
    Report

    Examples
    --------
    sweep gap my/robots
    sweep gap my/robots --metric polarization --over half
    """
    from sweep.methods.realities.analysis import reality_gap
    from sweep.methods.realities.report import gap_report

    half = over == Over.half
    return gap_report(reality_gap(study, metric, half=half, confidence=confidence))


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.realities.figure import KIND

    return {"gap": KIND}


def sections() -> "Sequence[SpecSection]":
    """Return the section `realities`."""
    from sweep.methods.realities.section import SECTION

    return (SECTION,)


METHOD = Method(
    reports=(gap,),
    figures=figures,
    sections=sections,
    in_figures=("gap_figure",),
)
