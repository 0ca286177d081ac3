"""The entry of hysteresis, and its command."""

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
    """Show the loops between way up and way down, of a study with `continue: both`.

    Of each loop its area, and between which values of the continued axis both ways
    differ. Chains are independent, and links of one are not: intervals are over chains.

    Parameters
    ----------
    study : StoredStudy
    metric : list of str, optional
        By default all metrics of the study.
    over : Over, default Over.last
        Last frames of the links, or means over their second half.

    Returns
    -------
    Report
    """
    from sweep.methods.hysteresis.analysis import find_loops
    from sweep.methods.hysteresis.report import hysteresis_report

    loops = find_loops(study, metric or (), half=over == Over.half)
    return hysteresis_report(study, loops)


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by their names."""
    from sweep.methods.hysteresis.figure import KIND as HYSTERESIS

    return {"hysteresis": HYSTERESIS}


METHOD = Method(
    reports=(hysteresis,), figures=figures, in_figures=("hysteresis_figure",)
)
