"""Which settings a metric depends on: Sobol indices, Morris's elementary effects, rank
correlations.

All are of means over replicates. A point's mean is over the trials that have a value;
where none has one, the whole block of points is left out, and the table says how many
were: what it says then holds for the part of the space where the model gives a value.
Intervals are percentiles of a bootstrap over blocks (over points, where the sample has
none), so that they include the noise; each is for one number alone. They assume blocks
drawn at random: those of a Sobol sequence or a Latin hypercube are more even, which
makes intervals too wide rather than too narrow.

A table has one row a setting, or index, at each combination of the other axes, whose
settings stand first. Its last columns count: blocks, blocks_left_out, trials,
trials_without_value. `attrs` names the study, metric, unit and confidence, and how
many blocks are the `fewest` that say something.
"""

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from types import MappingProxyType

import numpy as np
import pandas as pd

from sweep.analysis import CONFIDENCE
from sweep.errors import ChoiceError
from sweep.methods.search.known_samplers import SEARCH_SAMPLERS
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
from sweep.spec.point_tables import TABLE
from sweep.spec.samplers import SAMPLERS, made_for
from sweep.spec.sampling import Analyses
from sweep.spec.whole_samples import SALIB
from sweep.tables.stored_study import StoredStudy

RESAMPLES = 1000
FEWEST: Mapping[Analyses, int] = MappingProxyType(
    {"sobol": 100, "morris": 10, "ranks": 30}
)
"""Fewer blocks, or points, say little. Of Sobol indices some hundreds are usual
(Saltelli and others 2008, Global Sensitivity Analysis: The Primer), of Morris's effects
10 to 50 (Campolongo, Cariboni and Saltelli 2007); a rank correlation of 30 points has a
standard error of 0.19.
"""
MOST_NUMBERS = 2_000_000
"""So many numbers of one resampled column are held at once."""


def every_sampler(study: StoredStudy) -> tuple[str, ...]:
    """What an axis may be sampled by; the points of a table count as a sample, and
    those of a sampler that only the study has.
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
    """The table of `sobol` for an axis of a `saltelli` sample, of `morris` for one of
    its own, and else of `rank_correlations`, unless `analysis` names another.

    `axis` is the sampled one where there are several; the intervals come from so many
    bootstrap `resamples`, drawn with `seed`. Raises ChoiceError where nothing is
    sampled, and as the analysis does.
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
    """Sobol indices over a `saltelli` sample: the share of the variance of `metric`
    that each setting explains.

    Columns: index (S1 alone, ST with all interactions, S2 of a pair), setting, other
    (of the pair, else ""); `raw`, of the means as they are, and `corrected`, without
    replicate noise (see `sobol_indices`); noise_share, the part of the variance of a
    mean that is noise; each with _low and _high. Without replicates, and where noise
    leaves no variance, corrected numbers are NaN, as are intervals where a resample has
    no value. Raises ChoiceError where no axis has such a sample or several have, for an
    unknown metric, and where SALib is missing.
    """
    if find_spec(SALIB.name) is None:
        raise ChoiceError(
            f"Sobol indices need the package {SALIB.name},"
            f" which is not installed: {SALIB.install}",
            study.name,
        )
    chosen = sampled_axis(study, axis, made_for("sobol"))
    table = _table(study, metric, chosen, index_analysis, confidence, resamples, seed)
    return _of(table, "sobol")


def morris(
    study: StoredStudy,
    metric: str,
    axis: str | None = None,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> pd.DataFrame:
    """Elementary effects over a `morris` sample (Morris 1991, Technometrics 33,
    161-174), in the unit of `metric`.

    An effect is the change of the metric by a step of one setting, divided by the step
    as a part of the range of the setting (for other than uniform distributions: of its
    probability). Columns: setting; noise, the standard deviation that replicate noise
    alone gives effects, NaN without replicates; mu, mu_star and sigma, the mean of
    effects, of their absolute values (Campolongo, Cariboni and Saltelli 2007,
    Environmental Modelling and Software 22, 1509-1518) and their standard deviation,
    each with _low and _high. Noise makes mu_star and sigma larger. Trajectories on few
    levels share points, whose noise their intervals then take for effect. The sign of
    mu means nothing for a setting of texts. Raises ChoiceError as `sobol`, without a
    need of SALib.
    """
    chosen = sampled_axis(study, axis, made_for("morris"))
    table = _table(study, metric, chosen, effect_analysis, confidence, resamples, seed)
    return _of(table, "morris")


def rank_correlations(
    study: StoredStudy,
    metric: str,
    axis: str | None = None,
    *,
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> pd.DataFrame:
    """How monotonically `metric` goes with each setting of a sampled axis, whatever the
    sampler.

    Columns: setting; spearman, the correlation of ranks, and partial, that of what the
    ranks of the axis's other settings leave of both (Iman and Helton 1988, Risk
    Analysis 8, 71-90), each with _low and _high. NaN for a setting of texts, and where
    a rank does not vary or is determined by the others. Replicate noise makes them
    smaller. Equal points count once, except in blocks. Raises ChoiceError as `sobol`
    does; SALib is not needed.
    """
    chosen = sampled_axis(study, axis, every_sampler(study))
    table = _table(study, metric, chosen, rank_analysis, confidence, resamples, seed)
    return _of(table, "ranks")


ANALYSES: dict[Analyses, Callable[..., pd.DataFrame]] = {
    "sobol": sobol,
    "morris": morris,
    "ranks": rank_correlations,
}
"""By the name that samplers give to the one that they are made for."""


def _table(
    study: StoredStudy,
    metric: str,
    axis: str,
    analyse: Callable[[SampledAxis], Analysis],
    confidence: float,
    resamples: int,
    seed: int,
) -> pd.DataFrame:
    rows = []
    for sample in samples(study, metric, axis):
        analysis = analyse(sample)
        values, resampled = _estimated(analysis, len(sample.whole), resamples, seed)
        for place, row in enumerate(analysis.rows):
            found = sample.at | row
            for number, name in enumerate(analysis.names):
                found |= _interval(
                    name, values[number, place], resampled[number, place], confidence
                )
            rows.append(found | sample.counts())
    table = pd.DataFrame(rows)
    table.attrs = {
        "study": study.name,
        "metric": metric,
        "unit": study.units.get(metric, ""),
        "confidence": confidence,
    }
    return table


def _of(table: pd.DataFrame, analysis: Analyses) -> pd.DataFrame:
    table.attrs["fewest"] = FEWEST[analysis]
    return table


def _estimated(
    analysis: Analysis, blocks: int, resamples: int, seed: int
) -> tuple[Floats, Floats]:
    """The numbers (names, rows), and those of the resamples (names, rows, resamples);
    none of fewer than two blocks.
    """
    shape = (len(analysis.names), len(analysis.rows))
    if blocks == 0:
        return np.full(shape, np.nan), np.empty((*shape, 0))
    values = analysis.estimate(np.arange(blocks)[:, None])[:, :, 0]
    drawn = (
        np.random.default_rng(seed)
        .integers(blocks, size=(resamples if blocks > 1 else 0, blocks))
        .T
    )
    step = max(1, MOST_NUMBERS // blocks)
    parts = [
        analysis.estimate(drawn[:, start : start + step])
        for start in range(0, drawn.shape[1], step)
    ]
    return values, np.concatenate([np.empty((*shape, 0)), *parts], axis=2)


def _interval(
    name: str, value: float, resampled: Floats, confidence: float
) -> dict[str, object]:
    """`value` as `name`, and its interval, NaN where a resample has no value."""
    tail = (1.0 - confidence) / 2
    known = len(resampled) > 0 and bool(np.isfinite(resampled).all())
    low, high = (
        np.quantile(resampled, [tail, 1.0 - tail]) if known else (np.nan, np.nan)
    )
    return {name: float(value), f"{name}_low": float(low), f"{name}_high": float(high)}
