from .analysis import RealityGap as RealityGap
from .analysis import reality_gap as reality_gap
from .analysis import scores_of as scores_of
from .figure import gap_figure as gap_figure
from .report import gap_report as gap_report
