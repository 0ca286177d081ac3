"""The entry of hysteresis, with its command."""

from typing import TYPE_CHECKING

from sweep.method import Method
from sweep.methods import Metrics, Over, OverOption

if TYPE_CHECKING:
    from sweep.figures import FigureKind
    from sweep.tables import Report, StoredStudy


def hysteresis(
    study: "StoredStudy",
    metric: Metrics = None,
    over: OverOption = Over.last,
) -> "Report":
    """Measure hysteresis loops (needs `continue: both`).

    Prints the area of each loop, and the range of parameter values in which the
    increasing and the decreasing branch differ. Confidence intervals are over chains,
    because chains are independent and links of a chain are not.

    Parameters
    ----------
    study : StoredStudy
    metric : list of str, optional
        By default all metrics of the study.
    over : Over, default Over.last
        Last frames of the links, or means over the second half of each link.

    Returns
    -------
    Report

    Examples
    --------
    sweep hysteresis my/loop
    sweep hysteresis my/loop --metric polarization --over half
    """
    from sweep.methods.hysteresis.analysis import find_loops
    from sweep.methods.hysteresis.report import hysteresis_report

    loops = find_loops(study, metric or (), half=over == Over.half)
    return hysteresis_report(study, loops)


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.hysteresis.figure import KIND as HYSTERESIS

    return {"hysteresis": HYSTERESIS}


METHOD = Method(
    reports=(hysteresis,), figures=figures, in_figures=("hysteresis_figure",)
)
