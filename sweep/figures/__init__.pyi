import typing

from .coverage import coverage_figure as coverage_figure
from .curves import metric_curves as metric_curves
from .drawing import draw_flock as draw_flock
from .drawing import draw_map as draw_map
from .drawing import draw_values as draw_values
from .drawing import draw_visits as draw_visits
from .drawing import legend as legend
from .drawing import name_rows as name_rows
from .drawing import note as note
from .drawing import quantity as quantity
from .drawing import words as words
from .heatmap import heatmap_figure as heatmap_figure
from .kinds import KINDS as KINDS
from .parallel import parallel_figure as parallel_figure
from .pareto import pareto_figure as pareto_figure
from .planning import Choices as Choices
from .planning import FigureKind as FigureKind
from .planning import Planned as Planned
from .saving import save as save
from .saving import saved_about as saved_about
from .scatter import scatter_figure as scatter_figure
from .style import BLUE as BLUE
from .style import COLOURS as COLOURS
from .style import GREEN as GREEN
from .style import GREY as GREY
from .style import LINE_STYLES as LINE_STYLES
from .style import NAME as NAME
from .style import ORANGE as ORANGE
from .style import PURPLE as PURPLE
from .style import SKY as SKY
from .style import STYLE as STYLE
from .style import VERMILION as VERMILION
from .style import Drawing as Drawing
from .trajectories import trajectories_figure as trajectories_figure

def __getattr__(name: str) -> typing.Any: ...  # figures of methods
