"""Final flocks of trials, and trials that begin with final flocks.

A trial that begins with a final flock differs only in the first frame. Its steps count
from 0, it has separate random numbers, and no pixel has been visited.
"""

from functools import partial
from typing import Any

import numpy as np
from numpy.random import Generator

from kernels.flight import Flight
from kernels.model import Model
from kernels.state import Floats, Flock, Kinds
from sweep.design import Job, LastFlock


def last_flock(flight: Flight) -> LastFlock:
    """Return a copy of the current flock of a simulation."""
    work = flight.work
    return LastFlock(
        np.stack(flight.flock[:4]),
        np.stack([work.heading_x, work.heading_y]),
        work.state.copy(),
    )


def flock_of(job: Job, begins: LastFlock) -> Flock:
    """Return a copy of the flock with which a job begins.

    Raises RuntimeError if the number of boids or of state values does not match the
    job.
    """
    n = int(job.settings["n"])
    rows = len(job.catalogue.models[job.model].state)
    shapes = (begins.bodies.shape, begins.headings.shape, begins.state.shape)
    if shapes != ((4, n), (2, n), (rows, n)):
        boids = begins.bodies.shape[-1]
        raise RuntimeError(
            f"trial {job.parent} ended with {boids} boids with {len(begins.state)} rows"
            f" of state, and this trial has {n} with {rows}"
        )
    x, y, vx, vy = begins.bodies.copy()
    return Flock(x, y, vx, vy, previous_vx=np.zeros(n), previous_vy=np.zeros(n))


def starting(model: Model, begins: LastFlock | None) -> Model:
    """Return the model, with the state values of a final flock as initial values."""
    if begins is None or not model.state:
        return model
    return model._replace(begin_state=partial(_copy_state, begins.state))


def _copy_state(
    final: Floats,
    _params: Any,
    _flock: Flock,
    _kind: Kinds,
    _rng: Generator,
    state: Floats,
) -> None:
    state[:] = final


def place(flight: Flight, begins: LastFlock | None) -> None:
    """Restore the headings of the boids of a simulation.

    Headings matter for boids at rest.
    """
    if begins is not None:
        flight.work.heading_x[:], flight.work.heading_y[:] = begins.headings
