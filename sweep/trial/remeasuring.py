"""Metrics of a trial from its stored trajectory, bitwise identical to a run.

A trajectory has the inputs of most metrics: exact positions, velocities and state
values of boids in each frame. Counts, integrals, and the velocities one step earlier
are missing. If each step has a frame, the previous frame has the earlier velocities.
Missing inputs are replaced by two different guesses. If the values of a metric differ
between the guesses, the metric needs the missing inputs and gets no value.
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
from sweep.design import Job
from sweep.spec import DerivedMetric, RecordSpec
from sweep.trial.derived import summaries, with_derived
from sweep.trial.numba_errors import explained
from sweep.trial.simulation import BOID_STEPS_A_CALL, Simulation
from sweep.trial.state import joined

Floats = NDArray[np.float64]
MOVING = slice(0, 4)
"""Rows of `bodies` with positions and velocities, which a trajectory has."""
BEFORE = slice(4, FIRST_STATE)
"""Rows of `bodies` with the velocities one step earlier."""
OTHER_FLIGHT = (
    "its stored trajectory is not bitwise identical to a new run on this machine:"
    " another processor or library has computed the trajectory, or it was changed"
)


class FlownTrial(NamedTuple):
    """Finished trial with its stored trajectory.

    Attributes
    ----------
    job : Job
        The trial, with all metrics that its row is to have.
    missing : tuple of str
        Metrics that its row lacks, measured and derived ones.
    steps : array of int, shape (F,)
        Steps of all frames that the job records.
    bodies : array of float, shape (F, 4, N)
        x, y, vx and vy.
    states : array of float, shape (F, S, N)
        The S state values per boid that the model has.
    series : mapping of arrays, shape (F,)
        Stored values of metrics per frame.
    flies : bool
        Whether the beginning of the trial runs again, and is compared.
    """

    job: Job
    missing: tuple[str, ...]
    steps: NDArray[np.int64]
    bodies: Floats
    states: Floats
    series: Mapping[str, Floats]
    flies: bool


class Guess(NamedTuple):
    """Guess of the values of F frames that a trajectory lacks.

    Attributes
    ----------
    counts : array of int, shape (F, N_COUNTS)
    integrals : array of float, shape (F, N_INTEGRALS)
    velocities : array of float, shape (F, 2, N)
        Velocities one step earlier.
    blank : float
        Value where a metric writes none.
    """

    counts: NDArray[np.int64]
    integrals: Floats
    velocities: Floats
    blank: float


class Remeasured(NamedTuple):
    """Missing metrics of a trial, or the reason why they cannot be measured.

    Attributes
    ----------
    trial_id : str
    last : mapping of float
        Value at the last frame, by metric.
    mean : mapping of float
        Mean over the second half of the trial, or over an event, by metric.
    need : tuple of str
        Metrics that need more than a trajectory has.
    wrong : str
        Error.
    """

    trial_id: str
    last: Mapping[str, float] = MappingProxyType({})
    mean: Mapping[str, float] = MappingProxyType({})
    need: tuple[str, ...] = ()
    wrong: str = ""


def what_lacks(metric: Metric, every: int) -> str:
    """Return the declared inputs of a metric that a trajectory lacks, in words.

    The trajectory has a frame per `every` steps. Returns "" if no declared input is
    missing.
    """
    if metric.covers:
        return "the visits of pixels, which are counted in each step"
    if metric.counts:
        return "escapes, collisions or arrivals, which are counted in each step"
    if metric.pairs:
        return "contacts between boids, which are counted in each step"
    if metric.integrates:
        return "the velocities of each step, which are summed during each step"
    if metric.follows:
        return "flocks from frame to frame, which are compared during the run"
    if metric.per_step and every > 1:
        return f"the velocities one step earlier; frames are {every} steps apart"
    return ""


def sources(
    record: RecordSpec, names: Iterable[str], series: Iterable[str]
) -> tuple[tuple[str, ...], tuple[DerivedMetric, ...]]:
    """Return the metrics that must be measured and derived to get some metrics.

    Parameters
    ----------
    record : RecordSpec
    names : iterable of str
        Names of the metrics.
    series : iterable of str
        Metrics with stored values per frame, which need no measurement.

    Returns
    -------
    measured : tuple of str
    derived : tuple of DerivedMetric
        In the order in which they are computed.
    """
    stored = set(series)
    needed = set(names)
    derived: list[DerivedMetric] = []
    for metric in reversed(record.derive):
        if metric.name in needed - stored:
            derived.insert(0, metric)
            needed |= metric.expression.names
    measured = [name for name in record.metrics if name in needed - stored]
    return tuple(measured), tuple(derived)


def expected_steps(job: Job) -> NDArray[np.int64]:
    """Return the steps of all frames of a complete trial."""
    steps = int(job.settings["steps"])
    return np.unique([*range(0, steps, job.record.every), steps])


def remeasure(flown: FlownTrial) -> Remeasured:
    """Return the missing metrics of a trial from its stored frames.

    An exception becomes the error of the result.
    """
    try:
        return _remeasured(flown)
    except Exception as error:
        reason = explained(error) or f"{type(error).__name__}: {error}"
        return Remeasured(flown.job.trial_id, wrong=reason)


def unmeasured(flown: FlownTrial, error: str) -> Remeasured:
    """Return the result of a trial after the death of its worker."""
    return Remeasured(flown.job.trial_id, wrong=error)


def seconds(some: Sequence[FlownTrial]) -> list[float]:
    """Return the approximate relative durations of trials."""
    return [float(flown.bodies.size + len(flown.steps)) for flown in some]


def _remeasured(flown: FlownTrial) -> Remeasured:
    job = flown.job
    measured = dict(flown.series)
    names, derived = sources(job.record, flown.missing, flown.series)
    if names:
        record = RecordSpec(names, every=job.record.every, trajectories=True)
        looking = replace(job, record=record)
        values, unknown = _measured(Simulation(looking), flown)
        if flown.flies:
            unknown |= _begins_otherwise(Simulation(looking), flown, values)
        if unknown.any():
            need = tuple(np.array(names)[unknown].tolist())
            return Remeasured(job.trial_id, need=need)
        measured |= dict(zip(names, values, strict=True))
    every = with_derived(derived, measured, job.settings)
    missing = {name: every[name] for name in flown.missing}
    last, mean = summaries(
        missing,
        flown.steps,
        int(job.settings["steps"]),
        recorded=bool(job.catalogue.models[job.model].events),
    )
    return Remeasured(job.trial_id, last, mean)


def _begins_otherwise(
    simulation: Simulation, flown: FlownTrial, values: Floats
) -> NDArray[np.bool_]:
    """Return a mask of the metrics that differ at the beginning of a new run.

    The beginning runs here, and the values are compared with `values` (metrics, F) from
    the trajectory. Raises ValueError if the frames of the new run differ.
    """
    start = simulation.take_frames()
    simulation.advance(_steps_a_call(simulation))
    begun = joined([start, simulation.take_frames()])
    _check_same(flown, begun.bodies, begun.state)
    return _differ(begun.values, values[:, : len(begun.steps)])


def _check_same(flown: FlownTrial, bodies: Floats, states: Floats) -> None:
    """Raise ValueError if a trajectory does not begin with bitwise identical frames."""
    for stored, now in ((flown.bodies, bodies), (flown.states, states)):
        if stored[: len(now)].tobytes() != now.tobytes():
            raise ValueError(OTHER_FLIGHT)


def _measured(
    simulation: Simulation, flown: FlownTrial
) -> tuple[Floats, NDArray[np.bool_]]:
    """Measure the metrics of a simulation in the frames of a trajectory.

    The simulation is at its start. Returns the values (metrics, F), and a mask
    (metrics,) of the metrics that need more than the frames have.
    """
    flight = simulation.flight
    job = simulation.job
    bodies, counts, step, integrals = flight.record.frames
    start = Frames(
        bodies[:1].copy(), counts[:1].copy(), step[:1].copy(), integrals[:1].copy()
    )
    _check_same(flown, start.bodies[:, MOVING], start.bodies[:, FIRST_STATE:])
    metrics = [job.catalogue.metrics[name] for name in job.record.metrics]
    values = np.full((len(metrics), len(flown.steps)), np.nan)
    unknown = np.zeros(len(metrics), np.bool_)
    rng = np.random.default_rng(0)
    for places in _calls(simulation, flown.steps):
        by_guess = []
        for guess in (_nothing(flown, places), _anything(flown, places, rng)):
            _fill(flight.record.frames, flown, start, places, guess=guess)
            flight.record.progress[FILLED] = len(places)
            by_guess.append(measure(flight, metrics, guess.blank))
        values[:, places] = by_guess[0]
        unknown |= _differ(*by_guess)
    return values, unknown


def _steps_a_call(simulation: Simulation) -> int:
    """Return the steps of a kernel call, between two readings of frames of a run."""
    record = simulation.flight.record
    room = (len(record.frames.step) - 1) * record.every
    return min(max(1, BOID_STEPS_A_CALL // simulation.schedule.n), room)


def _calls(simulation: Simulation, steps: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return the indices of the frames of each kernel call."""
    call = -(-steps // _steps_a_call(simulation))
    return np.split(np.arange(len(steps)), np.flatnonzero(np.diff(call)) + 1)


def _nothing(flown: FlownTrial, places: NDArray[np.int64]) -> Guess:
    """Return the guess that all counts are 0 and all boids were at rest."""
    counts = np.zeros((len(places), N_COUNTS), np.int64)
    integrals = np.zeros((len(places), N_INTEGRALS))
    return Guess(counts, integrals, np.zeros_like(flown.bodies[places, 2:]), np.nan)


def _anything(
    flown: FlownTrial, places: NDArray[np.int64], rng: np.random.Generator
) -> Guess:
    """Return a random guess of counts, integrals and velocities."""
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
    """Put some frames of a trajectory into `frames`.

    The first frame of the trial comes from `start`, which is complete.
    """
    here = slice(0, len(places))
    before = places - 1
    follows = flown.steps[places] - flown.steps[before] == 1
    frames.step[here] = flown.steps[places]
    frames.counts[here] = guess.counts
    frames.integrals[here] = guess.integrals
    frames.bodies[here, MOVING] = flown.bodies[places]
    frames.bodies[here, FIRST_STATE:] = flown.states[places]
    frames.bodies[here, BEFORE] = np.where(
        follows[:, None, None], flown.bodies[before, 2:], guess.velocities
    )
    if places[0] == 0:
        for filled, first in zip(frames, start, strict=True):
            filled[0] = first[0]


def _differ(first: Floats, second: Floats) -> NDArray[np.bool_]:
    """Return a mask of metrics with different values (metrics, F); NaN equals NaN."""
    equal = (first == second) | (np.isnan(first) & np.isnan(second))
    different: NDArray[np.bool_] = ~equal.all(axis=1)
    return different
