"""Figures from tables, in one house style, for the command line, notebooks and published studies."""

from sweep.figures.curves import metric_curves
from sweep.figures.details import effects_figure, paired_effects
from sweep.figures.pieces import draw_flock, draw_map, draw_values, draw_visits, legend, name_rows, note
from sweep.figures.saving import save, saved_about
from sweep.figures.sensitivity import sensitivity_figure
from sweep.figures.style import (
    BLUE,
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

__all__ = [
    "BLUE",
    "GREEN",
    "GREY",
    "LINE_STYLES",
    "NAME",
    "ORANGE",
    "PURPLE",
    "SKY",
    "STYLE",
    "VERMILION",
    "Drawing",
    "draw_flock",
    "draw_map",
    "draw_values",
    "draw_visits",
    "effects_figure",
    "legend",
    "metric_curves",
    "name_rows",
    "note",
    "paired_effects",
    "save",
    "saved_about",
    "sensitivity_figure",
]
