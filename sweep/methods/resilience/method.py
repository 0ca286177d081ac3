"""The entry of resilience, with its command."""

from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method

if TYPE_CHECKING:
    from sweep.tables import Report, StoredStudy


def resilience(
    study: "StoredStudy",
    metric: Annotated[
        list[str] | None,
        typer.Option(help="Recorded series to report; by default all. Repeatable."),
    ] = None,
    within: Annotated[
        float,
        typer.Option(
            help="Tolerance of a recovery: fraction of the level by which a recovered"
            " metric may differ from the level."
        ),
    ] = 0.1,
) -> "Report":
    """Measure how failures of boids change recorded series.

    Prints the fraction of each metric that remains, the fraction of trials that
    recover, and the time of the recovery. The level of a metric is its mean in the
    trial without failures.

    Each trial with `failing_share` above 0 is compared with the trial of equal seed and
    replicate without failures, for example with sweep: {failing_share: [0, 0.2]}.

    Parameters
    ----------
    study : StoredStudy
    metric : list of str, optional
        Recorded series; by default all.
    within : float, default 0.1
        Tolerance of a recovery: fraction of the level by which a recovered metric may
        differ from the level.

    Returns
    -------
    Report

    Examples
    --------
    sweep resilience my/motors
    sweep resilience my/motors --metric polarization --within 0.2
    """
    from sweep.methods.resilience.analysis import resilience_rows
    from sweep.methods.resilience.report import resilience_report

    rows = resilience_rows(study, metric or (), within=within)
    return resilience_report(study, rows, within)


METHOD = Method(reports=(resilience,))
