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
    contrasting   differences between groups
    effect_sizes  Hedges' g, Cliff's delta
    simultaneous  intervals that hold together
    futures       what a pilot lets one expect
    replication   how many values a goal needs
    sequential    the same while trials are added
    hysteresis    the loop between two directions
    resilience    what a failure leaves, and when that is mended
    series        curves against time
    steady        means after the transient
    order         susceptibility and Binder cumulant
    size_curves   where those of several sizes cross and peak
    collapse      the exponents of finite-size scaling
    coexistence   whether a transition jumps
    offered       all their names, which this package offers too

A worker knows what metrics declare of their values, by `mean_bounds`, and analyses
nothing: the other modules, with pandas, are imported at the first use of a name.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sweep.analysis.offered import *  # noqa: F403


def __getattr__(name: str) -> Any:
    return getattr(import_module("sweep.analysis.offered"), name)


def __dir__() -> list[str]:
    return list(import_module("sweep.analysis.offered").__all__)
