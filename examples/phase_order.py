"""Metrics of swarmalators: how well phases agree, and how well phases and places do."""

import math

from kernels.elementary import atan2, sine_cosine
from kernels.jit import jit
from kernels.metrics import Ground, Metric
from kernels.recording import FIRST_STATE, Frames
from kernels.settings import Observation
from kernels.state import Floats

PHASE = FIRST_STATE
"""The row of the bodies: that of the state comes after the six of the flock."""


@jit
def mean_resultant(frames: Frames, f: int, side: float) -> float:
    """The length of the mean of exp(i (phase + side * angle)), where the angle of a
    boid is that of its place about the centre of all.
    """
    n = frames.bodies.shape[2]
    mean_x, mean_y = 0.0, 0.0
    for i in range(n):
        mean_x += frames.bodies[f, 0, i] / n
        mean_y += frames.bodies[f, 1, i] / n
    x, y = 0.0, 0.0
    for i in range(n):
        dx, dy = frames.bodies[f, 0, i] - mean_x, frames.bodies[f, 1, i] - mean_y
        angle = frames.bodies[f, PHASE, i] + side * atan2(dy, dx)
        sine, cosine = sine_cosine(angle)
        x += cosine
        y += sine
    return float(math.sqrt(x * x + y * y) / n)


@jit
def coherence(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """1 if all phases are equal."""
    for f in range(filled):
        values[f] = mean_resultant(frames, f, 0.0)


@jit
def wave(
    frames: Frames,
    filled: int,
    _ground: Ground,
    _observation: Observation,
    values: Floats,
) -> None:
    """The larger one of S+ and S-: 1 if the phase goes round with the place."""
    for f in range(filled):
        values[f] = max(mean_resultant(frames, f, 1.0), mean_resultant(frames, f, -1.0))


SOURCE = "K. P. O'Keeffe, H. Hong, S. H. Strogatz (2017), Nat. Commun. 8, 1504"
METRICS = {
    "phase_coherence": Metric(
        coherence, "", "length of the mean of exp(i phase)", SOURCE, state=("phase",)
    ),
    "phase_wave": Metric(
        wave, "", "S+ or S-: agreement of phases and places", SOURCE, state=("phase",)
    ),
}
