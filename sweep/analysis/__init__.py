"""From tables to estimates with intervals, contrasts, effect sizes and steady states.

Every result says on how many values it rests; trials that are not done take no part and
are counted.

    mean_bounds   the interval of a mean for each distribution of values
    estimate      a number with its interval
    notation      the same as text
    intervals     means and quantiles of tables, and the bootstrap
    resampling    bootstrap and jackknife
    pairing       values that share randomness
    pooling       trials of several points together
    contrasts     differences between groups
    effect_sizes  Hedges' g, Cliff's delta
    simultaneous  intervals that hold together
    sequential    the same while trials are added
    series        curves against time
    steady        means after the transient
    order         susceptibility and Binder cumulant
"""

from sweep.analysis.contrasts import (
    Contrast,
    Equivalence,
    Family,
    Together,
    compare,
    contrast,
    contrasts,
    equivalence,
    independent_contrast,
    jointly,
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
    paired_estimate,
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
    undefined_shares,
)
from sweep.analysis.mean_bounds import Distribution
from sweep.analysis.order import (
    binder_cumulant,
    binder_values,
    order_parameters,
    order_samples,
    susceptibility,
    susceptibility_values,
)
from sweep.analysis.pairing import (
    Unit,
    Units,
    agrees,
    chosen,
    common_streams,
    replicates,
    units,
)
from sweep.analysis.pooling import pooled
from sweep.analysis.resampling import pseudo_values
from sweep.analysis.series import (
    Autocorrelation,
    BurnIn,
    Drift,
    autocorrelation,
    burn_in,
    drift,
    integrated_time,
)
from sweep.analysis.simultaneous import (
    Simultaneous,
    adjusted,
    holm,
    max_t,
    simultaneous_confidence,
)
from sweep.analysis.steady import SteadyState, steady_state, steady_states

__all__ = [
    "CONFIDENCE",
    "Autocorrelation",
    "BurnIn",
    "Contrast",
    "Distribution",
    "Drift",
    "EffectSize",
    "Equivalence",
    "Estimate",
    "Family",
    "Interval",
    "MeanEstimate",
    "MeanKind",
    "RankEstimate",
    "Sample",
    "Simultaneous",
    "SteadyState",
    "Together",
    "Unit",
    "Units",
    "adjusted",
    "agrees",
    "autocorrelation",
    "binder_cumulant",
    "binder_values",
    "burn_in",
    "by_point",
    "chosen",
    "cliffs_delta",
    "common_streams",
    "compare",
    "contrast",
    "contrasts",
    "curves",
    "drift",
    "equivalence",
    "half_width",
    "hedges_g",
    "holm",
    "independent_contrast",
    "integrated_time",
    "jointly",
    "max_t",
    "mean_estimate",
    "mean_interval",
    "order_parameters",
    "order_samples",
    "paired_contrast",
    "paired_estimate",
    "pooled",
    "pseudo_values",
    "quantile_interval",
    "quantiles_by_point",
    "rank_estimate",
    "replicates",
    "simultaneous_confidence",
    "steady_state",
    "steady_states",
    "superiority",
    "susceptibility",
    "susceptibility_values",
    "undefined_shares",
    "units",
]
