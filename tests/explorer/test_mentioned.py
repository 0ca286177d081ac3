"""Published numbers in a figure stand only at points with all of their settings."""

from pathlib import Path
from typing import Any

import pytest

from sweep.errors import ChoiceError
from sweep.explorer import mentioned
from sweep.explorer.site import site_of
from sweep.explorer.watching import Watched
from sweep.figures import cells
from tests import plotted
from tests.many_trials import many_trials
from tests.studies import SMALL

CLAIM = """
  - where: {where}
    says: it is {value}
    spec: {spec}
    measure: {measure}
    expect: {{value: {value}}}
"""
CLAIMS = [
    ("here", 1.5, "same", "{mean: speed, for: {separation_weight: 0.5}}"),
    ("here", 1.5, "same", "{mean: speed, for: {separation_weight: 0.5}}"),
    ("at its end", 2.5, "same", "{mean: speed, for: {separation_weight: 1}, frame: 9}"),
    ("half", 3.5, "same", "{mean: speed_mean, for: {separation_weight: 1}}"),
    ("on the way", 4.5, "same", "{mean: speed, for: {separation_weight: 1}, frame: 4}"),
    ("over points", 5.5, "same", "{mean: speed}"),
    ("longer", 6.5, "longer", "{mean: speed, for: {separation_weight: 0.5}}"),
    ("not there", 7.5, "beyond", "{mean: speed, for: {separation_weight: 7}}"),
    ("another", 8.5, "same", "{mean: dispersion, for: {separation_weight: 0.5}}"),
]
SPECS = {
    "same": SMALL,
    "longer": SMALL.replace("steps: 9", "steps: 90"),
    "beyond": SMALL.replace("[0.5, 1]", "[0.5, 7]"),
}


@pytest.fixture
def experiments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "one"
    folder.mkdir()
    for name, spec in SPECS.items():
        (folder / f"{name}.yaml").write_text(spec)
    names = ("where", "value", "spec", "measure")
    claims = [CLAIM.format(**dict(zip(names, one, strict=True))) for one in CLAIMS]
    (folder / "published.yaml").write_text("claims:" + "".join(claims))
    monkeypatch.setattr(mentioned, "EXPERIMENTS", tmp_path)
    return tmp_path


def told(*pairs: tuple[str, str]) -> dict[str, Any]:
    results = plotted.study("small").store.folder.parent
    answer = site_of(Watched(results)).answers["published"]
    found: dict[str, Any] = answer([("study", "small"), *pairs])
    return found


@pytest.mark.usefixtures("experiments")
@pytest.mark.parametrize(
    ("pairs", "expected"),
    [
        ([("metric", "speed")], [("here", 1.5, 0), ("at its end", 2.5, 1)]),
        ([("metric", "speed"), ("half", "yes")], [("half", 3.5, 1)]),
        ([("metric", "dispersion")], [("another", 8.5, 0)]),
    ],
)
def test_a_published_number_stands_at_the_very_settings(
    pairs: list[tuple[str, str]], expected: list[tuple[str, float, int]]
) -> None:
    points = list(plotted.study("small").points.index)
    found = told(*pairs)["published"]
    assert [
        (one["where"], one["value"], points.index(one["point"])) for one in found
    ] == expected


def test_numbers_of_the_package_stand_at_no_study_with_other_settings() -> None:
    assert told(("metric", "speed"))["published"] == []


def test_a_metric_that_is_not_recorded_is_refused() -> None:
    with pytest.raises(ChoiceError, match='unknown metric "sped"; did you mean'):
        told(("metric", "sped"))


def test_ticks_of_listed_values_stand_at_them_and_others_at_none() -> None:
    results = plotted.study("grid").store.folder.parent
    answer = site_of(Watched(results)).answers["figure"]
    grid = answer([("study", "grid"), ("kind", "heatmap")])["panels"][0]
    assert (grid["x"]["listed"], grid["y"]["listed"]) == ((0.5, 1, 2), (0.01, 0.1, 1))
    plotted.study("drawn")
    drawn = answer([("study", "drawn"), ("kind", "scatter")])["panels"]
    listed = {one["x"]["name"]: one["x"]["listed"] for one in drawn}
    assert listed["separation_weight"] == ()


def test_a_bin_has_no_tick_at_a_listed_value(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cells, "MOST_MARKS", 31 * 2 - 1)
    many_trials(tmp_path, 31, 2, 1, parts=1)
    answer = site_of(Watched(tmp_path)).answers["figure"]
    panel = answer([("study", "many"), ("kind", "heatmap")])["panels"][0]
    rows = [
        dict(zip(panel["marks"]["columns"], row, strict=True))
        for row in panel["marks"]["data"]
    ]
    assert len({row["left"] for row in rows}) < 31
    assert {row["across"] for row in rows} == {None}
    assert {row["up"] for row in rows} == {0, 1}
    assert (panel["x"]["listed"], panel["y"]["listed"]) == ((), (0, 1))
