"""Metrics of a part of the flock: boids of one kind, or boids that have not failed.

`polarization_of_sheep` is the polarization of the sheep, without any further boid.
`polarization_of_working` is the polarization of all boids that have not failed yet.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

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
    metric = split_name(name, metrics, kinds)
    return metric if metric and has_parts(metric._replace(part="")) else None


def split_name(name: str, entries: Mapping[str, Any], kinds: Iterable[str]) -> Any:
    """Return an entry for the part of the boids in a name; None without a part.

    Parameters
    ----------
    name : str
        Name of an entry and of a part, such as "speed_of_working".
    entries : mapping
        Entries with the fields `part` and `text`: metrics or profiles.
    kinds : iterable of str
        Kinds of boids; each kind is a part.
    """
    base, separator, part = name.rpartition(OF)
    if not separator or part not in (WORKING, *kinds) or base not in entries:
        return None
    entry = entries[base]
    if entry.part:
        return None
    among = "that have not failed" if part == WORKING else f"of the kind {part}"
    return entry._replace(part=part, text=f"{entry.text}; among boids {among}")


def of_any_model(
    name: str,
    entries: Mapping[str, Any],
    of_part: Callable[[str, Mapping[str, Any], Iterable[str]], Any],
) -> Any:
    """Return the result of `of_part` for the kinds of boids of all models.

    Parameters
    ----------
    name : str
        Name of an entry and of a part.
    entries : mapping
        Metrics or profiles by name.
    of_part : callable
        Function of the name, the entries and the kinds.
    """
    if OF not in name:
        return None
    from kernels.models import MODELS  # imported late: packages may add models

    kinds = (kind for model in MODELS.values() for kind in model.kinds)
    return of_part(name, entries, kinds)


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
