"""sheep: the conversion of the recording, and what the README says of the models."""

import math
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from experiments.sheep.recording import convert
from sweep.own_code import load_spec
from sweep.trial import run
from tests import ROOT
from tests.recordings.tracks import jobs_of

FOLDER = ROOT / "experiments" / "sheep"
REPLICATES = 10
MEANS = {
    ("jadhav2024", 2.0): {
        "herd_radius": 2.73,
        "nearest_neighbour_distance_of_sheep": 1.45,
        "dog_distance": 8.09,
        "polarization_of_sheep": 0.850,
    },
    ("jadhav2024", 0.5): {
        "herd_radius": 1.27,
        "nearest_neighbour_distance_of_sheep": 0.62,
        "dog_distance": 2.90,
        "polarization_of_sheep": 0.807,
    },
    ("strombom2014", 2.0): {
        "herd_radius": 3.16,
        "nearest_neighbour_distance_of_sheep": 1.80,
        "dog_distance": 8.73,
        "polarization_of_sheep": 0.683,
    },
    ("strombom2014", 0.5): {
        "herd_radius": 1.43,
        "nearest_neighbour_distance_of_sheep": 0.76,
        "dog_distance": 3.70,
        "polarization_of_sheep": 0.706,
    },
}
"""Means of 60 trials, as the table of the README has them."""


@pytest.mark.parametrize(("model", "reach"), MEANS)
def test_the_models_have_the_means_of_the_readme(model: str, reach: float) -> None:
    """The mean of ten of the 60 trials deviates by its standard error.

    Two-sided at 5 standard errors of ten trials beyond the rounding, a Student's t of 9
    degrees of freedom fails by chance in 1 of 1,300 of 16 checks; these trials never.
    """
    study = load_spec(FOLDER / f"{model}.yaml")
    trials = [
        run(job)
        for job in jobs_of(study)
        if job.replicate < REPLICATES
        and job.settings["repulsion_range"] == reach
        and job.settings.get("alignment_strength") != 0.0
    ]
    assert len(trials) == REPLICATES
    readme = (FOLDER / "README.md").read_text("utf-8")
    for name, mean in MEANS[model, reach].items():
        values = [trial.mean[name] for trial in trials]
        error = np.std(values, ddof=1) / math.sqrt(REPLICATES)
        digits = 3 if name.startswith("polarization") else 2
        assert abs(np.mean(values) - mean) < 5 * error + 0.5 * 10.0**-digits, name
        assert f"{mean:.{digits}f} (" in readme


def test_the_drives_of_an_event_are_cut_at_their_lengths(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three drives of 3, 2 and 4 frames, of which the first event has two."""
    rng = np.random.default_rng(2)
    lengths = (3, 2, 4)
    arrays = {
        f"{kind}_ev_{event}": rng.random((16, 2, frames))
        for event, frames in ((1, 5), (2, 4))
        for kind in ("pos", "vel")
    }
    savemat(tmp_path / "data.mat", {"len_drvs": np.array(lengths) - 1, **arrays})
    monkeypatch.setattr(convert, "__file__", str(tmp_path / "convert.py"))
    monkeypatch.setattr(sys, "argv", ["convert.py", str(tmp_path / "data.mat")])
    convert.main()
    tracks = pd.read_parquet(tmp_path / "drives.parquet")
    counts = tracks.groupby("drive")["t"].nunique()
    assert tuple(counts) == lengths
    assert tracks.groupby("kind")["id"].unique().map(len).to_dict() == {
        "sheep": 14,
        "dog": 1,
        "shepherd": 1,
    }
    second = tracks.query("drive == 2 and id == 15")
    assert set(second["kind"]) == {"dog"}
    np.testing.assert_array_equal(second["x"], arrays["pos_ev_1"][14, 0, 3:])
    np.testing.assert_array_equal(second["vy"], arrays["vel_ev_1"][14, 1, 3:])
    np.testing.assert_array_equal(second["t"], [0.0, 0.1])
