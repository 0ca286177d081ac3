"""Derived metrics of a trial, and the two stored values of each metric."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sweep.spec import DerivedMetric, RecordSpec, Value, left_open
from sweep.trial.state import Taken

Floats = NDArray[np.float64]


def measured(
    record: RecordSpec, taken: Taken, settings: Mapping[str, Value]
) -> dict[str, Floats]:
    """Return the values of all metrics of a record, measured and derived ones.

    Parameters
    ----------
    record : RecordSpec
    taken : Taken
        Frames with the values of the measured metrics.
    settings : mapping
        All parameters of the trial.

    Returns
    -------
    dict of arrays, shape (F,)
        One value per frame, by name of the metric.
    """
    values = dict(zip(record.metrics, taken.values, strict=True))
    return with_derived(record.derive, values, settings)


def with_derived(
    derived: tuple[DerivedMetric, ...],
    values: Mapping[str, Floats],
    settings: Mapping[str, Value],
) -> dict[str, Floats]:
    """Return the values of metrics, together with the values of derived metrics.

    A part of an expression without a finite value in a frame, such as 0 / 0, is NaN
    there, like a metric without a value. Results computed from NaN are NaN, and no
    comparison with NaN holds.

    Parameters
    ----------
    derived : tuple of DerivedMetric
        Each one comes after the derived metrics that it needs.
    values : mapping of arrays, shape (F,)
        One value per frame, by name of the metric.
    settings : mapping
        All parameters of the trial.

    Returns
    -------
    dict of arrays, shape (F,)
    """
    every = dict(values)
    for metric in derived:
        frames = len(next(iter(every.values())))
        every[metric.name] = metric.expression.evaluate(
            {**settings, **every}, frames, left_open
        )
    return every


def summaries(
    values: Mapping[str, Floats],
    frames: NDArray[np.int64],
    steps: int,
    *,
    recorded: bool = False,
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the stored values of the metrics of a trial.

    Parameters
    ----------
    values : mapping of arrays, shape (F,)
        One value per frame, by name of the metric.
    frames : array of int, shape (F,)
        Steps of the frames.
    steps : int
        Steps of the trial.
    recorded : bool, default False
        Whether the trial is an event of a recording. An event has no transient, so
        means cover all frames. They leave out frames without a value.

    Returns
    -------
    last : dict of float
        Value at the last frame, by metric.
    mean : dict of float
        Mean over the frames of the second half, by metric; of an event, over all.
    """
    averaged = (2 * frames > steps) | recorded
    return (
        {name: float(value[-1]) for name, value in values.items()},
        {name: _mean(value[averaged], recorded) for name, value in values.items()},
    )


def _mean(values: Floats, recorded: bool) -> float:
    is_defined = np.isfinite(values)
    if recorded and is_defined.any():
        return float(values[is_defined].mean())
    return float(values.mean())
