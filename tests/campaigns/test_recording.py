"""What is recorded may shrink and grow: fewer metrics are served from what is stored,
more run again, and what both have must come out again.
"""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from sweep.campaigns.launching import launch
from sweep.design.recording import Recording
from sweep.errors import StoreError
from sweep.methods.adaptive import stopping
from sweep.methods.search.asked_trials import read_asked
from sweep.replays.verifying import verify
from sweep.store.manifest import table_names
from sweep.store.parquet import load_table
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.tables.cleaning import clean, find_waste
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.searches import TINY, searched
from tests.studies import SMALL, launched, numbers, read, relaunch

KEPT = "record: {series: [speed], every: 2}"
assert KEPT in SMALL


def recording(record: str) -> str:
    return SMALL.replace(KEPT, f"record: {{{record}}}")


MORE = recording(
    "metrics: [dispersion], series: [speed, polarization], every: 2,"
    " trajectories: true, derive: {gain: polarization / speed}"
)
FEWER = recording("metrics: [dispersion], series: [speed], every: 2")
OTHERS = recording("metrics: [dispersion, flock_radius], every: 2")


def test_fewer_metrics_are_served_from_what_is_stored(tmp_path: Path) -> None:
    launched(MORE, tmp_path / "here")
    progress = relaunch(FEWER, tmp_path / "here")
    assert (progress.missing, progress.stored, progress.apart) == (0, 6, 0)
    served = StoredStudy("small", tmp_path / "here")
    alone = launched(FEWER, tmp_path / "alone")
    for mine, theirs in zip(numbers(served), numbers(alone), strict=True):
        pd.testing.assert_frame_equal(mine, theirs, check_exact=True)
    assert served.metrics == ["dispersion", "speed"]
    assert served.trajectories.empty
    assert served.units == alone.units
    assert served.columns["column"].tolist() == alone.columns["column"].tolist()
    assert (served.apart(), served.statuses()) == (0, {"done": 6})
    assert relaunch(FEWER, tmp_path / "here").missing == 0
    assert relaunch(MORE, tmp_path / "here").missing == 0
    assert len(StoredStudy("small", tmp_path / "here").trajectories) == 36


def test_only_what_is_not_stored_runs(tmp_path: Path) -> None:
    launched(MORE, tmp_path)
    further = FEWER.replace("[0.5, 1]", "[0.5, 1, 2]")
    progress = relaunch(further, tmp_path)
    assert (progress.missing, progress.stored) == (3, 6)
    study = StoredStudy("small", tmp_path)
    assert study.statuses() == {"done": 9}
    assert study.trials["speed"].notna().all()
    assert len(study.series) == 9 * 6


@pytest.mark.parametrize(
    "record",
    [
        "metrics: [dispersion, flock_radius], series: [speed], every: 2",
        "metrics: [dispersion], series: [speed, dispersion], every: 2",
        "metrics: [dispersion], series: [speed], every: 3",
        "metrics: [dispersion], heatmaps: true, every: 2",
        "metrics: [speed], derive: {gain: 'polarization  / speed'}, every: 2",
    ],
)
def test_what_is_not_stored_runs_again(tmp_path: Path, record: str) -> None:
    launched(MORE, tmp_path)
    progress = relaunch(recording(record), tmp_path)
    assert (progress.missing, progress.apart) == (6, 6)
    assert progress.statuses == {"done": 6}


def changed(study: StoredStudy, column: str, value: float) -> None:
    """Store the first part again, with another value in its last row."""
    (part,) = study.store.current_parts()
    tables = {name: load_table(part, name) for name in table_names(part)}
    trials = tables["trials"]
    place = trials.schema.get_field_index(column)
    values = trials[column].to_numpy().copy()
    values[-1] = value
    new = pa.array(values)
    tables["trials"] = trials.set_column(place, trials.schema.field(place), new)
    Store(study.store.folder, study.store.folder.parent).append(tables)


def test_what_both_have_must_come_out_again(tmp_path: Path) -> None:
    stored = launched(FEWER, tmp_path)
    last = float(stored.trials["speed"].iloc[-1])
    changed(stored, "speed", np.nextafter(last, 9.0))
    said = rf"the same run as the stored trial .* speed is {last!r}, and"
    with pytest.raises(StoreError, match=said):
        relaunch(OTHERS.replace("dispersion,", "speed,"), tmp_path)
    after = StoredStudy("small", tmp_path)
    assert "done" in after.statuses()
    assert relaunch(OTHERS.replace("dispersion,", "speed,"), tmp_path).troubled == 0


def test_a_metric_that_is_new_is_compared_with_nothing(tmp_path: Path) -> None:
    stored = launched(FEWER, tmp_path)
    changed(stored, "speed", 9.0)
    assert relaunch(OTHERS, tmp_path).statuses == {"done": 6}


def test_a_trial_that_failed_does_not_serve(tmp_path: Path) -> None:
    stored = launched(MORE, tmp_path)
    (part,) = stored.store.current_parts()
    tables = {name: load_table(part, name) for name in table_names(part)}
    trials = tables["trials"]
    place = trials.schema.get_field_index("status")
    statuses = pa.array(["failed", *["done"] * 5])
    tables["trials"] = trials.set_column(place, trials.schema.field(place), statuses)
    stored.store.append(tables)
    assert relaunch(FEWER, tmp_path).statuses == {"done": 1}
    assert StoredStudy("small", tmp_path).statuses() == {"done": 6}


def test_cleaning_keeps_what_serves_and_it_runs_again_to_the_same_bits(
    tmp_path: Path,
) -> None:
    launched(MORE, tmp_path)
    relaunch(FEWER.replace("[0.5, 1]", "[0.5]"), tmp_path)
    study = StoredStudy("small", tmp_path)
    waste = find_waste(study)
    assert waste.trials == {"": 3}
    clean(study, waste)
    study = StoredStudy("small", tmp_path)
    assert study.statuses() == {"done": 3}
    assert len(study.store.trial_ids()) == 3
    found = verify(study, Serial(), fraction=1.0)
    assert found.same
    assert found.checked == {"done": 3}


def test_shares_take_what_is_stored(tmp_path: Path) -> None:
    launched(MORE, tmp_path)
    for number in (1, 2):
        share = Share(number, 2)
        progress = launch(read(FEWER), tmp_path, Serial(), share=share)
        assert progress.missing == 0
    assert StoredStudy("small", tmp_path).statuses() == {"done": 6}


def test_looks_at_intervals_see_what_is_served(tmp_path: Path) -> None:
    until = "replicates: {until: {metric: speed, half_width: 0.0001}, min: 3, max: 6}"
    more, fewer = (text.replace("replicates: 3", until) for text in (MORE, FEWER))
    before = launched(more, tmp_path)
    assert relaunch(fewer, tmp_path).missing == 0
    after = StoredStudy("small", tmp_path)
    assert stopping(after).equals(stopping(before))
    assert after.trials["trial_id"].equals(before.trials["trial_id"])


def test_a_search_takes_what_is_stored(tmp_path: Path) -> None:
    searched(TINY.replace("[flock_radius]", "[flock_radius, speed]"), tmp_path)
    before = read_asked(StoredStudy("tiny", tmp_path))
    assert searched(TINY, tmp_path).statuses.total() == 0
    after = read_asked(StoredStudy("tiny", tmp_path))
    assert set(after.table["status"]) == {"done"}
    names = ["run", "candidate", "block", "trial_id", "flock_radius"]
    pd.testing.assert_frame_equal(after.table[names], before.table[names])


def test_other_code_of_a_metric_serves_for_nothing() -> None:
    more, fewer = (Recording.of(read(text)) for text in (MORE, FEWER))
    assert more.covers(fewer)
    assert more.covers(more)
    assert not fewer.covers(more)
    edited = more._replace(stamps={**more.stamps, "speed": "other"})
    assert not edited.covers(fewer)
    assert edited.shared(fewer) == ["dispersion"]
    unasked = more._replace(stamps={**more.stamps, "polarization": "other"})
    assert unasked.covers(fewer)
