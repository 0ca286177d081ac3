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
    narrowing           half widths of intervals
    coverage            where boids were
    trajectories        the ways of boids
    ablation_effects    what each changed detail does
    sensitivity         which settings matter
    hysteresis          way up, way down, and the loop between
    phase               where a mean crosses a level
    validity            what other numerics make of conclusions
    scaling             curves of several sizes
    collapse            the same, scaled to become one
    search              history and front of a search
    search_layout       what these show, drawn or as marks
    search_marks        these as marks
    search_repetitions  its repetitions
"""

from sweep.figures.ablation_effects import effects_figure, paired_effects
from sweep.figures.collapse import collapse_figure
from sweep.figures.coverage import coverage_figure
from sweep.figures.curves import metric_curves
from sweep.figures.drawing import (
    draw_flock,
    draw_map,
    draw_values,
    draw_visits,
    legend,
    name_rows,
    note,
    quantity,
    words,
)
from sweep.figures.heatmap import heatmap_figure
from sweep.figures.hysteresis import hysteresis_figure
from sweep.figures.kinds import KINDS
from sweep.figures.narrowing import narrowing_figure
from sweep.figures.parallel import parallel_figure
from sweep.figures.pareto import pareto_figure
from sweep.figures.phase import phase_figure
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.saving import save, saved_about
from sweep.figures.scaling import scaling_figure
from sweep.figures.scatter import scatter_figure
from sweep.figures.search import front_figure, history_figure
from sweep.figures.search_repetitions import comparison_figure, hypervolume_figure
from sweep.figures.sensitivity import sensitivity_figure
from sweep.figures.style import (
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    LINE_STYLES,
    NAME,
    ORANGE,
    PURPLE,
    SKY,
    STYLE,
    VERMILION,
    Drawing,
)
from sweep.figures.trajectories import trajectories_figure
from sweep.figures.validity import validity_figure

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
    "collapse_figure",
    "comparison_figure",
    "coverage_figure",
    "draw_flock",
    "draw_map",
    "draw_values",
    "draw_visits",
    "effects_figure",
    "front_figure",
    "heatmap_figure",
    "history_figure",
    "hypervolume_figure",
    "hysteresis_figure",
    "legend",
    "metric_curves",
    "name_rows",
    "narrowing_figure",
    "note",
    "paired_effects",
    "parallel_figure",
    "pareto_figure",
    "phase_figure",
    "quantity",
    "save",
    "saved_about",
    "scaling_figure",
    "scatter_figure",
    "sensitivity_figure",
    "trajectories_figure",
    "validity_figure",
    "words",
]
