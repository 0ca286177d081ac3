"""Metrics of a trial from its stored trajectory, to the last bit as a flight measures
them.

A trajectory has what most metrics look at: positions, velocities and the state of boids
in each frame, all bits of them. It lacks counts and integrals, and the velocities one
step earlier, which are those of the frame before if each step has a frame. What it
lacks is filled in twice, in two ways. A metric whose values differ needs it, and has
none here.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.events import N_INTEGRALS
from kernels.flight import measure
from kernels.metrics import Metric
from kernels.recording import FILLED, FIRST_STATE, N_COUNTS, Frames
from sweep.design.jobs import Job
from sweep.spec.derived_metrics import DerivedMetric
from sweep.spec.study import RecordSpec
from sweep.trial.derived import summaries, with_derived
from sweep.trial.numba_errors import explained
from sweep.trial.simulation import BOID_STEPS_A_CALL, Simulation
from sweep.trial.state import joined

Floats = NDArray[np.float64]
MOVING = slice(0, 4)
BEFORE = slice(4, FIRST_STATE)
"""The rows of `bodies` that are in a trajectory, and those of the velocities before."""
OTHER_FLIGHT = (
    "its stored trajectory is not what this machine computes, to the last bit: another"
    " processor or library has computed it, or it was changed"
)


class FlownTrial(NamedTuple):
    """A trial that is done, with its stored trajectory.

    job     the trial, with all metrics that its row shall have
    wanted  those of them that its row lacks, measured and derived ones
    steps   (F,): the recorded frames, which are all that the job records
    bodies  (F, 4, N): x, y, vx and vy
    states  (F, S, N): the rows of the model's state
    series  values (F,) that are stored frame by frame, by metric
    flies   whether the beginning is flown too, and compared
    """

    job: Job
    wanted: tuple[str, ...]
    steps: NDArray[np.int64]
    bodies: Floats
    states: Floats
    series: Mapping[str, Floats]
    flies: bool


class Guess(NamedTuple):
    """What a trajectory lacks of F frames, guessed: the counts (F, N_COUNTS), the
    integrals (F, N_INTEGRALS), the velocities one step earlier (F, 2, N), and the value
    where a metric writes none.
    """

    counts: NDArray[np.int64]
    integrals: Floats
    velocities: Floats
    blank: float


class Remeasured(NamedTuple):
    """The wanted metrics of a trial at its last frame, and their means over its last
    half. Or those that `need` more than a trajectory has; or what is wrong.
    """

    trial_id: str
    last: Mapping[str, float] = MappingProxyType({})
    mean: Mapping[str, float] = MappingProxyType({})
    need: tuple[str, ...] = ()
    wrong: str = ""


def what_lacks(metric: Metric, every: int) -> str:
    """What a metric says that it needs and that trajectories with a frame `every` so
    many steps lack, in words; "" where it names nothing.
    """
    if metric.covers:
        return "the visits of pixels, which are counted in each step"
    if metric.counts:
        return "escapes, collisions or arrivals, which are counted in each step"
    if metric.pairs:
        return "contacts between boids, which are counted in each step"
    if metric.integrates:
        return "the velocities of each step, which are summed up as it is taken"
    if metric.follows:
        return "flocks from frame to frame, which are compared as the trial flies"
    if metric.per_step and every > 1:
        return f"the velocities one step earlier; frames are {every} steps apart"
    return ""


def sources(
    record: RecordSpec, wanted: Iterable[str], series: Iterable[str]
) -> tuple[tuple[str, ...], tuple[DerivedMetric, ...]]:
    """What gives the wanted metrics: the metrics to be measured, as they are not among
    the stored `series`, and the derived ones to be computed, in their order.
    """
    there, needed, derived = {*series}, {*wanted}, list[DerivedMetric]()
    for one in reversed(record.derive):
        if one.name in needed - there:
            derived.insert(0, one)
            needed |= one.expression.names
    measured = [name for name in record.metrics if name in needed - there]
    return tuple(measured), tuple(derived)


def expected_steps(job: Job) -> NDArray[np.int64]:
    """The steps of the frames that a trial records which comes to its end."""
    steps = int(job.settings["steps"])
    return np.unique([*range(0, steps, job.record.every), steps])


def remeasure(flown: FlownTrial) -> Remeasured:
    """The wanted metrics of a trial from what is stored of its frames; an exception
    becomes what is wrong.
    """
    try:
        return _remeasured(flown)
    except Exception as error:
        said = explained(error) or f"{type(error).__name__}: {error}"
        return Remeasured(flown.job.trial_id, wrong=said)


def unmeasured(flown: FlownTrial, error: str) -> Remeasured:
    """What came of a trial whose worker died."""
    return Remeasured(flown.job.trial_id, wrong=error)


def seconds(some: Sequence[FlownTrial]) -> list[float]:
    """How long trials take, about, in relation to each other."""
    return [float(flown.bodies.size + len(flown.steps)) for flown in some]


def _remeasured(flown: FlownTrial) -> Remeasured:
    trial, job, known = flown.job.trial_id, flown.job, dict(flown.series)
    names, derived = sources(job.record, flown.wanted, flown.series)
    if names:
        record = RecordSpec(names, every=job.record.every, trajectories=True)
        looking = replace(job, record=record)
        values, unknown = _measured(Simulation(looking), flown)
        if flown.flies:
            unknown |= _begins_otherwise(Simulation(looking), flown, values)
        if unknown.any():
            return Remeasured(trial, need=tuple(np.array(names)[unknown].tolist()))
        known |= dict(zip(names, values, strict=True))
    every = with_derived(derived, known, job.settings)
    wanted = {name: every[name] for name in flown.wanted}
    last, mean = summaries(wanted, flown.steps, int(job.settings["steps"]))
    return Remeasured(trial, last, mean)


def _begins_otherwise(
    simulation: Simulation, flown: FlownTrial, values: Floats
) -> NDArray[np.bool_]:
    """Which metrics of a simulation have other values at its beginning, which is flown
    here, than those from the trajectory, (metrics, F); shape (metrics,). Raises
    ValueError where the flight is another one.
    """
    start = simulation.take_frames()
    simulation.advance(_steps_a_call(simulation))
    found = joined([start, simulation.take_frames()])
    _check_same(flown, found.bodies, found.state)
    return _differ(found.values, values[:, : len(found.steps)])


def _check_same(flown: FlownTrial, bodies: Floats, states: Floats) -> None:
    """Raise ValueError where a trajectory does not begin with these frames, to the last
    bit.
    """
    for stored, now in ((flown.bodies, bodies), (flown.states, states)):
        if stored[: len(now)].tobytes() != now.tobytes():
            raise ValueError(OTHER_FLIGHT)


def _measured(
    simulation: Simulation, flown: FlownTrial
) -> tuple[Floats, NDArray[np.bool_]]:
    """The values of the metrics of a simulation at its start in the frames of a
    trajectory, (metrics, F); and which of them need more than these frames have,
    (metrics,).
    """
    flight, job = simulation.flight, simulation.job
    bodies, counts, step, integrals = flight.record.frames
    start = Frames(
        *(bodies[:1].copy(), counts[:1].copy(), step[:1].copy()),
        integrals=integrals[:1].copy(),
    )
    _check_same(flown, start.bodies[:, MOVING], start.bodies[:, FIRST_STATE:])
    metrics = [job.known.metrics[name] for name in job.record.metrics]
    values = np.full((len(metrics), len(flown.steps)), np.nan)
    unknown = np.zeros(len(metrics), np.bool_)
    rng = np.random.default_rng(0)
    for places in _calls(simulation, flown.steps):
        found = []
        for guess in (_nothing(flown, places), _anything(flown, places, rng)):
            _fill(flight.record.frames, flown, start, places, guess)
            flight.record.progress[FILLED] = len(places)
            found.append(measure(flight, metrics, guess.blank))
        values[:, places] = found[0]
        unknown |= _differ(*found)
    return values, unknown


def _steps_a_call(simulation: Simulation) -> int:
    """The steps of a kernel call, after which a flight takes its frames."""
    record = simulation.flight.record
    room = (len(record.frames.step) - 1) * record.every
    return min(max(1, BOID_STEPS_A_CALL // simulation.schedule.n), room)


def _calls(simulation: Simulation, steps: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """The places of the frames that a flight takes together."""
    call = -(-steps // _steps_a_call(simulation))
    return np.split(np.arange(len(steps)), np.flatnonzero(np.diff(call)) + 1)


def _nothing(flown: FlownTrial, places: NDArray[np.int64]) -> Guess:
    """Nothing was counted, and all boids were at rest."""
    counts = np.zeros((len(places), N_COUNTS), np.int64)
    integrals = np.zeros((len(places), N_INTEGRALS))
    return Guess(counts, integrals, np.zeros_like(flown.bodies[places, 2:]), np.nan)


def _anything(
    flown: FlownTrial, places: NDArray[np.int64], rng: np.random.Generator
) -> Guess:
    """Any counts, and velocities in any direction."""
    counts = rng.integers(1, 1000, (len(places), N_COUNTS))
    integrals = rng.uniform(1.0, 1000.0, (len(places), N_INTEGRALS))
    velocities = flown.bodies[places, 2:]
    scale = np.abs(velocities).max(initial=0.0) or 1.0
    guessed = scale * rng.standard_normal(velocities.shape)
    return Guess(counts, integrals, guessed, 0.0)


def _fill(
    frames: Frames,
    flown: FlownTrial,
    start: Frames,
    places: NDArray[np.int64],
    guess: Guess,
) -> None:
    """Put the frames at some places of a trajectory into `frames`. The first frame of
    all is that of the `start`, which lacks nothing.
    """
    here, before = slice(0, len(places)), places - 1
    follows = flown.steps[places] - flown.steps[before] == 1
    frames.step[here], frames.counts[here] = flown.steps[places], guess.counts
    frames.integrals[here] = guess.integrals
    frames.bodies[here, MOVING] = flown.bodies[places]
    frames.bodies[here, FIRST_STATE:] = flown.states[places]
    frames.bodies[here, BEFORE] = np.where(
        follows[:, None, None], flown.bodies[before, 2:], guess.velocities
    )
    if places[0] == 0:
        for filled, first in zip(frames, start, strict=True):
            filled[0] = first[0]


def _differ(one: Floats, other: Floats) -> NDArray[np.bool_]:
    """Which metrics have other values, (metrics, F) each; NaN is the same as NaN."""
    equal = (one == other) | (np.isnan(one) & np.isnan(other))
    found: NDArray[np.bool_] = ~equal.all(axis=1)
    return found
