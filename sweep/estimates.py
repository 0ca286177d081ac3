"""From a measure to its estimate in stored trials. Trials without a result are left out, and counted."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import Estimate, mean_estimate, rank_estimate
from sweep.measures import Call, Difference, Mean, Measure, RankCorrelation, agrees
from sweep.study import StoredStudy

Studies = Mapping[str, StoredStudy]

REPLICATE = ("seed", "replicate")
UNITS = {"trial": ["trial_id"], "replicate": list(REPLICATE), "point": ["point"]}


class Measured(NamedTuple):
    """An estimate, the number of trials behind it in words, and how many were left out as without a result."""

    estimate: Estimate
    trials: str
    left_out: int


class MeasureError(Exception):
    """A function of figures.py did not return what a measure needs, or raised."""


class _Units(NamedTuple):
    """The independent values of one mean: `values` (NaN where a trial lacks one) by the keys that pair them."""

    values: "pd.Series[float]"
    trials: int
    left_out: int
    pairs: bool

    def array(self) -> NDArray[np.float64]:
        return np.asarray(self.values, np.float64)


def measure(studies: Studies, what: Measure, functions: Mapping[str, Callable[..., Any]]) -> Measured:
    """The estimate of `what` in `studies`, which go by the names of their specs.

    Raises MeasureError where a function that it calls fails.
    """
    if isinstance(what, Mean):
        units = _units(studies[what.spec], what, set(what.settings))
        return Measured(mean_estimate(units.array()), f"{units.trials:,}", units.left_out)
    if isinstance(what, Difference):
        return _difference(studies, what)
    if isinstance(what, RankCorrelation):
        return _rank_correlation(studies[what.spec], what)
    return _called(studies, what, functions)


def _difference(studies: Studies, what: Difference) -> Measured:
    """Paired where both sides have the same units, else between independent samples."""
    named = {*what.first.settings, *what.second.settings}
    one, other = (_units(studies[side.spec], side, named) for side in (what.first, what.second))
    trials, left_out = f"{one.trials:,} and {other.trials:,}", one.left_out + other.left_out
    if _pairable(one, other):
        differences = one.values - other.values.loc[one.values.index]
        return Measured(mean_estimate(np.asarray(differences, np.float64)), f"{trials}, paired", left_out)
    return Measured(mean_estimate(one.array(), other.array()), trials, left_out)


def _pairable(one: _Units, other: _Units) -> bool:
    indices = one.values.index, other.values.index
    return (
        one.pairs
        and other.pairs
        and list(indices[0].names) == list(indices[1].names)
        and all(index.is_unique for index in indices)
        and set(indices[0]) == set(indices[1])
    )


def _units(study: StoredStudy, mean: Mean, named: set[str]) -> _Units:
    """The units of a mean; settings that the measure names in `named` are no part of what pairs them."""
    trials = _chosen(study.trials, mean.settings)
    free = [name for name in study.varied if name not in named]
    single = trials["point"].nunique() <= 1
    keys = {"trial": [*REPLICATE, *free], "replicate": [*REPLICATE], "point": free}[mean.unit]
    keys = [*REPLICATE] if single else keys or ["point"]
    values = _trial_values(study, trials, mean)
    table = trials[list(dict.fromkeys([*UNITS[mean.unit], *keys]))].assign(_value=values)
    groups = table.groupby(UNITS[mean.unit], sort=False)
    # A unit that lacks one of its trials would be the mean of something else.
    complete = groups["_value"].count() == groups.size()
    by_unit = groups["_value"].mean().where(complete).to_numpy(np.float64)
    index = pd.MultiIndex.from_frame(table.drop_duplicates(UNITS[mean.unit])[keys])
    common = bool(trials["streams"].str.contains("start=common").all())
    return _Units(
        pd.Series(by_unit, index=index),
        int(values.notna().sum()),
        int(values.isna().sum()),
        common or "replicate" not in keys,
    )


def _trial_values(study: StoredStudy, trials: pd.DataFrame, mean: Mean) -> "pd.Series[float]":
    """One value a row of `trials`, NaN where it is not done."""
    if mean.frames is None:
        values = trials[mean.metric]
    else:
        series = study.series
        frames = series[series["frame"].between(*mean.frames)]
        values = trials["trial_id"].map(frames.groupby("trial_id")[mean.metric].mean())
    return values.astype(np.float64).where(trials["status"] == "done")


def _chosen(trials: pd.DataFrame, settings: Mapping[str, Any]) -> pd.DataFrame:
    for name, value in settings.items():
        trials = trials[agrees(trials[name].to_numpy(), value)]
    return trials


def _rank_correlation(study: StoredStudy, what: RankCorrelation) -> Measured:
    trials = _chosen(study.trials, what.settings)
    values = trials[what.column].where(trials["status"] == "done")
    points = trials.assign(_value=values).groupby("point", sort=False)
    settings = points[what.setting].first().to_numpy(np.float64)
    estimate = rank_estimate(settings, points["_value"].mean().to_numpy(np.float64))
    return Measured(estimate, f"{values.notna().sum():,} at {estimate.n:,} points", int(values.isna().sum()))


def _called(studies: Studies, what: Call, functions: Mapping[str, Callable[..., Any]]) -> Measured:
    try:
        found = functions[what.function](studies)
        samples = [np.asarray(values, np.float64) for values in (found if isinstance(found, tuple) else (found,))]
    except Exception as error:
        raise MeasureError(f"{what.function}: {type(error).__name__}: {error}") from error
    if len(samples) > 2 or any(values.ndim != 1 for values in samples):
        raise MeasureError(f"{what.function} must return an array of one value each, or a tuple of two")
    left_out = sum(int(np.isnan(values).sum()) for values in samples)
    estimate = mean_estimate(*samples)
    return Measured(estimate, " and ".join(f"{sample.n:,}" for sample in estimate.samples), left_out)
