"""Estimates of measures from stored trials.

Trials without a result are left out, and counted.
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
from sweep.errors import ChoiceError, StoreError
from sweep.methods.calibration import posterior_estimate
from sweep.methods.scaling import Scaling, finite_size_scaling
from sweep.published.measures import (
    CalibratedParameter,
    Call,
    Mean,
    MeanDifference,
    Measure,
    RankCorrelation,
    Transition,
    columns_read,
)
from sweep.spec import Column
from sweep.tables import StoredStudy

Studies = Mapping[str, StoredStudy]


class Measured(NamedTuple):
    """An estimate, or the scaling of a transition, with numbers of trials.

    Attributes
    ----------
    estimate : Estimate or Scaling
        A Scaling for a transition.
    trials : str
        Number of trials, in words.
    used : int
        Number of trials.
    left_out : int
        Number of trials that have no result.
    """

    estimate: Estimate | Scaling
    trials: str
    used: int
    left_out: int


class MeasureError(Exception):
    """A measure that failed.

    A function of figures.py raised an error or returned the wrong type, or the points
    of a study do not belong to one transition.
    """


def metrics_left_out(studies: Studies, quantity: Measure) -> str:
    """Return the metrics of `quantity` that the studies leave out, with the reasons.

    The text is "" without such metrics.
    """
    reasons = (
        _left_out_text(studies[spec], Column.read(column).metric)
        for spec, column in columns_read(quantity)
    )
    return "; ".join(dict.fromkeys(filter(None, reasons)))


def _left_out_text(study: StoredStudy, metric: str) -> str:
    reason = study.left_out.get(metric)
    return f"{metric} {reason}" if reason else ""


def measure(
    studies: Studies, quantity: Measure, functions: Mapping[str, Callable[..., Any]]
) -> Measured:
    """Return the estimate of a quantity from stored studies.

    Parameters
    ----------
    studies : mapping of str to StoredStudy
        Stored studies by spec.
    quantity : Measure
        Quantity to estimate.
    functions : mapping of str to callable
        Functions of figures.py by name.

    Raises
    ------
    MeasureError
        If a function of figures.py fails, or the points do not belong to one
        transition.
    """
    if isinstance(quantity, Mean):
        sample = _units(studies[quantity.spec], quantity, set(quantity.settings))
        return Measured(
            mean_estimate(
                sample.array(), distribution=_distribution(studies, quantity)
            ),
            f"{sample.trials:,}",
            sample.trials,
            sample.left_out,
        )
    if isinstance(quantity, MeanDifference):
        return _difference(studies, quantity)
    if isinstance(quantity, RankCorrelation):
        return _rank_correlation(studies[quantity.spec], quantity)
    if isinstance(quantity, Transition):
        return _transition(studies[quantity.spec], quantity)
    if isinstance(quantity, CalibratedParameter):
        return _posterior(studies[quantity.spec], quantity)
    return _called(studies, quantity, functions)


def _difference(studies: Studies, difference: MeanDifference) -> Measured:
    """Return the first mean minus the second.

    Pairs are compared if the two sides have equal units. Otherwise independent samples
    are compared.
    """
    named = {*difference.first.settings, *difference.second.settings}
    first, second = (
        _units(studies[side.spec], side, named)
        for side in (difference.first, difference.second)
    )
    comparison = compare(second, first, _distribution(studies, difference.first))
    trials = f"{first.trials:,} and {second.trials:,}" + (
        ", paired" if comparison.paired else ""
    )
    return Measured(
        comparison.estimate, trials, first.trials + second.trials, comparison.left_out
    )


def _distribution(studies: Studies, mean: Mean) -> Declaration:
    """Return the declared distribution of the metric of a mean.

    The declaration is valid for values of trials and for means of such values.
    """
    return studies[mean.spec].distributions[mean.metric]


def _units(study: StoredStudy, mean: Mean, named: set[str]) -> Units:
    """Return the units of a mean.

    Units are paired by the varied parameters, without the parameters that the measure
    has `named`.
    """
    trials = chosen(study.trials, mean.settings)
    free = [name for name in study.varied if name not in named]
    return units(trials, _trial_values(study, trials, mean), mean.unit, free)


def _trial_values(
    study: StoredStudy, trials: pd.DataFrame, mean: Mean
) -> "pd.Series[float]":
    """Return one value per row of `trials`, NaN for a trial that is not done."""
    if mean.frames is None:
        values = trials[mean.metric]
    else:
        series = study.series
        frames = series[series["frame"].between(*mean.frames)]
        values = trials["trial_id"].map(frames.groupby("trial_id")[mean.metric].mean())
    return values.astype(np.float64).where(trials["status"] == "done")


def _rank_correlation(study: StoredStudy, correlation: RankCorrelation) -> Measured:
    trials = chosen(study.trials, correlation.settings)
    values = trials[correlation.column].where(trials["status"] == "done")
    points = trials.assign(_value=values).groupby("point", sort=False)
    settings = points[correlation.setting].first().to_numpy(np.float64)
    estimate = rank_estimate(settings, points["_value"].mean().to_numpy(np.float64))
    count = int(values.notna().sum())
    label = f"{count:,} at {estimate.n:,} points"
    return Measured(estimate, label, count, int(values.isna().sum()))


def _transition(study: StoredStudy, transition: Transition) -> Measured:
    try:
        scaling = finite_size_scaling(
            study.where(**transition.settings), transition.series
        )
    except ChoiceError as error:
        raise MeasureError(str(error)) from None
    used = int(scaling.states["trials"].sum())
    label = f"{used:,} at {len(scaling.states):,} points"
    return Measured(scaling, label, used, scaling.left_out)


def _posterior(study: StoredStudy, quantity: CalibratedParameter) -> Measured:
    try:
        estimate, trials = posterior_estimate(study, quantity.parameter)
    except (ChoiceError, StoreError) as error:
        raise MeasureError(str(error)) from None
    label = f"{trials:,}, and {len(estimate.draws):,} simulations kept"
    return Measured(estimate, label, trials, 0)


def _called(
    studies: Studies, call: Call, functions: Mapping[str, Callable[..., Any]]
) -> Measured:
    try:
        returned = functions[call.function](studies, **call.settings)
        samples = [
            np.asarray(values, np.float64)
            for values in (returned if isinstance(returned, tuple) else (returned,))
        ]
    except Exception as error:
        left_out = dict.fromkeys(
            f"; {_left_out_text(study, metric)}"
            for study in studies.values()
            for metric in study.left_out
        )
        raise MeasureError(
            f"{call.function}: {type(error).__name__}: {error}{''.join(left_out)}"
        ) from error
    if len(samples) > 2 or any(values.ndim != 1 for values in samples):
        raise MeasureError(
            f"{call.function} must return an array of values, or a tuple of two arrays"
        )
    missing = sum(int(np.isnan(values).sum()) for values in samples)
    estimate = mean_estimate(*reversed(samples), distribution=call.distribution)
    counts = [sample.n for sample in estimate.samples]
    label = " and ".join(f"{count:,}" for count in counts)
    return Measured(estimate, label, sum(counts), missing)
