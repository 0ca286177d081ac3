"""Metrics that a spec derives are plotted like others, with the values that a launch
stores.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.web.flight import fly
from sweep.web.history import Cursor
from sweep.web.live_show import Live
from sweep.web.replaying import Replay
from sweep.web.state import from_study
from tests.studies import DERIVING, launched

NAMES = ("loss", "gain", "size")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(DERIVING, tmp_path_factory.mktemp("deriving"))


def plotted(show: Live) -> Any:
    """The values that the page gets, by metric."""
    message, _ = show.history.since(Cursor())
    assert message is not None
    return message["values"]


def shown() -> Live:
    """The live run of the spec, to its end, with these metrics plotted."""
    show = Live(from_study(parse_spec(DERIVING)))
    show.follow(NAMES)
    show.run()
    while show.going:
        show.advance(4)
    return show


def test_a_live_run_plots_what_a_launch_of_the_copied_spec_stores(
    tmp_path: Path,
) -> None:
    """At the frames that the opened spec records, of its first trial."""
    show = shown()
    study = launched(show.state.as_text(), tmp_path)
    first = study.series["trial_id"] == study.trials["trial_id"][0]
    stored = study.series[first]
    for name, values in plotted(show).items():
        recorded = [values[step] for step in stored["frame"]]
        np.testing.assert_array_equal(recorded, stored[name])
    assert plotted(show).keys() == set(NAMES)
    assert len(plotted(show)["gain"]) == 10


def test_the_page_offers_them_with_their_units_until_another_model_is_chosen() -> None:
    show = shown()
    offered = {one["name"]: one for one in show.greeting()[0]["metrics"]}
    assert offered["gain"]["text"] == "polarization / speed"
    assert offered["gain"]["unit"] == "step/px"
    show.choose("patel2023", "as_run")
    assert "gain" not in {one["name"] for one in show.greeting()[0]["metrics"]}
    assert "derive" not in show.state.as_text()


def test_a_stored_trial_plots_them_with_the_stored_values(study: StoredStudy) -> None:
    trial = study.trials["trial_id"][0]
    show = Replay(study, trial)
    assert show.differences == []
    numbers = show.status()["replay"]["metrics"]
    for name in (*NAMES, "speed"):
        assert numbers[name]["stored"] == numbers[name]["replayed"]
    show.follow(("gain", "speed"))
    series = study.series[study.series["trial_id"] == trial]
    every = plotted(show)["gain"]
    assert [every[step] for step in series["frame"]] == series["gain"].tolist()


def test_a_file_of_the_run_has_them(study: StoredStudy) -> None:
    job = study.job(study.trial(study.trials["trial_id"][0]))
    kept = fly("derived", job, ("gain", "speed"), until=5)
    assert kept.values.keys() == {"gain", "speed"}
    both = fly("derived", job, ("polarization", "speed"), until=5).values
    expected = both["polarization"] / both["speed"]
    np.testing.assert_array_equal(kept.values["gain"], expected)
