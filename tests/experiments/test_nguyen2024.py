"""The measures of nguyen2024 that are worked out beside the table of trials."""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest

from experiments.nguyen2024 import measures

REPLICATES = 6


class Stored(NamedTuple):
    """What a measure reads of a stored study."""

    trials: pd.DataFrame
    series: pd.DataFrame


def as_published(weight: str, metric: str, off: float) -> Any:
    """A study of trials that are all alike, `off` standard errors above the points."""
    points = measures.published_points(f"{weight}_weight", metric)
    error = np.hypot(points["sd_between_trials"] / 10.0, points["reading_error"])
    trials, series = [], []
    for replicate in range(REPLICATES):
        for value in points["weight"].unique():
            trial = f"{replicate}-{value}"
            trials.append((trial, replicate, value, "done"))
            here = points["weight"] == value
            series.append(
                pd.DataFrame(
                    {
                        "trial_id": trial,
                        "frame": points["frame"][here],
                        metric: (points["published_value"] + off * error)[here],
                    }
                )
            )
    names = ["trial_id", "replicate", f"{weight}_weight", "status"]
    return Stored(pd.DataFrame(trials, columns=names), pd.concat(series))


@pytest.mark.parametrize("off", [0.0, 1.0, -3.0])
def test_curves_are_as_many_standard_errors_off_as_they_are(off: float) -> None:
    """The deviation between trials is that of the author's program."""
    studies = {"separation": as_published("separation", "speed", off)}
    found = measures.panel_separation_speed(studies)
    assert found.shape == (REPLICATES,)
    np.testing.assert_allclose(found, abs(off), atol=1e-9)


def test_the_figure_has_twelve_panels_of_points() -> None:
    panels = {
        (weight, metric): measures.published_points(f"{weight}_weight", metric)
        for weight in measures.WEIGHTS
        for metric in measures.METRICS
    }
    assert sum(len(points) for points in panels.values()) == 297
    assert all(points["frame"].between(50, 498).all() for points in panels.values())
    known = [points["sd_between_trials"].notna().all() for points in panels.values()]
    assert known == [True] * 4 + [False] * 8


def test_forces_in_opposite_directions_annihilate_each_other() -> None:
    """Both are limited to 0.5 at a distance of 10 px; at 100 px cohesion is alone."""
    settings = pd.Series(
        {
            "separation_range": 50.0,
            "cohesion_range": 200.0,
            "max_force": 0.5,
            "separation_weight": 1.0,
            "cohesion_weight": 1.0,
        }
    )
    for distance, left in ((10.0, 0.0), (100.0, 0.5)):
        x, y = np.array([0.0, distance]), np.zeros(2)
        separation, cohesion = measures._forces(x, y, settings)
        np.testing.assert_allclose((separation + cohesion)[0], [left, -left])
