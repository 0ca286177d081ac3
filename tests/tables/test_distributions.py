"""Rare events and undefined values in stored studies: what tables, figures, comparisons
and the rule `until` make of them.
"""

import math
from pathlib import Path

import numpy as np
import pytest

from sweep.analysis import contrast, mean_interval, undefined_shares
from sweep.cli.listing import metric_table
from sweep.cli.reporting import print_report
from sweep.figures.selection import select
from sweep.methods.adaptive import stopping
from sweep.methods.comparison import compare_sides, comparison_report, read_side
from sweep.tables.means import point_means
from sweep.tables.means_text import means_report
from sweep.tables.stored_study import StoredStudy
from tests.studies import SMALL, launched

METRICS = """record:
  metrics: [speed, escapes, flock_radius]
  derive: {hits: "collisions + escapes", gain: "escapes / speed"}
"""
RARE = SMALL.replace("record: {series: [speed], every: 2}\n", METRICS).replace(
    "study: small", "study: rare"
)
UNTIL = RARE.replace(
    "replicates: 3",
    "replicates: {until: {metric: escapes, half_width: 0.2}, min: 3, max: 16}",
).replace("study: rare", "study: until")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rare")
    launched(RARE, folder)
    return folder


@pytest.fixture
def half_known(results: Path) -> StoredStudy:
    """The study, of which the first trial of the first point has no radius."""
    study = StoredStudy("rare", results)
    study.trials.loc[0, "flock_radius"] = np.nan
    return study


def test_columns_have_the_distribution_of_their_metric(results: Path) -> None:
    declared = StoredStudy("rare", results).distributions
    found = {name: one.distribution for name, one in declared.items()}
    assert (found["speed"], found["speed_mean"]) == ("normal", "normal")
    assert (found["escapes"], found["escapes_mean"]) == ("count", "count")
    assert (found["hits"], found["gain_mean"]) == ("count", "skewed")
    ranges = {name: tuple(one.support) for name, one in declared.items()}
    assert ranges["speed"] == ranges["speed_mean"] == ranges["hits"] == (0.0, math.inf)
    assert ranges["gain"] == (-math.inf, math.inf)
    restricted = StoredStudy("rare", results).where(separation_weight=1)
    assert restricted.distributions == declared


def test_means_have_the_interval_of_the_distribution(results: Path) -> None:
    """Nobody has to name it; of metrics that decide the number of trials it is the
    repeated one, see below.
    """
    study = StoredStudy("rare", results)
    table = study.means(["speed", "escapes"])
    first = study.trials[study.trials["separation_weight"] == 0.5]
    for name, distribution in (("speed", "normal"), ("escapes", "count")):
        wanted = mean_interval(first[name], distribution=distribution)
        row = table.iloc[0][[name, f"{name}_low", f"{name}_high", f"{name}_n"]]
        assert row.tolist() == pytest.approx(list(wanted))
        assert study.mean_of(name, first[name]) == wanted
    assert table.iloc[0]["escapes_high"] > 0.5
    assert study.means(["speed"], ["point"])["point"].tolist() == list(
        dict.fromkeys(study.trials["point"])
    )


def test_the_table_of_metrics_says_it() -> None:
    columns = {column.header: list(column.cells) for column in metric_table().columns}
    said = dict(zip(columns["metric"], columns["distribution"], strict=True))
    ranges = dict(zip(columns["metric"], columns["range"], strict=True))
    assert (ranges["polarization"], ranges["share_arrived"]) == ("0 to 1", "0 to 100")
    assert (ranges["flock_count"], ranges["clearance"]) == ("from 1", "any")
    assert (said["escapes"], said["speed"]) == ("count", "normal")
    assert (said["share_arrived"], said["potential"]) == ("percentage", "skewed")


def test_a_table_has_no_zero_width_for_a_rare_event(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = StoredStudy("rare", results)
    assert (study.trials["escapes"] == 0).all()
    print_report(means_report(study, point_means(study, ["speed", "escapes", "hits"])))
    printed = capsys.readouterr().out
    assert "(0.00 to 1.00)" in printed
    assert "± 0 " not in printed
    assert "±" in printed
    found = point_means(study, ["escapes"], interval="t")
    assert found.rows["escapes_high"].isna().all()
    print_report(means_report(study, found))
    assert "0 (no interval)" in capsys.readouterr().out


def test_a_difference_of_rare_events_has_a_width(results: Path) -> None:
    study = StoredStudy("rare", results)
    sides = {"separation_weight": 1}, {"separation_weight": 0.5}
    low, high = contrast(study, "escapes", a=sides[0], b=sides[1]).interval()
    assert low < -0.5
    assert high > 0.5
    compared = compare_sides(
        read_side("rare:separation_weight=1", results),
        read_side("rare:separation_weight=0.5", results),
        ["escapes"],
    )
    assert (compared.rows["high"] > 0.5).all()
    assert list(compared.rows["verdict"]) == ["no difference shown"]


def test_undefined_values_are_told_beside_a_mean(
    half_known: StoredStudy, capsys: pytest.CaptureFixture[str]
) -> None:
    shares = undefined_shares(half_known.trials, "flock_radius")
    assert list(shares) == pytest.approx([1 / 3, 0.0])
    found = point_means(half_known, ["flock_radius"])
    rows = found.rows
    assert list(rows["flock_radius_undefined"]) == pytest.approx([1 / 3, 0.0])
    assert list(rows["flock_radius_n"]) == [2, 3]
    print_report(means_report(half_known, found))
    assert capsys.readouterr().out.count("33 % undefined") == 1
    note = select(half_known).note("{n} trials", [2, 3], "", ["flock_radius"])
    assert note.splitlines()[0].endswith("; flock_radius undefined in 17 % of trials")
    assert "undefined" not in select(half_known).note("{n} trials", [3], "", ["speed"])


def test_a_comparison_tells_undefined_values(
    results: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    sides = [read_side(f"rare:separation_weight={w}", results) for w in (0.5, 1)]
    sides[0].trials.loc[sides[0].trials.index[0], "flock_radius"] = np.nan
    compared = compare_sides(*sides, ["flock_radius"])
    row = compared.rows.iloc[0]
    assert (row["undefined_a"], row["undefined_b"]) == pytest.approx((1 / 3, 0.0))
    print_report(comparison_report(compared))
    said = "flock_radius is undefined in 33 % of the done trials of A and 0 % of B"
    assert said in capsys.readouterr().out


FEW = (
    "flock_radius: 2 to 5 skewed values cannot show a long tail, so the confidence"
    " intervals may contain the mean with less than 95 % probability"
)


def test_few_skewed_values_are_said(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study = StoredStudy("rare", results)
    print_report(means_report(study, point_means(study, ["speed", "flock_radius"])))
    printed = capsys.readouterr().out
    assert printed.splitlines()[-2:-1] == [FEW]
    print_report(means_report(study, point_means(study, ["speed", "escapes"])))
    assert "skewed" not in capsys.readouterr().out
    drawn = "mean with 95 % interval"
    note = select(study).note("{n} trials", [3], drawn, ["flock_radius"])
    assert note.splitlines()[-1] == FEW
    for counts, kind in (([6], drawn), ([1], drawn), ([3], "")):
        note = select(study).note("{n} trials", counts, kind, ["flock_radius"])
        assert "skewed" not in note
    sides = [read_side(f"rare:separation_weight={w}", results) for w in (0.5, 1)]
    print_report(comparison_report(compare_sides(*sides, ["flock_radius", "speed"])))
    assert FEW in capsys.readouterr().out.splitlines()


def test_a_table_has_no_value_that_cannot_be(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Three speeds whose interval by Student's has negative ones: both ends stand
    there, as no half width says them.
    """
    study = StoredStudy("rare", results)
    first = study.trials["point"] == study.trials["point"].iloc[0]
    study.trials.loc[first, "speed"] = [0.1, 0.2, 1.6]
    row = study.means(["speed"]).iloc[0]
    assert (row["speed_low"], row["speed_high"] > 2.0) == (0.0, True)
    print_report(means_report(study, point_means(study, ["speed"])))
    assert "0.6 (0.0 to 2.7)" in capsys.readouterr().out


def test_until_does_not_stop_because_nothing_was_seen(tmp_path: Path) -> None:
    """No boid escapes: a half width of 0.2 takes 12 trials and more, by Poisson."""
    study = launched(UNTIL, tmp_path)
    points = stopping(study)
    assert (study.trials["escapes"] == 0).all()
    assert (points["n"] >= 12).all()
    assert (points["why"] == "half width").all()
    assert (points["undefined"] == 0.0).all()
    assert ((points["half_width"] > 0.1) & (points["half_width"] <= 0.2)).all()
    rows = study.means(["escapes"])
    nominal = study.repeated["escapes"]
    wanted = mean_interval(np.zeros(points["n"].iloc[0]), nominal, distribution="count")
    assert rows["escapes_high"].iloc[0] == pytest.approx(wanted.high)
