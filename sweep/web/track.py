"""A run that was gone through once. It keeps the metrics, and states from which any
step is reached quickly.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job
from sweep.replays.flight import Report
from sweep.spec.study import RecordSpec
from sweep.trial.derived import measured
from sweep.trial.simulation import Simulation
from sweep.trial.state import State, joined
from sweep.web.running import recorded, simulation_of

BOID_STEPS_APART = 20_000
"""Boids times steps between two kept states: they take some milliseconds, so that a
page can go to any step without a visible wait.
"""
MOST_BYTES = 256 * 2**20
"""The most memory that the kept states may take. If there are too many, they lie
further apart, and reaching a step takes longer.
"""


NOTHING = RecordSpec(())
"""Records nothing, for frames that nobody looks at."""


class Track(NamedTuple):
    """The run of `job`, which records metrics at every step.

    `steps` (F,) are 0 to the last finite one, `values` has (F,) of each metric, and
    `states` has the kept states by their step.
    """

    job: Job
    steps: NDArray[np.int64]
    values: dict[str, NDArray[np.float64]]
    states: dict[int, State]

    @property
    def last(self) -> int:
        """The last step."""
        return int(self.steps[-1])


def survey(job: Job, metrics: tuple[str, ...], report: Report) -> Track:
    """Run `job` from its start to its end, and keep the metrics and some states. An
    exception of the run is raised as it is.
    """
    job = replace(job, record=recorded(job, metrics))
    simulation = simulation_of(job)
    taken, states = [simulation.take_frames(job.record)], dict[int, State]()
    apart, going = _steps_apart(simulation), True
    while going and simulation.steps_left > 0:
        going = simulation.advance(steps_a_call(simulation))
        taken.append(simulation.take_frames(job.record))
        report(simulation.step, simulation.schedule.steps)
        if (
            going
            and simulation.steps_left > 0
            and simulation.step >= max(states, default=0) + apart
        ):
            states[simulation.step] = simulation.state().copied()
    whole = joined(taken)
    values = measured(job.record, whole, job.settings)
    return Track(job, whole.steps, {name: values[name] for name in metrics}, states)


def _steps_apart(simulation: Simulation) -> int:
    """The number of steps between two kept states; at least those of one kernel
    call.
    """
    size = sum(array.nbytes for array in simulation.state().arrays.values())
    return max(
        steps_a_call(simulation), -(-simulation.schedule.steps * size // MOST_BYTES)
    )


def steps_a_call(simulation: Simulation) -> int:
    """The number of steps that take some milliseconds."""
    return max(1, BOID_STEPS_APART // simulation.schedule.n)


def go_to(track: Track, simulation: Simulation, step: int) -> Simulation:
    """A simulation of the track's job at `step`: `simulation`, moved there, or a new
    one. It holds no frames.
    """
    before = max((place for place in track.states if place <= step), default=0)
    if not before <= simulation.step <= step:
        if before:
            simulation.restore(track.states[before])
        else:
            simulation = quiet(track.job)
    run_to(simulation, step)
    return simulation


def run_to(simulation: Simulation, step: int) -> None:
    """Run up to a step that the simulation is known to reach, and hold no frames."""
    while simulation.step < step:
        simulation.advance(min(step - simulation.step, steps_a_call(simulation)))
        simulation.take_frames(NOTHING)


def quiet(job: Job) -> Simulation:
    """A simulation that counts what the metrics of `job` need, and holds no frames."""
    simulation = simulation_of(job)
    simulation.take_frames(NOTHING)
    return simulation
