"""Our trials beside Mesa, which many use for models of agents."""

import time
from statistics import median

from tests.bench.cases import BEST, covering
from tests.bench.scale import FULL, Scale
from tests.bench.timing import alone, one_core

ROUNDS = 5
N, STEPS, THEIR_STEPS = 100, 3600, 20


def mesa(scale: Scale = FULL) -> None:
    """Processor time of a boid-step against Mesa's flocking example with its own
    settings, in turn.
    """
    try:
        from mesa.examples.basic.boid_flockers.model import BoidFlockers
    except ImportError:
        print("mesa: not installed, skipped")
        return
    steps, their_steps = scale.of(STEPS), scale.of(THEIR_STEPS)
    one = covering("cafeteria", N, steps, BEST["cafeteria"])
    model = BoidFlockers(population_size=N)
    pairs = []
    with one_core():
        model.step()
        alone(one)
        for _ in range(scale.of(ROUNDS)):
            began = time.thread_time()
            for _ in range(their_steps):
                model.step()
            theirs = (time.thread_time() - began) / (N * their_steps)
            pairs.append((theirs, alone(one) / (N * steps)))
    theirs, mine = (median(column) for column in zip(*pairs, strict=True))
    ratio = median(a / b for a, b in pairs)
    print(
        f"mesa: {theirs * 1e6:.1f} us a boid-step, ours {mine * 1e9:.0f} ns,"
        f" {ratio:.0f} times faster"
    )
