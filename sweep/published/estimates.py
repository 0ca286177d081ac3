"""Turns a measure into an estimate from stored trials. Trials without a result are left
out, and counted.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from sweep.analysis import (
    Declaration,
    Estimate,
    Units,
    chosen,
    compare,
    mean_estimate,
    rank_estimate,
    units,
)
from sweep.errors import ChoiceError
from sweep.methods.scaling import Scaling, finite_size_scaling
from sweep.published.measures import (
    Call,
    Mean,
    MeanDifference,
    Measure,
    RankCorrelation,
    Transition,
    columns_read,
)
from sweep.spec.recorded import Column
from sweep.tables.stored_study import StoredStudy

Studies = Mapping[str, StoredStudy]


class Measured(NamedTuple):
    """An estimate, or what the sizes of a study tell of a transition; the number of its
    trials in words and in all, and the number of trials that were left out because they
    have no result.
    """

    estimate: Estimate | Scaling
    trials: str
    used: int
    left_out: int


class MeasureError(Exception):
    """A function of figures.py raised an error, or did not return what a
    measure needs; or the points of a study are not those of one transition.
    """


def metrics_left_out(studies: Studies, what: Measure) -> str:
    """The metrics that `what` measures and its studies leave out, with the reasons;
    "" where there are none.
    """
    reasons = (
        _said(studies[spec], Column.read(column).metric)
        for spec, column in columns_read(what)
    )
    return "; ".join(dict.fromkeys(filter(None, reasons)))


def _said(study: StoredStudy, metric: str) -> str:
    reason = study.left_out.get(metric)
    return f"{metric} {reason}" if reason else ""


def measure(
    studies: Studies, what: Measure, functions: Mapping[str, Callable[..., Any]]
) -> Measured:
    """The estimate of `what` in `studies`, which are found by the names of their specs.

    Raises MeasureError if a function of figures.py that it calls fails, and where the
    points of a study are not those of one transition.
    """
    if isinstance(what, Mean):
        found = _units(studies[what.spec], what, set(what.settings))
        return Measured(
            mean_estimate(found.array(), distribution=_distribution(studies, what)),
            f"{found.trials:,}",
            found.trials,
            found.left_out,
        )
    if isinstance(what, MeanDifference):
        return _difference(studies, what)
    if isinstance(what, RankCorrelation):
        return _rank_correlation(studies[what.spec], what)
    if isinstance(what, Transition):
        return _transition(studies[what.spec], what)
    return _called(studies, what, functions)


def _difference(studies: Studies, what: MeanDifference) -> Measured:
    """The first mean minus the second: between pairs if both sides have the same units,
    otherwise between independent samples.
    """
    named = {*what.first.settings, *what.second.settings}
    one, other = (
        _units(studies[side.spec], side, named) for side in (what.first, what.second)
    )
    found = compare(other, one, _distribution(studies, what.first))
    trials = f"{one.trials:,} and {other.trials:,}" + (
        ", paired" if found.paired else ""
    )
    return Measured(found.estimate, trials, one.trials + other.trials, found.left_out)


def _distribution(studies: Studies, what: Mean) -> Declaration:
    """How the values of a mean are distributed, and what they lie in: as its metric
    declares it, whether they are of trials or means of some.
    """
    return studies[what.spec].distributions[what.metric]


def _units(study: StoredStudy, mean: Mean, named: set[str]) -> Units:
    """The units of a mean. Units pair by the varied settings, except those `named` by
    the measure.
    """
    trials = chosen(study.trials, mean.settings)
    free = [name for name in study.varied if name not in named]
    return units(trials, _trial_values(study, trials, mean), mean.unit, free)


def _trial_values(
    study: StoredStudy, trials: pd.DataFrame, mean: Mean
) -> "pd.Series[float]":
    """One value a row of `trials`, NaN where it is not done."""
    if mean.frames is None:
        values = trials[mean.metric]
    else:
        series = study.series
        frames = series[series["frame"].between(*mean.frames)]
        values = trials["trial_id"].map(frames.groupby("trial_id")[mean.metric].mean())
    return values.astype(np.float64).where(trials["status"] == "done")


def _rank_correlation(study: StoredStudy, what: RankCorrelation) -> Measured:
    trials = chosen(study.trials, what.settings)
    values = trials[what.column].where(trials["status"] == "done")
    points = trials.assign(_value=values).groupby("point", sort=False)
    settings = points[what.setting].first().to_numpy(np.float64)
    estimate = rank_estimate(settings, points["_value"].mean().to_numpy(np.float64))
    count = int(values.notna().sum())
    words = f"{count:,} at {estimate.n:,} points"
    return Measured(estimate, words, count, int(values.isna().sum()))


def _transition(study: StoredStudy, what: Transition) -> Measured:
    try:
        found = finite_size_scaling(study.where(**what.settings), what.series)
    except ChoiceError as error:
        raise MeasureError(str(error)) from None
    used = int(found.states["trials"].sum())
    words = f"{used:,} at {len(found.states):,} points"
    return Measured(found, words, used, found.left_out)


def _called(
    studies: Studies, what: Call, functions: Mapping[str, Callable[..., Any]]
) -> Measured:
    try:
        found = functions[what.function](studies, **what.settings)
        samples = [
            np.asarray(values, np.float64)
            for values in (found if isinstance(found, tuple) else (found,))
        ]
    except Exception as error:
        left_out = dict.fromkeys(
            f"; {_said(study, metric)}"
            for study in studies.values()
            for metric in study.left_out
        )
        raise MeasureError(
            f"{what.function}: {type(error).__name__}: {error}{''.join(left_out)}"
        ) from error
    if len(samples) > 2 or any(values.ndim != 1 for values in samples):
        raise MeasureError(
            f"{what.function} must return an array of one value each, or a tuple of two"
        )
    missing = sum(int(np.isnan(values).sum()) for values in samples)
    estimate = mean_estimate(*reversed(samples), distribution=what.distribution)
    counts = [sample.n for sample in estimate.samples]
    words = " and ".join(f"{count:,}" for count in counts)
    return Measured(estimate, words, sum(counts), missing)
