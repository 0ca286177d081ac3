"""Rules that need neither neighbours nor obstacles."""

import numpy as np

from kernels.jit import jit


@jit
def wander(rng: np.random.Generator, width: float) -> tuple[float, float]:
    """Two independent components, uniform within +-width: Eq. (8) of nguyen2024."""
    x = rng.uniform(-width, width)
    y = rng.uniform(-width, width)
    return x, y
