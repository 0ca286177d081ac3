"""vicsek1995 as one writes it for JAX: all boids of a flock at once, flocks side by
side by `vmap`, steps by `scan`. Sums are in an order of the compiler, so that its bits
are others than ours.
"""

import time
from typing import Any, NamedTuple

import numpy as np

FLOCKS_TIMES_PAIRS = 4_000_000
"""So many pairs of boids of all flocks together: 32 MB for each number of a pair."""
STEPS = 100


class Flocks(NamedTuple):
    """Places and velocities, (N,) each, or (flocks, N)."""

    x: Any
    y: Any
    vx: Any
    vy: Any


def step(numpy: Any, flock: Flocks, turn: Any, size: float, reach: float) -> Flocks:
    """Eqs. (1) and (2) of Vicsek et al. (1995) in a torus, with the `numpy` of NumPy or
    JAX: boids move along their old headings, and take the average heading of those
    within reach, turned by angles `turn` (N,).
    """
    x, y, vx, vy = flock
    dx, dy = x[:, None] - x[None, :], y[:, None] - y[None, :]
    dx, dy = dx - size * numpy.round(dx / size), dy - size * numpy.round(dy / size)
    near = (dx * dx + dy * dy <= reach * reach).astype(x.dtype)
    sum_x, sum_y = near @ vx, near @ vy
    angle = numpy.arctan2(sum_y, sum_x) + turn
    speed = numpy.sqrt(vx * vx + vy * vy)
    return Flocks(
        (x + vx) % size,
        (y + vy) % size,
        speed * numpy.cos(angle),
        speed * numpy.sin(angle),
    )


def rate(n: int, noise: float, size: float, seed: int = 1) -> tuple[int, float]:
    """How many flocks of `n` boids fly side by side, and the boid-steps a second of all
    of them, after JAX has compiled it. Raises ImportError where it is not installed.
    """
    import jax

    jax.config.update("jax_enable_x64", True)
    count = max(1, FLOCKS_TIMES_PAIRS // n**2)
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, size, (2, count, n))
    angle = rng.uniform(-np.pi, np.pi, (count, n))
    flocks = Flocks(x, y, 0.03 * np.cos(angle), 0.03 * np.sin(angle))

    def one(flock: Flocks, key: Any) -> Flocks:
        def advance(flock: Flocks, key: Any) -> tuple[Flocks, None]:
            turn = noise * (jax.random.uniform(key, (n,), x.dtype) - 0.5)
            return step(jax.numpy, flock, turn, size, 1.0), None

        return jax.lax.scan(advance, flock, jax.random.split(key, STEPS))[0]

    fly = jax.jit(jax.vmap(one))
    keys = jax.random.split(jax.random.key(seed), count)
    there = jax.device_put(flocks)
    jax.block_until_ready(fly(there, keys))
    began = time.perf_counter()
    jax.block_until_ready(fly(there, keys))
    return count, count * n * STEPS / (time.perf_counter() - began)
