"""The boids of a trial are divided among threads: the same bits with any number of
them, and an end like that of one thread, whatever happens.
"""

import threading
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kernels.models import MODELS
from kernels.recording import Record
from kernels.state import LARGE_FLOCK
from kernels.threads.flying import Threads, in_threads, is_kept_for_threads
from kernels.threads.team import Team, build_teams
from kernels.workspace import Workspace
from sweep.design.jobs import Job
from sweep.trial import simulation
from sweep.trial.lanes import groups
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, compiling_seconds, run
from sweep.workers.checkpoint import Checkpointed
from tests import builders
from tests.cases import slow_but
from tests.trial.test_trial import OVERFLOWS, small
from tests.workers.test_checkpoint import broken_off, named, numbers

THREADS = (2, 3, 7)
TEAMS = {1: (2,), 5: (3, 7), 64: (2, 7)}
"""Numbers of boids, and of threads for each: fewer boids than threads, as many boids
for each of them, and numbers that cannot be divided.
"""
MODEL = "aziel_chen2025"
AT_ONCE = {
    name: dict(model.at_once)
    for name, model in MODELS.items()
    if model.at_once is not None
}
PRESETS = [(model, preset) for model, preset in builders.PRESETS if model in AT_ONCE]
IN_TURN = [(*which, each) for which, each in zip(PRESETS, cycle(builders.BORDERS))]
COMPILED = (MODEL, "dorsogna2006")
"""Fast tests compile these for threads."""
FAST = [one for one in IN_TURN if one[0] in COMPILED]
"""Of two models: to compile one for threads takes three seconds."""
WITHIN_BORDERS = [(*which, each) for which in PRESETS for each in builders.BORDERS]


def end(job: Job) -> dict[str, bytes]:
    """All that a trial leaves, but for what is left of its last search."""
    whole = builders.to_end(Simulation(job))
    frames = whole.flight.record.frames._asdict()
    arrays = {**whole.state().arrays, **frames, "grid": sizes(whole)}
    return {
        name: array.tobytes()
        for name, array in arrays.items()
        if not name.startswith("work.near.")
    }


def sizes(whole: Simulation) -> np.ndarray:
    """How many boids the list of each cell has."""
    grid = whole.flight.work.grid
    return grid.blocks[: grid.columns * grid.rows, 0]


def at_once(model: str = MODEL, **changes: Any) -> Job:
    """A short trial, with all metrics, whose boids are updated at once."""
    return small(model, **{**AT_ONCE[model], **changes})


def test_most_models_have_it() -> None:
    """Four draw random numbers, boid after boid; drones have motors, and so fly in one
    thread.
    """
    drawing = {"nguyen2024", "vicsek1995", "couzin2002", "strombom2014"}
    assert MODELS.keys() - AT_ONCE.keys() == drawing | {"vasarhelyi2018"}


@pytest.mark.parametrize(("model", "preset", "borders"), slow_but(FAST, WITHIN_BORDERS))
def test_any_number_of_threads_gives_the_same_bits(
    model: str, preset: str, borders: dict[str, Any]
) -> None:
    for n, teams in TEAMS.items():
        one = at_once(model, n=n, preset=preset, **borders)
        alone = end(one)
        for threads in teams:
            assert end(replace(one, threads=threads)) == alone, (n, threads)


def a_large_flock(model: str) -> Job:
    side = builders.scaled(model, width=6000, height=4000)
    return at_once(model, n=LARGE_FLOCK + 3, steps=4, map="empty", **side)


@pytest.mark.slow
def test_a_large_flock_has_the_same_bits() -> None:
    one = a_large_flock(MODEL)
    alone = end(one)
    for threads in THREADS:
        assert end(replace(one, threads=threads)) == alone, threads


@pytest.mark.slow
@pytest.mark.parametrize("model", AT_ONCE.keys() - {MODEL})
def test_a_large_flock_of_each_model_has_the_same_bits(model: str) -> None:
    one = a_large_flock(model)
    assert end(replace(one, threads=3)) == end(one)


@pytest.mark.parametrize("n", [0, 1, 6, 7, 20])
@pytest.mark.parametrize("size", THREADS)
def test_each_boid_belongs_to_one_thread(size: int, n: int) -> None:
    teams = build_teams(size, n)
    assert [i for one in teams for i in range(one.first, one.last)] == [*range(n)]
    assert {one.last - one.first for one in teams} <= {n // size, -(-n // size)}


def test_all_threads_take_part(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = Simulation(replace(at_once(), threads=3))
    met: list[tuple[int, int]] = []
    kernel = whole.flight.model.advance._kernel

    def noting(*given: Any) -> bool:
        met.append((given[-1].rank, threading.get_ident()))
        return bool(kernel(*given))

    monkeypatch.setattr(whole.flight.model.advance, "_kernel", noting)
    assert whole.advance(20)
    ranks, threads = zip(*met, strict=True)
    assert sorted(ranks) == [0, 1, 2]
    assert len(set(threads)) == 3


@pytest.mark.parametrize("model", slow_but(COMPILED, AT_ONCE))
def test_a_trial_that_overflows_ends_as_with_one_thread(model: str) -> None:
    one = at_once(model, steps=400, **OVERFLOWS[model])
    alone, divided = run(one), run(replace(one, threads=2))
    assert (alone.status, alone.step) == (divided.status, divided.step)
    assert divided.status == "diverged", divided.error
    assert divided.error == alone.error


def test_a_trial_past_its_time_limit_ends_as_timeout(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A call takes about as long with any number of threads."""
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 60)
    late = run(replace(at_once(steps=1000), time_limit=1e-9, threads=2))
    assert (late.status, late.step) == ("timeout", 10)


@pytest.mark.parametrize(("before", "after"), [(2, 1), (1, 2), (3, 2)])
def test_a_checkpoint_serves_any_number_of_threads(
    before: int, after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 36)
    one = named(at_once(steps=40))
    broken_off(tmp_path, monkeypatch, replace(one, threads=before))
    met: list[float] = []
    monkeypatch.setattr(Simulation, "restore", noting_restore(met))
    result = Checkpointed(run, tmp_path, 1e9)(replace(one, threads=after))
    assert met
    assert met[0] > 0
    assert numbers(replace(result, job=one)) == numbers(run(one))


def noting_restore(met: list[float]) -> Any:
    restore = Simulation.restore

    def noting(self: Simulation, *given: Any) -> None:
        restore(self, *given)
        met.append(self.step)

    return noting


def test_with_one_thread_a_model_is_itself() -> None:
    model = MODELS[MODEL]
    assert in_threads(model, 1) is model
    plain = model._replace(advance=model.advance.py_func)
    assert in_threads(plain, 2) is plain


def test_trials_with_threads_fly_alone() -> None:
    jobs = [at_once("nanobot", replicate=k, n=12) for k in range(8)]
    assert len(list(groups(jobs))) == 1
    assert len(list(groups([replace(one, threads=2) for one in jobs]))) == 8


def test_what_is_compiled_is_another_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    job, model = replace(at_once(), threads=2), MODELS[MODEL]
    run(job)
    assert is_kept_for_threads(model)
    assert compiling_seconds(job) == 0.0
    monkeypatch.setattr(simulation, "is_kept_for_threads", lambda _: False)
    assert compiling_seconds(job) > 0.0
    assert not is_kept_for_threads(MODELS["nguyen2024"])


def broken(rank: int, monkeypatch: pytest.MonkeyPatch) -> Result:
    """A trial of three threads, of which one raises an error."""
    kernel = Threads(MODELS[MODEL].advance, 3)._kernel

    def breaking(
        flock: Any, world: Any, params: Any, work: Workspace, record: Record, *rest: Any
    ) -> bool:
        team: Team = rest[-1]
        if team.rank == rank:
            raise ArithmeticError(f"thread {rank}")
        return bool(kernel(flock, world, params, work, record, *rest))

    monkeypatch.setattr("kernels.threads.flying.kernel_of", lambda _advance: breaking)
    return run(replace(at_once(), threads=3))


@pytest.mark.parametrize("rank", [0, 1, 2])
def test_an_error_in_a_thread_ends_the_trial_and_nobody_waits(
    rank: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = threading.active_count()
    result = broken(rank, monkeypatch)
    assert result.status == "failed"
    assert f"ArithmeticError: thread {rank}" in result.error
    assert threading.active_count() == before


def test_a_thread_that_cannot_start_ends_the_trial_and_nobody_waits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    start, before = threading.Thread.start, threading.active_count()
    begun: list[threading.Thread] = []

    def failing(self: threading.Thread) -> None:
        begun.append(self)
        if len(begun) == 2:
            raise RuntimeError("can't start new thread")
        start(self)

    monkeypatch.setattr(threading.Thread, "start", failing)
    result = run(replace(at_once(), threads=4))
    monkeypatch.undo()
    assert result.status == "failed"
    assert "can't start new thread" in result.error
    assert threading.active_count() == before
