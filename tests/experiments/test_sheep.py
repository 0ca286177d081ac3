"""sheep: the conversion of the recording, and what the README says of the models."""

import math
import re
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
HALVES = {"odd": {1, 3}, "even": {2}}


def means_of_the_readme() -> dict[tuple[str, float], dict[str, str]]:
    """The means in the table of results, as texts: by model and range of repulsion."""
    page = (FOLDER / "README.md").read_text("utf-8")
    lines = page.partition("## Results")[2].partition("\n## ")[0]
    heads, _, *rows = [line for line in lines.splitlines() if line.startswith("|")]
    names = re.findall(r"(\w+), r_a = ([0-9.]+)", heads)
    found = {(model, float(reach)): dict[str, str]() for model, reach in names}
    for row in rows:
        metric, *cells = [cell.strip(" `") for cell in row.strip("|").split("|")]
        _, *means = [cell.partition(" ")[0] for cell in cells]
        for column, mean in zip(found, means, strict=True):
            found[column][metric] = mean
    return found


MEANS = means_of_the_readme()


@pytest.mark.parametrize(("model", "reach"), MEANS)
def test_the_models_have_the_means_of_the_readme(model: str, reach: float) -> None:
    """Those of 60 trials, of which ten are flown again.

    Two-sided at 6 standard errors of ten trials beyond the rounding, Student's t with 9
    degrees of freedom fails by chance in 1 of 5,000; one of 30 in 1 of 160 seeds.
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
    assert len(MEANS[model, reach]) == 5
    for name, mean in MEANS[model, reach].items():
        values = [trial.mean[name] for trial in trials]
        error = np.std(values, ddof=1) / math.sqrt(REPLICATES)
        rounding = 0.5 * 10.0 ** -len(mean.partition(".")[2])
        assert abs(np.mean(values) - float(mean)) < 6 * error + rounding, name


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
    halves = {name: pd.read_parquet(tmp_path / f"{name}.parquet") for name in HALVES}
    assert {name: set(half["drive"]) for name, half in halves.items()} == HALVES
    assert sum(map(len, halves.values())) == len(tracks)
    second = tracks.query("drive == 2 and id == 15")
    assert set(second["kind"]) == {"dog"}
    np.testing.assert_array_equal(second["x"], arrays["pos_ev_1"][14, 0, 3:])
    np.testing.assert_array_equal(second["vy"], arrays["vel_ev_1"][14, 1, 3:])
    np.testing.assert_array_equal(second["t"], [0.0, 0.1])
