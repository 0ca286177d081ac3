"""The entry of calibration, with its section and its commands."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.method import Method

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sweep.figures import FigureKind
    from sweep.spec import SpecSection
    from sweep.store import Location
    from sweep.tables import Report, StoredStudy


def posterior(
    study: "StoredStudy",
    every: Annotated[
        bool,
        typer.Option("--every", help="All simulations in the CSV, not only kept ones."),
    ] = False,
) -> "Report":
    """Estimate parameters that data support (needs `calibrate`).

    The report has the distance of the data from what the model can do, credible
    intervals of the parameters, the posterior predictive of each summary, the
    generations, and simulation-based calibration. The CSV has a row per kept
    simulation, with its weight. With --every, the CSV has all simulations, with
    parameters and summaries, for programs that train a network.

    Parameters
    ----------
    study : StoredStudy
    every : bool, default False
        Whether the CSV has all simulations, without weights.

    Examples
    --------
    sweep posterior my/fit
    sweep posterior my/fit --csv > draws.csv
    sweep posterior my/fit --every --csv > simulations.csv
    """
    from sweep.methods.calibration import analysis
    from sweep.methods.calibration.report import posterior_report

    return posterior_report(analysis.posterior(study), every=every)


def odds(
    studies: Annotated[
        list[str],
        typer.Argument(
            metavar="STUDY",
            help="Calibrated studies of the models, with the same data and summaries.",
        ),
    ],
    results: "Location" = Path("results"),
) -> "Report":
    """Print how probable each of several calibrated models is.

    The report has the Bayes factors and posterior probabilities of the models, with
    confidence intervals, at several tolerances. Simulations of the priors test whether
    the summaries tell the models apart. The CSV has a row per study.

    Parameters
    ----------
    studies : list of str
        Names of at least two studies with `calibrate`.
    results : Location, default Path("results")
        Folder of stored studies.

    Returns
    -------
    Report

    Examples
    --------
    sweep odds my/fit my/fit_without_alignment
    sweep odds my/fit my/other my/third --json
    """
    from sweep.methods.calibration import odds as of
    from sweep.methods.calibration import odds_report
    from sweep.tables import StoredStudy

    return odds_report(of([StoredStudy(name, results) for name in studies]))


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.calibration.figure import KIND

    return {"posterior": KIND}


def status(study: "StoredStudy") -> dict[str, str]:
    """Return the last generation, in words, by label."""
    from sweep.errors import StoreError
    from sweep.methods.calibration.analysis import is_calibrated
    from sweep.methods.calibration.analysis import posterior as of
    from sweep.methods.calibration.report import settled_in_words

    if not is_calibrated(study):
        return {}
    try:
        return {"calibration": settled_in_words(of(study, checked=False))}
    except StoreError as error:
        return {"calibration": str(error)}


def unfinished(study: "StoredStudy") -> str:
    """Return the reason for further trials; "" without further trials."""
    from sweep.methods.calibration.analysis import is_calibrated, is_finished

    if not is_calibrated(study) or is_finished(study):
        return ""
    return f"generations of {study.name} follow"


def sections() -> "Sequence[SpecSection]":
    """Return the section `calibrate`."""
    from sweep.methods.calibration.section import SECTION

    return (SECTION,)


METHOD = Method(
    reports=(posterior,),
    reports_of_results=(odds,),
    figures=figures,
    in_figures=("posterior_figure",),
    status=status,
    unfinished=unfinished,
    sections=sections,
)
