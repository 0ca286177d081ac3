from .analysis import paired_effects as paired_effects
from .figure import effects_figure as effects_figure
