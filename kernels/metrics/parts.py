"""Metrics of a part of the flock: of boids of one kind, or of those that work.

`polarization_of_sheep` is the polarization of the sheep, as if no other boid were
there; `polarization_of_working` that of all that have not failed by then.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from kernels.metrics.ground import Metric
from kernels.model import WORKING
from kernels.state import Kinds

OF = "_of_"
"""Stands in a name between the metric and the part."""


def of_part(
    name: str, metrics: Mapping[str, Metric], kinds: Iterable[str]
) -> Metric | None:
    """The metric of a part that `name` stands for, as `speed_of_working`, of one of
    these `metrics`; None where it stands for none.
    """
    whole, found, part = name.rpartition(OF)
    if not found or part not in (WORKING, *kinds) or whole not in metrics:
        return None
    metric = metrics[whole]
    if not has_parts(metric):
        return None
    among = "that have not failed" if part == WORKING else f"of the kind {part}"
    return metric._replace(part=part, text=f"{metric.text}; among boids {among}")


def has_parts(metric: Metric) -> bool:
    """Whether there is such a metric of a part of the boids: if it looks at them, all
    alike.
    """
    return metric.looks and not (metric.kinds or metric.state or metric.part)


def members(
    part: str,
    kinds: tuple[str, ...],
    kind: Kinds,
    fails_at: NDArray[np.int64],
    steps: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Which boids are of a part after each of these `steps` (F,); shape (F, N).

    A boid that fails when so many steps are done has failed after the next one.
    """
    if part == WORKING:
        return steps[:, None] <= fails_at
    return np.broadcast_to(kind == kinds.index(part), (len(steps), kind.size))
