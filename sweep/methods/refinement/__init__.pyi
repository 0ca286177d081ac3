from .analysis import Boundary as Boundary
from .analysis import find_boundary as find_boundary
from .figure import phase_figure as phase_figure
from .report import boundary_report as boundary_report
