"""The metric predator_distance: how far prey are from the predator next to them."""

import math

from kernels.jit import jit
from kernels.metrics import Ground, Metric
from kernels.recording import Frames
from kernels.settings import Observation
from kernels.state import Floats

PREY, PREDATOR = 0, 1


@jit
def measure(
    frames: Frames,
    filled: int,
    ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """Mean distance of a prey to the nearest predator; NaN without predators."""
    n = frames.bodies.shape[2]
    for f in range(filled):
        total, prey = 0.0, 0
        for i in range(n):
            nearest2 = math.inf
            for j in range(n):
                dx = frames.bodies[f, 0, j] - frames.bodies[f, 0, i]
                dy = frames.bodies[f, 1, j] - frames.bodies[f, 1, i]
                hunted = ground.kind[i] == PREY and ground.kind[j] == PREDATOR
                nearest2 = min(nearest2, dx * dx + dy * dy if hunted else math.inf)
            total += math.sqrt(nearest2) if ground.kind[i] == PREY else 0.0
            prey += 1 if ground.kind[i] == PREY else 0
        values[f] = total / prey if math.isfinite(total) else math.nan


METRICS = {
    "predator_distance": Metric(
        measure,
        unit="length",
        text="mean distance of prey to the nearest predator",
        source="our own",
        pairwise=True,
        kinds=("prey", "predator"),
    )
}
