"""The entry of refinement, with its section and its command."""

from typing import TYPE_CHECKING

from sweep.method import Method

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sweep.figures import FigureKind
    from sweep.spec import SpecSection
    from sweep.tables import Report, StoredStudy


def boundary(
    study: "StoredStudy",
) -> "Report":
    """Locate the phase boundary of a study (needs `refine`).

    At a phase boundary, the mean of a metric crosses a level. With one refined axis,
    each row is a crossing, between the nearest points that are clearly on either side.
    With several refined axes, each row is a cell that contains the boundary, or is
    unresolved.

    Examples
    --------
    sweep boundary my/phase
    sweep boundary my/phase --csv
    """
    from sweep.methods.refinement.analysis import find_boundary
    from sweep.methods.refinement.report import boundary_report

    return boundary_report(study, find_boundary(study))


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.refinement.figure import KIND as PHASE

    return {"phase": PHASE}


def status(study: "StoredStudy") -> dict[str, str]:
    """Return the number of cells at the boundary, for `sweep status`."""
    from sweep.methods.refinement.report import cells_in_words

    refined = "refine" in study.about.sections
    return {"boundary": cells_in_words(study)} if refined else {}


def unfinished(study: "StoredStudy") -> str:
    """Return the reason for further trials; "" without further trials."""
    from sweep.methods.refinement.report import why_unfinished

    return why_unfinished(study)


def sections() -> "Sequence[SpecSection]":
    """Return the section `refine`."""
    from sweep.methods.refinement.section import SECTION

    return (SECTION,)


METHOD = Method(
    reports=(boundary,),
    figures=figures,
    in_figures=("phase_figure",),
    status=status,
    unfinished=unfinished,
    sections=sections,
)
