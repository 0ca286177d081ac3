"""The mean of recorded series in their steady state, with its interval and what to know
before believing it.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from sweep.analysis.estimate import CONFIDENCE, student_quantile
from sweep.analysis.intervals import Interval, mean_interval
from sweep.analysis.series import (
    ENOUGH_SERIES,
    Autocorrelation,
    as_series,
    burn_in,
    drift,
    integrated_time,
    series_variance,
)
from sweep.text import unknown

Floats = NDArray[np.float64]

DRIFT_LEVEL = 0.01


@dataclass(frozen=True)
class SteadyState:
    """The mean after the burn-in and its interval.

    `series` is their number; `burn_in` and `tau` are in frames. `reliable` says whether
    the series are 50 tau long, without which tau is likely to be too small. `problems`
    say in words why there may be no steady state.
    """

    mean: float
    low: float
    high: float
    series: int
    burn_in: int
    tau: float
    effective: float
    reliable: bool
    drift_p: float
    problems: tuple[str, ...]

    @property
    def stationary(self) -> bool:
        """Whether there are enough values and nothing speaks against a steady state."""
        return not self.problems


class SeriesTables(Protocol):
    """What tables of series by point need of a stored study."""

    @property
    def trials(self) -> pd.DataFrame:
        """One row a trial."""

    @property
    def series(self) -> pd.DataFrame:
        """One row a recorded frame of a trial."""

    @property
    def varied(self) -> list[str]:
        """The settings that differ between points."""


def steady_state(series: ArrayLike, confidence: float = CONFIDENCE) -> SteadyState:
    """The mean of a series (T,) or of several independent ones (m, T) after the
    burn-in, with its interval.

    `burn_in` says what to leave out, and `drift` tests the rest at 1 %; of ten series
    or more that alone decides. The interval of one series is Student's with the
    effective sample size in place of the number of frames, for a stationary series much
    longer than tau: of AR(1) series it covers 90 % at 50 tau, 93 % at 100 and 95 % at
    300 where it says 95 %, and calls up to 2 % of them drifting. That of several is
    Student's interval between their means, which asks for no length, and also holds
    where each settles somewhere else. Raises ValueError for fewer than 20 frames and
    for values that are not finite.
    """
    values = as_series(series)
    start = burn_in(values)
    rest = values[:, start.frames :]
    time, moved = integrated_time(rest), drift(rest)
    found = (
        mean_interval(rest.mean(axis=1), confidence)
        if len(values) > 1
        else _one(rest, time, confidence)
    )
    problems = ["the mean drifts"] if moved.p < DRIFT_LEVEL else []
    # Many series tell a drift by themselves; of few, only their autocorrelation says
    # what is one.
    few = len(values) < ENOUGH_SERIES
    problems += (
        ["no end of a burn-in was found"]
        if not start.end_found and (few or problems)
        else []
    )
    problems += (
        ["shorter than 50 autocorrelation times"] if not time.reliable and few else []
    )
    return SteadyState(*found, start.frames, *time, moved.p, tuple(problems))


def steady_states(
    study: SeriesTables, metric: str, confidence: float = CONFIDENCE
) -> pd.DataFrame:
    """The steady state of a recorded series at each point of a study, from its trials
    that are done.

    Columns: the varied settings, then mean, low, high, series (their number), burn_in
    and tau (both in steps), effective, reliable, drift_p, stationary, problems (in
    words), and left_out, the number of trials that are not done or lack a value. A last
    frame that comes sooner than the others is no part of it. Raises ValueError where
    the study has not recorded `metric`, or fewer than 20 frames of it.
    """
    if metric not in study.series or metric in ("trial_id", "frame"):
        raise ValueError(
            unknown("recorded series", metric, list(study.series.columns[2:]))
        )
    done = study.trials.loc[study.trials["status"] == "done", "trial_id"]
    series = study.series[study.series["trial_id"].isin(done)].pivot(
        index="trial_id", columns="frame", values=metric
    )
    rows = []
    for _, trials in study.trials.groupby("point", sort=False):
        settings = {name: trials[name].iloc[0] for name in study.varied}
        rows.append(settings | _row(series.reindex(trials["trial_id"]), confidence))
    return pd.DataFrame(rows)


def _row(series: pd.DataFrame, confidence: float) -> dict[str, object]:
    """The columns of one point beside its settings; `series` has a row a trial and a
    column a frame.
    """
    series = series.dropna(axis="columns", how="all")
    frames = series.columns.to_numpy(np.int64)
    steps = int(frames[1] - frames[0]) if len(frames) > 1 else 1
    values = series.to_numpy(np.float64)[:, (frames % steps) == 0]
    complete = (
        np.isfinite(values).all(axis=1)
        if values.shape[1]
        else np.zeros(len(values), np.bool_)
    )
    left_out = int((~complete).sum())
    if not complete.any():
        nothing = dict.fromkeys(
            ("mean", "low", "high", "burn_in", "tau", "effective", "drift_p"), np.nan
        )
        return nothing | {
            "series": 0,
            "stationary": False,
            "problems": "no trial is done",
            "left_out": left_out,
        }
    state = steady_state(values[complete], confidence)
    return {
        "mean": state.mean,
        "low": state.low,
        "high": state.high,
        "series": state.series,
        "burn_in": state.burn_in * steps,
        "tau": state.tau * steps,
        "effective": state.effective,
        "reliable": state.reliable,
        "drift_p": state.drift_p,
        "stationary": state.stationary,
        "problems": "; ".join(state.problems),
        "left_out": left_out,
    }


def _one(values: Floats, time: Autocorrelation, confidence: float) -> Interval:
    """The interval of one series (1, T) from its variance and autocorrelation time."""
    mean = float(values.mean())
    if math.isnan(time.tau):
        return Interval(mean, mean, mean, 1)
    error = math.sqrt(series_variance(values, time.tau) / time.effective)
    half = (
        student_quantile(0.5 + confidence / 2, max(1.0, time.effective - 1.0)) * error
    )
    return Interval(mean, mean - half, mean + half, 1)
