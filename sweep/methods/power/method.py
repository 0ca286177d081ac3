"""The entry of statistical power, and its command."""

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
            help="The pilot: STUDY, STUDY:setting=value[,...], or STUDY:PRESET.",
        ),
    ],
    b: Annotated[
        str | None,
        typer.Argument(
            metavar="B",
            help=(
                "What A is to differ from, written alike. Without it the first point of"
                " A is compared with each of the others."
            ),
        ),
    ] = None,
    results: "Location" = Path("results"),
    half_width: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=SIZE",
            help=(
                "Half the width that the 95 % interval may have: speed=0.05 in the unit"
                " of the metric, speed=5% as a share of the mean. Repeatable."
            ),
        ),
    ] = None,
    difference: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=SIZE",
            help=(
                "A true difference that sweep compare is to notice, written alike; a"
                " share is that of the mean of A. Repeatable."
            ),
        ),
    ] = None,
    chance: Annotated[
        float, typer.Option(help="With which that is to happen, from 0.5 to 0.99.")
    ] = 0.8,
    over: OverOption = Over.last,
) -> "Report":
    """Show how many replicates a half width, or a difference, needs.

    The stored trials are the pilot.

    Parameters
    ----------
    a : str
        The pilot, see `sweep.methods.comparison.side_of`.
    b : str, optional
        Side B of differences, in the same form. By default the first point of A is
        compared with each of the others.
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
