"""What a step of one boid costs in large flocks at the density of small ones."""

import time
import tracemalloc
from statistics import median

from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.spec.study import RecordSpec, Streams
from sweep.trial.simulation import Simulation
from tests.bench.scale import FULL, Scale

MODEL, UPDATES = "aziel_chen2025", ("sequential", "synchronous")
SIZES = (100, 1_000, 10_000, 100_000, 1_000_000)
ROUNDS, BOID_STEPS = 5, 1_000_000


def flocks(scale: Scale = FULL) -> None:
    """Each size is compared with the smallest, in turns; in processor time, with what
    memory a trial takes at most.
    """
    print(f"{'flocks':28} {'ns a boid-step':>14} {'times the least':>15} {'MB':>6}")
    for update in UPDATES:
        least, _ = ready(scale.boids(SIZES[0]), update)
        for n in map(scale.boids, SIZES):
            simulation, memory = ready(n, update)
            both, boid_steps = (simulation, least), scale.of(BOID_STEPS)
            pairs = [
                tuple(cost(one, boid_steps) for one in both)
                for _ in range(scale.of(ROUNDS))
            ]
            ratio = median(mine / theirs for mine, theirs in pairs)
            mine = median(mine for mine, _ in pairs)
            case = f"{update}, N={n:,}"
            print(f"{case:28} {mine:14.0f} {ratio:15.2f} {memory / 1e6:6.1f}")


def ready(n: int, update: str) -> tuple[Simulation, int]:
    """A trial that has done a step, so that all is compiled, and the most bytes that it
    has held.
    """
    tracemalloc.start()
    simulation = Simulation(large(n, update))
    simulation.take_frames()
    simulation.advance(1)
    held = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return simulation, held


def large(n: int, update: str) -> Job:
    """N boids in an empty world at the density of 100 boids in 800 x 600; no coverage,
    and no frame but the first.
    """
    scale, steps = (n / 100) ** 0.5, 10**9
    values = MODELS[MODEL].preset_values("as_run") | {
        "map": "empty",
        "n": n,
        "steps": steps,
        "update": update,
        "start_draws": "numpy",
        "width": 800 * scale,
        "height": 600 * scale,
    }
    record = RecordSpec(("speed",), every=steps)
    named = ("bench", "0" * 16, 0, 27, False, MODEL, "as_run")
    return Job(*named, values, record, Streams(), None)


def cost(simulation: Simulation, boid_steps: int) -> float:
    """Nanoseconds of processor time of a step of one boid."""
    n = simulation.schedule.n
    steps = max(2, boid_steps // n)
    began = time.thread_time()
    assert simulation.advance(steps)
    return (time.thread_time() - began) / (n * steps) * 1e9
