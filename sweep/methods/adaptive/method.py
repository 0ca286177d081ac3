"""The entry of adaptive replicates."""

from typing import TYPE_CHECKING

from sweep.method import Method

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sweep.figures import FigureKind
    from sweep.spec import SpecSection
    from sweep.tables import StoredStudy


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.adaptive.figure import KIND

    return {"narrowing": KIND}


def status(study: "StoredStudy") -> dict[str, str]:
    """Return the number of settled points, in words, by label."""
    from sweep.methods.adaptive.analysis import has_rule, settled_points

    return {"settled": settled_points(study)} if has_rule(study) else {}


def unfinished(study: "StoredStudy") -> str:
    """Return the reason for further trials; "" without further trials."""
    from sweep.methods.adaptive.analysis import why_unfinished

    return why_unfinished(study)


def sections() -> "Sequence[SpecSection]":
    """Return the form of `replicates` that is a rule."""
    from sweep.methods.adaptive.section import SECTION

    return (SECTION,)


METHOD = Method(
    figures=figures,
    in_figures=("narrowing_figure",),
    status=status,
    unfinished=unfinished,
    sections=sections,
)
