"""The profiles of a trial, from the positions in its averaged frames."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from kernels.flight import Flight
from kernels.metrics.parts import members
from kernels.profiles import BINNED, Passage, Profile
from sweep.design import Job
from sweep.spec import TORUS, USUAL_BINS, RecordedProfile
from sweep.trial.result import ProfileValues

Floats = NDArray[np.float64]
BOX_BINS = 9
"""Usual numbers of values along an axis; the largest box is a quarter of the world."""


def profiles_of(
    job: Job, flight: Flight, steps: NDArray[np.int64], bodies: Floats
) -> dict[str, ProfileValues]:
    """Return the profiles of a trial that is done, by name.

    Parameters
    ----------
    job : Job
    flight : Flight
        Run of the trial.
    steps : array of int, shape (F,)
        Steps of the frames.
    bodies : array of float, shape (F, 4, N)
        x, y, vx and vy of all boids; NaN for a boid without a position.
    """
    model = job.catalogue.models[job.model]
    # Lags need equal times between frames, and the last frame may be early.
    averaged = steps % job.record.every == 0
    if not model.events:
        averaged &= 2 * steps > flight.schedule.steps
    values = {}
    for recorded in job.record.profiles:
        profile = job.catalogue.profiles[recorded.name]
        part = bodies[averaged]
        if profile.part:
            is_member = members(
                profile.part,
                model.kinds,
                flight.ground.kind,
                flight.work.robots.failing.fails_at,
                steps=steps[averaged],
            )
            part = np.where(is_member[:, np.newaxis], part, np.nan)
        values[recorded.name] = _measured(job, profile, recorded, part)
    return values


def _measured(
    job: Job, profile: Profile, recorded: RecordedProfile, bodies: Floats
) -> ProfileValues:
    width = float(job.settings["width"])
    height = float(job.settings["height"])
    periodic = job.settings["borders"] == TORUS
    frame_time = float(job.settings["dt"]) * job.record.every
    axis = _axis_of(
        profile,
        recorded,
        sides=(width, height),
        frame_time=frame_time,
        frames=_usual_frames(job, len(bodies)),
    )
    size = len(axis) - 1 if profile.axis in BINNED else len(axis)
    values = np.full(
        bodies.shape[2] if profile.axis == "individual" else size, math.nan
    )
    x, y, vx, vy = np.ascontiguousarray(bodies.transpose(1, 0, 2))
    passage = Passage(
        x=x,
        y=y,
        vx=vx,
        vy=vy,
        width=width,
        height=height,
        periodic=periodic,
    )
    profile.measure(passage, axis, values)
    if profile.in_time:
        values *= frame_time
    if profile.axis in BINNED:
        at = 0.5 * (axis[1:] + axis[:-1])
    elif profile.axis == "lag":
        at = axis * frame_time
    elif profile.axis == "box side":
        at = math.sqrt(width * height) / axis
    else:
        at = np.arange(float(bodies.shape[2]))
    return ProfileValues(at, values)


def _usual_frames(job: Job, frames: int) -> int:
    """Return the number of averaged frames that determines the usual longest lag.

    The events of a recording have equal lags, which the shortest event determines.
    """
    events = job.catalogue.models[job.model].events
    if not events:
        return frames
    return min(event.steps for event in events) // job.record.every + 1


def _axis_of(
    profile: Profile,
    recorded: RecordedProfile,
    sides: Sequence[float],
    frame_time: float,
    frames: int,
) -> Floats:
    """Return the axis of a profile, as its kernel reads it.

    Parameters
    ----------
    profile : Profile
    recorded : RecordedProfile
        The wanted extent of the axis.
    sides : sequence of float
        Width and height of the world.
    frame_time : float
        Time between two frames.
    frames : int
        Number of averaged frames.
    """
    bins = recorded.bins or (BOX_BINS if profile.axis == "box side" else USUAL_BINS)
    if profile.axis == "distance":
        return np.linspace(0.0, recorded.to or 0.5 * min(sides), bins + 1)
    if profile.axis == "wave number":
        smallest = 2.0 * math.pi / max(sides)
        most = recorded.to or (bins + 0.5) * smallest
        return np.linspace(0.5 * smallest, most, bins + 1)
    if profile.axis == "box side":
        return np.arange(float(bins + 1), 1.0, -1.0)
    longest = max(1, frames // 4)
    if recorded.to is not None:
        longest = max(1, round(recorded.to / frame_time))
    if profile.axis == "individual":
        return np.arange(longest + 1.0)
    return _lags(longest, bins)


def _lags(longest: int, bins: int) -> Floats:
    """Return up to `bins` lags from 1 to `longest`, in about equal ratios."""
    if longest <= bins:
        return np.arange(1.0, longest + 1.0)
    return np.unique(np.rint(np.geomspace(1.0, longest, bins)))
