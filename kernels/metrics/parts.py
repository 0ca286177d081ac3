"""Metrics of a part of the flock: boids of one kind, or boids that have not failed.

`polarization_of_sheep` is the polarization of the sheep, without any further boid.
`polarization_of_working` is the polarization of all boids that have not failed yet.
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
    """Return the metric of a part of the boids that a name denotes, or None.

    Parameters
    ----------
    name : str
        Name such as "speed_of_working".
    metrics : mapping of str to Metric
        Metrics that may have parts.
    kinds : iterable of str
        Kinds of boids; each kind is a part.

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

    A metric has parts if the metric reads the bodies, and needs neither kinds nor state
    rows.
    """
    return metric.looks and not (metric.kinds or metric.state or metric.part)


def members(
    part: str,
    kinds: tuple[str, ...],
    kind: Kinds,
    fails_at: NDArray[np.int64],
    steps: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Return a mask of the boids that belong to a part, after given steps.

    A boid that fails after `fails_at` steps counts as failed after the next step.

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
