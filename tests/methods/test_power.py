"""How many replicates a study needs: `sweep power`."""

import json
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.analysis import independent_contrast, paired_contrast
from sweep.analysis.replication import values_for_difference, values_for_width
from sweep.analysis.sequential import Width
from sweep.errors import ChoiceError
from sweep.loaded import LoadedStudy
from sweep.methods.power import needed_replicates
from sweep.tables.stored_study import StoredStudy
from tests.commands import sweep
from tests.plotted import study
from tests.studies import SMALL, launched

PILOT = SMALL.replace("replicates: 3", "replicates: 6").replace(
    "{series: [speed], every: 2}", "{metrics: [speed, dispersion]}"
)
APART = PILOT.replace("study: small", "study: apart").replace(
    "seed: 5", "seed: 5\nstreams: {start: independent, world: independent}"
)
NUMBERS = ("replicates", "replicates_low", "replicates_high")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("pilot")
    for spec in (PILOT, APART):
        launched(spec, place / "results")
    return place


def speeds(folder: Path, name: str) -> list[np.ndarray]:
    """By point, in the order of replicates."""
    trials = StoredStudy(name, folder / "results").trials
    return [
        part.sort_values("replicate")["speed"].to_numpy()
        for _, part in trials.groupby("point", sort=False)
    ]


def test_each_point_and_metric_has_a_row_and_the_worst_is_named(folder: Path) -> None:
    asked = ["--half-width", "speed=5%", "--half-width", "dispersion=20"]
    rows = json.loads(sweep(folder, "power", "small", *asked, "--json").stdout)
    assert [(row["metric"], row["separation_weight"]) for row in rows] == [
        *(("speed", 0.5), ("speed", 1.0)),
        *(("dispersion", 0.5), ("dispersion", 1.0)),
    ]
    wanted = values_for_width(speeds(folder, "small"), Width(0.05, relative=True))
    for name, numbers in zip(NUMBERS, wanted[:3], strict=True):
        assert [row[name] for row in rows[:2]] == numbers.tolist()
    assert [row["caveat"] for row in rows] == ["", "", "small pilot", "small pilot"]
    text = sweep(folder, "power", "small", *asked).stdout
    worst = max(rows[:2], key=lambda row: row["replicates"])
    assert (
        f"most for speed, half width 5%: {worst['replicates']:,.0f} replicates"
        f" ({worst['replicates_low']:,.0f} to {worst['replicates_high']:,.0f}),"
        f" at separation_weight = {worst['separation_weight']:g}\n"
    ) in text
    assert "! fewer than 10 values that are not normal" in text
    assert "(2 rows)" in text
    loaded = LoadedStudy("small", folder / "results")
    table = loaded.power({"speed": "5%", "dispersion": 20})
    assert table["replicates"].tolist() == [row["replicates"] for row in rows]
    csv = pd.read_csv(StringIO(sweep(folder, "power", "small", *asked, "--csv").stdout))
    assert csv["replicates"].tolist() == table["replicates"].tolist()
    one = sweep(folder, "power", "small:separation_weight=1", *asked, "--json")
    for row in rows:
        row.pop("separation_weight")  # one value is left, which tells nothing apart
    assert json.loads(one.stdout) == [rows[1], rows[3]]


@pytest.mark.parametrize(("name", "paired"), [("small", True), ("apart", False)])
def test_a_difference_is_between_pairs_where_compare_pairs(
    folder: Path, name: str, paired: bool
) -> None:
    first, second = speeds(folder, name)
    contrast = (
        paired_contrast(pd.Series(first), pd.Series(second))
        if paired
        else independent_contrast(first, second)
    )
    size = 0.1 * abs(first.mean())
    wanted = values_for_difference([contrast], np.array([size]), chance=0.9)
    sides = [f"{name}:separation_weight={value}" for value in (0.5, 1)]
    asked = ["--difference", "speed=10%", "--chance", "0.9", "--json"]
    for given in ([name], sides):
        printed = sweep(folder, "power", *given, *asked)
        (row,) = json.loads(printed.stdout)
        assert [row[one] for one in NUMBERS] == [one[0] for one in wanted[:3]]
        assert (row["goal"], row["paired"]) == ("difference", paired)
        assert row["mean"] == pytest.approx(first.mean())
    loaded = LoadedStudy(name, folder / "results")
    table = loaded.where(separation_weight=0.5).power(
        {},
        {"speed": "10%"},
        against=loaded.where(separation_weight=1),
        chance=0.9,
    )
    assert table["replicates"].tolist() == [row["replicates"]]
    text = sweep(folder, "power", name, "--difference", "speed=10%").stdout
    assert "each against separation_weight = 0.5\n" in text
    assert ("6 pairs" in text) == paired


def test_differences_are_judged_together_as_compare_judges_them(folder: Path) -> None:
    stored = StoredStudy("apart", folder / "results")
    alone = needed_replicates(stored, differences=["speed=0.1"]).rows
    both = needed_replicates(stored, differences=["speed=0.1", "dispersion=10"])
    assert both.tests == 2
    first, second = speeds(folder, "apart")
    wanted = values_for_difference(
        [independent_contrast(first, second)], np.array([0.1]), confidence=0.975
    )
    assert both.rows["replicates"][0] == wanted.n[0] > alone["replicates"][0]


def test_all_mistakes_are_said_at_once(folder: Path) -> None:
    asked = ["sped=5", "dispersion=0", "speed=5%", "speed=1", "speed"]
    widths = [word for one in asked for word in ("--half-width", one)]
    sizes = ["--difference", "dispersin=3", "--difference", "speed=a"]
    found = sweep(folder, "power", "small", *widths, *sizes, "--chance", "2")
    assert (found.returncode, found.stdout) == (2, "")
    metric, zero, twice, *_, other, none, chance = found.stderr.splitlines()
    assert 'unknown metric "sped"; did you mean "speed"?' in metric
    assert zero.startswith('"dispersion=0" is no half width; allowed: METRIC=SIZE')
    assert "speed is given twice" in twice
    assert 'unknown metric "dispersin"; did you mean "dispersion"?' in other
    assert none.startswith('"speed=a" is no difference; allowed: METRIC=SIZE')
    assert chance == "chance: 2; allowed: from 0.5 to 0.99, such as 0.8"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["small"], "neither half-width nor difference is given; allowed: METRIC=SIZE"),
        (["smal", "--half-width", "speed=1"], 'did you mean "small"?'),
        (
            ["small:separation_weight=1", "--difference", "speed=1"],
            "a difference needs two points, but the study has one",
        ),
        (["small", "apart", "--half-width", "speed=1"], "needs a single study"),
        (["small", "small", "--difference", "speed=1"], "are identical trials"),
        (["small", "--half-width", "speed=1", "--csv", "--json"], "choose one"),
    ],
)
def test_what_cannot_be_asked_for(folder: Path, words: list[str], said: str) -> None:
    found = sweep(folder, "power", *words)
    assert (found.returncode, found.stdout) == (2, "")
    assert said in found.stderr


@pytest.mark.parametrize("size", ["nan", "inf", "-1", "0%", "5 px", "", "1e999"])
def test_what_is_no_size(folder: Path, size: str) -> None:
    stored = StoredStudy("small", folder / "results")
    with pytest.raises(ChoiceError, match="is no half width"):
        needed_replicates(stored, half_widths=[f"speed={size}"])
    with pytest.raises(ChoiceError, match="is no difference"):
        needed_replicates(stored, differences=[f"speed={size}"])


def test_a_share_cannot_differ_by_the_whole(folder: Path) -> None:
    stored = StoredStudy("small", folder / "results")
    stored.distributions["speed"] = "proportion"
    with pytest.raises(ChoiceError, match="values from 0 to 1; allowed: a difference"):
        needed_replicates(stored, differences=["speed=1"])


def test_a_pilot_that_is_too_small_is_refused_with_the_way_out() -> None:
    for asked in ("half_widths", "differences"):
        with pytest.raises(ChoiceError, match=r"at most 3 values.*replicates: 10"):
            needed_replicates(study("small"), **{asked: ["speed=5%"]})


def test_trials_without_a_value_are_replaced_by_more(folder: Path) -> None:
    """Half of the trials define the metric, so twice as many are needed."""
    stored = StoredStudy("apart", folder / "results")
    asked = {"half_widths": ["speed=0.2"], "differences": ["speed=0.2"]}
    whole = needed_replicates(stored, **asked).rows
    trials = stored.trials
    gaps = trials.assign(
        speed=np.nan,
        trial_id=trials["trial_id"] + "x",
        replicate=trials["replicate"] + 100,
    )
    stored.trials = pd.concat([trials, gaps], ignore_index=True)
    rows = needed_replicates(stored, **asked).rows
    assert rows["values"].tolist() == whole["values"].tolist() == [6, 6, 6]
    for name in NUMBERS:
        assert rows[name].tolist() == (2.0 * whole[name]).tolist()
