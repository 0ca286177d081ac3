"""A trial that has run once.

A track keeps the metrics, and states from which any step is reached quickly.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design import Job
from sweep.replays import Report
from sweep.spec import RecordSpec
from sweep.trial import Simulation, State, joined, measured
from sweep.web.running import recorded, simulation_of

BOID_STEPS_APART = 60_000
"""Boids times steps between two kept states.

These steps take about 20 ms, so that a page can go to any step without a visible
wait.
"""
MOST_BYTES = 256 * 2**20
"""Largest memory, in bytes, that the kept states take.

Beyond this limit the states are further apart, and reaching a step takes longer.
"""


NOTHING = RecordSpec(())
"""An empty record, for frames that are not shown."""


class Track(NamedTuple):
    """The run of a trial that records metrics at every step.

    Attributes
    ----------
    job : Job
        The trial.
    steps : array (F,)
        Steps from 0 to the last finite step.
    values : dict of str to array (F,)
        Values of each metric.
    states : dict of int to State
        The kept states by step.
    """

    job: Job
    steps: NDArray[np.int64]
    values: dict[str, NDArray[np.float64]]
    states: dict[int, State]

    @property
    def last(self) -> int:
        """The last step."""
        return int(self.steps[-1])


def survey(
    job: Job, metrics: tuple[str, ...], report: Report, *, visits: bool = False
) -> Track:
    """Run a trial from start to end, and keep the metrics and some states.

    An exception of the run is raised unchanged.

    Parameters
    ----------
    job : Job
        The trial.
    metrics : tuple of str
        Names of the metrics.
    report : callable
        Called with the number of steps done and the number of all steps.
    visits : bool, default False
        Whether visits are counted even if no metric needs visits.
    """
    job = replace(job, record=recorded(job, metrics, visits=visits))
    simulation = simulation_of(job, job.record)
    measured_only = replace(job.record, trajectories=False)
    taken = [simulation.take_frames(measured_only)]
    states: dict[int, State] = {}
    apart = _steps_apart(simulation)
    going = True
    while going and simulation.steps_left > 0:
        going = simulation.advance(steps_a_call(simulation))
        taken.append(simulation.take_frames(measured_only))
        report(simulation.step, simulation.schedule.steps)
        if (
            going
            and simulation.steps_left > 0
            and simulation.step >= max(states, default=0) + apart
        ):
            states[simulation.step] = simulation.state().copied()
    run = joined(taken)
    values = measured(job.record, run, job.settings)
    return Track(job, run.steps, {name: values[name] for name in metrics}, states)


def _steps_apart(simulation: Simulation) -> int:
    """Return the number of steps between two kept states, at least those of a call."""
    size = sum(array.nbytes for array in simulation.state().arrays.values())
    return max(
        steps_a_call(simulation), -(-simulation.schedule.steps * size // MOST_BYTES)
    )


def steps_a_call(simulation: Simulation) -> int:
    """Return the number of steps that take some milliseconds."""
    return max(1, BOID_STEPS_APART // simulation.schedule.n)


def go_to(track: Track, simulation: Simulation, step: int) -> Simulation:
    """Return a simulation of the track's trial at a step, which holds no frames.

    Parameters
    ----------
    track : Track
        The run.
    simulation : Simulation
        A simulation of the trial at any step; the simulation is moved to the step, or
        replaced by a new simulation.
    step : int
        The step, at most the last step of the track.
    """
    before = max((start for start in track.states if start <= step), default=0)
    if not before <= simulation.step <= step:
        if before:
            simulation.restore(track.states[before])
        else:
            simulation = quiet(track.job, track.job.record)
    run_to(simulation, step)
    return simulation


def run_to(simulation: Simulation, step: int) -> None:
    """Run up to a step that the simulation is known to reach, and hold no frames."""
    while simulation.step < step:
        simulation.advance(min(step - simulation.step, steps_a_call(simulation)))
        simulation.take_frames(NOTHING)


def quiet(job: Job, record: RecordSpec) -> Simulation:
    """Return a simulation that counts events for `record`, and holds no frames."""
    simulation = simulation_of(job, record)
    simulation.take_frames(NOTHING)
    return simulation
