from .figure import front_figure as front_figure
from .figure import history_figure as history_figure
from .figure_repetitions import comparison_figure as comparison_figure
from .figure_repetitions import hypervolume_figure as hypervolume_figure
