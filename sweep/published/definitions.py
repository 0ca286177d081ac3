"""What is recorded of trials, against what its definition makes of what else is stored
of them. It shares no code with kernels, nor with what sums up a trial.

So a row of a document that asks for it notices mistakes of the program that its other
rows cannot: they compare trials with each other, of which each has the same mistake.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]

CLOSE = 1e-6
"""Relative: the order of a sum differs."""


def _polarization(bodies: Floats, _trial: "pd.Series[Any]") -> Floats:
    vx, vy = bodies[:, 2], bodies[:, 3]
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
"""By metric its values (F,) of bodies (F, 4, N): x, y, vx, vy; and of the row of the
trial, which has the settings.
"""


def as_defined(studies: Mapping[str, StoredStudy], spec: str) -> Floats:
    """100 for each trial of a spec that is done and as defined, 0 for each other one.

    Of each metric of DEFINITIONS of which trajectories are stored, and of each series,
    the value of a trial must be that of its last frame, and its mean that over the
    frames of the last half. And no other replicate of its point may have the same
    frames. Raises ValueError for a study that stores neither.
    """
    study = studies[spec]
    trials = study.trials[study.trials["status"] == "done"]
    series = dict(list(study.series.groupby("trial_id")))
    shares, seen = list[float](), set[bytes]()
    for _, trial in trials.iterrows():
        frames = dict(_frames(study, trial, series))
        if not frames:
            raise ValueError(f"{study.name} stores nothing that defines its metrics")
        values = [one.tobytes() for _, one in frames.values()]
        mark = b"".join([trial["point"].encode(), *values])
        as_stored = [
            np.isclose(trial[column], value, rtol=CLOSE, equal_nan=True)
            for name, known in frames.items()
            for column, value in _summed(name, *known, trial["steps"])
        ]
        shares.append(100.0 * (all(as_stored) and mark not in seen))
        seen.add(mark)
    return np.array(shares)


def _frames(
    study: StoredStudy, trial: "pd.Series[Any]", series: Mapping[Any, pd.DataFrame]
) -> Iterator[tuple[str, tuple[NDArray[np.int64], Floats]]]:
    """By metric the frames (F,) of a trial that are stored, and its values in them."""
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
    """The columns of a metric in the table of trials, and what must stand there."""
    yield name, float(values[-1])
    yield f"{name}_mean", float(values[frames > steps / 2].mean())
