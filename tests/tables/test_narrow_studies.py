"""A study of which only some columns are read has the numbers of the whole one."""

from pathlib import Path

import pandas as pd
import pyarrow as pa
import pytest

from sweep.explorer.site import site_of
from sweep.explorer.watching import Watched
from sweep.store import placed
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy
from tests.many_trials import FAILING, many_trials
from tests.studies import SMALL, launched

METRICS = ["speed", "dispersion_mean"]


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    """Of 1,200 trials in three parts."""
    return many_trials(tmp_path_factory.mktemp("many"), 4, 3, 100, parts=3)


def test_a_narrow_study_has_the_rows_of_the_whole_in_the_order_of_the_plan(
    many: StoredStudy,
) -> None:
    narrow = StoredStudy(many.name, many.store.results).narrow(["speed", "dispersion"])
    assert list(narrow.trials["trial_id"]) == many.plan["trial_id"].to_pylist()
    columns = list(narrow.trials.columns)
    pd.testing.assert_frame_equal(narrow.trials, many.trials[columns])
    assert narrow.means(METRICS).equals(many.means(METRICS))
    failed = (many.trials["status"] == "failed").sum()
    assert failed >= len(many.trials) // FAILING - 3  # whole hundreds of each part
    assert "polarization" not in columns


def test_metrics_that_are_asked_for_later_are_of_the_same_rows(
    many: StoredStudy,
) -> None:
    study = StoredStudy(many.name, many.store.results)
    first, second = study.narrow(["speed"]), study.narrow(["dispersion"])
    assert first.trials["speed"].equals(many.trials["speed"])
    assert second.trials["dispersion"].equals(many.trials["dispersion"])
    assert "speed" not in second.trials


def test_points_are_made_once_for_all_metrics(many: StoredStudy) -> None:
    study = StoredStudy(many.name, many.store.results)
    first, second = study.narrow(["speed"]), study.narrow(["dispersion"])
    assert first.points is second.points
    pd.testing.assert_frame_equal(first.points, StoredStudy.points.func(many))
    assert list(first.points.index) == list(dict.fromkeys(many.trials["point"]))


def test_texts_that_a_part_lacks_are_missing(tmp_path: Path) -> None:
    """Texts are numbered part by part, and a part may have none."""
    study = launched(SMALL, tmp_path)
    rows = study.store.read("trials")
    place = rows.column_names.index("error")
    said = pa.array([None, "a", "b", "a"], pa.string())
    field = rows.schema.field(place)
    study.store.append({"trials": rows.slice(0, 4).set_column(place, field, said)})
    none = field.with_type(pa.null())
    study.store.append(
        {"trials": rows.slice(4, 1).set_column(place, none, pa.nulls(1))}
    )
    errors = StoredStudy("small", tmp_path).narrow([]).trials["error"]
    pd.testing.assert_series_equal(
        errors, StoredStudy("small", tmp_path).trials["error"]
    )
    assert errors.fillna("").tolist() == ["", "a", "b", "a", "", ""]


def test_of_a_trial_in_several_parts_the_latest_counts(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    rows = study.store.read("trials")
    speed = rows.column_names.index("speed")
    newer = rows.slice(1, 2).set_column(
        speed, rows.schema.field(speed), pa.array([7.0, 8.0])
    )
    study.store.append({"trials": newer})
    narrow = StoredStudy("small", tmp_path).narrow(["speed"])
    whole = StoredStudy("small", tmp_path)
    assert narrow.trials["speed"].equals(whole.trials["speed"])
    assert {7.0, 8.0} < {*narrow.trials["speed"]}
    assert len(narrow.trials) == len(whole.trials) == 6


def test_parts_that_are_merged_between_two_readings_lose_nothing(
    tmp_path: Path,
) -> None:
    many_trials(tmp_path, 2, 2, 5, parts=4)
    study = StoredStudy("many", tmp_path)
    before = study.narrow(["speed"]).trials
    Store(study.store.folder).compact()
    after = study.narrow(["speed", "dispersion"]).trials
    pd.testing.assert_frame_equal(after[before.columns], before)


def test_a_study_that_is_not_finished_is_marked_trial_by_trial(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    launched(SMALL.replace("replicates: 3", "replicates: 2"), tmp_path / "other")
    stored = StoredStudy("small", tmp_path / "other").store.read("trials")
    study.store.discard(study.store.current_parts()[0])
    study.store.append({"trials": stored.slice(1, 3)})
    there = set(stored["trial_id"].slice(1, 3).to_pylist())
    state = site_of(Watched(tmp_path)).answers["state"]([("study", "small")])
    marks = [0 if one in there else 2 for one in study.plan["trial_id"].to_pylist()]
    assert state["strip"]["marks"] == marks
    assert (state["missing"], state["counts"]) == (3, {"done": 3})


def test_the_ids_of_a_part_are_read_once_whatever_is_asked_for(
    many: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    load, read = placed.load_table, list[str]()

    def noted(part: Path, name: str, columns: list[str] | None) -> pa.Table:
        read.extend(columns or [])
        return load(part, name, columns)

    monkeypatch.setattr(placed, "load_table", noted)
    study = StoredStudy(many.name, many.store.results)
    study.narrow(["speed"])
    study.narrow(["dispersion"])
    parts = len(study.store.current_parts())
    assert read.count("trial_id") == read.count("status") == parts
    assert read.count("speed") == read.count("dispersion") == parts
    assert "polarization" not in read
