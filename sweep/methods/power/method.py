"""The entry of statistical power, with its command."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method
from sweep.methods import Over, OverOption

if TYPE_CHECKING:
    from sweep.store import Location
    from sweep.tables import Report


def power(
    a: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help="Pilot study, and side A of a difference: STUDY,"
            " STUDY:parameter=value[,...], or STUDY:PRESET.",
        ),
    ],
    b: Annotated[
        str | None,
        typer.Argument(
            metavar="B",
            help=(
                "Side B of a difference, in the form of A; by default each further"
                " point of A is compared with the first point of A."
            ),
        ),
    ] = None,
    results: "Location" = Path("results"),
    half_width: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=SIZE",
            help=(
                "Half-width of the 95 % confidence interval of a mean: speed=0.05 in"
                " the unit of the metric, or speed=5% of the mean. Repeatable."
            ),
        ),
    ] = None,
    difference: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=SIZE",
            help=(
                "True difference that sweep compare detects: speed=0.05 in the unit of"
                " the metric, or speed=5% of the mean of A. Repeatable."
            ),
        ),
    ] = None,
    chance: Annotated[
        float,
        typer.Option(
            "--chance",
            "--power",
            help="Statistical power: probability of reaching a goal, from 0.5 to 0.99.",
        ),
    ] = 0.8,
    over: OverOption = Over.last,
) -> "Report":
    """Estimate the replicates you need from a pilot study.

    The stored trials of A are the pilot. A goal is a half-width of a confidence
    interval, or a difference to detect. At least one goal is required.

    Parameters
    ----------
    a : str
        The pilot, see `sweep.methods.comparison.side_of`.
    b : str, optional
        Side B of differences, in the form of A. By default the first point of A is
        compared with each further point of A.
    results : Location, default Path("results")
        Folder of stored studies.
    half_width, difference : list of str, optional
        Goals such as "speed=0.05", or "speed=5%" for a fraction of the mean.
    chance : float, default 0.8
        Probability of reaching a goal, from 0.5 to 0.99.
    over : Over, default Over.last
        Last frames, or means over the second half of each trial.

    Returns
    -------
    Report

    Examples
    --------
    sweep power my/pilot --half-width speed=5%
    sweep power my/pilot --difference speed=0.5 --power 0.9
    """
    from sweep.methods.comparison import read_side
    from sweep.methods.power.analysis import needed_replicates
    from sweep.methods.power.report import power_report

    needed = needed_replicates(
        read_side(a, results),
        None if b is None else read_side(b, results),
        half_widths=half_width or [],
        differences=difference or [],
        half=over == Over.half,
        chance=chance,
    )
    return power_report(needed)


METHOD = Method(reports_of_results=(power,))
