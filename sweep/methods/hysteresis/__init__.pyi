from .analysis import FoundLoop as FoundLoop
from .analysis import find_loops as find_loops
from .analysis import loop_rows as loop_rows
from .figure import hysteresis_figure as hysteresis_figure
from .report import hysteresis_report as hysteresis_report
