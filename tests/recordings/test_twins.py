"""The trajectory of a trial, read as a recording, gives the numbers of the trial."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.settings import Observation, WorldSettings
from sweep.design import Job, Jobs, expand
from sweep.own_code import study_of
from sweep.trial import run
from sweep.trial.result import Result
from tests.builders import FIRST_PRESETS, every_metric, job

NOT_OF_BODIES = ("state", "kinds", "potential")
"""Fields of metrics that need a property of a model."""


def recorded_metrics(model: str) -> tuple[str, ...]:
    return tuple(
        name
        for name in every_metric(model)
        if not any(getattr(METRICS[name], field) for field in NOT_OF_BODIES)
    )


def flown(model: str, preset: str, n: int = 9, steps: int = 25) -> Result:
    metrics = recorded_metrics(model)
    trial = job(model, preset, metrics=metrics, series=metrics, n=n, steps=steps)
    result = run(replace(trial, record=replace(trial.record, trajectories=True)))
    assert result.error == ""
    return result


def rows_of(result: Result) -> pd.DataFrame:
    """A row per boid and frame, as a program would write it."""
    assert result.trajectory is not None
    assert result.frames is not None
    frames, _, n = result.trajectory.shape
    x, y, vx, vy = result.trajectory.transpose(1, 0, 2).reshape(4, -1)
    return pd.DataFrame(
        {
            "boid": np.tile(np.arange(n), frames),
            "frame": np.repeat(result.frames, n),
            "x": x,
            "y": y,
            "vx": vx,
            "vy": vy,
        }
    )


def recording_of(result: Result, path: Path, metrics: Sequence[str] = ()) -> Job:
    """The trial of the recording at `path`, in the world of a trial; by default with
    all metrics of the trial.
    """
    settings = result.job.settings
    observed = (*Observation._fields, *WorldSettings._fields)
    study = study_of(
        {
            "study": "twin",
            "recording": {
                "files": [path.name],
                "time_step": settings["dt"],
                "velocities": "given",
                "length": MODELS[result.job.model].length,
                "origin": {"x": 0, "y": 0},
                "columns": {
                    "individual": "boid",
                    "frame": "frame",
                    "vx": "vx",
                    "vy": "vy",
                },
            },
            "seed": result.job.seed,
            "fixed": {name: settings[name] for name in observed},
            "record": {
                "metrics": list(metrics or result.job.record.metrics),
                "series": list(metrics or result.job.record.series),
                "trajectories": True,
            },
        },
        path.with_name("spec.yaml"),
    )
    return Jobs(study, expand(study)).at(0)


@pytest.mark.parametrize(("model", "preset"), FIRST_PRESETS)
def test_a_recorded_trial_has_the_values_of_the_trial(
    model: str, preset: str, tmp_path: Path
) -> None:
    result = flown(model, preset)
    file = tmp_path / "tracks.csv"
    rows_of(result).sample(frac=1.0, random_state=1).sort_values("frame").to_csv(
        file, index=False
    )
    again = run(recording_of(result, file))
    assert again.error == ""
    assert again.trajectory is not None
    assert result.trajectory is not None
    assert again.trajectory.tobytes() == result.trajectory.tobytes()
    different = [
        name
        for name, values in result.series.items()
        if again.series[name].tobytes() != values.tobytes()
    ]
    assert different == []


@pytest.mark.parametrize(("model", "preset"), FIRST_PRESETS[:2])
def test_an_individual_without_a_position_is_left_out_of_a_frame(
    model: str, preset: str, tmp_path: Path
) -> None:
    """In a gap the values are those of a recording without the individual. A change in
    one step leaves the individual out in the first frame after the gap, too.
    """
    result = flown(model, preset)
    metrics = [name for name in recorded_metrics(model) if METRICS[name].looks]
    rows = rows_of(result)
    hidden = rows["boid"] == 3
    gap = rows["frame"].between(10, 14)
    values = {}
    for name, kept in {
        "all": gap | ~gap,
        "gap": ~(hidden & gap),
        "none": ~hidden,
    }.items():
        file = tmp_path / f"{name}.csv"
        rows[kept].to_csv(file, index=False)
        recorded = run(recording_of(result, file, metrics))
        assert recorded.error == ""
        values[name] = recorded.series
        if name == "gap":
            assert recorded.job.settings["absent"] == pytest.approx(5 / (9 * 26))
            assert recorded.trajectory is not None
            absent = np.isnan(recorded.trajectory).any(axis=(1, 2))
            assert np.flatnonzero(absent).tolist() == [10, 11, 12, 13, 14]
    frames = np.arange(26)
    for name in metrics:
        last = 15 if METRICS[name].per_step else 14
        without = (frames >= 10) & (frames <= last)
        expected = np.where(without, values["none"][name], values["all"][name])
        np.testing.assert_array_equal(values["gap"][name], expected, name)
