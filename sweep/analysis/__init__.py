"""From tables to estimates with intervals, contrasts, effect sizes and steady states.

Every result says on how many values it rests; trials that are not done take no part and are counted.
"""

from sweep.analysis.contrasts import (
    Contrast,
    Equivalence,
    compare,
    contrast,
    contrasts,
    equivalence,
    paired_contrast,
)
from sweep.analysis.effect_sizes import EffectSize, cliffs_delta, hedges_g, superiority
from sweep.analysis.estimate import (
    CONFIDENCE,
    Estimate,
    MeanEstimate,
    RankEstimate,
    Sample,
    mean_estimate,
    rank_estimate,
)
from sweep.analysis.intervals import (
    Interval,
    MeanKind,
    by_point,
    curves,
    half_width,
    mean_interval,
    quantile_interval,
    quantiles_by_point,
)
from sweep.analysis.order import (
    binder_cumulant,
    binder_values,
    order_parameters,
    order_samples,
    susceptibility,
    susceptibility_values,
)
from sweep.analysis.pairing import Unit, Units, agrees, chosen, units
from sweep.analysis.series import Autocorrelation, BurnIn, Drift, autocorrelation, burn_in, drift, integrated_time
from sweep.analysis.simultaneous import Simultaneous, holm, max_t, simultaneous_confidence
from sweep.analysis.steady import SteadyState, steady_state, steady_states

__all__ = [
    "CONFIDENCE",
    "Autocorrelation",
    "BurnIn",
    "Contrast",
    "Drift",
    "EffectSize",
    "Equivalence",
    "Estimate",
    "Interval",
    "MeanEstimate",
    "MeanKind",
    "RankEstimate",
    "Sample",
    "Simultaneous",
    "SteadyState",
    "Unit",
    "Units",
    "agrees",
    "autocorrelation",
    "binder_cumulant",
    "binder_values",
    "burn_in",
    "by_point",
    "chosen",
    "cliffs_delta",
    "compare",
    "contrast",
    "contrasts",
    "curves",
    "drift",
    "equivalence",
    "half_width",
    "hedges_g",
    "holm",
    "integrated_time",
    "max_t",
    "mean_estimate",
    "mean_interval",
    "order_parameters",
    "order_samples",
    "paired_contrast",
    "quantile_interval",
    "quantiles_by_point",
    "rank_estimate",
    "simultaneous_confidence",
    "steady_state",
    "steady_states",
    "superiority",
    "susceptibility",
    "susceptibility_values",
    "units",
]
