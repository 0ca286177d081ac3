"""Parameters of 200 synthetic flocks of three published models are recovered, and a
posterior tells which parameters a mill does not.

Each flock has parameters from the prior, and goes through a calibration of its own. The
ranks of the true values are uniform, and credible intervals hold them as often as they
say. There are 18 such comparisons: of two parameters of three models the ranks and two
coverages. All together fail by chance in at most 1 of 100 cases (Bonferroni).
"""

from pathlib import Path

import pytest
from scipy.stats import binomtest

from sweep.loaded import LoadedStudy
from sweep.methods.calibration import Posterior
from tests.commands import started

SURE = 0.01 / 18
CALIBRATE = """
  population: 50
  generations: 3
  checks: 200
replicates: 1
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
        "[polarization_mean, nearest_neighbour_distance_mean]",
    ),
    "couzin2002": (
        COUZIN,
        {
            "orientation_width": "{uniform: [0, 10]}",
            "attraction_width": "{uniform: [0, 14]}",
        },
        "[polarization_mean, flock_radius_mean, nearest_neighbour_distance_mean]",
    ),
    "strombom2014": (
        STROMBOM,
        {"attraction_strength": "{uniform: [0, 2]}", "noise": "{uniform: [0, 1]}"},
        "[polarization_mean, flock_radius_mean, speed_mean]",
    ),
}
"""Of each model: the spec, the prior, and the summaries."""


def launched(folder: Path, data: str, fit: str) -> Posterior:
    """The posterior of the study `fit`, after both specs are launched."""
    for name, text in {"data": data, "fit": fit}.items():
        (folder / f"{name}.yaml").write_text(text)
        done = started(folder, "launch", f"{name}.yaml")
        assert done.returncode == 0, done.stderr
    return LoadedStudy("fit", folder / "results").posterior()


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_intervals_hold_the_parameters_of_synthetic_flocks(
    model: str, tmp_path: Path
) -> None:
    spec, prior, summaries = MODELS[model]
    fixed = ", ".join(f"{name}: 1" for name in prior)
    data = spec.format(study="data", fixed=fixed, rest="replicates: 1\nseed: 9")
    drawn = ", ".join(f"{name}: {spread}" for name, spread in prior.items())
    rest = (
        f"sweep:\n  prior: {{sample: random, points: 300, {drawn}}}\n"
        f"calibrate:\n  to: data\n  summaries: {summaries}{CALIBRATE}"
    )
    calibrated = spec.format(study="fit", fixed="", rest=rest).replace(", }", "}")
    posterior = launched(tmp_path, data, calibrated)
    assert posterior.checks["parameter"].tolist() == list(prior)
    for row in posterior.checks.to_dict("records"):
        assert row["data_sets"] == 200
        assert row["p"] > SURE
        for level in (50, 95):
            inside = round(row[f"coverage_{level}"] * row["data_sets"])
            assert binomtest(inside, row["data_sets"], level / 100).pvalue > SURE


MILL = """
study: {study}
model: couzin2002
preset: as_written
fixed: {{n: 40, steps: 3000, start_margin: 0, start_center_x: 10, start_center_y: 10,
  start_radius: 5, {fixed}}}
derive: {{flock_range: repulsion_range + orientation_width + attraction_width}}
replicates: 4
record:
  metrics: [polarization, angular_momentum, flock_radius, nearest_neighbour_distance]
  every: 50
{rest}
"""
OF_MILL = """
sweep:
  prior:
    sample: random
    points: 600
    orientation_width: {uniform: [0, 8]}
    attraction_width: {uniform: [2, 30]}
    repulsion_range: {uniform: [0.5, 2]}
calibrate:
  to: data
  summaries: [polarization_mean, angular_momentum_mean, flock_radius_mean,
    nearest_neighbour_distance_mean]
  population: 150
  generations: 4
"""


@pytest.mark.slow
def test_a_mill_does_not_tell_the_range_of_its_attraction(tmp_path: Path) -> None:
    """As Mann (2011, PLoS One 6, e22827) has found: beyond the size of the mill, every
    range of attraction gives the same mill. The distance of neighbours is told.
    """
    true = "orientation_width: 2, attraction_width: 14"
    data = MILL.format(study="data", fixed=true, rest="seed: 7")
    fit = MILL.format(study="fit", fixed="", rest=OF_MILL).replace(", }", "}")
    posterior = launched(tmp_path, data, fit)
    rows = posterior.parameters.set_index("parameter")
    part = (rows["high"] - rows["low"]) / (rows["prior_high"] - rows["prior_low"])
    assert part["attraction_width"] > 0.5
    assert rows.loc["attraction_width", "high"] > 28.0
    assert part["repulsion_range"] < 0.5
    for name, value in {"orientation_width": 2.0, "repulsion_range": 1.0}.items():
        assert rows.loc[name, "low"] < value < rows.loc[name, "high"]
