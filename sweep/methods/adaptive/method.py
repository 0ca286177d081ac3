"""Replicates until intervals are narrow: its entry."""

from typing import TYPE_CHECKING

from sweep.method import Method

if TYPE_CHECKING:
    from sweep.figures.planning import FigureKind
    from sweep.tables.stored_study import StoredStudy


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by their names."""
    from sweep.methods.adaptive.figure import KIND

    return {"narrowing": KIND}


def status(study: "StoredStudy") -> dict[str, str]:
    """Return how many points need no more trials."""
    from sweep.methods.adaptive.analysis import settled_points

    return {"settled": settled_points(study)} if study.about.until else {}


def unfinished(study: "StoredStudy") -> str:
    """Return why more trials follow, or "" where none do."""
    from sweep.methods.adaptive.analysis import why_unfinished

    return why_unfinished(study)


METHOD = Method(
    figures=figures,
    in_figures=("narrowing_figure",),
    status=status,
    unfinished=unfinished,
)
