"""The table of a study: chosen, pooled and sorted."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.analysis import by_point, mean_interval, pooled
from sweep.errors import ChoiceError
from sweep.figures import metric_curves
from sweep.loaded import LoadedStudy
from sweep.tables.json_text import rows_as_json
from sweep.tables.means import point_means
from tests.commands import sweep
from tests.plotted import study


def grid() -> LoadedStudy:
    """Three weights of two rules and two kinds of borders, three replicates each."""
    stored = study("grid")
    return LoadedStudy(stored.name, stored.store.folder.parent)


def test_points_that_agree_are_pooled_replicate_by_replicate() -> None:
    """Every point weighs the same, whatever order its trials are stored in."""
    trials = grid().trials
    rows = grid().table(["speed"], by=["borders", "separation_weight"])
    assert len(rows) == 6
    assert set(rows["points"]) == {3}
    for _, row in rows.iterrows():
        part = trials[
            (trials["borders"] == row["borders"])
            & (trials["separation_weight"] == row["separation_weight"])
        ]
        means = part.groupby("replicate")["speed"].mean()
        wanted = mean_interval(means.to_numpy())
        found = row[["speed", "speed_low", "speed_high", "speed_n"]].to_numpy(float)
        assert found == pytest.approx(list(wanted), rel=1e-12)
        assert row["trial_id"] in set(part["trial_id"])
    shuffled = trials.sample(frac=1.0, random_state=3)
    again = pooled(shuffled, ["borders"], ["speed"])
    same = pooled(trials, ["borders"], ["speed"])
    one, other = (
        frame.sort_values(["borders", "replicate"])["speed"].to_numpy()
        for frame in (again, same)
    )
    assert one == pytest.approx(other)


def test_a_row_of_one_point_is_the_usual_one() -> None:
    usual = grid().table(["speed"])
    settings = ["borders", "alignment_weight", "separation_weight"]
    apart = grid().table(["speed"], by=settings)
    pd.testing.assert_frame_equal(
        apart.sort_values(settings, ignore_index=True),
        usual[apart.columns].sort_values(settings, ignore_index=True),
    )
    everything = grid().table(["speed"], by=[])
    assert everything["points"].tolist() == [18]
    assert everything["speed"][0] == pytest.approx(grid().trials["speed"].mean())


def test_a_replicate_that_lacks_a_value_at_a_point_is_left_out_and_counted() -> None:
    trials = grid().trials.copy()
    first, second = trials.index[trials["replicate"] == 1][:2]
    trials.loc[first, "speed"] = np.nan
    trials.loc[second, "status"] = "failed"
    found = pooled(trials, [], ["speed", "dispersion"])
    lost = found[found["replicate"] == 1].iloc[0]
    assert lost["status"] == "not done"
    assert np.isnan([lost["speed"], lost["dispersion"]]).all()
    table = by_point(found, [], ["speed"])
    assert table[["speed_n", "not_done"]].to_numpy().tolist() == [[2, 1]]
    without = pooled(trials.drop(index=second), [], ["speed"])
    assert without["status"].tolist().count("not done") == 1


def test_trials_that_share_their_start_are_not_taken_for_independent() -> None:
    """Two-sided: of 400 tables of 8 replicates at 6 points that share half of their
    variance, 95 % intervals cover the mean in 361 to 393, but for a chance of 0.1 %;
    those of trials taken for independent cover far too few.
    """
    rng = np.random.default_rng(11)
    drawn = [np.tile(rng.normal(size=8), 6) + rng.normal(size=48) for _ in range(400)]
    trials = pd.DataFrame(
        {
            "table": np.repeat(np.arange(400), 48),
            "point": np.tile(np.repeat([f"p{k}" for k in range(6)], 8), 400),
            "replicate": np.tile(np.arange(8), 6 * 400),
            "seed": 5,
            "seed_listed": False,
            "status": "done",
            "trial_id": [f"{k}" for k in range(48 * 400)],
            "speed": np.concatenate(drawn),
        }
    )
    rows = by_point(pooled(trials, ["table"], ["speed"]), ["table"], ["speed"])
    assert len(rows) == 400
    covered = ((rows["speed_low"] <= 0.0) & (rows["speed_high"] >= 0.0)).sum()
    bounds = [mean_interval(values)[1:3] for values in drawn]
    naive = sum(low <= 0.0 <= high for low, high in bounds)
    assert 361 <= covered <= 393
    assert naive < 330


def test_rows_are_sorted_by_settings_and_metrics() -> None:
    rows = grid().table(["speed", "dispersion"], sort=["borders:desc", "speed"])
    assert rows["borders"].tolist() == ["torus"] * 9 + ["bounded"] * 9
    for _, part in rows.groupby("borders"):
        assert part["speed"].is_monotonic_increasing
    half = grid().table(["speed"], sort=["speed:desc"], half=True)
    assert half["speed_mean"].is_monotonic_decreasing


def test_a_condition_chooses_points_for_every_analysis() -> None:
    whole = grid()
    part = whole.where("separation_weight >= 1 and borders == 'torus'")
    trials = whole.trials
    kept = (trials["separation_weight"] >= 1) & (trials["borders"] == "torus")
    assert part.trials["trial_id"].tolist() == trials[kept]["trial_id"].tolist()
    assert part.varied == ["separation_weight", "alignment_weight"]
    assert part.restricted
    assert "where separation_weight >= 1 and" in repr(part)
    further = part.where("separation_weight < alignment_weight + 1", "n=12")
    assert further.points["separation_weight"].tolist() == [1.0, 1.0, 1.0]
    assert further.chosen == {"n": 12}
    assert len(further.conditions) == 2


MISTAKES = [
    ("separation_wieght >= 1", 'unknown name "separation_wieght"; did you mean'),
    (
        "speed_mean > 1 and n > 2",
        '"speed_mean > 1 and n > 2": speed_mean is a metric, but points are chosen by'
        " parameters (the study varies separation_weight, alignment_weight,",
    ),
    (
        "separation_weight >= 10",
        "is true at no point; values of separation_weight: 0.5,",
    ),
    ("borders == 'tours'", 'unknown borders "tours"; did you mean "torus"?'),
    ("separation_weight < 'a'", "needs a number, but \"'a'\" is a string"),
    ("__import__('os') == 1", 'unknown function "__import__"'),
    ("separation_weight >=", "is not an expression"),
    ("separation_weight + 1 if borders == 'torus' else 2", "is a number, not a"),
    ("separation_weight", '"separation_weight" chooses nothing; allowed:'),
    ("borders=tours", "no point has borders = tours; did you mean"),
]


@pytest.mark.parametrize(
    ("text", "message"), MISTAKES, ids=[one for one, _ in MISTAKES]
)
def test_what_is_no_condition_is_refused(text: str, message: str) -> None:
    with pytest.raises(ChoiceError) as error:
        grid().where(text)
    assert message in str(error.value)
    assert str(error.value).startswith("study grid: ")


def test_conditions_that_hold_at_no_point_together_are_refused() -> None:
    with pytest.raises(
        ChoiceError, match="no point satisfies all of: borders = torus, sep"
    ):
        grid().where(
            "separation_weight > 1 and alignment_weight < 1",
            "separation_weight < 2 or alignment_weight == 1",
            borders="torus",
        )


def test_all_mistakes_of_a_table_are_said_at_once() -> None:
    folder = grid().store.folder.parent
    done = sweep(
        Path(),
        *("table", "grid", "--results", str(folder)),
        *("--where", "separation_wieght > 1", "--where", "border=torus"),
        *("--metric", "sped", "--by", "map,alignment_wieght", "--sort", "speed:down"),
    )
    assert done.returncode == 2
    assert done.stdout == ""
    said = done.stderr.splitlines()
    words = ("border", "separation_wieght", "sped", "map", "alignment_wieght", "down")
    assert len(said) == len(words)
    for line, word in zip(said, words, strict=True):
        assert f'"{word}"' in line
        assert line.startswith("study grid: ")
    with pytest.raises(ChoiceError, match='unknown column of this table "dispersion"'):
        point_means(grid(), ["speed"], sort=["dispersion"])


def test_the_command_says_what_it_pools() -> None:
    folder = grid().store.folder.parent
    command = ["table", "grid", "--results", str(folder), "--by", "borders"]
    options = ["--where", "separation_weight >= 1", "--sort", "speed:desc"]
    text = sweep(Path(), *command, *options).stdout
    words = " ".join(text.split())
    assert "points" in words
    assert "replicates" in words
    assert "each row pools points with equal weight" in words
    rows = json.loads(sweep(Path(), *command, *options, "--json").stdout)
    assert [row["points"] for row in rows] == [6, 6]
    assert rows[0]["speed"] > rows[1]["speed"]
    assert rows[0]["view"].startswith("sweep view grid ")
    assert list(rows[0])[-1] == "view"


def test_a_text_is_a_list_of_one_and_never_its_letters() -> None:
    one = point_means(grid(), "speed", by="borders", sort="speed:desc").rows
    same = point_means(grid(), ["speed"], by=["borders"], sort=["speed:desc"]).rows
    pd.testing.assert_frame_equal(one, same)
    assert len(one) == 2
    means = grid().means("speed", "borders")
    pd.testing.assert_frame_equal(means, grid().means(["speed"], ["borders"]))
    with pytest.raises(ChoiceError, match='unknown varied parameter "border"'):
        point_means(grid(), by="border")
    with pytest.raises(ChoiceError, match='unknown series metric "sped"'):
        metric_curves(grid(), metrics="sped")


def test_json_has_all_digits_of_a_float_and_no_number_that_json_lacks() -> None:
    values = [1e-11, 0.1 + 0.2, 5e-324, 1 / 3, 1.7e308]
    frame = pd.DataFrame({"value": [*values, np.nan, np.inf]})
    frame["count"] = pd.array([1, 2, 3, 4, 5, None, 7], "Int64")
    frame["name"] = ["a", None, "é", "", "b", "c", "d"]
    read = json.loads(rows_as_json(frame))
    assert [row["value"] for row in read] == [*values, None, None]
    assert [row["count"] for row in read] == [1, 2, 3, 4, 5, None, 7]
    assert [row["name"] for row in read] == ["a", None, "é", "", "b", "c", "d"]
    assert rows_as_json(frame[:0]) == "[]"
