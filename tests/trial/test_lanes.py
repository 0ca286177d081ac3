"""Trials in lanes have the bits that they have alone, whatever flies beside them."""

import time
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kernels.lanes.facts import NotForLanesError
from kernels.lanes.kernel import weights_of
from kernels.lanes.together import Formation
from kernels.lanes.vectors import WIDTH
from kernels.models import MODELS
from sweep.design.cost import job_seconds
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.trial import lanes
from sweep.trial.lanes import (
    COMPILING_TIMES,
    Trials,
    fly,
    groups,
    in_groups,
    worth_flying_together,
)
from sweep.trial.result import Result
from sweep.trial.simulation import COMPILING_SECONDS, Simulation, run
from sweep.workers import attempts, flying
from sweep.workers.checkpoint import Checkpointed
from sweep.workers.checkpoint_folder import Checkpoints
from sweep.workers.executors import Serial
from sweep.workers.fingerprint import own_part
from sweep.workers.worker import run_chunk
from tests.builders import BORDERS, PRESETS, UPDATES, job, map_size, maps_of
from tests.searches import edited
from tests.studies import SMALL, launched, read, same

FAST = "aziel_chen2025"
"""The fast tests compile this model alone for lanes."""
ATTEMPT = lanes._attempt
LAST_STATES = "last_states"
LEAST = 4
"""So many fly together in tests, so that lanes are made up."""
LONG = COMPILING_TIMES * COMPILING_SECONDS
"""Where trials take so many seconds, a kernel for lanes is compiled."""


def eight(model: str, preset: Any = "as_run", **changes: Any) -> list[Job]:
    """Jobs that differ in all that may differ in lanes."""
    rng, made = np.random.default_rng(4), []
    base = job(model, preset, **changes)
    free = [name for name in weights_of(MODELS[model]) if name in base.settings]
    for k in range(WIDTH):
        drawn = {name: float(base.settings[name]) * rng.uniform(0, 2) for name in free}
        settings = base.settings | (drawn if k > 1 else {})
        made.append(replace(base, settings=settings, replicate=k))
    return made


def numbers(result: Result) -> dict[str, Any]:
    """Every bit of a result but its seconds."""

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return value.dtype.str, value.shape, value.tobytes()
        if isinstance(value, dict):
            return {name: plain(member) for name, member in value.items()}
        return repr(value)

    return {
        name: plain(getattr(result, name))
        for name in Result.__slots__
        if name not in ("job", "seconds")
    }


def are_equal(jobs: list[Job]) -> list[Result]:
    """The results of jobs together, which are checked against those alone."""
    together = Trials(together=True).several(jobs)
    for one, mine in zip(jobs, together, strict=True):
        assert numbers(mine) == numbers(run(one))
        assert mine.job is one
    return together


@pytest.mark.slow
def test_last_flocks_are_the_same_together_and_alone() -> None:
    """And so are the links that begin with them."""
    chained = "{values: [0.5, 1], continue: up, hold: 40}"
    text = edited(
        SMALL,
        ("n: 12, steps: 9", "n: 12"),
        ("[0.5, 1]", chained),
        ("replicates: 3", f"replicates: {WIDTH}"),
    )
    study = read(text)
    links = Jobs(study, expand(study))[:]
    jobs = [one for one in links if not one.parent]
    assert all(one.record.last_flocks for one in jobs)
    results = Trials(together=True).several(jobs)
    flocks = {one.job.trial_id: one.last_flock for one in results}
    later = [
        replace(one, begins=flocks[one.parent]) for one in links if one.parent in flocks
    ]
    assert len(later) == WIDTH
    for made, ran in (
        (results, jobs),
        (Trials(together=True).several(later), later),
    ):
        for one, flown in zip(made, ran, strict=True):
            alone = run(flown)
            assert one.last == alone.last
            for name in ("bodies", "headings", "state"):
                mine, theirs = (
                    getattr(flock, name) for flock in (one.last_flock, alone.last_flock)
                )
                assert mine.tobytes() == theirs.tobytes()


@pytest.fixture(autouse=True)
def _none_falls_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """A group that fails would be run alone, and be equal."""
    monkeypatch.setattr(lanes, "_attempt", lambda together, jobs: together(jobs))


@pytest.mark.parametrize(
    ("changes", "borders"),
    [
        *product([{"update": name} for name in UPDATES], BORDERS),
        ({"priority": "obstacle_first", "walls_are_obstacles": True}, {}),
        ({"goal_weight": 0.01, "fov": 360.0, "range_inclusive": True}, {}),
    ],
)
def test_trials_together_have_the_bits_that_they_have_alone(
    changes: dict[str, Any], borders: dict[str, Any]
) -> None:
    jobs = eight(
        FAST,
        n=33,
        steps=150,
        heatmaps=True,
        map="dense_cafeteria",
        **changes,
        **borders,
    )
    are_equal(jobs)


def test_series_and_trajectories_are_the_same() -> None:
    counted = "pair_collisions", "fissions", "control_effort", "mechanical_work"
    series = "coverage", "speed", "speed_of_working", *counted
    jobs = eight(FAST, n=9, steps=37, every=5, series=series)
    wanted = replace(jobs[0].record, trajectories=True)
    results = are_equal([replace(one, record=wanted) for one in jobs])
    assert results[0].trajectory is not None


@pytest.mark.parametrize("count", [4, 5, 9, 20])
def test_what_is_left_over_is_made_up_or_flies_alone(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lanes, "LEAST", LEAST)
    jobs = [
        replace(one, replicate=10 * turn + one.replicate)
        for turn in range(3)
        for one in eight(FAST, n=12, steps=30)
    ][:count]
    are_equal(jobs)
    sizes = {4: [4], 5: [5], 9: [8, 1], 20: [8, 8, 4]}
    assert [len(group) for group in groups(jobs)] == sizes[count]


def test_a_lane_that_diverges_harms_no_other() -> None:
    endless = {"max_acceleration": np.inf, "max_speed": np.inf}
    jobs = eight(FAST, n=30, steps=60, **endless)
    for place in (2, 5):
        settings = jobs[place].settings | {"cohesion_weight": 1e308}
        jobs[place] = replace(jobs[place], settings=settings)
    results = are_equal(jobs)
    assert [one.status == "diverged" for one in results] == [
        place in (2, 5) for place in range(WIDTH)
    ]


def test_boids_that_stand_need_more_than_sixteen_bits() -> None:
    """A pixel with 40,000 visits, in the middle and at the border."""
    still = {"max_speed": 0.0, "start_speed": 0.0}
    jobs = eight(FAST, n=4, steps=40_000, every=40_000, heatmaps=True, **still)
    results = are_equal(jobs)
    assert results[0].heatmap is not None
    assert results[0].heatmap.max() >= 40_000


def test_a_map_larger_than_all_visits_is_not_narrow() -> None:
    are_equal(eight(FAST, n=5, steps=20, heatmaps=True))


@pytest.mark.slow
def test_discs_and_large_footprints_are_marked_too() -> None:
    for about in ({"footprint": "disc"}, {"footprint_radius": 6.0}):
        are_equal(eight(FAST, n=40, steps=60, heatmaps=True, pixel=8.0, **about))


def test_what_differs_otherwise_flies_apart() -> None:
    jobs = eight(FAST, n=12, steps=30)
    other = replace(jobs[1], settings=jobs[1].settings | {"perception_range": 70.0})
    timed = replace(jobs[2], time_limit=1e9)
    large = [replace(one, settings=one.settings | {"n": 1000}) for one in jobs[3:]]
    assert [len(one) for one in groups([jobs[0], other, timed, *large])] == [1] * 8


def test_a_checkpoint_of_a_group_goes_on_alone(tmp_path: Path) -> None:
    jobs = [
        replace(one, trial_id=f"{one.replicate:024x}")
        for one in eight(FAST, n=100, steps=2100, heatmaps=True)
    ]
    kept: list[dict[str, Any]] = []

    class EnoughError(Exception):
        pass

    def end(_seconds: float, settle: Callable[[], None]) -> None:
        if simulations[0].step > 900:
            settle()
            raise EnoughError

    simulations = [Simulation(one) for one in jobs]
    with pytest.raises(EnoughError):
        fly(simulations, time.perf_counter(), end)
    for one in simulations[:3]:
        later = Simulation(one.job)
        later.restore(one.state())
        later.taken = one.taken[:]
        later.taken[-1:] = one.taken[-1:]
        kept.append(numbers(_rest(later)))
        assert kept[-1] == numbers(run(one.job))
    checkpointed = Checkpointed(run, tmp_path / "checkpoints", 0.0, together=True)
    results = checkpointed.several(jobs)
    assert [numbers(one) for one in results[:3]] == kept
    assert list((tmp_path / "checkpoints").glob("*.state"))


def _rest(simulation: Simulation) -> Result:
    """The result of a simulation that is under way and has taken its frames."""
    while simulation.steps_left > 0:
        simulation.advance(2000)
        simulation.taken.append(simulation.take_frames())
    return simulation.summary("done", 0.0)


def test_a_chunk_with_limits_runs_one_job_after_the_other() -> None:
    class Seat:
        noted = 0

        def noting(self, jobs: Any) -> Any:
            for one in jobs:
                self.noted += 1
                yield one

    jobs, seat = eight(FAST, n=12, steps=30), Seat()
    outcomes = run_chunk(Trials(together=True), jobs, seat, own_part())
    assert seat.noted == WIDTH
    assert not isinstance(outcomes, str)
    found = [numbers(one) for one in outcomes[0] if isinstance(one, Result)]
    assert found == [numbers(run(one)) for one in jobs]


@pytest.fixture
def flown(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many steps each trial of a first group takes, which flies nowhere here; no
    kernel is compiled for lanes before.
    """
    steps: list[int] = []

    def together(jobs: list[Job]) -> list[Result]:
        steps.extend(int(one.settings["steps"]) for one in jobs)
        return []

    monkeypatch.setattr(lanes, "_together", together)
    monkeypatch.setattr(lanes, "is_kept_for_lanes", lambda _model: False)
    return steps


def test_a_small_study_compiles_nothing_for_lanes(
    flown: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = eight(FAST, n=12, steps=30)
    assert not worth_flying_together(jobs, 0.9 * LONG)
    assert flown == []
    assert worth_flying_together(jobs, 1.1 * LONG)
    assert flown == [1] * WIDTH
    monkeypatch.setattr(lanes, "is_kept_for_lanes", lambda _model: True)
    assert worth_flying_together(jobs, 0.001)


def test_of_very_many_jobs_a_few_are_looked_at(flown: list[int]) -> None:
    class Many(list[Job]):
        looked = 0

        def __getitem__(self, places: Any) -> Any:
            found = super().__getitem__(places)
            self.looked += len(found)
            return found

    one = job(FAST, n=1000, steps=30)
    jobs = Many([one] * 20_000)
    assert not worth_flying_together(jobs, LONG)
    assert 0 < jobs.looked <= 1000
    jobs = Many([one] * 19_000 + eight(FAST, n=12, steps=30) * 125)
    assert worth_flying_together(jobs, LONG)
    assert flown == [1] * WIDTH


def test_large_flocks_and_those_that_see_far_fly_alone() -> None:
    for n, about, count in [
        (200, {}, 1),
        (201, {}, WIDTH),
        (110, {"perception_range": 500.0}, 1),
        (111, {"perception_range": 500.0}, WIDTH),
    ]:
        jobs = eight(FAST, n=n, steps=30, map="empty", **about)
        assert len(list(groups(jobs))) == count


def test_a_launch_in_lanes_stores_what_one_alone_stores(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = f"""
study: small
model: {FAST}
preset: as_run
fixed: {{n: 12, steps: 30}}
sweep: {{cohesion_weight: [0.1, 0.2, 0.3]}}
replicates: 6
seed: 5
record: {{metrics: [coverage, speed], heatmaps: true, series: [speed]}}
"""
    alone = launched(spec, tmp_path / "alone")
    flown = list[int]()
    monkeypatch.setattr(flying, "worth_flying_together", lambda *_: True)

    def formation(flights: Any) -> Any:
        flown.append(len(flights))
        return Formation(flights)

    monkeypatch.setattr(lanes, "Formation", formation)
    both = launched(spec, tmp_path / "together")
    assert flown == [WIDTH, WIDTH]
    assert same(alone, both)
    assert both.statuses() == {"done": 18}


def test_trials_that_keep_their_last_state_fly_alone() -> None:
    jobs = eight(FAST, n=12, steps=30)
    kept = replace(jobs[0].record, last_states=True)
    assert len(list(groups([replace(one, record=kept) for one in jobs]))) == WIDTH


def test_that_it_compiles_for_lanes_is_said(
    flown: list[int], caplog: pytest.LogCaptureFixture
) -> None:
    worth_flying_together(eight(FAST, n=12, steps=30), LONG)
    assert caplog.messages == [
        f"compiling {FAST} for 8 trials at once, about 15 s on an idle core, once"
    ]
    assert flown


def test_nothing_flies_together_without_a_compiler_or_without_a_group(
    flown: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = eight(FAST, n=12, steps=30)
    assert not worth_flying_together(jobs[:3], LONG)
    assert not worth_flying_together([], LONG)
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert not worth_flying_together(jobs, LONG)
    assert flown == []


@pytest.mark.parametrize(
    "line",
    ["memory_limit: 4 GB", "time_limit: 100", LAST_STATES, ""],
)
def test_a_launch_with_limits_or_last_states_asks_for_no_lanes(
    line: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They bind one trial at a time, so that all would be compiled in vain."""
    asked: list[float] = []
    given: dict[str, Any] = {}

    def ask(_jobs: Any, seconds: float) -> bool:
        asked.append(seconds)
        return True

    monkeypatch.setattr(flying, "worth_flying_together", ask)
    monkeypatch.setattr(attempts, "drive", lambda *_, **about: given.update(about))
    lasting = "streams: {noise: lasting}\nrecord: {last_states: true, "
    spec = SMALL.replace("record: {", lasting)
    study = read(spec if line == LAST_STATES else f"{SMALL}{line}")
    jobs = Jobs(study, expand(study))
    attempts._driven(study, jobs, Serial(workers=2), Checkpoints(None))
    assert asked == ([] if line else [job_seconds(jobs).sum() / 2])
    assert given["deal"].keywords.get("at_once", 1) == (1 if line else WIDTH)


def _fail(jobs: Any) -> list[Result]:
    raise ArithmeticError(f"{len(jobs)} cannot")


def test_a_group_that_fails_is_run_one_after_the_other(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """And what only flying together makes fail is said, once."""
    monkeypatch.setattr(lanes, "_attempt", ATTEMPT)
    lanes._say_once.cache_clear()
    jobs = eight(FAST, n=5, steps=2)
    for _ in range(2):
        found = in_groups(jobs, run, _fail)
        assert [numbers(one) for one in found] == [numbers(run(one)) for one in jobs]
    [said] = caplog.messages
    assert said.startswith(f"trials of {FAST} that fail together")
    assert said.rstrip().endswith("ArithmeticError: 8 cannot")
    monkeypatch.setattr(lanes, "_together", _fail)
    assert not worth_flying_together(jobs, LONG)


@pytest.mark.parametrize(
    ("error", "status"),
    [(ArithmeticError("no place"), "failed"), (NotForLanesError("a loop"), "done")],
)
def test_nothing_is_said_of_trials_that_fail_alone_or_have_to_fly_so(
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    error: Exception,
    status: str,
) -> None:
    def fail(_jobs: Any) -> list[Result]:
        raise error

    monkeypatch.setattr(lanes, "_attempt", ATTEMPT)
    lanes._say_once.cache_clear()
    jobs = eight(FAST, n=5, steps=2)
    found = in_groups(jobs, lambda job: Result(job, status, 0.0), fail)
    assert [one.status for one in found] == [status] * WIDTH
    assert not caplog.messages


@pytest.mark.slow
@pytest.mark.parametrize(("model", "preset"), PRESETS)
def test_all_models_have_the_same_bits_on_all_maps(model: str, preset: str) -> None:
    cases: Any = product(maps_of(model), UPDATES, BORDERS)
    for name, update, borders in cases:
        about = borders | map_size(model, name) | {"map": name, "update": update}
        are_equal(eight(model, preset, n=21, steps=40, **about))
