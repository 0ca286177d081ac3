"""The entry of profiles, with its command."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method

if TYPE_CHECKING:
    from sweep.figures import FigureKind
    from sweep.store import Location
    from sweep.tables import Report


def profiles(
    a: Annotated[
        str,
        typer.Argument(
            metavar="STUDY",
            help="Study with `record: {profiles: [...]}`, STUDY, or"
            " STUDY:parameter=value[,...].",
        ),
    ],
    b: Annotated[
        str | None,
        typer.Argument(
            metavar="OTHER",
            help="Study, or point of a study, to compare with, such as a recording.",
        ),
    ] = None,
    results: "Location" = Path("results"),
    profile: Annotated[
        list[str] | None,
        typer.Option(help="Profile to report; by default all profiles. Repeatable."),
    ] = None,
    start: Annotated[
        float | None,
        typer.Option(help="Least position that exponents and zeros use."),
    ] = None,
    stop: Annotated[
        float | None,
        typer.Option(help="Largest position that exponents and zeros use."),
    ] = None,
) -> "Report":
    """Print metrics along an axis, such as a distance or a lag.

    Confidence intervals hold for all positions of a profile together. With a second
    study, prints the differences of the two studies at each position.

    Parameters
    ----------
    a : str
        The study, see `sweep.methods.comparison.side_of`.
    b : str, optional
        The study to compare with, in the form of `a`.
    results : Location, default Path("results")
        Folder of stored studies.
    profile : list of str, optional
        By default all profiles of the study, or all common profiles of two studies.
    start, stop : float, optional
        Least and largest position that exponents and zeros use.

    Returns
    -------
    Report

    Examples
    --------
    sweep profiles my/flock
    sweep profiles my/flock --profile mean_squared_displacement --start 10
    sweep profiles lab/fish my/model:noise=0.5 --csv
    """
    from sweep.errors import ChoiceError
    from sweep.methods.comparison import read_side
    from sweep.methods.profiles.analysis import (
        comparable,
        profile_difference,
        profiles_of_side,
    )
    from sweep.methods.profiles.report import difference_report, profiles_report

    side = read_side(a, results)
    if b is None:
        means = profiles_of_side(side, profile or (), start=start, stop=stop)
        return profiles_report(side.study, means)
    if start is not None or stop is not None:
        message = "start and stop are for exponents, which a difference does not have"
        raise ChoiceError(message, side.study.name)
    other = read_side(b, results)
    if profile:
        differences = [profile_difference(side, other, name) for name in profile]
        return difference_report(a, b, differences)
    return difference_report(a, b, *comparable(side, other))


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.profiles.figure import KIND as PROFILES

    return {"profiles": PROFILES}


METHOD = Method(
    reports_of_results=(profiles,), figures=figures, in_figures=("profile_figure",)
)
