"""Tables that no launch writes are refused before arrays are made of them."""

import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

import sweep.tables.netcdf as netcdf
from sweep.errors import ChoiceError, StoreError
from sweep.tables.exporting import export
from sweep.tables.stored_study import StoredStudy
from tests.attacks.hostile import give
from tests.cases import slow_but
from tests.commands import sweep
from tests.studies import COVERING, launched

KEPT = COVERING.replace(
    "record: {", "record: {trajectories: true, every: 10, "
).replace("n: 10,", "n: 3,")
TRIALS, FRAMES, BOIDS = 4, 3, 3
ROWS = TRIALS * FRAMES
INT32, BODIES = pa.int32(), pa.list_(pa.float64())


def lists(*rows: object, kind: pa.DataType = BODIES) -> pa.Array:
    """One list a row of trajectories; those that are not given are three zeros."""
    return pa.array([*rows, *([[0.0] * BOIDS] * (ROWS - len(rows)))], kind)


TABLES: dict[str, tuple[str, dict[str, Any], str]] = {
    "rows -1": (
        "heatmaps",
        {"rows": pa.array([-1] * TRIALS, INT32)},
        "not rows times columns",
    ),
    "rows 0": (
        "heatmaps",
        {"rows": pa.array([0] * TRIALS, INT32)},
        "not rows times columns",
    ),
    "rows of too many": (
        "heatmaps",
        {"rows": pa.array([2**31 - 1] * TRIALS, INT32)},
        "not rows times columns",
    ),
    "both negative": (
        "heatmaps",
        {
            "rows": pa.array([-600] * TRIALS, INT32),
            "columns": pa.array([-800] * TRIALS, INT32),
        },
        "not rows times columns",
    ),
    "rows null": (
        "heatmaps",
        {"rows": pa.nulls(TRIALS, INT32)},
        '"rows" has empty cells',
    ),
    "rows fractions": (
        "heatmaps",
        {"rows": pa.array([1.5] * TRIALS)},
        '"rows" holds double',
    ),
    "columns texts": ("heatmaps", {"columns": "800"}, '"columns" holds string'),
    "visits too few": (
        "heatmaps",
        {"visits": pa.array([[1]] * TRIALS, pa.list_(INT32))},
        "not rows times columns",
    ),
    "visits empty": (
        "heatmaps",
        {"visits": pa.array([[]] * TRIALS, pa.list_(INT32))},
        "not rows times columns",
    ),
    "visits null": (
        "heatmaps",
        {"visits": pa.nulls(TRIALS, pa.list_(INT32))},
        '"visits" has empty',
    ),
    "visits of nulls": (
        "heatmaps",
        {"visits": pa.array([[None]] * TRIALS, pa.list_(INT32))},
        "empty elements",
    ),
    "visits of texts": (
        "heatmaps",
        {"visits": pa.array([["x"]] * TRIALS)},
        "not lists of int32",
    ),
    "visits a number": (
        "heatmaps",
        {"visits": pa.array([1] * TRIALS)},
        "not lists of int32",
    ),
    "x shorter": ("trajectories", {"x": lists([0.0])}, "different numbers of boids"),
    "all shorter in one frame": (
        "trajectories",
        {name: lists([0.0]) for name in ("x", "y", "vx", "vy")},
        "the number of boids changes",
    ),
    "no boids": (
        "trajectories",
        {name: pa.array([[]] * ROWS, BODIES) for name in ("x", "y", "vx", "vy")},
        "different numbers of boids",
    ),
    "x null": ("trajectories", {"x": pa.nulls(ROWS, BODIES)}, '"x" has empty cells'),
    "x NaN": (
        "trajectories",
        {"x": lists([math.nan] * BOIDS)},
        "x has values that are not finite",
    ),
    "vy infinite": (
        "trajectories",
        {"vy": lists([math.inf] * BOIDS)},
        "vy has values that are not",
    ),
    "y of texts": (
        "trajectories",
        {"y": pa.array([["a"] * BOIDS] * ROWS)},
        "not lists of double",
    ),
    "y a number": (
        "trajectories",
        {"y": pa.array([1.0] * ROWS)},
        "not lists of double",
    ),
    "a state shorter": (
        "trajectories",
        {"phase": lists([0.0])},
        "x, y, vx, vy, phase have different numbers of boids",
    ),
    "a state NaN": (
        "trajectories",
        {"phase": lists([math.nan] * BOIDS)},
        "phase has values that are not finite",
    ),
    "a state null in one frame": (
        "trajectories",
        {"phase": lists(None)},
        '"phase" has empty cells',
    ),
    "a state of texts": (
        "trajectories",
        {"phase": pa.array([["a"] * BOIDS] * ROWS)},
        "not lists of double",
    ),
    "a state a number": ("trajectories", {"phase": 1.0}, "not lists of double"),
    "kinds of fractions": ("trajectories", {"kind": lists()}, "not lists of int64"),
    "kinds of texts": ("trajectories", {"kind": "prey"}, "not lists of int64"),
    "frames backwards": (
        "trajectories",
        {"frame": pa.array([20, 10, 0] * TRIALS)},
        "not in ascending order",
    ),
    "frames alike": (
        "trajectories",
        {"frame": pa.array([0] * ROWS)},
        "not in ascending order",
    ),
    "frames null": (
        "trajectories",
        {"frame": pa.nulls(ROWS, pa.int64())},
        '"frame" has empty cells',
    ),
    "series of texts": (
        "trials",
        {"coverage": "high"},
        '"coverage" holds string, not double',
    ),
    "a setting of texts": ("trials", {"n": "12"}, '"n" holds string, not int64'),
    "status null": (
        "trials",
        {"status": pa.nulls(TRIALS, pa.string())},
        '"status" has empty cells',
    ),
    "status a number": (
        "trials",
        {"status": pa.array([1] * TRIALS)},
        '"status" holds int64',
    ),
    "models unknown": ("trials", {"model": "evil"}, "one known model, not evil"),
}
"""The table, its columns, and what is said."""


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("honest")
    launched(KEPT, folder)
    return folder


@pytest.fixture
def folder(honest: Path, tmp_path: Path) -> Path:
    shutil.copytree(honest, tmp_path / "results")
    return tmp_path


READERS: dict[str, tuple[Callable[[StoredStudy], object], ...]] = {
    "heatmaps": (lambda study: study.heatmaps,),
    "trajectories": (
        lambda study: study.trajectories,
        lambda study: [
            study.trajectory(trial) for trial in study.plan["trial_id"].to_pylist()
        ],
    ),
    "trials": (lambda study: study.trials,),
}


@pytest.mark.parametrize("name", TABLES)
def test_a_table_that_no_launch_writes_is_refused(folder: Path, name: str) -> None:
    table, columns, message = TABLES[name]
    give(folder / "results" / "covering", table, **columns)
    study = StoredStudy("covering", folder / "results")
    exports = [
        lambda study, ending=ending: export(study, folder / f"x{ending}", table)
        for ending in (".csv", ".nc")
    ]
    for read in (*READERS[table], *exports):
        with pytest.raises(
            StoreError,
            match=f"study covering: the stored {table} are not what a launch writes",
        ):
            read(study)
    with pytest.raises(StoreError, match=message):
        READERS[table][0](study)


OF_NO_MODEL = ("a state", "kinds")
"""What a column is of that the model of this study has not: it is left alone."""


@pytest.mark.parametrize(
    "name",
    slow_but(
        ["rows -1", "x null", "frames backwards", "status null"],
        [name for name in TABLES if not name.startswith(OF_NO_MODEL)],
    ),
)
def test_nothing_is_measured_of_it(folder: Path, name: str) -> None:
    table, columns, _ = TABLES[name]
    give(folder / "results" / "covering", table, **columns)
    before = StoredStudy("covering", folder / "results").plan
    done = sweep(folder, "measure", "covering", "speed")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1].startswith("study covering: ")
    after = StoredStudy("covering", folder / "results")
    assert after.plan.equals(before, check_metadata=True)
    assert len(list((after.store.folder / "parts").iterdir())) <= 1


@pytest.mark.parametrize(
    ("kind", "table", "columns"),
    [
        ("coverage", "heatmaps", {"rows": pa.array([-1] * TRIALS, INT32)}),
        ("trajectories", "trajectories", {"x": lists([0.0])}),
        ("trajectories", "trials", {"width": math.nan}),
        ("coverage", "trials", {"height": 0.0}),
    ],
)
def test_a_figure_of_it_is_one_line(
    folder: Path, kind: str, table: str, columns: dict[str, Any]
) -> None:
    give(folder / "results" / "covering", table, **columns)
    done = sweep(folder, "plot", "covering", kind)
    assert done.returncode == 2, done.stdout
    assert done.stderr.count("\n") == 1
    assert "study covering: " in done.stderr


def test_a_state_that_only_other_trials_have_is_left_out(folder: Path) -> None:
    """As of the parts of an earlier launch, when the model had another state."""
    give(folder / "results" / "covering", "trajectories", phase=pa.nulls(ROWS, BODIES))
    study = StoredStudy("covering", folder / "results")
    assert list(study.trajectories) == ["trial_id", "frame", "x", "y", "vx", "vy"]


def test_honest_tables_pass(honest: Path) -> None:
    study = StoredStudy("covering", honest)
    assert [len(study.heatmaps), len(study.trajectories), len(study.trials)] == [
        TRIALS,
        ROWS,
        TRIALS,
    ]


def test_a_series_whose_frames_are_no_numbers_is_refused(tmp_path: Path) -> None:
    study = launched(
        COVERING.replace(
            "series: [coverage], heatmaps: true", "series: [speed], every: 20"
        ),
        tmp_path,
    )
    folder = study.store.folder
    assert isinstance(folder, Path)
    for columns in ({"frame": pa.array([0.5] * 8)}, {"speed": "fast"}):
        give(folder, "series", **columns)
        with pytest.raises(StoreError, match="stored series are not"):
            _ = StoredStudy("covering", tmp_path).series


def test_an_array_of_all_trials_has_a_bound(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One wide and one high map, or one frame of many boids, would make an array of far
    more than is stored.
    """
    monkeypatch.setattr(netcdf, "MOST_PLACES", TRIALS * 600 * 800 - 1)
    study = StoredStudy("covering", folder / "results")
    with pytest.raises(
        ChoiceError, match="4 x 600 x 800 elements; at most 1,919,999 are allowed"
    ):
        export(study, folder / "x.nc", "heatmaps")
