"""Entries of every kind, in files beside a spec."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.campaigns.launching import launch
from sweep.design.design import expand
from sweep.errors import CodeError, SpecError
from sweep.figures.own_kinds import with_files
from sweep.methods.comparison import compare_sides, read_side
from sweep.own_code.reading import load_spec
from sweep.tables.means import point_means
from sweep.tables.means_text import caption, point_rows
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.commands import sweep

SPEC = """
study: mine
model: nguyen2024
preset: as_run
fixed: {n: 3, steps: 4, start_draws: ./flock.csv, map: ./entries.py:pillar}
sweep:
  both: {sample: ./entries.py, points: 3, separation_weight: {uniform: [0, 1]},
         cohesion_weight: {uniform: [2, 4]}}
replicates: 2
seed: 5
record: {metrics: [speed, "./entries.py:eastward"], trajectories: true}
"""
FLOCK = "x,y,heading\n100,200,0\n200,300,90\n\n300,50.5,-45\n"
ENTRIES = '''
import numpy as np
from kernels.jit import jit
from kernels.metrics import Metric
from kernels.worlds import Map
from sweep.spec.sampling import Sampler


@jit
def eastward(frames, filled, ground, observation, values):
    """Mean x component of the velocity."""
    for f in range(filled):
        total = 0.0
        for i in range(frames.bodies.shape[2]):
            total += frames.bodies[f, 2, i]
        values[f] = total / frames.bodies.shape[2]


def pillar(settings, rng):
    """One disc in the middle."""
    return np.array([[settings.width / 2, settings.height / 2, 9.0, 9.0, 1.0]])


def hall(settings, rng):
    """Nothing."""
    return np.empty((0, 5))


def evenly(cube):
    """The same number for all settings of a point."""
    unit = (np.arange(cube.points) + 0.5) / cube.points
    return [unit.copy() for _ in cube.names]


METRICS = {
    "eastward": Metric(eastward, "length/time", "mean velocity to the east", "a test"),
    "haste": Metric(eastward, "length/time", "the same", "a test"),
}
MAPS = {
    "pillar": Map(pillar, "a pillar in the middle", "a test"),
    "hall": Map(hall, "an empty hall", "a test", (90.0, 60.0)),
}
SAMPLERS = {"evenly": Sampler(evenly, "the diagonal")}
'''
KIND = '''
from matplotlib.figure import Figure
from sweep.figures.planning import FigureKind, Planned


def plan(study, choices):
    """A figure without anything."""
    return [Planned("", Figure)]


FIGURES = {"bare": FigureKind("nothing at all", (), plan)}
'''


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "spec.yaml").write_text(SPEC)
    (tmp_path / "flock.csv").write_text(FLOCK)
    (tmp_path / "entries.py").write_text(ENTRIES)
    (tmp_path / "kind.py").write_text(KIND)
    return tmp_path


def with_text(folder: Path, old: str, new: str) -> Path:
    """The spec with another text in a place."""
    path = folder / "spec.yaml"
    assert old in SPEC
    path.write_text(SPEC.replace(old, new))
    return path


def test_files_bring_a_metric_a_map_a_sampler_and_a_start(folder: Path) -> None:
    done = sweep(folder, "launch", "spec.yaml")
    assert "6 new trials (6 done)" in done.stderr
    study = StoredStudy("mine", folder / "results")
    points = study.points
    assert points["separation_weight"].tolist() == pytest.approx([1 / 6, 0.5, 5 / 6])
    assert points["cohesion_weight"].tolist() == pytest.approx([7 / 3, 3, 11 / 3])
    trials = study.trials
    assert set(trials["map"]) == {"pillar"}
    assert set(trials["start_draws"]) == {"flock"}
    assert study.metrics == ["speed", "eastward"]
    assert study.units["eastward"] == "px/step"
    frames, bodies = study.trajectory(trials["trial_id"][0])
    assert frames[0] == 0
    np.testing.assert_array_equal(bodies[0, 0], [100, 200, 300])
    np.testing.assert_array_equal(bodies[0, 1], [200, 300, 50.5])
    speed = study.trials["start_speed"][0]
    angles = np.radians([0, 90, -45])
    np.testing.assert_allclose(bodies[0, 2], speed * np.cos(angles), atol=1e-15)
    np.testing.assert_allclose(bodies[0, 3], speed * np.sin(angles), atol=1e-15)
    last = bodies[-1, 2].mean()
    assert trials["eastward"][0] == pytest.approx(last, rel=1e-12)
    assert sweep(folder, "verify", "mine", "--fraction", "1").returncode == 0
    assert "sensitivity" in sweep(folder, "plot", "mine", "sensitivity").stdout


def test_a_table_says_that_a_metric_declares_no_distribution(folder: Path) -> None:
    launch(load_spec(folder / "spec.yaml"), folder / "results", Serial())
    study = StoredStudy("mine", folder / "results")
    table = point_means(study, ["speed", "eastward"])
    assert "eastward declares no distribution and is treated as normal" in caption(
        study, table
    )
    rows = point_rows(study, table)
    assert rows["eastward_declared"].eq(False).all()
    assert "speed_declared" not in rows
    assert "declares no" not in caption(study, point_means(study, ["speed"]))


def test_velocities_may_be_given_too(folder: Path) -> None:
    (folder / "flock.csv").write_text("vy, vx, y, x\n4,3,2,1\n8,7,6,5\n0,0,0,0\n")
    sweep(folder, "launch", "spec.yaml")
    study = StoredStudy("mine", folder / "results")
    _, bodies = study.trajectory(study.trials["trial_id"][0])
    np.testing.assert_array_equal(
        bodies[0], [[1, 5, 0], [2, 6, 0], [3, 7, 0], [4, 8, 0]]
    )


def flocks(replicates: int) -> str:
    """A table with a flock for each replicate, those of the last one first."""
    rows = [
        f"{k},{100 * i},{50.0 + k},{0.5 * k},-1"
        for k in reversed(range(replicates))
        for i in range(1, 4)
    ]
    return "\n".join(["replicate,x,y,vx,vy", *rows]) + "\n"


def test_each_replicate_may_have_a_flock_of_its_own(folder: Path) -> None:
    (folder / "flock.csv").write_text(flocks(3))  # more than are needed
    results = launched(folder)
    study = StoredStudy("mine", results)
    assert len(study.trials) == 6
    for trial, k in study.trials[["trial_id", "replicate"]].itertuples(index=False):
        _, bodies = study.trajectory(trial)
        expected = [[100, 200, 300], [50 + k] * 3, [0.5 * k] * 3, [-1] * 3]
        np.testing.assert_array_equal(bodies[0], expected)
    done = sweep(folder, "verify", "mine", "--fraction", "1")
    assert done.returncode == 0, done.stderr
    # Also without its code, and after one flock has changed.
    assert sweep(folder, "table", "mine").returncode == 0
    (folder / "flock.csv").write_text(flocks(3).replace("0,100,50.0", "0,100,51.0"))
    assert "6 new trials" in sweep(folder, "launch", "spec.yaml").stderr


STARTED = """
study: {name}
model: nguyen2024
preset: as_run
fixed: {{n: 3, steps: 4, {more}}}
sweep: {{separation_weight: [0.5, 1]}}
replicates: 3
seed: 5
streams: {{start: common, world: independent}}
record: {{metrics: [speed]}}
"""
SIDES = {
    "random": "drag: 0",
    "given": "start_draws: ./flock.csv",
    "again": "start_draws: ./flock.csv, drag: 0",
    "else": "start_draws: ./other.csv",
}


def test_a_table_of_flocks_has_nothing_in_common_with_random_starts(
    tmp_path: Path,
) -> None:
    """Though replicates have the same numbers; those of one table start alike."""
    (tmp_path / "flock.csv").write_text(flocks(3))
    (tmp_path / "other.csv").write_text(flocks(3).replace("50.0", "51.0"))
    for name, more in SIDES.items():
        spec = tmp_path / f"{name}.yaml"
        spec.write_text(STARTED.format(name=name, more=more))
        launch(load_spec(spec), tmp_path / "results", Serial())

    def paired(a: str, b: str) -> bool:
        one, other = (read_side(side, tmp_path / "results") for side in (a, b))
        found = compare_sides(one, other)
        (pairs,) = {bool(each) for each in found.rows["paired"]}
        assert found.streams == (("start",) if pairs else ())
        return pairs

    weights = [f"given:separation_weight={weight}" for weight in (0.5, 1)]
    assert paired("given", "again")
    assert paired(weights[0], weights[1])
    for others in (("given", "random"), ("random", "given"), ("given", "else")):
        assert not paired(*others)


@pytest.mark.parametrize(
    ("table", "change", "message"),
    [
        (flocks(1), ("", ""), None),
        (flocks(2), ("", ""), None),
        (
            flocks(2),
            ("replicates: 2", "replicates: 5"),
            "9: flock.csv has the flocks of 2 replicates, but a point may have 5",
        ),
        (
            flocks(2),
            ("replicates: 2", "seeds: [1, 2]"),
            "5: flock.csv has the flocks of 2 replicates: use a sweep with",
        ),
        (flocks(3).replace("\n0,", "\n4,"), ("", ""), "5: flock.csv has no boid of"),
        (
            flocks(2) + "1,1,1,1,1\n",
            ("", ""),
            "5: flock.csv has 3 boids of replicate 0, and 4 of replicate 1: the",
        ),
        (flocks(2) + "-1,1,1,1,1\n", ("", ""), '5: flock.csv, line 8: replicate "-1"'),
        (flocks(2) + "0,1,1,1\n", ("", ""), "5: flock.csv, line 8: 0, 1, 1, 1: not 5"),
    ],
)
def test_flocks_of_replicates_must_be_whole(
    table: str, change: tuple[str, str], message: str | None, folder: Path
) -> None:
    (folder / "flock.csv").write_text(table)
    path = with_text(folder, *change)
    if message is None:
        assert expand(load_spec(path)).n_points == 3
        return
    with pytest.raises(SpecError) as caught:
        expand(load_spec(path))
    assert str(caught.value).startswith(f"spec.yaml:{message}")


@pytest.mark.parametrize("x", [-0.5, 1e6])
def test_boids_outside_the_world_are_for_open_borders(x: float, folder: Path) -> None:
    (folder / "flock.csv").write_text(FLOCK.replace("100,200", f"{x},200"))
    plain = with_text(folder, "map: ./entries.py:pillar", "borders: torus")
    with pytest.raises(
        SpecError, match=r"5: flock\.csv has boids from .* outside the w"
    ):
        expand(load_spec(plain))
    plain.write_text(plain.read_text().replace("borders: torus", "borders: open"))
    assert expand(load_spec(plain)).n_points == 3


def test_another_place_makes_other_trials_and_the_same_points(folder: Path) -> None:
    first = StoredStudy("mine", launched(folder)).trials
    (folder / "flock.csv").write_text(FLOCK.replace("50.5", "51.5"))
    again = sweep(folder, "launch", "spec.yaml")
    assert "6 new trials" in again.stderr
    second = StoredStudy("mine", folder / "results").trials
    assert first["point"].tolist() == second["point"].tolist()
    assert set(first["trial_id"]).isdisjoint(second["trial_id"])
    # Layout is no place.
    (folder / "flock.csv").write_text(FLOCK.replace("50.5", "51.50 "))
    assert "nothing was missing" in sweep(folder, "launch", "spec.yaml").stderr


def launched(folder: Path) -> Path:
    sweep(folder, "launch", "spec.yaml")
    return folder / "results"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            "",
            "flock.csv, line 1: wrong columns; allowed: x, y, heading or x, y, vx, vy",
        ),
        ("x,y\n1,2\n", "flock.csv, line 1: wrong columns; allowed: "),
        ("x,y,heading,heading\n", "flock.csv, line 1: wrong columns; allowed: "),
        ("x,y,heading\n", "flock.csv has no boid"),
        ("x,y,heading\n1,2,3\n1,2\n", "flock.csv, line 3: 1, 2: not 3 finite numbers"),
        ("x,y,heading\n1,2,nan\n", "flock.csv, line 2: 1, 2, nan: not 3 finite"),
        ("x,y,heading\n1,2,3,4\n", "flock.csv, line 2: 1, 2, 3, 4: not 3 finite"),
        ("x,y,heading\n1,east,3\n", "flock.csv, line 2: 1, east, 3: not 3 finite"),
        ("x,y,heading\n1,2,3\n", "flock.csv has the places of 1 boids where n = 3"),
    ],
)
def test_what_is_no_table_of_places_is_said(
    table: str, message: str, folder: Path
) -> None:
    (folder / "flock.csv").write_text(table)
    with pytest.raises(SpecError) as caught:
        expand(load_spec(folder / "spec.yaml"))
    assert str(caught.value).startswith(f"spec.yaml:5: {message}")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (":pillar", "", "5: entries.py has several maps: write ./entries.py:NAME"),
        (":pillar", ":piller", '5: unknown map of entries.py "piller"; did you mean'),
        (":eastward", ":x", '11: unknown metric of entries.py "x". Allowed: eastward'),
        ("./entries.py:pillar", "./flock.csv", "5: flock.csv is a table; allowed:"),
        ("./flock.csv", "./entries.py", "5: entries.py has no STARTS"),
        (
            "model: nguyen2024",
            "model: ./entries.py",
            "3: entries.py: MODEL is no Model",
        ),
        ("./flock.csv", "./folk.csv", '5: there is no file "folk.csv" in'),
        ("./flock.csv", "flock.csv", '5: write "./flock.csv" for a file next to'),
        ("points: 3", "points: 3, levels: 4", '7: unknown key "levels"'),
    ],
)
def test_a_file_that_cannot_be_meant_is_said_with_its_line(
    old: str, new: str, message: str, folder: Path
) -> None:
    with pytest.raises(SpecError) as caught:
        load_spec(with_text(folder, old, new))
    assert str(caught.value).startswith(f"spec.yaml:{message}")


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ('MAPS = {"cafeteria": MAPS["hall"]}', 'the map "cafeteria" is built in'),
        ('MAPS = {"Hall": MAPS["hall"]}', 'a map cannot be called "Hall"'),
        ("MAPS = [1]", "MAPS is no mapping from names to Map"),
        ('MAPS = {"hall": pillar}', 'MAPS["hall"] is no Map'),
        (
            'METRICS = {"x_mean": METRICS["haste"]}',
            'cannot be called "x_mean"',
        ),
        (
            'METRICS = {"status": METRICS["haste"]}',
            'cannot be called "status"',
        ),
        ('METRICS = {"n": METRICS["haste"]}', 'there is a parameter "n" already'),
        (
            'METRICS = {"haste": METRICS["haste"]._replace(unit="px")}',
            'metric "haste" has the unit "px"; allowed: "", "length"',
        ),
        ("1 / 0", "line 44: ZeroDivisionError: division by zero"),
        ("raise SystemExit(3)", "line 44: SystemExit: 3"),
        ("import nowhere", "line 44: ModuleNotFoundError: No module named 'nowhere'"),
        ("import near", '"near" is a file in the folder of this file; import it'),
        ("from . import far", "there is no far.py to import"),
        ("def", "line 44: not Python: invalid syntax"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_a_sentence(
    code: str, message: str, folder: Path
) -> None:
    (folder / "near.py").write_text("")
    with (folder / "entries.py").open("a") as file:
        file.write(f"{code}\n")
    with pytest.raises(SpecError) as caught:
        load_spec(folder / "spec.yaml")
    said = str(caught.value)
    assert said.startswith("spec.yaml:")
    assert "entries.py" in said
    assert message in said
    assert "\n" not in said


def test_a_metric_of_the_name_of_a_setting_is_refused(folder: Path) -> None:
    with (folder / "entries.py").open("a") as file:
        file.write('METRICS = {"drag": METRICS["haste"]}\n')
    with pytest.raises(SpecError, match="metrics have the names of parameters: drag"):
        load_spec(with_text(folder, "./entries.py:eastward", "./entries.py"))


def test_a_file_stands_for_all_its_metrics(folder: Path) -> None:
    study = load_spec(with_text(folder, ":eastward", ""))
    assert study.record.metrics == ("speed", "eastward", "haste")


def test_other_keys_name_the_entries_of_files_plainly(folder: Path) -> None:
    path = with_text(folder, "speed,", "speed, haste,")
    assert load_spec(path).record.metrics == ("speed", "haste", "eastward")
    # The line of a mistake behind the list is still its own.
    path.write_text(path.read_text().replace("trajectories: true", "every: 0"))
    with pytest.raises(SpecError, match=r"spec\.yaml:11: "):
        load_spec(path)


def test_a_map_of_a_file_has_its_size(folder: Path) -> None:
    (folder / "flock.csv").write_text("x,y,heading\n1,2,0\n20,30,0\n30,5,0\n")
    study = load_spec(with_text(folder, ":pillar", ":hall"))
    settings = expand(study).settings(0)
    assert (settings["width"], settings["height"]) == (90.0, 60.0)


def test_a_figure_of_a_file_is_drawn(folder: Path) -> None:
    launched(folder)
    done = sweep(folder, "plot", "mine", "./kind.py", "scatter")
    names = [Path(line).name for line in done.stdout.splitlines()]
    assert "bare.png" in names
    assert any(name.startswith("scatter") for name in names)
    assert "bare" in sweep(folder, "plot", "mine", "./kind.py:bare").stdout
    wrong = sweep(folder, "plot", "mine", "./kind.py:bear")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert 'unknown figure of ./kind.py "bear"; did you mean "bare"?' in wrong.stderr


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ('FIGURES["curves"] = FIGURES["bare"]', 'a kind "curves" exists already'),
        ("FIGURES = {}", "kind.py has no FIGURES"),
        ("FIGURES = {'bare': 1}", 'FIGURES["bare"] is no FigureKind'),
    ],
)
def test_what_is_no_kind_of_figure_is_said(
    code: str, message: str, folder: Path
) -> None:
    with (folder / "kind.py").open("a") as file:
        file.write(f"{code}\n")
    with pytest.raises(CodeError) as caught:
        with_files([f"{folder}/kind.py"])
    assert message in str(caught.value)


def test_tables_of_files_are_read_without_them(folder: Path) -> None:
    results = launched(folder)
    for name in ("entries.py", "flock.csv", "spec.yaml"):
        (folder / name).unlink()
    study = StoredStudy("mine", results)
    assert isinstance(study.trials, pd.DataFrame)
    assert len(study.where(map="pillar").trials) == 6
    done = sweep(folder, "table", "mine", "--csv")
    assert len(done.stdout.splitlines()) == 4
