"""Estimates with confidence intervals, contrasts, effect sizes and steady states.

Every result has the number of values behind it. Trials that are not done take no part
and are counted.

    mean_bounds       confidence interval of a mean for each distribution of values
    estimate          a number with its confidence interval
    notation          such a number as text
    intervals         means and quantiles of tables, and the bootstrap
    resampling        bootstrap and jackknife
    pairing           values that share randomness
    pooling           trials of several points together
    contrasting       differences between groups
    effect_sizes      Hedges' g, Cliff's delta
    simultaneous      simultaneous confidence intervals and adjusted p-values
    futures           predictive distributions of samples to come, from a pilot
    replication       number of values that a goal needs
    sequential        tests that are repeated while trials are added
    hysteresis        the loop between two directions
    failure_response  performance after a failure, and time to recover
    series            burn-in, autocorrelation and drift of time series
    steady            means after the transient
    order             susceptibility and Binder cumulant
    size_curves       crossings and peaks of the curves of several sizes
    size_collapse     the exponents of finite-size scaling
    fronts            Pareto fronts, their hypervolume and their knee
    coexistence       transitions of first order and continuous ones

A worker needs only `mean_bounds`, for what metrics declare of their values. Therefore
the other modules, with pandas, are imported at the first use of a name.
"""

import lazy_loader

__getattr__, __dir__, _ = lazy_loader.attach_stub(__name__, __file__)
__all__ = [
    "CONFIDENCE",
    "Autocorrelation",
    "BurnIn",
    "Contrast",
    "Declaration",
    "Declared",
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
    "Support",
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
]  # for users; the stub has also what other packages take
