"""Recorded values, compared with values that are computed again from stored tables.

The definitions of this module share no code with kernels, nor with the summary of a
trial. So a claim that calls the definitions can detect mistakes of the program. Most
claims only compare trials with each other, and every trial contains the mistake.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables import StoredStudy

Floats = NDArray[np.float64]

CLOSE = 1e-6
"""Relative tolerance: the order of a sum differs."""


def _polarization(bodies: Floats, _trial: "pd.Series[Any]") -> Floats:
    vx = bodies[:, 2]
    vy = bodies[:, 3]
    flying = (vx != 0.0) | (vy != 0.0)
    headings = flying * np.exp(1j * np.arctan2(vy, vx))
    return np.asarray(np.abs(headings.mean(axis=1)))


def _flock_radius(bodies: Floats, _trial: "pd.Series[Any]") -> Floats:
    places = bodies[:, 0] + 1j * bodies[:, 1]
    off = np.abs(places - places.mean(axis=1, keepdims=True))
    return np.asarray(off.mean(axis=1))


def _speed(bodies: Floats, _trial: "pd.Series[Any]") -> Floats:
    return np.asarray(np.hypot(bodies[:, 2], bodies[:, 3]).mean(axis=1))


def _in_contact(bodies: Floats, trial: "pd.Series[Any]") -> Floats:
    places = bodies[:, 0] + 1j * bodies[:, 1]
    apart = np.abs(places[:, :, None] - places[:, None])
    apart[:, *np.diag_indices(places.shape[1])] = np.inf
    near = apart.min(axis=2) < trial["contact_distance"]
    return np.asarray(100.0 * near.mean(axis=1))


DEFINITIONS: Mapping[str, Callable[[Floats, "pd.Series[Any]"], Floats]] = {
    "polarization": _polarization,
    "flock_radius": _flock_radius,
    "speed": _speed,
    "in_contact": _in_contact,
}
"""By metric, the function that computes the values (F,).

The arguments are the bodies (F, 4, N) with x, y, vx and vy, and the row of the trial.
The row has the parameters.
"""


def as_defined(studies: Mapping[str, StoredStudy], spec: str) -> Floats:
    """Return 100 for each finished trial that agrees with the definitions, else 0.

    The check covers each recorded series and, with stored trajectories, each metric of
    DEFINITIONS. The value of a trial must equal the value of the last frame. The mean
    of a trial must equal the mean over the frames of the second half. Two replicates of
    one point may not have equal frames.

    Parameters
    ----------
    studies : mapping of str to StoredStudy
        Stored studies by spec.
    spec : str
        Spec whose trials are checked.

    Returns
    -------
    ndarray of float, shape (trials,)

    Raises
    ------
    ValueError
        If a trial has neither series nor trajectories.
    """
    study = studies[spec]
    trials = study.trials[study.trials["status"] == "done"]
    series = dict(list(study.series.groupby("trial_id")))
    shares = list[float]()
    earlier = set[bytes]()
    for _, trial in trials.iterrows():
        frames = dict(_frames(study, trial, series))
        if not frames:
            raise ValueError(f"{study.name} stores neither series nor trajectories")
        values = [recorded.tobytes() for _, recorded in frames.values()]
        mark = b"".join([trial["point"].encode(), *values])
        as_stored = [
            np.isclose(trial[column], value, rtol=CLOSE, equal_nan=True)
            for name, flown in frames.items()
            for column, value in _summed(name, *flown, trial["steps"])
        ]
        shares.append(100.0 * (all(as_stored) and mark not in earlier))
        earlier.add(mark)
    return np.array(shares)


def _frames(
    study: StoredStudy, trial: "pd.Series[Any]", series: Mapping[Any, pd.DataFrame]
) -> Iterator[tuple[str, tuple[NDArray[np.int64], Floats]]]:
    """Yield each metric with the stored frames (F,) and the values (F,)."""
    for name in study.series_metrics:
        rows = series[trial["trial_id"]]
        yield name, (rows["frame"].to_numpy(), rows[name].to_numpy())
    if "trajectories" in (study.about.tables or ()):
        frames, bodies = study.trajectory(trial["trial_id"])
        for name in study.metrics:
            if name in DEFINITIONS:
                yield name, (frames, DEFINITIONS[name](bodies, trial))


def _summed(
    name: str, frames: NDArray[np.int64], values: Floats, steps: int
) -> Iterator[tuple[str, float]]:
    """Yield the columns of a metric in the table of trials, with correct values."""
    yield name, float(values[-1])
    yield f"{name}_mean", float(values[frames > steps / 2].mean())
