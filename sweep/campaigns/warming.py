"""Compilation of kernels ahead of a launch, for images and clusters.

Trials run for a single step, as the first step of a launch. So the cache has exactly
the kernels that a launch loads.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from kernels.settings import COMMON, ROBOT_GROUPS
from sweep.design import Design, Job, Jobs, evenly, expand
from sweep.errors import SpecError
from sweep.own_code import named_model, study_of
from sweep.spec import Study
from sweep.text import unknown
from sweep.trial import AT_ONCE, first_group, groups, usual, warm, warm_together
from sweep.workers import in_a_line

IDEAL = {name: COMMON[name] for group in ROBOT_GROUPS for name in group._fields} | {
    "obstacle_speed": COMMON["obstacle_speed"]
}
"""Parameters of robots and of moving obstacles, with values that disable the feature.
"""
MOST_POINTS = 10_000
"""Number of points that are searched for points that need another kernel."""


def cache_folder() -> Path:
    """Return the folder of compiled kernels. Raises CacheError without a folder."""
    return usual()


def warm_study(study: Study) -> float:
    """Compile the kernels that the trials of a study need.

    The kernels of batches are compiled too, if batches are possible. Returns the
    seconds that this took. Raises SpecError if no trial can take a step.
    """
    began = time.perf_counter()
    study = study.stand_in
    design = expand(study)
    jobs = list(unlike(study, design))
    results = [warm(job) for job in jobs]
    failed = [result for result in results if result.has_failed]
    if failed and len(failed) == len(results):
        message = f"no trial can be run: {in_a_line(failed[0].error)}"
        raise study.document.error(("model",), message)
    if study.policy.memory is None and first_group(Jobs(study, design)):
        for job in jobs:
            _warm_together(job)
    return time.perf_counter() - began


def _warm_together(job: Job) -> None:
    """Compile the kernels for batches of trials like `job`, if batches are possible."""
    alike = [replace(job, replicate=k) for k in range(AT_ONCE)]
    if len(next(groups(alike))) > 1:
        warm_together(alike)


def warm_model(model: str, *, code: bool = True) -> float:
    """Compile a model with each preset, and all metrics that the model can record.

    Returns the seconds that this took. Raises SpecError for an unknown model, for a
    model that cannot run, and without `code` for a file.
    """
    name, catalogue = named_model(model, code=code)
    if name not in catalogue.models:
        raise SpecError(unknown("model", name, catalogue.models))
    began = time.perf_counter()
    for preset in catalogue.models[name].presets:
        spec = {
            "study": "warm",
            "model": model,
            "preset": preset,
            "replicates": AT_ONCE,
        }
        fitting = [metric for metric in catalogue.metrics if _fits(spec, metric)]
        warm_study(study_of(spec | {"record": {"metrics": fitting}}))
    return time.perf_counter() - began


def _fits(spec: dict[str, Any], metric: str) -> bool:
    try:
        study_of(spec | {"record": {"metrics": [metric]}})
    except SpecError:
        return False
    return True


def unlike(study: Study, design: Design) -> Iterator[Job]:
    """Yield a trial for each combination of choices that may need another kernel.

    The choices are maps, initial conditions and further choices, and the parameters
    that make robots of boids.
    """
    looked = evenly(design.n_points, MOST_POINTS)
    spreads = [name for name, setting in study.settings.items() if setting.spread_of]
    ideal = IDEAL | dict.fromkeys(spreads, 0.0)
    choices = [
        (column if column.dtype == object else column == ideal[name])[looked]
        for name, column in design.columns.items()
        if column.dtype == object or name in ideal
    ]
    first = (
        dict(zip(zip(*choices, strict=True), looked, strict=True)) if choices else {}
    )
    few = design.only(sorted(first.values()) or [0])
    yield from Jobs(study, few, np.ones(few.n_points, np.int64))
