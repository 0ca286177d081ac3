"""The estimated cost of a trial, in seconds and in bytes.

The constants were measured on a 2.3 GHz server core with the first two models. Another
machine is faster or slower by a common factor, which a run measures. So only the ratio
between trials matters. Custom code may be slower or faster by any factor. A probe
measures this factor if a user asks for the duration of a study.
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
from sweep.spec import RecordSpec, Study, Value, settings_of, settings_tuple

TRIAL_SECONDS = 1.5e-3
BOID_STEP_SECONDS = 110e-9
CANDIDATE_SECONDS = 2e-9
GATHERED = 2.0
"""Boids in range, as a multiple of the number for evenly spread boids."""
ROBOT_SECONDS = 20e-9
"""Per boid-step of robots.

The constants from here to BETWEEN_SECONDS were measured with it
(`make bench ONLY=robots`).
"""
HEARD_SECONDS = 3e-9
"""Per boid in range and in view, to decide if a message is received."""
NORMALS_SECONDS = 30e-9
"""Per two normal numbers: an axis of a measurement error, or motor noise."""
LOST_SECONDS = 10e-9
"""Per boid in range and in view, to decide if a message is lost."""
BEHIND_OBSTACLE_SECONDS = 10e-9
"""Per boid in range and in view, to decide if an obstacle hides it."""
BODY_SECONDS = 1.5e-9
"""Per boid whose distance is computed, where boids hide each other."""
BETWEEN_SECONDS = 0.5e-9
"""Per pair of a boid in range and a boid that may be hidden."""
OBSTACLE_SECONDS = 2.6e-6
"""Per obstacle that is drawn for the world of a trial."""
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
    """Measured duration of trials as a multiple of the estimated duration.

    Code with a known cost needs no probe: `steps`, the length of the probe, is 0.
    """

    factor: float = 1.0
    steps: int = 0


KNOWN_PACE = TrialPace()
NOTHING = RecordSpec(())


def job_seconds(jobs: Sequence[Job]) -> NDArray[np.float64]:
    """Return the estimated seconds of each trial, shape (number of jobs,)."""
    if isinstance(jobs, ContinuedJobs):
        left = 1.0 - jobs.begun / steps_of(jobs.jobs)
        return job_seconds(jobs.jobs) * left
    if isinstance(jobs, LinkedJobs):
        chains = range(len(jobs))
        lengths = [len(jobs.left([chain])) for chain in chains]
        seconds = job_seconds(jobs.left(chains))
        return np.add.reduceat(seconds, np.cumsum([0, *lengths[:-1]]))
    if isinstance(jobs, SomeJobs):  # millions of jobs may have few points
        study_jobs = jobs.jobs
        return point_seconds(study_jobs.study, study_jobs.design)[jobs.points]
    return np.array(
        [
            trial_seconds(job.model, job.catalogue, job.settings, job.record)
            for job in jobs
        ]
    )


def trial_seconds(
    model: str,
    catalogue: Catalogue,
    settings: dict[str, Value],
    record: RecordSpec,
) -> float:
    """Return the estimated seconds of a trial.

    The estimate adds up boid-steps, neighbours, frames, metrics and the drawing of
    obstacles.

    Parameters
    ----------
    model : str
    catalogue : Catalogue
        Models, metrics, maps and starts by name.
    settings : dict
        All parameters of the trial.
    record : RecordSpec

    Returns
    -------
    float
    """
    n = float(settings["n"])
    steps = float(settings["steps"])
    share = searched_share(model, catalogue, settings)
    boid_step = BOID_STEP_SECONDS + CANDIDATE_SECONDS * n * share
    boid_step += robot_seconds(model, catalogue, settings)
    frames = steps / record.every + 1.0
    measured = [catalogue.metrics[name] for name in record.metrics]
    looking = sum(metric.looks for metric in measured)
    boid_step += PAIR_METRIC_SECONDS * any(metric.pairs for metric in measured)
    boid_step += INTEGRAL_SECONDS * any(metric.integrates for metric in measured)
    pairing = sum(metric.pairwise for metric in measured)
    pairing += any(metric.follows for metric in measured)
    cubic = n**2 * sum(metric.cubic for metric in measured)
    of_a_boid = METRIC_SECONDS * looking + PAIR_METRIC_SECONDS * pairing
    metrics = n * frames * (of_a_boid + CUBIC_METRIC_SECONDS * cubic)
    seconds = TRIAL_SECONDS + n * steps * boid_step + metrics
    drawn = catalogue.maps.get(str(settings["map"]))  # None for a map of the spec
    if drawn is not None and drawn.random:
        seconds += OBSTACLE_SECONDS * float(settings["n_obstacles"])
    return seconds


def robot_seconds(
    model: str, catalogue: Catalogue, settings: dict[str, Value]
) -> float:
    """Return the extra seconds of a boid-step of a robot, compared to an ideal boid.

    Sensing, communication and motors take this time.

    Parameters
    ----------
    model : str
    catalogue : Catalogue
        Models, metrics, maps and starts by name.
    settings : dict
        All parameters of the trial.

    Returns
    -------
    float
        0.0 for ideal boids.
    """
    robots = robots_at(model, catalogue, settings)
    dt = float(settings["dt"])
    if is_ideal(robots, dt):
        return 0.0
    sensing = robots.sensing
    seconds: float = ROBOT_SECONDS + NORMALS_SECONDS * (
        robots.actuation.motor_noise > 0
    )
    if not may_sense(robots, dt):
        return seconds
    n = float(settings["n"])
    errs = sensing.position_noise + sensing.velocity_noise > 0
    params = settings_tuple(
        catalogue.models[model].params, settings, settings_of(model, catalogue)
    )
    sight = catalogue.models[model].sight(params)
    area = float(settings["width"]) * float(settings["height"])
    circle = GATHERED * math.pi * sight.range * sight.range
    around = n * min(1.0, circle / area)
    in_view = around * min(1.0, sight.fov / 360.0)
    seconds += HEARD_SECONDS * in_view
    measured = 1 + (sensing.own_noise == OWN_INDEPENDENT)
    seconds += 2 * NORMALS_SECONDS * errs * measured
    seconds += LOST_SECONDS * in_view * (sensing.packet_loss > 0)
    if sensing.occlusion in (HIDDEN_BY_OBSTACLES, HIDDEN_BY_BOTH):
        seconds += BEHIND_OBSTACLE_SECONDS * in_view
    if sensing.occlusion in (HIDDEN_BY_BOIDS, HIDDEN_BY_BOTH):
        seconds += BODY_SECONDS * n + BETWEEN_SECONDS * around * in_view
    return seconds


def searched_share(
    model: str, catalogue: Catalogue, settings: dict[str, Value]
) -> float:
    """Return the fraction of the world that a neighbour search covers.

    The search looks at 3 x 3 cells of the grid.

    Parameters
    ----------
    model : str
    catalogue : Catalogue
        Models, metrics, maps and starts by name.
    settings : dict
        All parameters of the trial.

    Returns
    -------
    float
        From 0 to 1.
    """
    described = settings_of(model, catalogue)
    params = settings_tuple(catalogue.models[model].params, settings, described)
    sensing = settings_tuple(Sensing, settings, described)
    width = float(settings["width"])
    height = float(settings["height"])
    around = look_around(sensing, int(settings["n"]), width * height)
    side = 3.0 * min(catalogue.models[model].sight(params).range, around)
    return min(1.0, side / width) * min(1.0, side / height)


def trial_bytes(
    settings: dict[str, Value], record: RecordSpec, states: int = 0
) -> float:
    """Return the estimated bytes that a trial adds to the store.

    The bytes of a last state are not included.

    Parameters
    ----------
    settings : dict
        All parameters of the trial.
    record : RecordSpec
    states : int, default 0
        Number of state values per boid that the model has.

    Returns
    -------
    float
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
    model: str, catalogue: Catalogue, settings: dict[str, Value], record: RecordSpec
) -> float:
    """Return the estimated bytes of the last state of a trial.

    A last state has the boids, the frames so far, and pixels if visits are counted.

    Parameters
    ----------
    model : str
    catalogue : Catalogue
        Models, metrics, maps and starts by name.
    settings : dict
        All parameters of the trial.
    record : RecordSpec

    Returns
    -------
    float
        0.0 if `record` has no last states.
    """
    if not record.last_states:
        return 0.0
    states = len(catalogue.models[model].state)
    n = float(settings["n"])
    visits = any(catalogue.metrics[name].covers for name in record.metrics)
    frames_so_far = RecordSpec(
        record.metrics,
        record.metrics,
        record.every,
        heatmaps=visits or record.heatmaps,
        trajectories=record.trajectories,
    )
    own = LAST_STATE_BYTES + n * (LAST_STATE_BOID_BYTES + 2 * NUMBER_BYTES * states)
    own += trial_bytes(settings, frames_so_far, states)
    return own - trial_bytes(settings, NOTHING)


def point_seconds(study: Study, design: Design) -> NDArray[np.float64]:
    """Return the estimated seconds of a trial at each point, shape (n_points,).

    A design may have millions of points. So points are estimated once if they differ
    only in parameters that do not change the estimate.
    """

    def estimate(point: int) -> float:
        settings = design.settings(point)
        return trial_seconds(study.model, study.catalogue, settings, study.record)

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
    """Return whether a varied parameter changes the estimate.

    The smallest and the largest value, or all strings, are tried at a few points.
    """
    column = design.columns[name]
    tried = (
        dict.fromkeys(column.tolist())
        if column.dtype == object
        else (column.min().item(), column.max().item())
    )
    for point in evenly(design.n_points, ENDS_TRIED_AT):
        settings = design.settings(point)
        estimates = {
            trial_seconds(
                study.model, study.catalogue, settings | {name: value}, study.record
            )
            for value in tried
        }
        if len(estimates) > 1:
            return True
    return False


class StudyCost(NamedTuple):
    """Estimated cost of all trials of a study.

    Attributes
    ----------
    seconds : float
        Seconds of one core.
    size_bytes : float
        Bytes in the store, including last states.
    last_state_bytes : float
        Bytes of last states.
    """

    seconds: float
    size_bytes: float
    last_state_bytes: float


def study_cost(study: Study, design: Design, pace: TrialPace = KNOWN_PACE) -> StudyCost:
    """Return the estimated cost of a study, from at most 500 evenly spread points.

    Parameters
    ----------
    study : Study
    design : Design
        Points of the study.
    pace : TrialPace, default KNOWN_PACE
        Measured duration of trials as a multiple of the estimated duration.

    Returns
    -------
    StudyCost
        For the largest number of trials that the study may have.
    """
    points: list[dict[str, Any]] = [
        design.settings(point) for point in evenly(design.n_points, 500)
    ]
    model = study.model
    catalogue = study.catalogue
    record = study.record
    seconds = np.mean(
        [trial_seconds(model, catalogue, point, record) for point in points]
    )
    states = len(catalogue.models[model].state)
    size = np.mean([trial_bytes(point, record, states) for point in points])
    last = np.mean(
        [last_state_bytes(model, catalogue, point, record) for point in points]
    )
    trials = study.most_trials(design.n_points)
    return StudyCost(
        float(seconds) * pace.factor * trials,
        float(size + last) * trials,
        float(last) * trials,
    )
