"""Finite-size scaling of stored studies."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.analysis import binder_cumulant, order_samples, susceptibility
from sweep.cli.reporting import print_report
from sweep.errors import ChoiceError
from sweep.loaded import LoadedStudy
from sweep.methods.scaling import DRIFTS, finite_size_scaling, scaling_report
from tests.commands import sweep as command
from tests.studies import launched

SPEC = """\
study: sizes
model: vicsek1995
fixed: {steps: 200}
sizes: {n: [16, 36]}
sweep: {noise: [2, 4, 6]}
replicates: 10
seed: 1
record: {series: [polarization, speed], every: 2}
"""


def flown(spec: str, results: Path) -> LoadedStudy:
    return LoadedStudy(launched(spec, results).name, results)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("sizes")


@pytest.fixture(scope="module")
def study(folder: Path) -> LoadedStudy:
    return flown(SPEC, folder / "results")


def test_points_are_those_of_each_size_alone(study: LoadedStudy) -> None:
    found = study.scaling()
    assert (found.metric, found.control, found.length) == (
        "polarization",
        "noise",
        "side",
    )
    assert [one.length for one in found.curves] == [2.0, 3.0]
    points = found.points.set_index(["n", "noise"])
    samples = order_samples(study, "polarization")
    table = study.points
    for point, values in samples.items():
        row = points.loc[(table.at[point, "n"], table.at[point, "noise"])]
        half = values[:, values.shape[1] // 2 :]
        chi = susceptibility(half, int(table.at[point, "n"]))
        assert row["susceptibility"] == pytest.approx(chi.value)
        assert row["susceptibility_low"] == pytest.approx(chi.low)
        assert row["binder_high"] == pytest.approx(binder_cumulant(half).high)
        assert row["order"] == pytest.approx(half.mean())
        assert (row["trials"], row["frames"]) == (10, half.shape[1])
    assert found.left_out == 0


def test_a_burn_in_is_in_steps(study: LoadedStudy) -> None:
    found = study.scaling(burn_in=150)
    assert set(found.states["frames"]) == {26}
    assert found.burn_in == 150


def test_series_that_are_not_stationary_are_flagged(
    study: LoadedStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One point is made to grow to the end, and one to come to rest late."""
    series, trials = study.series.copy(), study.trials.set_index("trial_id")
    noise = series["trial_id"].map(trials["noise"])
    n = series["trial_id"].map(trials["n"])
    wobble = np.random.default_rng(1).normal(0.0, 0.01, len(series))
    share = series["frame"] / 200.0
    values = 0.5 + wobble
    values = values + np.where((noise == 2) & (n == 16), share, 0.0)
    values = values + np.where((noise == 4) & (n == 16) & (share < 0.3), 1.0, 0.0)
    series["polarization"] = values
    monkeypatch.setitem(vars(study), "series", series)
    rows = study.scaling(burn_in=20).states.to_dict("records")
    states = {(row["n"], row["noise"]): row for row in rows}
    assert DRIFTS in states[16, 2.0]["problems"]
    assert states[16, 4.0]["problems"] == DRIFTS
    assert 60 <= states[16, 4.0]["burn_in"] <= 70
    assert not any(states[36, noise]["problems"] for noise in (2.0, 4.0, 6.0))
    found = study.scaling(burn_in=20)
    assert not found.stationary
    assert found.order == ("not decided", "not all series are stationary")


@pytest.mark.parametrize(
    ("where", "asked", "message"),
    [
        ("n = 16", {}, 'has flocks of a single size; add "sizes" to the spec'),
        ("noise = 4", {}, "varies no number in addition to n"),
        ("", {"metric": "polarisation"}, 'did you mean "polarization"'),
        ("", {"by": "nois"}, 'did you mean "noise"'),
        ("", {"burn_in": 200}, "burn-in: 200 steps; allowed: 0 to 199"),
        ("", {"burn_in": -1}, "burn-in: -1 steps; allowed: 0 to 199"),
    ],
)
def test_what_has_no_sizes_is_said(
    study: LoadedStudy, where: str, asked: dict[str, object], message: str
) -> None:
    chosen = study.where(where) if where else study
    with pytest.raises(ChoiceError, match=message):
        finite_size_scaling(chosen, **asked)  # type: ignore[arg-type]


def test_a_study_without_series_or_with_more_axes(tmp_path: Path) -> None:
    short = SPEC.replace("steps: 200", "steps: 4").replace("[2, 4, 6]", "[2, 4]")
    plain = short.replace("series: [polarization, speed]", "metrics: [polarization]")
    found = flown(plain, tmp_path / "a")
    with pytest.raises(ChoiceError, match="has recorded no series"):
        found.scaling()
    more = short.replace("noise: [2, 4]", "noise: [2, 4], max_speed: [0.1, 0.2]")
    found = flown(more, tmp_path / "b")
    with pytest.raises(ChoiceError, match="choose from: noise, max_speed"):
        found.scaling()
    with pytest.raises(ChoiceError, match="choose with where: max_speed"):
        found.scaling(by="noise")
    assert found.where("max_speed = 0.1").scaling().control == "noise"
    kept = short.replace("[16, 36]}", "[16, 36], keep: box}")
    found = flown(kept, tmp_path / "c")
    assert found.scaling().length == "n"
    assert [one.length for one in found.scaling().curves] == [16.0, 36.0]


@pytest.mark.parametrize(
    ("left_out", "said"), [(0, ""), (2, "2 trials left out: not done, without")]
)
def test_trials_that_do_not_count_are_said(
    study: LoadedStudy, left_out: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    print_report(scaling_report(study, replace(study.scaling(), left_out=left_out)))
    lines = [line for line in capsys.readouterr().out.splitlines() if "left" in line]
    assert " ".join(map(str.strip, lines)).startswith(said)
    assert bool(lines) == bool(said)


@pytest.mark.usefixtures("study")
def test_the_command(folder: Path) -> None:
    text = command(folder, "scaling", "sizes").stdout
    assert "transition: not decided" in text
    assert "no collapse: fewer than 3 sizes" in text
    assert "the first half of each trial discarded" in text
    table = command(folder, "scaling", "sizes", "--csv").stdout
    assert table.startswith("n,length,noise,order,order_low,order_high,susceptibility")
    assert len(table.splitlines()) == 7
    said = json.loads(command(folder, "scaling", "sizes", "--json").stdout)
    assert said["collapse"]["place"] == [None, None, None]
    assert pd.DataFrame(said["points"])["n"].tolist() == 3 * [16] + 3 * [36]
    bad = command(folder, "scaling", "sizes", "--by", "nois")
    assert bad.returncode == 2
    assert bad.stderr.count("\n") == 1
