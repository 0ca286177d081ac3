"""Playback of an event of a recording, in the place of a model that steers boids.

The frames of an event are on the disk. A trial reads the frames of one kernel call at a
time. An individual without a position keeps the last one, so that the kernels have
numbers, and metrics leave the individual out in that frame.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kernels.flight import Flight, measure
from kernels.metrics import Metric
from kernels.playback import Played
from kernels.recording import FILLED, Frames
from sweep.design import Job, LastFlock
from sweep.recordings import open_frames
from sweep.text import so_many

Floats = NDArray[np.float64]
Presence = NDArray[np.bool_]
FRAMES_AT_ONCE = 1024
"""Largest number of frames in memory, besides recorded frames."""


class Playback:
    """Frames of the event of a job.

    Parameters
    ----------
    job : Job
        Trial of a recording.

    Raises
    ------
    RuntimeError
        If the recording has no such event, or if the event has another number of
        individuals or fewer steps.
    StoreError
        If the frames are not on this machine.
    """

    def __init__(self, job: Job) -> None:
        events = job.catalogue.models[job.model].events
        boids = int(job.settings["n"])
        if job.replicate >= len(events):
            reason = f"the recording has {so_many(len(events), 'event')}"
            raise RuntimeError(f"{reason}: there is no event {job.replicate}, from 0")
        event = events[job.replicate]
        if boids != event.boids:
            reason = f'event "{event.name}" has {event.boids} individuals, not {boids}'
            raise RuntimeError(reason)
        if int(job.settings["steps"]) > event.steps:  # a kernel would read beyond
            reason = f'event "{event.name}" has {event.steps} steps'
            raise RuntimeError(f"{reason}, not {job.settings['steps']}")
        self._frames = open_frames(event)
        self._dt = float(job.settings["dt"])
        self._last = _known(np.zeros(self._frames.shape[1:]), self._frames[:1])[-1]
        self.complete = event.absent == 0.0

    def beginning(self) -> LastFlock:
        """Return the flock of the first frame."""
        boids = self._last.shape[1]
        none = np.empty((0, boids))
        return LastFlock(self._last.copy(), self._last[2:].copy(), none)

    def load(self, flight: Flight, steps: int) -> int:
        """Give a run its next frames; return the number of frames, at most `steps`.

        Parameters
        ----------
        flight : Flight
            Its boids are at the last frame that was loaded.
        steps : int
            Number of frames that the caller wants.
        """
        first = flight.step + 1
        count = min(steps, FRAMES_AT_ONCE)
        before = np.stack(flight.flock[:4])
        bodies = _known(before, self._frames[first : first + count])
        flight.params = Played(self._dt, bodies, first)
        return count

    def present(self, steps: NDArray[np.int64]) -> Presence:
        """Return which boids have a position after given steps, shape (F, N)."""
        present: Presence = np.isfinite(self._frames[steps, 0])
        return present

    def measure(self, flight: Flight, metrics: Sequence[Metric]) -> Floats:
        """Return the values of metrics of the boids with a position.

        Frames with the same boids are measured together.

        Parameters
        ----------
        flight : Flight
            With frames in memory.
        metrics : sequence of Metric

        Returns
        -------
        array of float64, shape (number of metrics, F)
            NaN for a frame without any position.
        """
        filled = flight.filled
        if self.complete or not filled or not any(metric.looks for metric in metrics):
            return measure(flight, metrics)
        values = np.full((len(metrics), filled), np.nan)
        per_step = np.array([metric.per_step for metric in metrics])
        steps = flight.record.frames.step[:filled]
        present = self.present(steps)
        # A change in one step needs the position of the step before as well.
        followed = present & self.present(np.maximum(steps - 1, 0))
        for rows, members in ((~per_step, present), (per_step, followed)):
            chosen = [metrics[row] for row in np.flatnonzero(rows).tolist()]
            for alike in _alike(members) if chosen else ():
                who = np.flatnonzero(members[alike[0]])
                if who.size:
                    among = _among(flight, alike, who)
                    values[np.ix_(rows, alike)] = measure(among, chosen)
        return values


def playback_of(job: Job) -> Playback | None:
    """Return the playback of a trial of a recording; None for any other trial."""
    return Playback(job) if job.catalogue.models[job.model].events else None


def with_last_positions(bodies: Floats) -> Floats:
    """Return frames (F, 4, N) in which an absent individual keeps the last values.

    An individual without earlier values gets zeros.
    """
    return _known(np.zeros(bodies.shape[1:]), bodies)


def _alike(present: Presence) -> list[NDArray[np.int64]]:
    """Return the indices of consecutive frames with the same boids."""
    changes = (present[1:] != present[:-1]).any(axis=1)
    return np.split(np.arange(len(present)), np.flatnonzero(changes) + 1)


def _among(flight: Flight, alike: NDArray[np.int64], who: NDArray[np.int64]) -> Flight:
    """Return a run with some of the frames, and some of the boids, for metrics."""
    bodies, counts, step, integrals = flight.record.frames
    frames = Frames(
        bodies[alike][:, :, who].copy(), counts[alike], step[alike], integrals[alike]
    )
    progress = flight.record.progress.copy()
    progress[FILLED] = len(alike)
    ground = flight.ground
    failing = flight.work.robots.failing
    robots = flight.work.robots._replace(
        failing=failing._replace(fails_at=failing.fails_at[who])
    )
    return replace(
        flight,
        record=flight.record._replace(frames=frames, progress=progress),
        ground=ground._replace(boids=len(who), kind=ground.kind[who]),
        work=flight.work._replace(robots=robots),
    )


def _known(before: Floats, frames: Floats) -> Floats:
    """Return frames (F, 4, N) in which missing values are the last known ones.

    `before` (4, N) has the values before the first frame.
    """
    every = np.concatenate([before[np.newaxis], frames])
    missing = np.isnan(every)
    rows = np.arange(len(every))[:, np.newaxis, np.newaxis]
    last = np.maximum.accumulate(np.where(missing, 0, rows), axis=0)
    filled: Floats = np.take_along_axis(every, last, axis=0)[1:]
    return filled
