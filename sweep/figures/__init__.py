"""Figures from tables, in a common style.

The command line, notebooks and published studies use this package.

    kinds               kinds of figures, and kinds that suit a study
    own_kinds           kinds in custom files
    asked               studies and kinds by name

    planning            the parts of a kind of figure
    selection           the trials that a figure shows
    style               colours and style sheet of all figures
    drawing             maps, flocks, confidence intervals

    marks               figures as plain data
    scales              axes of parameters
    directions          the better values of a metric
    saving              files with the study in the metadata

    curves              metrics against time
    heatmap             a metric over two parameters
    cells               the cells of a heatmap, for files and pages
    scatter             a metric against each parameter

    parallel            all parameters of the best points
    pareto              two metrics, and the Pareto front
    coverage            visits of each pixel of the map
    trajectories        paths of boids
"""

from importlib import import_module
from typing import Any

import lazy_loader

from sweep.method import own_methods

_own, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)
__all__ = [
    "BLUE",
    "COLOURS",
    "GREEN",
    "GREY",
    "KINDS",
    "LINE_STYLES",
    "NAME",
    "ORANGE",
    "PURPLE",
    "SKY",
    "STYLE",
    "VERMILION",
    "Choices",
    "Drawing",
    "FigureKind",
    "Planned",
    "coverage_figure",
    "draw_flock",
    "draw_map",
    "draw_values",
    "draw_visits",
    "heatmap_figure",
    "legend",
    "metric_curves",
    "name_rows",
    "note",
    "parallel_figure",
    "pareto_figure",
    "quantity",
    "save",
    "saved_about",
    "scatter_figure",
    "trajectories_figure",
    "words",
]  # for users; the stub also lists names for other packages


def __getattr__(name: str) -> Any:
    """Return a name of this package, or a name that a method exports to notebooks."""
    for package, method in own_methods().items():
        if name in method.in_figures:
            return getattr(import_module(f"sweep.methods.{package}"), name)
    return _own(name)
