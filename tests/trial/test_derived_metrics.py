"""Derived metrics in trials, stores and all that reads them: their values are those of
NumPy on the metrics that they need, to the last bit.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from kernels.catalogue import BUILT_IN
from sweep.analysis import by_point
from sweep.errors import StoreError
from sweep.figures import metric_curves, scatter_figure
from sweep.figures.directions import direction
from sweep.methods.adaptive import stopping
from sweep.methods.search.asked_trials import AskedTrials
from sweep.replays.replaying import replay
from sweep.replays.verifying import verify
from sweep.spec.derived_metrics import read_derived
from sweep.spec.document import Document, Entry
from sweep.spec.settings import settings_of
from sweep.spec.study import parse_spec
from sweep.tables.exporting import export
from sweep.tables.stored_study import StoredStudy
from sweep.trial.derived import with_derived
from sweep.workers.executors import Serial
from tests.commands import sweep
from tests.interpreter import interpreted
from tests.searches import TINY, asked_by
from tests.studies import DERIVING, SMALL, launched, relaunch


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(DERIVING, tmp_path_factory.mktemp("deriving"))


def values(
    expressions: dict[str, str], measured: dict[str, list[float]], **settings: float
) -> dict[str, list[float]]:
    """The values of derived metrics, where others have these."""
    entry = Entry(Document(Path("spec.yaml"), ""), ("derive",), expressions)
    model = "nguyen2024"
    derived = read_derived(entry, model, BUILT_IN, settings_of(model, BUILT_IN))
    given = {name: np.array(column) for name, column in measured.items()}
    found = with_derived(derived, given, settings)
    return {one.name: found[one.name].tolist() for one in derived}


def test_series_are_those_of_numpy_to_the_last_bit(study: StoredStudy) -> None:
    series = study.series
    speed, polarization = series["speed"].to_numpy(), series["polarization"].to_numpy()
    start = study.trials["start_speed"].unique()
    gain = polarization / speed
    np.testing.assert_array_equal(series["gain"].to_numpy(), gain)
    np.testing.assert_array_equal(series["loss"].to_numpy(), 1 - start * gain)
    assert len(start) == 1
    assert len(set(gain)) > 20


def test_columns_are_the_last_frame_and_the_mean_of_the_late_frames(
    study: StoredStudy,
) -> None:
    """Of the expression in each frame, which is not the expression of the means."""
    trials = study.trials.set_index("trial_id")
    for trial, frames in study.series.groupby("trial_id"):
        late = frames[2 * frames["frame"] > 9]
        for name in ("gain", "loss"):
            assert trials.loc[trial, name] == frames[name].iloc[-1]
            assert trials.loc[trial, f"{name}_mean"] == late[name].to_numpy().mean()
    of_means = trials["polarization_mean"] / trials["speed_mean"]
    assert (trials["gain_mean"] != of_means).all()
    wide = trials["dispersion"] > 170
    assert 0 < wide.sum() < len(wide)
    root = np.sqrt(trials["dispersion"] * trials["flock_radius"])
    expected = np.where(wide, root, trials["dispersion"])
    np.testing.assert_array_equal(trials["size"].to_numpy(), expected)


def test_other_columns_are_those_of_a_study_that_derives_nothing(
    study: StoredStudy, tmp_path: Path
) -> None:
    plain = launched(
        SMALL.replace("record: {", "record: {metrics: [dispersion, polarization], "),
        tmp_path,
    )
    shared = ["point", "seed", "speed", "speed_mean", "polarization", "dispersion_mean"]
    pd.testing.assert_frame_equal(
        plain.trials[shared], study.trials[shared], check_exact=True
    )


def test_the_interpreter_gives_the_same_bits(study: StoredStudy) -> None:
    code = (
        "from sweep.design.design import expand\nfrom sweep.design.jobs import Jobs\n"
        "from sweep.spec.study import parse_spec\n"
        "from sweep.trial.simulation import run\n"
        "from tests.studies import DERIVING\n"
        "study = parse_spec(DERIVING)\nfor job in Jobs(study, expand(study)):\n"
        "    result = run(job); print(*(result.mean[one.name].hex()"
        " for one in study.record.derive))"
    )
    lines = interpreted(code).splitlines()
    names = [one.name for one in parse_spec(DERIVING).record.derive]
    means = study.trials[[f"{name}_mean" for name in names]].to_numpy()
    assert lines == [" ".join(value.hex() for value in row) for row in means.tolist()]


def test_what_has_no_finite_value_is_nan() -> None:
    measured = {"speed": [0.0, 2.0, np.nan, 4.0], "polarization": [0.0, 0.0, 1.0, 1.0]}
    found = values(
        {
            "gain": "polarization / speed",
            "inverse": "1 / (speed / polarization)",
            "root": "sqrt(polarization - 0.5)",
            "logarithm": "log(polarization)",
            "still": "1 if speed > 1 else 0",
            "least": "min(speed, 3)",
        },
        measured,
    )
    nan = np.nan
    np.testing.assert_equal(
        found,
        {
            "gain": [nan, 0.0, nan, 0.25],
            "inverse": [nan, nan, nan, 0.25],
            "root": [nan, nan, np.sqrt(0.5), np.sqrt(0.5)],
            "logarithm": [nan, nan, 0.0, 0.0],
            "still": [0.0, 1.0, 0.0, 1.0],
            "least": [0.0, 2.0, nan, 3.0],
        },
    )


def test_infinity_of_a_metric_stays_and_none_is_made() -> None:
    measured = {"least_clearance": [np.inf, 3.0], "speed": [1.0, 1.0]}
    found = values(
        {
            "half": "least_clearance / 2",
            "apart": "least_clearance - least_clearance",
            "large": "speed * 9 ** 999",
        },
        measured,
    )
    nan = np.nan
    np.testing.assert_equal(
        found, {"half": [np.inf, 1.5], "apart": [nan, 0.0], "large": [nan, nan]}
    )


def test_settings_of_the_point_are_those_of_the_trial(tmp_path: Path) -> None:
    weighed = SMALL.replace(
        "every: 2", 'every: 2, derive: {weighed: "separation_weight * speed"}'
    )
    trials = launched(weighed, tmp_path).trials
    assert trials["separation_weight"].nunique() == 2
    product = trials["separation_weight"] * trials["speed"]
    assert (trials["weighed"] == product).all()


def test_nan_in_trials_is_left_out_as_that_of_any_metric(tmp_path: Path) -> None:
    spec = SMALL.replace(
        "every: 2", 'every: 2, derive: {none: "speed / (speed - speed)"}'
    )
    study = launched(spec, tmp_path)
    assert study.trials["none"].isna().all()
    assert (study.trials["status"] == "done").all()
    table = by_point(study.trials, ["separation_weight"], ["none", "speed"])
    assert table["none_n"].tolist() == [0, 0]
    assert table["speed_n"].tolist() == [3, 3]
    assert verify(study, Serial(), fraction=1.0).same


def test_unit_text_and_expression_stand_with_the_column(study: StoredStudy) -> None:
    units = {name: study.units.get(name) for name in ("gain", "gain_mean", "size")}
    assert units == {"gain": "step/px", "gain_mean": "step/px", "size": "px"}
    assert "loss" not in study.units
    part = next(study.store.folder.glob("parts/*/trials.parquet"))
    schema = pq.read_schema(part)
    assert schema.field("gain").metadata == {
        b"unit": b"step/px",
        b"text": b"polarization / speed, at the last frame",
        b"expression": b"polarization / speed",
        b"distribution": b"skewed",
    }
    assert b"expression" not in schema.field("speed").metadata
    series = pq.read_schema(part.with_name("series.parquet"))
    assert series.field("gain").metadata[b"unit"] == b"step/px"


def test_an_export_has_the_unit(study: StoredStudy, tmp_path: Path) -> None:
    export(study, tmp_path / "trials.csv")
    about = json.loads((tmp_path / "trials.csv.json").read_text())
    assert about["columns"]["gain_mean"]["unit"] == "step/px"
    read = pd.read_csv(tmp_path / "trials.csv")
    assert read["gain"].tolist() == study.trials["gain"].tolist()


def test_a_trial_is_replayed_and_verified_with_its_expressions(
    study: StoredStudy,
) -> None:
    report, same = replay(study, study.trials["trial_id"][4])
    assert same, report
    assert "bitwise identical to the stored values: trials, series" in report
    found = verify(study, Serial(), fraction=1.0)
    assert found.same
    assert found.checked.total() == 6
    job = study.job(study.trial(study.trials["trial_id"][0]))
    assert {one.name for one in job.record.derive} == {"gain", "loss", "size"}


def test_an_edited_expression_runs_again_and_an_earlier_one_is_kept(
    tmp_path: Path,
) -> None:
    first = SMALL.replace("every: 2", 'every: 2, derive: {gain: "1 / speed"}')
    other = first.replace("1 / speed", "2 * speed")
    before = launched(first, tmp_path)
    assert relaunch(first, tmp_path).missing == 0
    assert relaunch(other, tmp_path).missing == 6
    study = StoredStudy("small", tmp_path)
    assert (study.trials["gain"] == 2 * study.trials["speed"]).all()
    assert study.units["gain"] == "px/step"
    # A trial of before is replayed by its own expression.
    trial = before.trials["trial_id"][0]
    assert trial not in set(study.trials["trial_id"])
    report, same = replay(study, trial)
    assert same, report
    assert relaunch(first, tmp_path).missing == 0
    again = StoredStudy("small", tmp_path)
    pd.testing.assert_frame_equal(again.trials, before.trials, check_exact=True)
    assert again.units["gain"] == "step/px"


def test_an_expression_that_no_launch_accepts_is_an_error_of_the_store(
    study: StoredStudy,
) -> None:
    stored = study.trial(study.trials["trial_id"][0])
    for wrong in ("__import__('os')", "speed + dispersion", "", "gain"):
        forged = stored._replace(derive={"gain": wrong})
        with pytest.raises(StoreError, match="cannot be run again"):
            study.job(forged)


def test_tables_comparisons_and_figures_know_it(
    study: StoredStudy, tmp_path: Path
) -> None:
    results = study.store.folder.parent
    said = sweep(results.parent, "table", "small", "--results", str(results))
    assert said.returncode == 0, said.stderr
    compared = sweep(
        tmp_path,
        *("compare", "small:separation_weight=0.5", "small:separation_weight=1"),
        *("--metric", "gain", "--json", "--results", str(results)),
    )
    assert compared.returncode == 0, compared.stderr
    (row,) = json.loads(compared.stdout)["rows"]
    means = study.trials.groupby("separation_weight")["gain"].mean()
    assert row["metric"] == "gain"
    assert row["difference"] == pytest.approx(means[1.0] - means[0.5], rel=1e-12)
    labels = [axes.get_ylabel() for axes in scatter_figure(study, "gain_mean").axes]
    assert labels == ["gain, second half (step/px)"]
    assert direction(study, "gain").high
    assert not direction(study, "gain-").high
    curves = metric_curves(study, metrics=["gain"])
    assert [axes.get_ylabel() for axes in curves.axes][:1] == ["gain (step/px)"]


def test_trials_are_added_until_its_mean_is_known(tmp_path: Path) -> None:
    rule = "replicates: {until: {metric: gain_mean, half_width: 0.05}, min: 3, max: 40}"
    spec = SMALL.replace("replicates: 3", rule).replace(
        "every: 2", 'every: 2, derive: {gain: "polarization / speed"}'
    )
    study = launched(spec, tmp_path)
    points = stopping(study)
    assert points["reached"].all()
    assert (points["half_width"] <= 0.05).all()
    assert 3 < points["n"].max() < 40


def test_a_search_makes_it_better_within_its_bound(tmp_path: Path) -> None:
    spec = TINY.replace(
        "flock_radius: {minimize: mean}",
        "crowding_mean: {maximize: mean}\n  constraints:\n    loss: {at_most: 0.95}",
    ).replace(
        "every: 9}",
        'every: 3, derive: {crowding: "width / flock_radius", '
        'loss: "1 - polarization"}}',
    )
    asked: AskedTrials = asked_by(spec, tmp_path)
    table = asked.table
    assert {"crowding", "crowding_mean", "loss_mean"} <= set(table.columns)
    study = StoredStudy("tiny", tmp_path)
    assert (study.trials["loss"] == 1 - study.trials["polarization"]).all()
    held_out = table[table["phase"] == "held_out"]
    assert len(held_out) >= 3
    assert held_out["crowding_mean"].notna().all()
    report = sweep(tmp_path, "status", "tiny", "--results", str(tmp_path))
    assert report.returncode == 0, report.stderr
