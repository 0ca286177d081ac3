from .analysis import Posterior as Posterior
from .analysis import posterior as posterior
from .figure import posterior_figure as posterior_figure
from .report import posterior_report as posterior_report
