"""Final flocks of trials, and trials that begin with them.

Such a trial has another first frame; nothing else differs. Its steps count from 0, it
has its own random numbers, and no pixel has been visited.
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
    """Return a copy of the flock of a flight."""
    work = flight.work
    return LastFlock(
        np.stack(flight.flock[:4]),
        np.stack([work.heading_x, work.heading_y]),
        work.state.copy(),
    )


def flock_of(job: Job, begins: LastFlock) -> Flock:
    """Return a copy of the flock with which a job begins.

    Raises RuntimeError if its number of boids or of state values is not that of the
    job.
    """
    n = int(job.settings["n"])
    rows = len(job.known.models[job.model].state)
    shapes = (begins.bodies.shape, begins.headings.shape, begins.state.shape)
    if shapes != ((4, n), (2, n), (rows, n)):
        boids = begins.bodies.shape[-1]
        raise RuntimeError(
            f"trial {job.parent} has left {boids} boids with {len(begins.state)} rows"
            f" of state, and this one has {n} with {rows}"
        )
    x, y, vx, vy = begins.bodies.copy()
    return Flock(x, y, vx, vy, previous_vx=np.zeros(n), previous_vy=np.zeros(n))


def starting(model: Model, begins: LastFlock | None) -> Model:
    """Return the model, with the state values of a final flock as its initial ones."""
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
    """Give the boids of a flight the headings that they had, which matter at rest."""
    if begins is not None:
        flight.work.heading_x[:], flight.work.heading_y[:] = begins.headings
