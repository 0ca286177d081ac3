from .analysis import NOTHING as NOTHING
from .analysis import needed_replicates as needed_replicates
from .report import power_report as power_report
