"""Metrics of a part of the flock: of boids of one kind, or of boids that work.

`polarization_of_sheep` is the polarization of the sheep, as if there were no other
boid. `polarization_of_working` is that of all boids that have not failed by then.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from kernels.metrics.ground import Metric
from kernels.model import WORKING
from kernels.state import Kinds

OF = "_of_"
"""Separator of the metric and the part in a name."""


def of_part(
    name: str, metrics: Mapping[str, Metric], kinds: Iterable[str]
) -> Metric | None:
    """Return the metric of a part that a name denotes, or None.

    Parameters
    ----------
    name : str
        Name such as "speed_of_working".
    metrics : mapping of str to Metric
        Metrics that may have parts.
    kinds : iterable of str
        Kinds of boids, which are parts too.

    Returns
    -------
    Metric or None
        None if `name` denotes no part, or a metric without parts.
    """
    base, separator, part = name.rpartition(OF)
    if not separator or part not in (WORKING, *kinds) or base not in metrics:
        return None
    metric = metrics[base]
    if not has_parts(metric):
        return None
    among = "that have not failed" if part == WORKING else f"of the kind {part}"
    return metric._replace(part=part, text=f"{metric.text}; among boids {among}")


def has_parts(metric: Metric) -> bool:
    """Return whether a metric has metrics of parts of the boids.

    It does if it reads the bodies, and treats all boids in the same way.
    """
    return metric.looks and not (metric.kinds or metric.state or metric.part)


def members(
    part: str,
    kinds: tuple[str, ...],
    kind: Kinds,
    fails_at: NDArray[np.int64],
    steps: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Return which boids are of a part after each of some steps.

    A boid that fails when `fails_at` steps are done has failed after the next step.

    Parameters
    ----------
    part : str
        WORKING, or the name of a kind.
    kinds : tuple of str
        Names of the kinds.
    kind : array of int, shape (N,)
        Index of the kind of each boid.
    fails_at : array of int, shape (N,)
        Number of steps done when a boid fails, or NEVER.
    steps : array of int, shape (F,)
        Numbers of steps done.

    Returns
    -------
    array of bool, shape (F, N)
    """
    if part == WORKING:
        return steps[:, None] <= fails_at
    return np.broadcast_to(kind == kinds.index(part), (len(steps), kind.size))
