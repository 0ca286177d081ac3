"""Figures from tables, in one house style, for the command line, notebooks and
published studies.

    kinds               which figures suit a study
    own_kinds           kinds in files of the user's own
    asked               studies and kinds by their names
    planning            what a kind of figure is
    selection           which trials a figure shows
    style               what all figures share
    drawing             maps, flocks, intervals
    marks               figures as plain data
    scales              axes of settings
    directions          which way a metric is better
    saving              files that say what they show
    curves              metrics against time
    heatmap             a metric over two settings
    scatter             a metric against each setting
    parallel            all settings of the best
    pareto              two metrics, and their front
    coverage            where boids were
    trajectories        the ways of boids
    search              history and front of a search
    search_layout       what these show, drawn or as marks
    search_marks        these as marks
    search_repetitions  its repetitions
"""

from importlib import import_module
from typing import Any

import lazy_loader

from sweep.method import own_methods

_own, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Return a name of this package, or one that a method hands on to notebooks."""
    for package, method in own_methods().items():
        if name in method.in_figures:
            return getattr(import_module(f"sweep.methods.{package}"), name)
    return _own(name)
