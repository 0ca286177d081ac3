"""State of boids beyond place and velocity, and their kinds, by a made-up model:
against a slow twin, the interpreter, and whatever could be wrong with them.
"""

import hashlib
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from examples.vortex import MODEL as VORTEX
from kernels import flight
from kernels.catalogue import BUILT_IN
from kernels.identity import code_of
from kernels.metrics.ground import FIRST_STATE
from kernels.model import BODY_COLUMNS, Model, flaw
from kernels.models import MODELS
from kernels.settings import About
from kernels.stamps import Definition, closure
from sweep.design.jobs import Job, stream
from sweep.errors import SpecError
from sweep.spec.study import RecordSpec, parse_spec
from sweep.trial import looking
from sweep.trial.kinds import kinds_of
from sweep.trial.simulation import Simulation, run
from tests import builders, naive
from tests.interpreter import interpreted
from tests.naive.flight import bordered, neighbours
from tests.oscillators import FOLLOWER, FREQUENCY, MODEL, ORDER, PHASE
from tests.studies import SMALL
from tests.trial.test_trial import flown

every_update = pytest.mark.parametrize("update", builders.UPDATES)


@pytest.fixture(autouse=True)
def _oscillators() -> Iterator[None]:
    with builders.entered(MODEL, order=ORDER):
        yield


def oscillating(**changes: Any) -> Job:
    return builders.job("oscillators", **changes)


def with_model(model: Model, **changes: Any) -> Simulation:
    """A simulation of another model of that name."""
    with builders.entered(model):
        return Simulation(oscillating(metrics=("speed",), **changes))


class Twin:
    """The made-up model, slowly: lists of numbers, and every pair."""

    def __init__(self, simulation: Simulation, a_job: Job) -> None:
        work = simulation.flight.work
        self.settings, self.world = a_job.settings, simulation.world
        self.birds = naive.birds(simulation.flock)
        self.phases = work.state[PHASE].tolist()
        self.frequencies = work.state[FREQUENCY].tolist()
        self.kinds = work.kind.tolist()
        self.rng = np.random.default_rng(stream(a_job, "noise"))

    def step(self) -> None:
        s, synchronous = self.settings, self.settings["update"] == "synchronous"
        birds, phases = list(self.birds), list(self.phases)
        for i in range(len(birds)):
            seen, heard = (birds, phases) if synchronous else (self.birds, self.phases)
            found = neighbours(self.world, seen, i, s["perception_range"], False)
            pull = sum(math.sin(heard[j] - heard[i]) for j, _ in found)
            pull = pull / len(found) if found and self.kinds[i] == FOLLOWER else 0.0
            turn = self.frequencies[i] + s["coupling"] * pull
            self.phases[i] += turn * s["dt"] + self.rng.uniform(
                -s["jitter"], s["jitter"]
            )
            heading = np.array([math.cos(self.phases[i]), math.sin(self.phases[i])])
            velocity = s["speed_of_flight"] * heading
            place = self.birds[i].position + velocity * s["dt"]
            self.birds[i] = bordered(self.world, place, velocity)

    @property
    def state(self) -> np.ndarray:
        return np.array([[*bird.position, *bird.velocity] for bird in self.birds]).T


@every_update
@pytest.mark.parametrize("borders", builders.BORDERS)
def test_a_model_with_state_does_what_its_slow_twin_does(
    update: str, borders: dict[str, Any]
) -> None:
    """Also from call to call, where the state before a step is kept."""
    a_job = oscillating(update=update, seed=27, **borders)
    simulation = Simulation(a_job)
    twin = Twin(simulation, a_job)
    for steps in (1, 4, 2, 13):
        simulation.advance(steps)
        for _ in range(steps):
            twin.step()
        work = simulation.flight.work
        for found, slow in (
            (builders.state(simulation.flock), twin.state),
            (work.state[PHASE], twin.phases),
            (work.state_before, work.state),
        ):
            np.testing.assert_allclose(found, slow, rtol=0, atol=1e-11)
    assert np.ptp(twin.phases) > 1.0


def bits(a_job: Job) -> str:
    """A hash of every number of a trial that keeps its trajectory."""
    result = run(flown(a_job))
    assert result.trajectory is not None
    assert result.states is not None
    digest = hashlib.sha256(builders.fingerprint(result).encode())
    digest.update(result.trajectory.tobytes() + result.states.tobytes())
    return digest.hexdigest()


def exact_jobs() -> list[Job]:
    return [
        oscillating(update=update, series=("order",), every=3, **borders)
        for update in builders.UPDATES
        for borders in builders.BORDERS
    ]


def test_the_interpreter_gives_the_same_bits() -> None:
    code = (
        "from tests import builders\n"
        "from tests.kernels import test_boid_state as t\n"
        "with builders.entered(t.MODEL, order=t.ORDER):\n"
        "    for job in t.exact_jobs(): print(t.bits(job))"
    )
    plain = interpreted(code).split()
    assert plain == list(map(bits, exact_jobs()))
    assert len(set(plain)) == len(plain)


def test_frames_have_the_state_of_their_step() -> None:
    a_job = oscillating(every=6)
    result, simulation = run(flown(a_job)), Simulation(a_job)
    states = [simulation.flight.work.state.copy()]
    for steps in (6, 6, 6, 2):
        simulation.advance(steps)
        states.append(simulation.flight.work.state.copy())
    assert result.states is not None
    assert (result.states == np.stack(states)).all()
    assert (np.diff(result.states[:, FREQUENCY], axis=0) == 0).all()
    assert run(a_job).states is None


def test_a_metric_reads_state_and_kinds() -> None:
    result = run(flown(oscillating(series=("order",))))
    assert result.states is not None
    followers = np.exp(1j * result.states[:, PHASE, 3:])
    np.testing.assert_allclose(
        result.series["order"], abs(followers.mean(axis=1)), atol=1e-12
    )


@pytest.mark.parametrize(("pacemakers", "first"), [(0, 0), (3, 3), (40, 12)])
def test_kinds_follow_each_other_in_the_order_of_boids(
    pacemakers: int, first: int
) -> None:
    a_job = oscillating(pacemakers=pacemakers)
    kind = Simulation(a_job).flight.work.kind
    assert kind.tolist() == [0] * first + [1] * (12 - first)
    assert kinds_of(a_job) == {"pacemaker": first, "follower": 12 - first}


WITHOUT_STATE = [name for name, about in MODELS.items() if not about.state]


@pytest.mark.parametrize("model", WITHOUT_STATE)
def test_a_model_without_state_has_no_room_for_any(model: str) -> None:
    simulation = Simulation(flown(builders.job(model, n=9)))
    work, frames = simulation.flight.work, simulation.flight.record.frames
    assert work.state.shape == work.state_before.shape == (0, 9)
    assert work.kind.tolist() == [0] * 9
    room = flight.FRAME_BYTES // (48 * 9 + 48)
    assert frames.bodies.shape == (min(flight.MOST_FRAMES, room), 6, 9)
    assert not any("kind" in name for name in simulation.state().arrays)
    assert kinds_of(simulation.job) == {}


def test_the_state_is_drawn_after_the_flock() -> None:
    """So the flock is that of any model with the same start, and a trial has the noise
    that it would have without.
    """
    bare = MODEL._replace(state={}, begin_state=None)
    one, other = Simulation(oscillating()), with_model(bare)
    assert builders.state(one.flock).tobytes() == builders.state(other.flock).tobytes()
    assert one.noise.state == other.noise.state
    drawn = one.flight.work.state[FREQUENCY, 3:]
    assert len(np.unique(drawn)) == 9
    again = Simulation(oscillating()).flight.work.state[FREQUENCY, 3:]
    assert drawn.tobytes() == again.tobytes()
    twelfth = Simulation(oscillating(replicate=1)).flight.work.state[FREQUENCY, 3:]
    assert not set(drawn) & set(twelfth)


def test_a_state_that_nothing_begins_is_zero() -> None:
    state = with_model(MODEL._replace(begin_state=None)).flight.work.state
    assert state.tolist() == [[0.0] * 12] * 2


def test_a_state_that_is_not_finite_ends_the_trial() -> None:
    a_job = oscillating(coupling=1e308, dt=1e3, speed_of_flight=0, steps=40)
    result = run(flown(a_job))
    assert result.status == "diverged"
    assert 0 < result.step < 40
    assert result.error == (
        "a position, velocity or state was not a finite number after step"
        f" {result.step}"
    )
    assert result.states is not None
    assert result.states.shape == (result.step, 2, 12)
    assert np.isfinite(result.states).all()


def test_each_row_must_be_finite_though_nothing_follows_from_it() -> None:
    spare = MODEL.state | {"spare": About("what nobody reads")}
    simulation = with_model(MODEL._replace(state=spare))
    assert simulation.advance(3)
    simulation.flight.work.state[2, 11] = math.nan
    assert not simulation.advance(3)
    assert simulation.step == 4
    assert np.isfinite(builders.state(simulation.flock)).all()


def begins_at_infinity(
    _params: Any, _flock: Any, _kind: Any, _rng: Any, state: np.ndarray
) -> None:
    state[FREQUENCY, 5] = math.inf


def test_a_state_that_begins_not_finite_is_refused() -> None:
    with builders.entered(MODEL._replace(begin_state=begins_at_infinity)):
        result = run(oscillating())
    assert result.status == "failed"
    assert result.error.strip().endswith(
        "RuntimeError: model oscillators: begin_state gives boids a frequency that is"
        " not a finite number"
    )


@pytest.mark.parametrize(
    ("count_kinds", "given"),
    [
        (lambda _params, n: (1, n), "(1, 12)"),
        (lambda _params, n: (-1, n + 1), "(-1, 13)"),
        (lambda _params, n: (n,), "(12,)"),
        (lambda _params, n: (0.5, n - 0.5), "(0.5, 11.5)"),
        (lambda _params, n: n, "12"),
        (lambda _params, _n: None, "None"),
    ],
)
def test_kinds_that_are_not_those_of_all_boids_fail_in_a_sentence(
    count_kinds: Callable[[Any, int], Any], given: str
) -> None:
    with builders.entered(MODEL._replace(count_kinds=count_kinds)):
        result = run(oscillating())
    assert result.status == "failed"
    assert result.error.strip().endswith(
        f"RuntimeError: model oscillators: count_kinds gives {given} for the kinds"
        " pacemaker, follower: it must give a whole number from 0 for each kind, and 12"
        " in all"
    )


@pytest.mark.parametrize("states", [MODEL.state, dict(reversed(MODEL.state.items()))])
def test_a_flight_that_goes_on_keeps_the_state_of_the_same_rows(
    states: dict[str, About],
) -> None:
    earlier = Simulation(oscillating())
    earlier.advance(7)
    earlier.take_frames()
    later = with_model(MODEL._replace(state=states), coupling=0.5)
    begun = later.flight.work.state.copy()
    later.go_on_from(earlier)
    same = list(states) == list(MODEL.state)
    wanted = earlier.flight.work.state if same else begun
    work, record = later.flight.work, later.flight.record
    for array in (work.state, work.state_before, record.state, record.state_before):
        assert array.tobytes() == wanted.tobytes()
    assert (begun != wanted).any() == same


def test_to_look_at_a_flight_does_not_change_its_state() -> None:
    simulation = Simulation(oscillating(seed=3))
    simulation.advance(4)
    simulation.flight.work.state_before[:] = 7.0
    before = simulation.state().copied()
    drawn = looking.accelerations(simulation)
    assert drawn.shape == (0, 2, 12)
    for name, array in simulation.state().arrays.items():
        assert array.tobytes() == before.arrays[name].tobytes(), name


NOT_USED = About("what nobody uses", "radians")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"state": {"vx": NOT_USED}}, '"vx": tables have a column of that name'),
        (
            {"state": {"max_speed": NOT_USED}, "params": VORTEX.params},
            '"max_speed": there',
        ),
        ({"state": {"n": NOT_USED}}, '"n": there is a setting of that name'),
        ({"state": {"Phase": NOT_USED}}, '"Phase": its name has small letters, and'),
        ({"state": {"_phase": NOT_USED}}, '"_phase": its name has small letters'),
        ({"state": {"a-b": NOT_USED}}, '"a-b": its name has letters, digits and _'),
        ({"state": {5: NOT_USED}}, '"5": its name has letters, digits and _'),
        ({"state": ("phase",)}, "state is no mapping from names to Abouts"),
        ({"state": "phase"}, "state is no mapping from names to Abouts"),
        ({"begin_state": 5}, "begin_state is no function"),
        ({"count_kinds": (3, 9)}, "count_kinds is no function"),
        ({"kinds": "prey"}, "kinds is no tuple of different names"),
        ({"kinds": ("prey", 5)}, "kinds is no tuple of different names"),
        ({"state": {"phase": "radians"}}, 'state "phase" needs an About'),
        ({"state": {"phase": About("", "hour")}}, "needs an About with a unit"),
        ({"state": {}}, "there is a begin_state, but no state"),
        ({"kinds": ()}, "kinds and count_kinds belong together"),
        ({"count_kinds": None}, "kinds and count_kinds belong together"),
        ({"kinds": ("one", "one")}, "kinds is no tuple of different names"),
    ],
)
def test_what_is_wrong_with_a_model_is_said(changes: dict[str, Any], said: str) -> None:
    assert said in flaw(MODEL._replace(**changes))


def test_nothing_is_wrong_with_those_that_there_are() -> None:
    assert {name: flaw(model) for name, model in MODELS.items()} == dict.fromkeys(
        MODELS, ""
    )


@pytest.mark.parametrize("model", ["nguyen2024", "oscillators"])
def test_a_metric_is_for_models_with_what_it_reads(model: str) -> None:
    """Else it would read beyond the rows that there are."""
    spec = SMALL.replace("nguyen2024", model).replace("[speed]", "[order]")
    spec = spec.replace("sweep:\n  separation_weight: [0.5, 1]\n", "")
    if model == "oscillators":
        assert parse_spec(spec).record.metrics == ("order", "speed")
        return
    with pytest.raises(SpecError) as raised:
        parse_spec(spec)
    assert str(raised.value).endswith(
        'metric "order" needs a model with the state phase. Allowed: oscillators'
    )


@pytest.mark.parametrize(
    ("changes", "needed"),
    [
        ({"state": ("frequency",)}, "the state frequency"),
        ({"kinds": ("follower", "pacemaker")}, "the kinds follower, pacemaker"),
    ],
)
def test_a_metric_reads_rows_and_kinds_in_their_order(
    changes: dict[str, Any], needed: str
) -> None:
    spec = SMALL.replace("nguyen2024", MODEL.name).replace("[speed]", "[order]")
    spec = spec.replace("sweep:\n  separation_weight: [0.5, 1]\n", "")
    with (
        builders.entered(MODEL, order=ORDER._replace(**changes)),
        pytest.raises(SpecError, match=f"with {needed}. Allowed: no known model$"),
    ):
        parse_spec(spec)


@pytest.mark.parametrize("model", ["nguyen2024", "nanobot"])
def test_a_trial_measures_nothing_that_its_boids_have_not(model: str) -> None:
    """Whoever names the metric: a stored row may be a stranger's, and a model may have
    it among its own.
    """
    result = run(builders.job(model, metrics=("speed", "order"), steps=2))
    assert result.status == "failed"
    assert result.error.strip().endswith(
        'RuntimeError: metric "order" is for models with the state phase'
    )
    simulation = Simulation(builders.job(model, steps=2))
    with pytest.raises(RuntimeError, match='metric "order" is for models with'):
        simulation.take_frames(RecordSpec(("order",)))


def begins_otherwise(
    _params: Any, _flock: Any, _kind: Any, _rng: Any, _state: np.ndarray
) -> None:
    """Another begin_state."""


def counts_otherwise(_params: Any, n: int) -> tuple[int, int]:
    """Another count_kinds."""
    return n, 0


@pytest.mark.parametrize(
    "changes",
    [
        {"state": {"phase": NOT_USED, "rate": NOT_USED}},
        {"state": dict(reversed(MODEL.state.items()))},
        {"kinds": ("leader", "follower")},
        {"begin_state": begins_otherwise},
        {"count_kinds": counts_otherwise},
    ],
)
def test_the_code_of_a_model_covers_its_state_and_kinds(
    changes: dict[str, Any],
) -> None:
    def codes() -> dict[str, str]:
        return code_of(BUILT_IN, [("oscillators", "as_run")], [], [], []).models

    assert codes() == codes()
    before = codes()
    with builders.entered(MODEL._replace(**changes)):
        assert codes() != before


def test_what_a_row_of_state_says_of_itself_changes_no_id() -> None:
    before = code_of(BUILT_IN, [("oscillators", "as_run")], [], [], [])
    better = MODEL.state | {"phase": About("a better sentence", "radians")}
    with builders.entered(MODEL._replace(state=better)):
        assert code_of(BUILT_IN, [("oscillators", "as_run")], [], [], []) == before


def test_where_compiled_kernels_are_kept_concerns_no_trial() -> None:
    flying = Definition("kernels.flight", "advance")
    used = closure([flying, Definition("kernels.models.nanobot", "advance")])
    assert Definition("kernels.jit", "_compiled") in used
    assert not any(one.module == "kernels.caching" for one in used)


def test_columns_that_are_taken_are_refused_as_names_of_state() -> None:
    for name in BODY_COLUMNS:
        assert name in flaw(MODEL._replace(state={name: NOT_USED}))
    assert FIRST_STATE == 6
