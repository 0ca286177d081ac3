from .analysis import Posterior as Posterior
from .analysis import posterior as posterior
from .figure import posterior_figure as posterior_figure
from .model_odds import Odds as Odds
from .model_odds import odds as odds
from .report import odds_report as odds_report
from .report import posterior_report as posterior_report
