"""What a trial is expected to cost, in seconds and in bytes.

The constants were measured on a 2.3 GHz server core with the first two models. Another
machine is faster or slower by a common factor, which the launch measures while it runs.
So what counts is the ratio between trials. Code that is none of ours may be slower or
faster by any factor: a probe measures it, for those who ask how long a study takes.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.catalogue import Catalogue
from kernels.robots.robots import is_ideal, may_sense
from kernels.settings import (
    HIDDEN_BY_BOIDS,
    HIDDEN_BY_BOTH,
    HIDDEN_BY_OBSTACLES,
    OWN_INDEPENDENT,
    Sensing,
)
from kernels.topology import look_around
from sweep.design.design import Design, evenly
from sweep.design.jobs import ContinuedJobs, Job, LinkedJobs, SomeJobs, steps_of
from sweep.design.robots import robots_at
from sweep.spec.settings import Value, settings_of, settings_tuple
from sweep.spec.study import RecordSpec, Study

TRIAL_SECONDS = 1.5e-3
BOID_STEP_SECONDS = 110e-9
CANDIDATE_SECONDS = 2e-9
GATHERED = 2.0
"""So many times as many boids are in range as if all were spread evenly: they flock."""
ROBOT_SECONDS, HEARD_SECONDS = 20e-9, 3e-9
"""Of a boid-step of robots, and of each boid that is in range and in view: is its
packet heard? What follows was measured with them (`make bench ONLY=robots`).
"""
NORMALS_SECONDS = 30e-9
"""Of two normal numbers: of each axis of an error of measurement, of motors' noise."""
LOST_SECONDS, BEHIND_OBSTACLE_SECONDS = 10e-9, 10e-9
BODY_SECONDS, BETWEEN_SECONDS = 1.5e-9, 0.5e-9
"""Of each body whose distance is looked at, and of each pair of one in range and one
that may be hidden by it.
"""
OBSTACLE_SECONDS = 2.6e-6
"""Of each obstacle that is drawn for the world of a trial."""
METRIC_SECONDS = 15e-9
INTEGRAL_SECONDS = 1.5e-9
PAIR_METRIC_SECONDS = 250e-9
CUBIC_METRIC_SECONDS = 0.5e-9
ROW_BYTES = 120.0
NUMBER_BYTES = 7.0
TRAJECTORY_NUMBER_BYTES = 7.0
HEATMAP_PIXEL_BYTES = 0.6
LAST_STATE_BYTES = 500.0
LAST_STATE_BOID_BYTES = 90.0
ENDS_TRIED_AT = 20


class TrialPace(NamedTuple):
    """How many times the estimated seconds trials take, as measured in a probe of so
    many steps. Of code whose cost is known there is no probe, and `steps` is 0.
    """

    factor: float = 1.0
    steps: int = 0


KNOWN_PACE = TrialPace()
NOTHING = RecordSpec(())


def job_seconds(jobs: Sequence[Job]) -> NDArray[np.float64]:
    """The estimated seconds of each trial, shape (number of jobs,)."""
    if isinstance(jobs, ContinuedJobs):
        left = 1.0 - jobs.begun / steps_of(jobs.jobs)
        return job_seconds(jobs.jobs) * left
    if isinstance(jobs, LinkedJobs):
        chains = range(len(jobs))
        lengths = [len(jobs.left([chain])) for chain in chains]
        seconds = job_seconds(jobs.left(chains))
        return np.add.reduceat(seconds, np.cumsum([0, *lengths[:-1]]))
    if isinstance(jobs, SomeJobs):  # millions of jobs may have few points
        whole = jobs.jobs
        return point_seconds(whole.study, whole.design)[jobs.points]
    return np.array(
        [trial_seconds(job.model, job.known, job.settings, job.record) for job in jobs]
    )


def trial_seconds(
    model: str,
    known: Catalogue,
    settings: dict[str, Value],
    record: RecordSpec,
) -> float:
    """The estimated seconds of a trial with these settings, from its boid-steps, their
    neighbours, its frames and its metrics.
    """
    n, steps = float(settings["n"]), float(settings["steps"])
    share = searched_share(model, known, settings)
    boid_step = BOID_STEP_SECONDS + CANDIDATE_SECONDS * n * share
    boid_step += robot_seconds(model, known, settings)
    frames = steps / record.every + 1.0
    measured = [known.metrics[name] for name in record.metrics]
    looking = sum(metric.looks for metric in measured)
    boid_step += PAIR_METRIC_SECONDS * any(metric.pairs for metric in measured)
    boid_step += INTEGRAL_SECONDS * any(metric.integrates for metric in measured)
    pairing = sum(metric.pairwise for metric in measured)
    pairing += any(metric.follows for metric in measured)
    cubic = n**2 * sum(metric.cubic for metric in measured)
    of_a_boid = METRIC_SECONDS * looking + PAIR_METRIC_SECONDS * pairing
    metrics = n * frames * (of_a_boid + CUBIC_METRIC_SECONDS * cubic)
    seconds = TRIAL_SECONDS + n * steps * boid_step + metrics
    drawn = known.maps.get(str(settings["map"]))  # of a map of the spec it is None
    if drawn is not None and drawn.random:
        seconds += OBSTACLE_SECONDS * float(settings["n_obstacles"])
    return seconds


def robot_seconds(model: str, known: Catalogue, settings: dict[str, Value]) -> float:
    """What a boid-step takes longer than that of an ideal boid, by what it measures and
    hears, and by its motors.
    """
    robots, dt = robots_at(model, known, settings), float(settings["dt"])
    if is_ideal(robots, dt):
        return 0.0
    about, described = known.models[model], settings_of(model, known)
    sensing = robots.sensing
    seconds: float = ROBOT_SECONDS + NORMALS_SECONDS * (
        robots.actuation.motor_noise > 0
    )
    if not may_sense(robots, dt):
        return seconds
    n, errs = float(settings["n"]), sensing.position_noise + sensing.velocity_noise > 0
    sight = about.sight(settings_tuple(about.params, settings, described))
    area = float(settings["width"]) * float(settings["height"])
    circle = GATHERED * math.pi * sight.range * sight.range
    around = n * min(1.0, circle / area)
    found = around * min(1.0, sight.fov / 360.0)
    seconds += HEARD_SECONDS * found
    measured = 1 + (sensing.own_noise == OWN_INDEPENDENT)
    seconds += 2 * NORMALS_SECONDS * errs * measured
    seconds += LOST_SECONDS * found * (sensing.packet_loss > 0)
    if sensing.occlusion in (HIDDEN_BY_OBSTACLES, HIDDEN_BY_BOTH):
        seconds += BEHIND_OBSTACLE_SECONDS * found
    if sensing.occlusion in (HIDDEN_BY_BOIDS, HIDDEN_BY_BOTH):
        seconds += BODY_SECONDS * n + BETWEEN_SECONDS * around * found
    return seconds


def searched_share(model: str, known: Catalogue, settings: dict[str, Value]) -> float:
    """The part of the world that a search looks through: 3 x 3 cells of the grid."""
    about, described = known.models[model], settings_of(model, known)
    params = settings_tuple(about.params, settings, described)
    sensing = settings_tuple(Sensing, settings, described)
    width, height = float(settings["width"]), float(settings["height"])
    around = look_around(sensing, int(settings["n"]), width * height)
    side = 3.0 * min(about.sight(params).range, around)
    return min(1.0, side / width) * min(1.0, side / height)


def trial_bytes(
    settings: dict[str, Value], record: RecordSpec, states: int = 0
) -> float:
    """The estimated bytes that a trial adds to the store; `states` is the number of
    rows of its model's state.
    """
    frames = math.ceil(float(settings["steps"]) / record.every) + 1
    size = ROW_BYTES + 2 * NUMBER_BYTES * len(record.names)
    if record.series:
        size += frames * (1.0 + NUMBER_BYTES * len(record.series))
    if record.trajectories:
        numbers = (4 + states) * float(settings["n"])
        size += frames * (1.0 + TRAJECTORY_NUMBER_BYTES * numbers)
    if record.last_flocks:
        size += TRAJECTORY_NUMBER_BYTES * (6 + states) * float(settings["n"])
    if record.heatmaps:
        pixels = (
            float(settings["width"])
            * float(settings["height"])
            / float(settings["pixel"]) ** 2
        )
        size += HEATMAP_PIXEL_BYTES * pixels
    return size


def last_state_bytes(
    model: str, known: Catalogue, settings: dict[str, Value], record: RecordSpec
) -> float:
    """The estimated bytes of the last state of a trial with these settings: those of
    its boids, its pixels if visits are counted, and its frames. 0 where none is kept.
    """
    if not record.last_states:
        return 0.0
    states, n = len(known.models[model].state), float(settings["n"])
    visits = any(known.metrics[name].covers for name in record.metrics)
    kept = RecordSpec(
        record.metrics,
        record.metrics,
        record.every,
        heatmaps=visits or record.heatmaps,
        trajectories=record.trajectories,
    )
    own = LAST_STATE_BYTES + n * (LAST_STATE_BOID_BYTES + 2 * NUMBER_BYTES * states)
    return own + trial_bytes(settings, kept, states) - trial_bytes(settings, NOTHING)


def point_seconds(study: Study, design: Design) -> NDArray[np.float64]:
    """The estimated seconds of a trial at each point, shape (n_points,).

    Points that differ only in what does not change the estimate are estimated once,
    since a design may have millions of points.
    """

    def estimate(point: int) -> float:
        settings = design.settings(point)
        return trial_seconds(study.model, study.known, settings, study.record)

    matters = [
        np.unique(column, return_inverse=True)[1]
        for name, column in design.columns.items()
        if _matters(study, design, name)
    ]
    if not matters:
        return np.full(design.n_points, estimate(0))
    _, first, which = np.unique(
        np.column_stack(matters), axis=0, return_index=True, return_inverse=True
    )
    return np.array([estimate(point) for point in first.tolist()])[which.ravel()]


def _matters(study: Study, design: Design, name: str) -> bool:
    """Whether a varied setting changes the estimate: its least and its greatest value,
    or of words each, are tried at a few points.
    """
    column = design.columns[name]
    tried = (
        dict.fromkeys(column.tolist())
        if column.dtype == object
        else (column.min().item(), column.max().item())
    )
    for point in evenly(design.n_points, ENDS_TRIED_AT):
        one = design.settings(point)
        seconds = {
            trial_seconds(study.model, study.known, one | {name: value}, study.record)
            for value in tried
        }
        if len(seconds) > 1:
            return True
    return False


class StudyCost(NamedTuple):
    """Estimated seconds of one core, bytes, and how many of these are last states, for
    all trials of a study.
    """

    seconds: float
    size_bytes: float
    last_state_bytes: float


def study_cost(study: Study, design: Design, pace: TrialPace = KNOWN_PACE) -> StudyCost:
    """What a study costs, from at most 500 points spread evenly."""
    settings: list[dict[str, Any]] = [
        design.settings(point) for point in evenly(design.n_points, 500)
    ]
    model, known, record = study.model, study.known, study.record
    seconds = np.mean([trial_seconds(model, known, one, record) for one in settings])
    states = len(known.models[model].state)
    size = np.mean([trial_bytes(one, record, states) for one in settings])
    last = np.mean([last_state_bytes(model, known, one, record) for one in settings])
    trials = study.most_trials(design.n_points)
    return StudyCost(
        float(seconds) * pace.factor * trials,
        float(size + last) * trials,
        float(last) * trials,
    )
