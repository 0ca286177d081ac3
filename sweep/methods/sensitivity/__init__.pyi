from .analysis import RESAMPLES as RESAMPLES
from .analysis import every_sampler as every_sampler
from .analysis import morris as morris
from .analysis import rank_correlations as rank_correlations
from .analysis import sensitivity as sensitivity
from .analysis import sobol as sobol
from .figure import sensitivity_figure as sensitivity_figure
