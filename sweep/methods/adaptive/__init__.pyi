from .analysis import rule_of as rule_of
from .analysis import settled_points as settled_points
from .analysis import stopping as stopping
from .analysis import why_unfinished as why_unfinished
from .figure import narrowing_figure as narrowing_figure
