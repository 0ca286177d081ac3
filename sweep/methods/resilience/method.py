"""The entry of resilience, and its command."""

from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method

if TYPE_CHECKING:
    from sweep.tables import Report, StoredStudy


def resilience(
    study: "StoredStudy",
    metric: Annotated[
        list[str] | None,
        typer.Option(help="A recorded series to show; may be repeated."),
    ] = None,
    within: Annotated[
        float,
        typer.Option(help="The part of the level at which a metric has come back."),
    ] = 0.1,
) -> "Report":
    """Show what failures of boids do to recorded series.

    The part that is kept, how many trials come back to the level, and when.

    A trial with `failing_share` above 0 is compared with the one of the same seed and
    replicate in which nobody fails: sweep: {failing_share: [0, 0.2]}.

    Parameters
    ----------
    study : StoredStudy
    metric : list of str, optional
        Recorded series; by default all.
    within : float, default 0.1
        Fraction of the level by which a metric that has come back may differ from it.

    Returns
    -------
    Report
    """
    from sweep.methods.resilience.analysis import resilience_rows
    from sweep.methods.resilience.report import resilience_report

    rows = resilience_rows(study, metric or (), within=within)
    return resilience_report(study, rows, within)


METHOD = Method(reports=(resilience,))
