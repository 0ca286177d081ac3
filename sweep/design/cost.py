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
from sweep.design.design import Design, evenly
from sweep.design.jobs import Job, SomeJobs
from sweep.spec.settings import Value, settings_of, settings_tuple
from sweep.spec.study import RecordSpec, Study

TRIAL_SECONDS = 1.5e-3
BOID_STEP_SECONDS = 110e-9
CANDIDATE_SECONDS = 6e-9
METRIC_SECONDS = 15e-9
PAIR_METRIC_SECONDS = 250e-9
ROW_BYTES = 120.0
NUMBER_BYTES = 7.0
TRAJECTORY_NUMBER_BYTES = 7.0
HEATMAP_PIXEL_BYTES = 0.6
ENDS_TRIED_AT = 20


class TrialPace(NamedTuple):
    """How many times the estimated seconds trials take, as measured in a probe of so
    many steps. Of code whose cost is known there is no probe, and `steps` is 0.
    """

    factor: float = 1.0
    steps: int = 0


KNOWN_PACE = TrialPace()


def job_seconds(jobs: Sequence[Job]) -> NDArray[np.float64]:
    """The estimated seconds of each trial, shape (number of jobs,)."""
    if isinstance(jobs, SomeJobs):  # millions of jobs may have few points
        whole = jobs.jobs
        return point_seconds(whole.study, whole.design)[jobs.points]
    return np.array(
        [trial_seconds(job.model, job.known, job.settings, job.record) for job in jobs]
    )


def trial_seconds(
    model: str, known: Catalogue, settings: dict[str, Value], record: RecordSpec
) -> float:
    """The estimated seconds of a trial with these settings, from its boid-steps, their
    neighbours, its frames and its metrics.
    """
    about = known.models[model]
    params = settings_tuple(about.params, settings, settings_of(model, known))
    n, steps = float(settings["n"]), float(settings["steps"])
    side = 3.0 * about.sight(params).range
    width, height = float(settings["width"]), float(settings["height"])
    share = min(1.0, side / width) * min(1.0, side / height)
    boid_step = BOID_STEP_SECONDS + CANDIDATE_SECONDS * n * share
    frames = steps / record.every + 1.0
    measured = [known.metrics[name] for name in record.metrics]
    looking = sum(metric.looks for metric in measured)
    boid_step += PAIR_METRIC_SECONDS * any(metric.pairs for metric in measured)
    pairing = sum(metric.pairwise for metric in measured)
    metrics = n * frames * (METRIC_SECONDS * looking + PAIR_METRIC_SECONDS * pairing)
    return TRIAL_SECONDS + n * steps * boid_step + metrics


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
    if record.heatmaps:
        pixels = (
            float(settings["width"])
            * float(settings["height"])
            / float(settings["pixel"]) ** 2
        )
        size += HEATMAP_PIXEL_BYTES * pixels
    return size


def point_seconds(study: Study, design: Design) -> NDArray[np.float64]:
    """The estimated seconds of a trial at each point, shape (n_points,).

    Points that differ only in what does not change the estimate are estimated once,
    since a design may have millions of points.
    """

    def estimate(point: int) -> float:
        settings = design.settings(point)
        return trial_seconds(study.model, study.known, settings, study.record)

    matters = [
        column
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
    """Whether a varied setting changes the estimate: its least and its greatest value
    are tried at a few points.
    """
    column = design.columns[name]
    if column.dtype == object:
        return False
    ends = column.min().item(), column.max().item()
    for point in evenly(design.n_points, ENDS_TRIED_AT):
        one = design.settings(point)
        low, high = (
            trial_seconds(study.model, study.known, one | {name: end}, study.record)
            for end in ends
        )
        if low != high:
            return True
    return False


def study_cost(
    study: Study, design: Design, pace: TrialPace = KNOWN_PACE
) -> tuple[float, float]:
    """Estimated seconds of one core, and bytes, for all trials, from at most 500 points
    spread evenly.
    """
    settings: list[dict[str, Any]] = [
        design.settings(point) for point in evenly(design.n_points, 500)
    ]
    seconds = np.mean(
        [trial_seconds(study.model, study.known, one, study.record) for one in settings]
    )
    states = len(study.known.models[study.model].state)
    size = np.mean([trial_bytes(one, study.record, states) for one in settings])
    trials = design.n_points * study.trials_per_point
    return float(seconds) * pace.factor * trials, float(size) * trials
