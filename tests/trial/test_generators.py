"""Random numbers for kernels."""

import gc
import tracemalloc
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.random import SeedSequence

from sweep.trial.generators import Randomness
from sweep.trial.simulation import run
from tests.builders import job


def test_a_stream_is_that_of_numpy_however_it_is_cut() -> None:
    whole = (
        np.random.default_rng(SeedSequence(7))
        .integers(0, 1000, 12, dtype=np.int32)
        .tolist()
    )
    ours, other, taken = Randomness(SeedSequence(7)), Randomness(SeedSequence(8)), []
    for count in (1, 4, 0, 7):  # an odd count of 32 bits leaves half a number over
        with ours.lent() as rng:
            taken += rng.integers(0, 1000, count, dtype=np.int32).tolist()
        with other.lent() as rng:
            rng.standard_normal(3)
    assert taken == whole


def test_threads_do_not_disturb_each_other() -> None:
    def draw(seed: int) -> list[float]:
        stream, taken = Randomness(SeedSequence(seed)), []
        for _ in range(200):
            with stream.lent() as rng:
                taken.append(rng.random())
        return taken

    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(draw, range(8)))
    assert found == [
        np.random.default_rng(SeedSequence(seed)).random(200).tolist()
        for seed in range(8)
    ]


def test_trials_leave_nothing_in_memory() -> None:
    """Both generators of a trial, with what belongs to them, are 6 kB. The first trials
    fill caches.
    """
    one, held = job("nguyen2024", n=2, steps=1, map="empty"), []
    tracemalloc.start()
    try:
        for _ in range(2):
            for _ in range(100):
                run(one)
            gc.collect()
            held.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert held[1] - held[0] < 100 * 600
