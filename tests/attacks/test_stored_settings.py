"""What a stranger's row asks for passes the checks of a
spec before a kernel meets it.
"""

import json
import math
import re
import shutil
import signal
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.errors import StoreError
from sweep.replays.replaying import replay
from sweep.spec.settings import preset_settings
from sweep.spec.study import parse_spec
from sweep.store.manifest import MANIFEST, write_manifest
from sweep.tables.stored_study import StoredStudy
from sweep.web.replaying import Replay
from tests.attacks.hostile import give, give_plan
from tests.cases import slow_but
from tests.commands import sweep
from tests.studies import COVERING, DERIVING, IMPOSSIBLE, SMALL, launched

OWN = SMALL.replace(
    "fixed: {n: 12, steps: 9}",
    "maps: {room: {size: [90, 90], shapes: [{disc: {x: 45, y: 45, radius: 5}},"
    " {rectangle: {x: 5, y: 9, width: 3, height: 1}}]}}\n"
    "fixed: {n: 12, steps: 9, map: room, obstacle_margin: 0, start_margin: 0}",
)
INTEGER = pa.int64()

ROWS: dict[str, tuple[dict[str, Any], str]] = {
    "every 0": ({"every": 0}, '"every" must be an integer from 1, not 0'),
    "every -1": ({"every": -1}, '"every" must be an integer from 1, not -1'),
    "every -2^63": (
        {"every": -(2**63)},
        '"every" must be an integer from 1, not -9223',
    ),
    "every a text": ({"every": "1"}, '"every" must be an integer from 1, not "1"'),
    "steps 2^60": (
        {"steps": 2**60},
        "steps; allowed: an integer from 1 to 1,000,000,000",
    ),
    "steps 0": ({"steps": 0}, "0 is not allowed for steps"),
    "steps negative": ({"steps": -5}, "-5 is not allowed for steps"),
    "n 10^8": ({"n": 10**8}, "n; allowed: an integer from 1 to 10,000,000"),
    "n 0": ({"n": 0}, "0 is not allowed for n"),
    "n -1": ({"n": -1}, "-1 is not allowed for n"),
    "n -2^63": ({"n": -(2**63)}, "is not allowed for n"),
    "n a fraction": ({"n": pa.array([2.5] * 6)}, "2.5 is not allowed for n"),
    "n a text": ({"n": "12"}, "'12' is not allowed for n"),
    "n null": ({"n": pa.array([None] * 6, INTEGER)}, "None is not allowed for n"),
    "n a list": ({"n": pa.array([[1, 2]] * 6)}, r"\[1, 2\] is not allowed for n"),
    "width NaN": ({"width": math.nan}, "nan is not allowed for width"),
    "width infinite": (
        {"width": math.inf},
        "the world is larger than 1e[+]15 .* where .* width = inf",
    ),
    "width 0": ({"width": 0.0}, "0.0 is not allowed for width"),
    "width negative": ({"width": -1.0}, "-1.0 is not allowed for width"),
    "width tiny": ({"width": 5e-324}, "no room|has no"),
    "height NaN": ({"height": math.nan}, "nan is not allowed for height"),
    "model unknown": ({"model": "evil"}, 'unknown model "evil"'),
    "model of Python": ({"model": "__class__"}, 'unknown model "__class__"'),
    "model another": ({"model": "rustamani2024"}, "is not allowed for"),
    "model null": ({"model": pa.nulls(6, pa.string())}, '"model" must be a string'),
    "preset unknown": ({"preset": "evil"}, 'unknown preset of nguyen2024 "evil"'),
    "stream unknown": (
        {"streams": "start=evil world=common noise=common"},
        'unknown kind of stream "evil"',
    ),
    "stream of another name": ({"streams": "evil=common"}, 'unknown key "evil"'),
    "streams without =": ({"streams": "start"}, 'unknown kind of stream ""'),
    "streams empty": (
        {"streams": ""},
        '"streams" must be a mapping with at least one entry',
    ),
    "streams a number": ({"streams": pa.array([7] * 6)}, '"streams" must be a string'),
    "obstacles 10^12": (
        {"n_obstacles": 10**12},
        "1000000000000 is not allowed for n_obstacles",
    ),
    "footprint 5000": (
        {"footprint_radius": 5000.0},
        "5000.0 is not allowed for footprint_radius",
    ),
    "pixel 0": ({"pixel": 0.0}, "0.0 is not allowed for pixel"),
    "seed -1": ({"seed": -1}, '"seed" must be an integer from 0, not -1'),
    "seed null": ({"seed": pa.nulls(6, INTEGER)}, '"seed" must be an integer'),
    "replicate -1": ({"replicate": -1}, '"replicate" must be an integer from 0'),
    "replicate 2^62": (
        {"replicate": 2**62},
        '"replicate" must be an integer from 0',
    ),
    "seed_listed a number": (
        {"seed_listed": pa.array([1] * 6)},
        '"seed_listed" must be true or false',
    ),
    "borders": ({"borders": "evil"}, 'unknown borders "evil"'),
    "start margin": ({"start_margin": 1e9}, "start_margin leaves boids no room"),
    "draws": (
        {"start_draws": "python_random", "start_radius": 5.0},
        "needs start_radius 0",
    ),
    "goals a number": ({"next_goals": pa.array([7] * 6)}, "7 is not allowed for next_"),
    "goals of one number": ({"next_goals": "1 2; 3"}, "'1 2; 3' is not allowed for"),
    "goals of NaN": ({"next_goals": "nan 2"}, "'nan 2' is not allowed for next_goals"),
    "goals of 50 kB": (
        {"next_goals": "1 2; " * 10_000},
        r"\.\.\. is not allowed for next_",
    ),
    "goals of another model": ({"next_goals": "1 2"}, "nguyen2024 calls no `goal_of`"),
    "spread 1e308": ({"drag_spread": 1e308}, "1e[+]308 is not allowed for drag_spread"),
    "spread NaN": ({"drag_spread": math.nan}, "nan is not allowed for drag_spread"),
    "spread negative": ({"drag_spread": -1.0}, "-1.0 is not allowed for drag_spread"),
    "spread a text": ({"drag_spread": "1"}, "'1' is not allowed for drag_spread"),
    "wind infinite": ({"wind_x": math.inf}, "wind and gusts must be finite"),
    "obstacles fast": (
        {"obstacle_speed": 1e308, "dt": 10.0},
        "an obstacle moves farther in one step than the world",
    ),
    "status a number": ({"status": pa.array([1] * 6)}, '"status" must be a string'),
    "error a number": ({"error": pa.array([1] * 6)}, '"error" must be a string'),
}
"""What is put into all rows of a small study, and what is said of it."""


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("honest")
    launched(SMALL, folder)
    return folder


@pytest.fixture
def folder(honest: Path, tmp_path: Path) -> Path:
    """A folder with results/small, for this test alone."""
    shutil.copytree(honest, tmp_path / "results")
    return tmp_path


@pytest.fixture
def no_kernel(monkeypatch: pytest.MonkeyPatch) -> None:
    def met(*_arguments: object) -> None:
        raise AssertionError("a kernel has met a row that was not checked")

    for place in (
        "sweep.replays.replaying.simulate",
        "sweep.trial.world.obstacles",
        "sweep.trial.simulation.Simulation",
    ):
        monkeypatch.setattr(place, met)


def first(folder: Path) -> tuple[StoredStudy, str]:
    study = StoredStudy("small", folder / "results")
    return study, study.plan["trial_id"][0].as_py()


@pytest.mark.usefixtures("no_kernel")
@pytest.mark.parametrize("name", ROWS)
def test_a_row_that_no_launch_writes_is_refused(folder: Path, name: str) -> None:
    columns, message = ROWS[name]
    give(folder / "results" / "small", **columns)
    study, trial = first(folder)
    for meet in (replay, StoredStudy.world, lambda study, trial: Replay(study, trial)):
        with pytest.raises(StoreError, match=message) as error:
            meet(study, trial)  # type: ignore[operator]
        assert str(error.value).startswith(
            f"study small: trial {trial} cannot be run again"
        )


@pytest.mark.parametrize("command", [("replay",), ("view", "--no-open")])
def test_commands_say_so_in_one_line(folder: Path, command: tuple[str, ...]) -> None:
    give(folder / "results" / "small", every=0)
    _, trial = first(folder)
    done = sweep(folder, command[0], "small", trial, *command[1:])
    assert done.returncode == 2
    assert (
        done.stderr
        == f"study small: trial {trial} cannot be run again, because no launch accepts"
        ' the stored row: "every" must be an integer from 1, not 0\n'
    )


def test_a_view_of_the_study_checks_its_first_trial_too(folder: Path) -> None:
    give(folder / "results" / "small", n=10**8)
    done = sweep(folder, "view", "small", "--no-open")
    assert done.returncode == 2
    assert (
        "100000000 is not allowed for n; allowed: an integer from 1 to 10,000,000"
        in done.stderr
    )


def test_verify_goes_on_past_a_refused_trial_and_counts_it(folder: Path) -> None:
    """Of six trials one asks for every = 0: five are
    compared, and the exit code is 1.
    """
    give(folder / "results" / "small", every=pa.array([2, 2, 0, 2, 2, 2]))
    done = sweep(folder, "verify", "small", "--fraction", "1")
    assert done.returncode == 1
    assert "result     5 of 6 bitwise identical" in done.stdout
    assert "1 of all 6 trials differ" in done.stdout
    refused = (
        r'study small: trial \w{24} cannot be run again.*"every" must be an integer'
        r" from 1, not 0\n"
    )
    assert len(re.findall(refused, done.stdout)) == 1


def test_verify_of_refused_trials_alone_is_a_report_too(folder: Path) -> None:
    give(folder / "results" / "small", steps=2**60)
    done = sweep(folder, "verify", "small", "--fraction", "1")
    assert done.returncode == 1
    assert "result     0 of 6 bitwise identical" in done.stdout


@pytest.mark.parametrize(
    "spec",
    [SMALL, COVERING, OWN, IMPOSSIBLE, DERIVING],
    ids=["small", "covering", "own map", "failing", "deriving"],
)
def test_an_honest_row_gives_the_job_of_its_launch(tmp_path: Path, spec: str) -> None:
    """To the last bit and in every type, also where the trial has failed: nothing is
    coerced to something else.
    """
    study, record = launched(spec, tmp_path), parse_spec(spec).record
    for trial in study.plan["trial_id"].to_pylist():
        stored = study.trial(trial)
        job = study.job(stored)
        row = {
            name: (value, type(value))
            for name, value in stored.row.items()
            if name in job.settings
        }
        assert row == {
            name: (value, type(value)) for name, value in job.settings.items()
        }
        assert (job.trial_id, job.point) == (trial, stored.row["point"])
        assert sorted(job.record.metrics) == sorted(record.metrics)
        assert job.record == replace(record, metrics=job.record.metrics)
        assert [job.seed, job.literal, job.replicate] == [
            stored.row[name] for name in ("seed", "seed_listed", "replicate")
        ]


@pytest.mark.parametrize(
    ("model", "preset"),
    slow_but(
        [("nguyen2024", "as_run"), *((model, "as_written") for model in MODELS)],
        product(MODELS, ["as_written", "as_run"]),
    ),
)
def test_every_preset_passes_as_a_row(tmp_path: Path, model: str, preset: str) -> None:
    settings = preset_settings(model, preset, BUILT_IN)
    spec = {
        "study": "one",
        "model": model,
        "preset": preset,
        "fixed": {"n": 3, "steps": 2},
        "replicates": 1,
        "seed": 1,
    }
    study = launched(json.dumps(spec), tmp_path)
    job = study.job(study.trial(study.plan["trial_id"][0].as_py()))
    assert job.settings.keys() == settings.keys()


def test_a_row_without_a_column_is_refused(folder: Path) -> None:
    part = next((folder / "results" / "small" / "parts").iterdir())
    table = pq.read_table(part / "trials.parquet")
    for name in ("n", "every", "streams", "model", "seed_listed", "status"):
        pq.write_table(table.drop_columns([name]), part / "trials.parquet")
        (part / MANIFEST).unlink()
        write_manifest(part)
        study, trial = first(folder)
        with pytest.raises(StoreError, match=f"{name}"):
            replay(study, trial)


def test_a_series_of_a_metric_that_does_not_exist_is_refused(folder: Path) -> None:
    give(folder / "results" / "small", "series", evil=1.0)
    with pytest.raises(StoreError, match='unknown metric "evil"'):
        replay(*first(folder))


def test_a_table_that_no_launch_writes_is_a_difference(folder: Path) -> None:
    part = next((folder / "results" / "small" / "parts").iterdir())
    series = pq.read_table(part / "series.parquet")
    pq.write_table(series.rename_columns({"speed": "more"}), part / "evil.parquet")
    (part / MANIFEST).unlink()
    write_manifest(part)
    report, same = replay(*first(folder))
    assert not same
    assert "evil.more has" in report


def _triangle(x: float = 9.0, **about: Any) -> dict[str, Any]:
    """A polygon as a plan has it, whose last vertex is at (x, 9)."""
    return {"vertices": [[0, 0], [9, 0], [x, 9]]} | about


def _arena(**about: Any) -> dict[str, Any]:
    return _triangle(solid="outside", **about)


MAPS: dict[str, tuple[Any, str]] = {
    "no mapping": ([1], "has no valid provenance"),
    "a built-in name": (
        {"cafeteria": {"size": [9, 9], "obstacles": []}},
        '"cafeteria" is not an allowed name',
    ),
    "a name with escapes": (
        {"\x1b[2J": {"size": [9, 9], "obstacles": []}},
        "is not an allowed name of a custom map",
    ),
    "null": ({"room": None}, "no size"),
    "no size": ({"room": {"obstacles": []}}, "no size"),
    "size of one": ({"room": {"size": [9], "obstacles": []}}, "no size"),
    "size of three": ({"room": {"size": [9, 9, 9], "obstacles": []}}, "no size"),
    "size a text": ({"room": {"size": "big", "obstacles": []}}, "no size"),
    "size negative": (
        {"room": {"size": [-9, 9], "obstacles": []}},
        "the size of the map is -9.0 x 9.0",
    ),
    "size NaN": (
        {"room": {"size": [math.nan, 9], "obstacles": []}},
        "the size of the map is nan x 9.0",
    ),
    "size infinite": (
        {"room": {"size": [math.inf, 9], "obstacles": []}},
        "the size of the map is inf x 9.0",
    ),
    "size of 10^400": ({"room": {"size": [10**400, 9], "obstacles": []}}, "no size"),
    "obstacles a number": (
        {"room": {"size": [9, 9], "obstacles": 7}},
        "no size, or no table",
    ),
    "obstacles ragged": (
        {"room": {"size": [9, 9], "obstacles": [[1], [1, 2]]}},
        "no size, or no table",
    ),
    "obstacles of four": (
        {"room": {"size": [9, 9], "obstacles": [[1, 1, 1, 1]]}},
        "no size, or no table",
    ),
    "obstacles of texts": (
        {"room": {"size": [9, 9], "obstacles": [list("abcde")]}},
        "no size, or no table",
    ),
    "obstacle NaN": (
        {"room": {"size": [9, 9], "obstacles": [[math.nan, 1, 1, 1, 1]]}},
        "a shape at nan",
    ),
    "obstacle infinite": (
        {"room": {"size": [9, 9], "obstacles": [[1, 1, math.inf, math.inf, 1]]}},
        "a shape",
    ),
    "obstacle negative": (
        {"room": {"size": [9, 9], "obstacles": [[1, 1, -1, 1, 0]]}},
        "a shape at 1.0",
    ),
    "obstacle far away": (
        {"room": {"size": [9, 9], "obstacles": [[1e300, 1, 1, 1, 1]]}},
        "a shape at 1e[+]300",
    ),
    "neither disc nor rectangle": (
        {"room": {"size": [9, 9], "obstacles": [[1, 1, 1, 1, 7]]}},
        "a shape at",
    ),
    "velocity 10^300": (
        {"room": {"size": [9, 9], "obstacles": [[1, 1, 1, 1, 1, 1e300, 0]]}},
        "no size, or no table",
    ),
    "polygon of nested lists": (
        {"room": {"size": [9, 9], "obstacles": [{"vertices": [[[1]], [2, 3]]}]}},
        "a polygon has no list of vertices",
    ),
    "polygon of 10^300": (
        {"room": {"size": [9, 9], "obstacles": [_triangle(1e300)]}},
        "a polygon has numbers beyond 1e[+]15, a value of solid",
    ),
    "polygon of NaN": (
        {"room": {"size": [9, 9], "obstacles": [_triangle(math.nan)]}},
        "a polygon has numbers beyond 1e[+]15, a value of solid",
    ),
    "polygon that moves by NaN": (
        {"room": {"size": [9, 9], "obstacles": [_triangle(velocity=[math.nan, 1])]}},
        "a polygon has numbers beyond 1e[+]15, a value of solid",
    ),
    "arena that moves": (
        {"room": {"size": [9, 9], "obstacles": [_arena(velocity=[1, 1])]}},
        "a polygon has numbers beyond 1e[+]15, a value of solid",
    ),
}


def _refused(folder: Path, stored: Any, message: str) -> None:
    give(folder / "results" / "small", map="room")
    give_plan(folder / "results" / "small", {"maps": stored})
    for meet in (replay, StoredStudy.world):
        with pytest.raises(StoreError, match=message):
            meet(*first(folder))  # type: ignore[operator]


@pytest.mark.usefixtures("no_kernel")
@pytest.mark.parametrize("name", MAPS)
def test_stored_maps_that_are_none_are_refused(folder: Path, name: str) -> None:
    _refused(folder, *MAPS[name])


@pytest.mark.usefixtures("no_kernel")
def test_a_stored_map_of_too_many_shapes_is_refused(folder: Path) -> None:
    shapes = [[1, 1, 1, 1, 1]] * 100_001
    _refused(folder, {"room": {"size": [9, 9], "obstacles": shapes}}, "100,001 shapes")


@pytest.mark.slow
@pytest.mark.usefixtures("no_kernel")
def test_a_stored_polygon_of_a_million_vertices_is_refused(folder: Path) -> None:
    polygon = {"vertices": [[1, 1]] * 10**6}
    room = {"room": {"size": [9, 9], "obstacles": [polygon]}}
    _refused(folder, room, "a polygon has 1000000 vertices")


def test_a_map_that_is_not_the_trial_s_is_refused(folder: Path) -> None:
    give(folder / "results" / "small", map="room")
    give_plan(
        folder / "results" / "small",
        {"maps": {"room": {"size": [9, 9], "obstacles": []}}},
    )
    with pytest.raises(StoreError, match="map room is 9 x 9 px"):
        replay(*first(folder))


def test_ctrl_c_ends_a_replay_whose_kernel_call_never_returns(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A row may ask for ten million boids that all see each other: Python would see
    Ctrl-C after years.
    """
    during = []

    def endless(_job: object) -> None:
        during.append(signal.getsignal(signal.SIGINT))
        raise RuntimeError("endless")

    monkeypatch.setattr("sweep.replays.replaying.simulate", endless)
    with pytest.raises(RuntimeError, match="endless"):
        replay(*first(folder))
    assert during == [signal.SIG_DFL]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
