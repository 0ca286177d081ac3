"""Estimates with confidence intervals, contrasts, effect sizes and steady states.

Every result reports the number of values. Trials that are not done are left out and
counted.

    mean_bounds       confidence interval of a mean for each distribution of values
    estimate          means and differences with confidence intervals
    notation          numbers with confidence intervals as strings

    intervals         means and quantiles of tables, and the bootstrap
    resampling        bootstrap and jackknife
    pairing           values that share random numbers
    pooling           means over several points, by replicate

    contrasting       differences between groups
    effect_sizes      Hedges' g, Cliff's delta
    simultaneous      simultaneous confidence intervals and adjusted p-values
    futures           predictive distributions of future samples, from a pilot

    replication       number of values that a goal needs
    sequential        confidence intervals that are repeated while trials are added
    hysteresis        hysteresis loop between two directions

    failure_response  performance after a failure, and time to recover
    series            burn-in, autocorrelation and drift of time series
    steady            means after the transient
    order             susceptibility and Binder cumulant

    size_curves       crossings and peaks of the curves of several sizes
    size_collapse     exponents of finite-size scaling
    fronts            Pareto fronts, hypervolume and knee
    coexistence       transitions of first order and continuous transitions

A worker needs only `mean_bounds`, for the declarations of metrics. Therefore modules
with pandas are imported at the first use of a name.
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
]  # for users; the stub also lists names for other packages
