"""Sensitivity analyses: Sobol indices, Morris's elementary effects, rank correlations.

All analyses use means over replicates. The mean of a point is over the trials with a
value. If no trial of a point has a value, the whole block of points is left out, and
the table counts these blocks. The table then holds for the part of the space where the
model gives a value.

Confidence intervals are percentiles of a bootstrap over blocks, or over points if the
sample has no blocks. So the intervals include the noise. The intervals are not
simultaneous, and assume blocks drawn at random. Blocks of a Sobol sequence or a Latin
hypercube are more even, which makes intervals too wide rather than too narrow.

A table has one row per parameter, or index, at each combination of the other axes,
whose parameters are the first columns. The last columns count: blocks, blocks_left_out,
trials, trials_without_value. `attrs` has the study, metric, unit and confidence, and
`fewest`, the least number of blocks for a useful estimate.
"""

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd

from sweep.analysis import CONFIDENCE
from sweep.errors import ChoiceError
from sweep.methods.search import SEARCH_SAMPLERS
from sweep.methods.sensitivity.resampled_ranks import rank_analysis
from sweep.methods.sensitivity.sampled import (
    Analysis,
    Floats,
    SampledAxis,
    sampled_axis,
    samples,
)
from sweep.methods.sensitivity.screening import effect_analysis
from sweep.methods.sensitivity.sobol_indices import index_analysis
from sweep.spec import SALIB, SAMPLERS, TABLE, Analyses, made_for
from sweep.tables import StoredStudy

RESAMPLES = 1000
FEWEST: Mapping[Analyses, int] = MappingProxyType(
    {"sobol": 100, "morris": 10, "ranks": 30}
)
"""Least number of blocks, or points, for a useful estimate.

For Sobol indices some hundreds are usual (Saltelli and others 2008, Global Sensitivity
Analysis: The Primer), for Morris's effects 10 to 50 (Campolongo, Cariboni and Saltelli
2007). A rank correlation of 30 points has a standard error of 0.19.
"""
MOST_NUMBERS = 2_000_000
"""Largest number of values of one resampled column in memory."""


def every_sampler(study: StoredStudy) -> tuple[str, ...]:
    """Return the samplers that an axis may have.

    The points of a table count as a sample. So do points of a sampler that only the
    study has.
    """
    drawn = [axis.sampler for axis in study.axes.values() if axis.sampler]
    own = [name for name in drawn if name not in SEARCH_SAMPLERS]
    return tuple(dict.fromkeys([*SAMPLERS, TABLE, *own]))


def sensitivity(
    study: StoredStudy,
    metric: str,
    axis: str | None = None,
    analysis: Analyses | None = None,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> pd.DataFrame:
    """Return the table of the analysis that suits the sampler of an axis.

    The analysis is `sobol` for a `saltelli` sample, `morris` for a `morris` sample, and
    otherwise `rank_correlations`.

    Parameters
    ----------
    study : StoredStudy
    metric : str
    axis : str, optional
        The sampled axis; needed if there are several.
    analysis : {"sobol", "morris", "ranks"}, optional
        By default the analysis that suits the sampler.
    confidence : float, default 0.95
        Confidence level of the intervals.
    resamples : int, default 1000
        Number of bootstrap resamples.
    seed : int, default 0
        Seed of the resamples.

    Returns
    -------
    DataFrame

    Raises
    ------
    ChoiceError
        Nothing is sampled, or the analysis does not suit the sampler or metric.
    """
    if analysis is None:
        name = study.axes[sampled_axis(study, axis, every_sampler(study))].sampler
        sampler = SAMPLERS.get(name or "")
        analysis = sampler.analysis if sampler else "ranks"
    return ANALYSES[analysis](
        study, metric, axis, confidence=confidence, resamples=resamples, seed=seed
    )


def sobol(
    study: StoredStudy,
    metric: str,
    axis: str | None = None,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> pd.DataFrame:
    """Return Sobol indices: the fraction of variance that each parameter explains.

    Parameters
    ----------
    study : StoredStudy
    metric : str
    axis : str, optional
        The axis with a sample made for Sobol indices; needed if there are several.
    confidence : float, default 0.95
        Confidence level of the intervals.
    resamples : int, default 1000
        Number of bootstrap resamples.
    seed : int, default 0
        Seed of the resamples.

    Returns
    -------
    DataFrame
        Columns: index (S1 alone, ST with all interactions, S2 of a pair), setting, and
        other (the second parameter of the pair, else ""). Each of the following has
        _low and _high: `raw`, from the unchanged means; `corrected`, without replicate
        noise (see `sobol_indices`); and noise_share, the fraction of the variance of a
        mean that is noise. Without replicates, and if noise leaves no variance,
        `corrected` is NaN. Bounds are NaN if a resample has no value.

    Raises
    ------
    ChoiceError
        No axis has a suitable sample or several axes have, the metric is unknown, or
        SALib is not installed.
    """
    if find_spec(SALIB.name) is None:
        raise ChoiceError(
            f"Sobol indices need the package {SALIB.name},"
            f" which is not installed: {SALIB.install}",
            study.name,
        )
    chosen = sampled_axis(study, axis, made_for("sobol"))
    bootstrap = _Bootstrap(confidence, resamples, seed)
    return _table(study, metric, chosen, "sobol", bootstrap=bootstrap)


def morris(
    study: StoredStudy,
    metric: str,
    axis: str | None = None,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> pd.DataFrame:
    """Return elementary effects (Morris 1991, Technometrics 33, 161-174).

    An effect is the change of the metric by a step of one parameter, divided by the
    step as a fraction of the range of the parameter. For other than uniform
    distributions it is a fraction of the probability. Noise makes mu_star and sigma
    larger. Trajectories on few levels share points, and the intervals then count the
    noise of these points as effect.

    Parameters
    ----------
    study : StoredStudy
    metric : str
    axis : str, optional
        The axis with a sample made for elementary effects; needed if there are several.
    confidence : float, default 0.95
        Confidence level of the intervals.
    resamples : int, default 1000
        Number of bootstrap resamples.
    seed : int, default 0
        Seed of the resamples.

    Returns
    -------
    DataFrame
        All numbers are in the unit of the metric. Columns: setting; noise, the standard
        deviation of effects by replicate noise alone, NaN without replicates; mu,
        mu_star and sigma, each with _low and _high. `mu` is the mean of effects.
        `mu_star` is the mean of absolute values (Campolongo, Cariboni and Saltelli
        2007, Environmental Modelling and Software 22, 1509-1518). sigma is the
        standard deviation of effects. The sign of mu has no meaning for a parameter
        whose values are strings.

    Raises
    ------
    ChoiceError
        No axis has a suitable sample or several axes have, or the metric is unknown.
    """
    chosen = sampled_axis(study, axis, made_for("morris"))
    bootstrap = _Bootstrap(confidence, resamples, seed)
    return _table(study, metric, chosen, "morris", bootstrap=bootstrap)


def rank_correlations(
    study: StoredStudy,
    metric: str,
    axis: str | None = None,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> pd.DataFrame:
    """Return rank correlations of a metric with each parameter of a sampled axis.

    The correlations do not depend on the sampler. Replicate noise makes correlations
    smaller. Equal points count once, except in blocks.

    Parameters
    ----------
    study : StoredStudy
    metric : str
    axis : str, optional
        The sampled axis; needed if there are several.
    confidence : float, default 0.95
        Confidence level of the intervals.
    resamples : int, default 1000
        Number of bootstrap resamples.
    seed : int, default 0
        Seed of the resamples.

    Returns
    -------
    DataFrame
        Columns: setting; spearman, the correlation of ranks; partial, the correlation
        given the ranks of the other parameters of the axis (Iman and Helton 1988,
        Risk Analysis 8, 71-90). spearman and partial have _low and _high. Correlations
        are NaN for a parameter whose values are strings, and also if a rank does not
        vary, or the other ranks determine the rank.

    Raises
    ------
    ChoiceError
        No axis is sampled or several are, or the metric is unknown.
    """
    chosen = sampled_axis(study, axis, every_sampler(study))
    bootstrap = _Bootstrap(confidence, resamples, seed)
    return _table(study, metric, chosen, "ranks", bootstrap=bootstrap)


ANALYSES: dict[Analyses, Callable[..., pd.DataFrame]] = {
    "sobol": sobol,
    "morris": morris,
    "ranks": rank_correlations,
}
"""Functions by the names that samplers give to their analyses."""

ESTIMATES: Mapping[Analyses, Callable[[SampledAxis], Analysis]] = MappingProxyType(
    {"sobol": index_analysis, "morris": effect_analysis, "ranks": rank_analysis}
)
"""Estimates of one sample, by the names of the analyses."""


class _Bootstrap(NamedTuple):
    """The level of confidence intervals, and the number and seed of resamples."""

    confidence: float
    resamples: int
    seed: int


def _table(
    study: StoredStudy,
    metric: str,
    axis: str,
    name: Analyses,
    *,
    bootstrap: _Bootstrap,
) -> pd.DataFrame:
    rows = []
    for sample in samples(study, metric, axis):
        analysis = ESTIMATES[name](sample)
        values, resampled = _estimated(analysis, len(sample.complete), bootstrap)
        for place, row in enumerate(analysis.rows):
            cells = sample.at | row
            for number, column in enumerate(analysis.names):
                low, high = _interval(resampled[number, place], bootstrap.confidence)
                cells |= {column: float(values[number, place])}
                cells |= {f"{column}_low": low, f"{column}_high": high}
            rows.append(cells | sample.counts())
    table = pd.DataFrame(rows)
    table.attrs = {
        "study": study.name,
        "metric": metric,
        "unit": study.units.get(metric, ""),
        "confidence": bootstrap.confidence,
        "fewest": FEWEST[name],
    }
    return table


def _estimated(
    analysis: Analysis, blocks: int, bootstrap: _Bootstrap
) -> tuple[Floats, Floats]:
    """Return the estimates, (names, rows), and the estimates of the resamples.

    Resampled estimates have the shape (names, rows, resamples), with no resample of
    fewer than two blocks.
    """
    shape = (len(analysis.names), len(analysis.rows))
    if blocks == 0:
        return np.full(shape, np.nan), np.empty((*shape, 0))
    values = analysis.estimate(np.arange(blocks)[:, None])[:, :, 0]
    resamples = bootstrap.resamples if blocks > 1 else 0
    random = np.random.default_rng(bootstrap.seed)
    drawn = random.integers(blocks, size=(resamples, blocks)).T
    step = max(1, MOST_NUMBERS // blocks)
    parts = [
        analysis.estimate(drawn[:, start : start + step])
        for start in range(0, drawn.shape[1], step)
    ]
    return values, np.concatenate([np.empty((*shape, 0)), *parts], axis=2)


def _interval(resampled: Floats, confidence: float) -> tuple[float, float]:
    """Return the confidence interval, NaN if a resample has no value."""
    if not (len(resampled) and np.isfinite(resampled).all()):
        return np.nan, np.nan
    tail = (1.0 - confidence) / 2
    low, high = np.quantile(resampled, [tail, 1.0 - tail])
    return float(low), float(high)
