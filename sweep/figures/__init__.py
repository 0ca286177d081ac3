"""Figures from tables, in one style.

The command line, notebooks and published studies draw them.

    kinds               which figures suit a study
    own_kinds           kinds in custom files
    asked               studies and kinds by their names
    planning            the parts of a kind of figure
    selection           the trials that a figure shows
    style               colours and style sheet of all figures
    drawing             maps, flocks, confidence intervals
    marks               figures as plain data
    scales              axes of parameters
    directions          the better values of a metric
    saving              files with the study in their metadata
    curves              metrics against time
    heatmap             a metric over two parameters
    scatter             a metric against each parameter
    parallel            all parameters of the best points
    pareto              two metrics, and their front
    coverage            visits of each pixel of the map
    trajectories        paths of boids
"""

from importlib import import_module
from typing import Any

import lazy_loader

from sweep.method import own_methods

_own, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Return a name of this package, or one that a method exports to notebooks."""
    for package, method in own_methods().items():
        if name in method.in_figures:
            return getattr(import_module(f"sweep.methods.{package}"), name)
    return _own(name)
