"""The entry of ablation."""

from typing import TYPE_CHECKING

from sweep.method import Method

if TYPE_CHECKING:
    from sweep.figures import FigureKind


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.ablation.figure import KIND

    return {"effects": KIND}


METHOD = Method(figures=figures, in_figures=("effects_figure", "paired_effects"))
