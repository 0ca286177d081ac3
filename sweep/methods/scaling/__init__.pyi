from .analysis import CURVES as CURVES
from .analysis import DRIFTS as DRIFTS
from .analysis import LENGTHS as LENGTHS
from .analysis import Scaling as Scaling
from .analysis import finite_size_scaling as finite_size_scaling
from .collapse import collapse_figure as collapse_figure
from .figure import scaling_figure as scaling_figure
from .report import scaling_report as scaling_report
