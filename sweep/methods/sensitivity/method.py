"""The entry of sensitivity analysis."""

from typing import TYPE_CHECKING

from sweep.method import Method

if TYPE_CHECKING:
    from sweep.figures import FigureKind


def figures() -> "dict[str, FigureKind]":
    """Return the kinds of figures by name."""
    from sweep.methods.sensitivity.figure import KIND

    return {"sensitivity": KIND}


METHOD = Method(figures=figures, in_figures=("sensitivity_figure",))
