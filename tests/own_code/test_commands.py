"""Every command takes a study with own code as it takes one without."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import sweep as boidsweep
from sweep.errors import SpecError
from sweep.methods.adaptive import stopping
from sweep.methods.search.strategy import search
from sweep.tables.stored_study import StoredStudy
from sweep.trial.simulation import Simulation
from sweep.web.replaying import Replay
from sweep.web.session import Session
from sweep.web.state import from_job, from_study
from sweep.workers.executors import Serial
from tests.commands import sweep
from tests.own_models import OTHER_RULE, SPEC, edited, written
from tests.studies import SMALL, launched, read, relaunch

AXIS = "sweep: {cohesion_weight: [0.01, 0.02]}"
UNTIL = SPEC.replace(
    "replicates: 3",
    "replicates: {until: {metric: rightwards, half_width: 0.4}, min: 3, max: 9}",
)
ABLATED = SPEC.replace(AXIS, "sweep: {detail: {ablate: as_written}}")
SAMPLED = SPEC.replace(
    AXIS,
    "sweep: {both: {sample: saltelli, points: 8, cohesion_weight: {uniform: [0, 1]},"
    " max_speed: {uniform: [2, 4]}}}",
).replace("replicates: 3", "replicates: 1")
SOUGHT = SPEC.replace(
    AXIS,
    """search:
  parameters: {cohesion_weight: {uniform: [0, 1]}}
  objectives: {rightwards: {minimize: mean}}
  budget: 12
  batch: 3
  held_out: {candidates: 1, replicates: 3}""",
)
FLOWN = SPEC.replace("every: 2", "every: 1, trajectories: true, heatmaps: true")


def said(folder: Path, *arguments: str, code: int = 0) -> str:
    """What a command prints, which must end with a code."""
    done = sweep(folder, *arguments)
    assert done.returncode == code, done.stderr
    return done.stdout + done.stderr


@pytest.fixture
def flown(tmp_path: Path) -> StoredStudy:
    """A study with trajectories and heatmaps."""
    return launched(written(tmp_path, spec=FLOWN), tmp_path / "results")


def test_trials_are_added_until_an_interval_is_narrow(tmp_path: Path) -> None:
    spec = written(tmp_path, spec=UNTIL)
    assert "6 to 18 (3 to 9 per point" in said(tmp_path, "plan", "drawn.yaml")
    study = launched(spec, tmp_path / "results")
    assert stopping(study)["n"].min() > 3
    assert "nothing was missing" in said(tmp_path, "launch", "drawn.yaml")
    edited(tmp_path, *OTHER_RULE)
    assert "0 of them stored already" in said(tmp_path, "launch", "drawn.yaml")


def test_a_preset_is_ablated(tmp_path: Path) -> None:
    study = launched(written(tmp_path, spec=ABLATED), tmp_path / "results")
    details = set(study.points["detail"])
    assert details == {"", "swirl_weight"}
    table = said(tmp_path, "table", "drawn", "--csv")
    assert all(detail in table for detail in details)
    assert "curves" in said(tmp_path, "plot", "drawn")


def test_a_sample_has_its_sensitivity(tmp_path: Path) -> None:
    launched(written(tmp_path, spec=SAMPLED), tmp_path / "results")
    drawn = said(tmp_path, "plot", "drawn", "sensitivity", "parallel")
    assert "sensitivity" in drawn
    assert (tmp_path / "results" / "drawn" / "figures").is_dir()


def test_a_search_goes_on_and_begins_anew_with_another_rule(tmp_path: Path) -> None:
    spec = written(tmp_path, spec=SOUGHT)
    first = search(read(spec), tmp_path / "results", Serial())
    assert first.statuses == {"done": 15}
    assert not search(read(spec), tmp_path / "results", Serial()).statuses
    assert "held out" in said(tmp_path, "search", "drawn.yaml")
    edited(tmp_path, *OTHER_RULE)
    again = search(read(spec), tmp_path / "results", Serial())
    assert again.statuses.total() > 12
    assert "history" in said(tmp_path, "plot", "drawn", "history")


def test_stored_trials_are_shown_exported_and_drawn(flown: StoredStudy) -> None:
    folder = flown.store.folder.parent.parent
    trial = flown.plan["trial_id"][0].as_py()
    verified = said(folder, "verify", "drawn", "--fraction", "1")
    assert "6 of 6 bitwise identical" in verified
    shown = said(folder, "replay", "drawn", trial, "--animate", "flight.gif")
    assert "identical to the stored values" in shown
    assert (folder / "flight.gif").stat().st_size > 0
    assert "coverage.png" in said(folder, "plot", "drawn", "coverage", "trajectories")
    for name in ("rows.csv", "rows.nc", "rows.parquet"):
        said(folder, "export", "drawn", "--to", name)
    sides = [f"drawn:cohesion_weight={value}" for value in (0.01, 0.02)]
    assert "rightwards (px/step)" in said(folder, "compare", *sides)
    assert "done      6" in said(folder, "status", "drawn")


def test_diff_says_which_code_has_changed_before_anything_runs(tmp_path: Path) -> None:
    launched(written(tmp_path), tmp_path / "results")
    assert "6 of the planned trials, 0 to run" in said(tmp_path, "diff", "drawn.yaml")
    edited(tmp_path, *OTHER_RULE)
    shown = said(tmp_path, "diff", "drawn.yaml")
    assert "the code has changed (model drawn as_run)" in shown
    assert "0 of the planned trials, 6 to run" in shown
    assert "model" not in said(tmp_path, "diff", "drawn.yaml", "drawn.yaml")


def frames(session: Session) -> Iterator[np.ndarray]:
    """The frames of a session from here to its end."""
    yield session.bodies
    session.run()
    while session.going:
        yield from session.advance(4).bodies


def test_a_view_has_the_frames_of_the_launch_and_its_spec_can_be_launched(
    flown: StoredStudy,
) -> None:
    folder = flown.store.folder.parent.parent
    trial = flown.plan["trial_id"][0].as_py()
    _, stored = flown.trajectory(trial)
    session = Session(from_study(read(folder / "drawn.yaml")))
    np.testing.assert_array_equal(list(frames(session)), stored)
    assert session.exact
    assert session.state.plots == ("rightwards", "speed")
    copy = folder / "copy.yaml"
    copy.write_text(session.state.as_text())
    again = launched(copy, folder / "again")
    assert again.plan["trial_id"].to_pylist() == flown.plan["trial_id"].to_pylist()
    np.testing.assert_array_equal(again.trajectory(trial)[1], stored)


def test_the_page_goes_from_an_own_model_to_ours_and_back(tmp_path: Path) -> None:
    session = Session(from_study(read(written(tmp_path))))
    session.choose("drawn", "as_written")
    assert session.state.job.settings["swirl_weight"] == 0.01
    session.choose("nguyen2024", "as_run")
    session.choose("drawn", "as_run")
    session.change({"n": 12, "steps": 9, "map": "pillar"})
    assert "./places.py:pillar" in session.state.as_text()
    assert len(list(frames(session))) == 10


def test_a_file_stands_for_its_model_where_a_model_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path)
    assert "cohesion_weight" in said(tmp_path, "models", "./drawn.py")
    refused = said(tmp_path, "models", "./drawn.py", "--no-code", code=2)
    assert 'runs code from "./drawn.py"; no code may run' in refused
    assert 'unknown model "drawn"' in said(tmp_path, "models", "drawn", code=2)
    monkeypatch.chdir(tmp_path)
    view = boidsweep.view("./drawn.py", "as_written", n=5)
    assert "model: ./drawn.py" in view.spec
    with pytest.raises(SpecError, match="no file"):
        boidsweep.view("./nowhere.py")


def test_an_old_trial_is_viewed_by_the_code_that_computed_it(
    flown: StoredStudy,
) -> None:
    """Also when the file says otherwise now, and when it is gone."""
    folder = flown.store.folder.parent.parent
    trial = flown.plan["trial_id"][0].as_py()
    _, stored = flown.trajectory(trial)
    edited(folder, *OTHER_RULE)
    for command in (["replay", "drawn", trial], ["verify", "drawn"]):
        assert "rules.py: another file now" in said(folder, *command)
    (folder / "drawn.py").unlink()
    simulation = Simulation(flown.job(flown.trial(trial)))
    session = Session(from_job(simulation.job))
    np.testing.assert_array_equal(list(frames(session)), stored)
    show = Replay(flown, trial)
    while show.going:
        show.advance(3)
    assert "identical to the stored values" in said(folder, "replay", "drawn", trial)


def test_spec_and_code_are_laid_out_to_launch_on(tmp_path: Path) -> None:
    """After an edit, of which the earlier version lies apart."""
    home = tmp_path / "home"
    spec = written(home)
    launched(spec, home / "results")
    edited(home, *OTHER_RULE)
    relaunch(spec, home / "results")
    done = sweep(home, "code", "drawn", "--to", "work")
    assert done.stderr == "sweep launch work/spec.yaml resumes the study\n"
    lines = done.stdout.splitlines()
    names = ["drawn.py", "mine.py", "places.py", "rules.py"]
    assert lines[:5] == [f"work/{name}" for name in ("spec.yaml", *names)]
    [version] = {Path(line).parent.name for line in lines[5:]}
    old, new = OTHER_RULE
    assert new in (home / "work" / "rules.py").read_text()
    assert old in (home / "work" / version / "rules.py").read_text()
    for name in names:
        assert (home / "work" / name).read_text() == (home / name).read_text()
    trials = StoredStudy("drawn", home / "results").plan["trial_id"].to_pylist()
    assert "nothing was missing" in said(home, "launch", "work/spec.yaml")
    within = said(home / "work", "launch", "spec.yaml", "--results", "../results")
    assert "nothing was missing" in within
    again = StoredStudy("drawn", home / "results").plan["trial_id"].to_pylist()
    assert again == trials


def test_a_packed_study_is_laid_out_under_another_name(tmp_path: Path) -> None:
    launched(written(tmp_path / "home"), tmp_path / "home" / "results")
    said(tmp_path / "home", "pack", "drawn")
    file = str(tmp_path / "home" / "drawn.zip")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "drawn.py").write_text("mine")
    assert "exists already" in said(tmp_path, "load", file, "--to=taken", code=2)
    assert not (tmp_path / "results").exists()
    shown = said(tmp_path, "load", file, "--as", "their/own", "--to", "work")
    assert shown.endswith("sweep launch work/spec.yaml resumes the study\n")
    assert "study: their/own" in (tmp_path / "work" / "spec.yaml").read_text()
    assert "nothing was missing" in said(tmp_path, "launch", "work/spec.yaml")
    loaded = boidsweep.unpack(file, "other", tmp_path / "there", to=tmp_path / "mine")
    assert (tmp_path / "mine" / "drawn.py").is_file()
    assert loaded.name == "other"


def test_code_from_another_folder_is_laid_out_there(tmp_path: Path) -> None:
    home = tmp_path / "home"
    written(home)
    inner = home / "specs"
    inner.mkdir()
    text = (home / "drawn.yaml").read_text()
    (inner / "drawn.yaml").write_text(text.replace("./", "../"))
    launch = ("launch", "specs/drawn.yaml", "--code-from", ".")
    said(home, *launch)
    shown = sweep(home, "code", "drawn", "--to", "work")
    assert shown.stdout.startswith("work/specs/spec.yaml\nwork/drawn.py\n")
    on = "launch work/specs/spec.yaml --code-from work"
    assert shown.stderr == f"sweep {on} resumes the study\n"
    assert "nothing was missing" in said(home, *on.split())


def test_a_study_without_code_of_its_own_is_laid_out_as_its_spec(
    tmp_path: Path,
) -> None:
    launched(SMALL, tmp_path / "results")
    done = sweep(tmp_path, "code", "small", "--to", "work")
    assert done.stdout == "work/spec.yaml\n"
    assert "nothing was missing" in said(tmp_path, "launch", "work/spec.yaml")
