"""The entry of finite-size scaling, with section and command."""

from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sweep.figures import FigureKind
    from sweep.spec import SpecSection
    from sweep.tables import Report, StoredStudy


def scaling(
    study: "StoredStudy",
    metric: Annotated[
        str | None,
        typer.Option(
            "--metric",
            help="Order parameter, a recorded series; by default the first series.",
        ),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(
            "--by",
            help="Control parameter; by default the only other number that varies.",
        ),
    ] = None,
    burn_in: Annotated[
        int | None,
        typer.Option(
            "--burn-in",
            help="Number of steps to discard at the start of each trial; by default"
            " half of each trial.",
        ),
    ] = None,
) -> "Report":
    """Analyse a phase transition by finite-size scaling.

    The spec needs `sizes`, and records the order parameter as a series. Prints for each
    size the mean order, the susceptibility and the Binder cumulant. For all sizes
    together, prints the crossings of the cumulants, the exponents of the data collapse,
    and whether the transition is continuous or of first order. The report names series
    that are not stationary.

    Parameters
    ----------
    study : StoredStudy
    metric : str, optional
        The order parameter, a recorded series; by default the first series.
    by : str, optional
        The control parameter; by default the only number that varies in addition to n.
    burn_in : int, optional
        Steps that do not count; by default the first half of each trial.

    Returns
    -------
    Report

    Examples
    --------
    sweep scaling my/sizes
    sweep scaling my/sizes --metric polarization --burn-in 100
    """
    from sweep.methods.scaling.analysis import finite_size_scaling
    from sweep.methods.scaling.report import scaling_report

    return scaling_report(study, finite_size_scaling(study, metric, by, burn_in))


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.scaling.collapse import KIND as COLLAPSE
    from sweep.methods.scaling.figure import KIND as SCALING

    return {"scaling": SCALING, "collapse": COLLAPSE}


def sections() -> "Sequence[SpecSection]":
    """Return the section `sizes`."""
    from sweep.methods.scaling.section import SECTION

    return (SECTION,)


METHOD = Method(
    reports=(scaling,),
    figures=figures,
    sections=sections,
    in_figures=("scaling_figure", "collapse_figure"),
)
