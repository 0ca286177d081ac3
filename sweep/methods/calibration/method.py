"""The entry of calibration, with its section and its command."""

from typing import TYPE_CHECKING

from sweep.method import Method

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sweep.figures import FigureKind
    from sweep.spec import SpecSection
    from sweep.tables import Report, StoredStudy


def posterior(
    study: "StoredStudy",
) -> "Report":
    """Estimate parameters that data support (needs `calibrate`).

    The report has the distance of the data from what the model can do, credible
    intervals of the parameters, the posterior predictive of each summary, the
    generations, and simulation-based calibration. The CSV has a row per kept
    simulation, with its weight.

    Examples
    --------
    sweep posterior my/fit
    sweep posterior my/fit --csv > draws.csv
    """
    from sweep.methods.calibration import analysis
    from sweep.methods.calibration.report import posterior_report

    return posterior_report(analysis.posterior(study))


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
    figures=figures,
    in_figures=("posterior_figure",),
    status=status,
    unfinished=unfinished,
    sections=sections,
)
