"""The entry of a search."""

from typing import TYPE_CHECKING

from sweep.method import Method

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sweep.figures import FigureKind
    from sweep.spec import SpecSection
    from sweep.tables import StoredStudy


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.search.figure import FRONT, HISTORY
    from sweep.methods.search.figure_repetitions import COMPARISON, HYPERVOLUME

    return {
        "history": HISTORY,
        "front": FRONT,
        "comparison": COMPARISON,
        "hypervolume": HYPERVOLUME,
    }


def sections() -> "Sequence[SpecSection]":
    """Return the section `search`."""
    from sweep.methods.search.section import SECTION

    return (SECTION,)


def keep_apart(study: "StoredStudy") -> "StoredStudy":
    """Return a search with separate phases, and any other study unchanged."""
    from sweep.methods.search.separate_phases import by_phase

    return by_phase(study)


def directions(study: "StoredStudy") -> "Mapping[str, bool]":
    """Return whether high values are better, by the columns of the objectives."""
    from sweep.methods.search.asked_trials import asked_objectives

    return {aim.column: aim.maximize for aim in asked_objectives(study)}


METHOD = Method(
    figures=figures,
    in_figures=(
        "comparison_figure",
        "front_figure",
        "history_figure",
        "hypervolume_figure",
    ),
    sections=sections,
    keep_apart=keep_apart,
    directions=directions,
)
