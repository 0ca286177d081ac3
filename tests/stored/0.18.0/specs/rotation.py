"""The metric rotation: how far the boids circle about their centre, all the same way.

A spec names this file under `record`, and the metric by its name in METRICS.
"""

import math

from kernels.jit import jit
from kernels.metrics import Ground, Metric
from kernels.recording import Frames
from kernels.settings import Observation
from kernels.state import Floats


@jit
def measure(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Write one number into `values` for each of the `filled` first frames.

    Of frame f, `frames.bodies[f]` has x, y, vx and vy of all boids, and the velocities
    of the step before: shape (6, N). A metric is compiled: it makes no arrays.
    """
    n = frames.bodies.shape[2]
    for f in range(filled):
        mean_x, mean_y = 0.0, 0.0
        for i in range(n):
            mean_x += frames.bodies[f, 0, i] / n
            mean_y += frames.bodies[f, 1, i] / n
        total = 0.0
        for i in range(n):
            dx, dy = frames.bodies[f, 0, i] - mean_x, frames.bodies[f, 1, i] - mean_y
            vx, vy = frames.bodies[f, 2, i], frames.bodies[f, 3, i]
            size = math.sqrt((dx * dx + dy * dy) * (vx * vx + vy * vy))
            total += (dx * vy - dy * vx) / size if size > 0.0 else 0.0
        values[f] = abs(total) / n


METRICS = {
    "rotation": Metric(
        measure,
        unit="",
        text="mean sine between way from the centre and velocity: 1 if all circle",
        source="not stated",  # who described it, and where
    )
}
