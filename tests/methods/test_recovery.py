"""Parameters of 200 synthetic flocks of three published models are recovered.

Each flock has parameters from the prior, and goes through a calibration of its own. The
ranks of the true values are uniform, and credible intervals hold them as often as they
say. Each test of a parameter fails by chance in 1 of 100 cases for the ranks, and in 1
of 100 for each of two coverages.
"""

from pathlib import Path

import pytest
from scipy.stats import binomtest

from sweep.loaded import LoadedStudy
from tests.commands import started

SURE = 0.01
CALIBRATE = """
  population: 50
  generations: 2
  checks: 200
replicates: 3
"""
VICSEK = """
study: {study}
model: vicsek1995
fixed: {{n: 30, steps: 40, {fixed}}}
record: {{metrics: [polarization, nearest_neighbour_distance], every: 1}}
{rest}
"""
COUZIN = """
study: {study}
model: couzin2002
fixed: {{n: 20, steps: 200, {fixed}}}
record: {{metrics: [polarization, flock_radius, nearest_neighbour_distance], every: 10}}
{rest}
"""
STROMBOM = """
study: {study}
model: strombom2014
fixed: {{n: 21, steps: 100, {fixed}}}
record: {{metrics: [polarization, flock_radius, speed], every: 5}}
{rest}
"""
MODELS = {
    "vicsek1995": (
        VICSEK,
        {"noise": "{uniform: [0, 6]}", "interaction_range": "{loguniform: [0.3, 3]}"},
        "{polarization_mean: [mean, sd], nearest_neighbour_distance_mean: mean}",
    ),
    "couzin2002": (
        COUZIN,
        {
            "orientation_width": "{uniform: [0, 10]}",
            "attraction_width": "{uniform: [0, 14]}",
        },
        "{polarization_mean: mean, flock_radius_mean: mean,"
        " nearest_neighbour_distance_mean: mean}",
    ),
    "strombom2014": (
        STROMBOM,
        {"attraction_strength": "{uniform: [0, 2]}", "noise": "{uniform: [0, 1]}"},
        "{polarization_mean: mean, flock_radius_mean: mean, speed_mean: mean}",
    ),
}
"""Of each model: the spec, the prior, and the summaries."""


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_intervals_hold_the_parameters_of_synthetic_flocks(
    model: str, tmp_path: Path
) -> None:
    spec, prior, summaries = MODELS[model]
    fixed = ", ".join(f"{name}: 1" for name in prior)
    data = spec.format(study="data", fixed=fixed, rest="replicates: 3\nseed: 9")
    drawn = ", ".join(f"{name}: {spread}" for name, spread in prior.items())
    rest = (
        f"sweep:\n  prior: {{sample: random, points: 100, {drawn}}}\n"
        f"calibrate:\n  to: data\n  summaries: {summaries}{CALIBRATE}"
    )
    calibrated = spec.format(study="fit", fixed="", rest=rest).replace(", }", "}")
    for name, text in {"data": data, "fit": calibrated}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
        done = started(tmp_path, "launch", f"{name}.yaml")
        assert done.returncode == 0, done.stderr
    posterior = LoadedStudy("fit", tmp_path / "results").posterior()
    assert posterior.checks["parameter"].tolist() == list(prior)
    for row in posterior.checks.to_dict("records"):
        assert row["data_sets"] == 200
        assert row["p"] > SURE
        for level in (50, 95):
            inside = round(row[f"coverage_{level}"] * row["data_sets"])
            assert binomtest(inside, row["data_sets"], level / 100).pvalue > SURE
