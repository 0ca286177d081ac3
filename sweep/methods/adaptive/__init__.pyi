from .analysis import settled_points as settled_points
from .analysis import why_unfinished as why_unfinished
from .figure import narrowing_figure as narrowing_figure
