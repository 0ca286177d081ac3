"""The values of metrics of a trial: those that are derived from others, and the two
that are kept of each.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sweep.spec.derived_metrics import DerivedMetric
from sweep.spec.evaluation import left_open
from sweep.spec.settings import Value
from sweep.spec.study import RecordSpec
from sweep.trial.state import Taken

Floats = NDArray[np.float64]


def measured(
    record: RecordSpec, taken: Taken, settings: Mapping[str, Value]
) -> dict[str, Floats]:
    """The values of all metrics of a record by name, each (F,): those that were `taken`
    for it, and what it derives from them.
    """
    values = dict(zip(record.metrics, taken.values, strict=True))
    return with_derived(record.derive, values, settings)


def with_derived(
    derived: tuple[DerivedMetric, ...],
    values: Mapping[str, Floats],
    settings: Mapping[str, Value],
) -> dict[str, Floats]:
    """The `values` of metrics by name, each (F,) over frames, with those of `derived`
    ones, each of which stands after those that it needs.

    A part of an expression that has no finite value in a frame, as the quotient of
    zeros, is NaN there, like a metric that has no value. What is computed from NaN is
    NaN, and no comparison with it holds.
    """
    found = dict(values)
    for one in derived:
        frames = len(next(iter(found.values())))
        found[one.name] = one.expression.evaluate(
            {**settings, **found}, frames, left_open
        )
    return found


def summaries(
    values: Mapping[str, Floats], frames: NDArray[np.int64], steps: int
) -> tuple[dict[str, float], dict[str, float]]:
    """What is kept of each metric of a trial of so many steps: its value at the last
    frame, and its mean over the frames of the last half.

    values  of each metric, (F,)
    frames  the steps of the frames, (F,)
    steps   those of the trial
    """
    late = 2 * frames > steps
    return (
        {name: float(value[-1]) for name, value in values.items()},
        {name: float(value[late].mean()) for name, value in values.items()},
    )
