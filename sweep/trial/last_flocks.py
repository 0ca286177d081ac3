"""Where boids are at the end of a trial, and trials that begin there.

A trial that begins so has another first frame; all else of it is as of any other: its
steps count from 0, its random numbers are its own, and nothing has been visited.
"""

from functools import partial
from typing import Any

import numpy as np
from numpy.random import Generator

from kernels.flight import Flight
from kernels.model import Model
from kernels.state import Floats, Flock, Kinds
from sweep.design.jobs import Job, LastFlock


def last_flock(flight: Flight) -> LastFlock:
    """Where the boids of a flight are, in arrays of their own."""
    flock, work = flight.flock, flight.work
    return LastFlock(
        np.stack(flock[:4]),
        np.stack([work.heading_x, work.heading_y]),
        work.state.copy(),
    )


def flock_of(job: Job, begins: LastFlock) -> Flock:
    """The flock with which a job begins, in arrays of its own.

    Raises RuntimeError where it is of another number of boids than those of the job, or
    of another model.
    """
    n, rows = int(job.settings["n"]), len(job.known.models[job.model].state)
    shapes = (begins.bodies.shape, begins.headings.shape, begins.state.shape)
    if shapes != ((4, n), (2, n), (rows, n)):
        found = begins.bodies.shape[-1]
        raise RuntimeError(
            f"trial {job.parent} has left {found} boids with {len(begins.state)} rows"
            f" of state, and this one has {n} with {rows}"
        )
    x, y, vx, vy = begins.bodies.copy()
    return Flock(x, y, vx, vy, np.zeros(n), np.zeros(n))


def starting(model: Model, begins: LastFlock | None) -> Model:
    """The model, whose boids begin with the state that those of another trial had."""
    if begins is None or not model.state:
        return model
    return model._replace(begin_state=partial(_given, begins.state))


def _given(
    given: Floats,
    _params: Any,
    _flock: Flock,
    _kind: Kinds,
    _rng: Generator,
    state: Floats,
) -> None:
    state[:] = given


def place(flight: Flight, begins: LastFlock | None) -> None:
    """Let boids at rest look where they did."""
    if begins is not None:
        flight.work.heading_x[:], flight.work.heading_y[:] = begins.headings
