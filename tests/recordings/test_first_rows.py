"""A spec that begins with a file of tracks."""

import math
from pathlib import Path

import numpy as np
import pytest

from sweep.errors import SpecError
from sweep.own_code import load_spec
from sweep.published import begin_with_recording
from sweep.recordings import survey
from tests.commands import sweep
from tests.recordings.tracks import written

ROWS = [(k, name, k, 2 * k) for k in range(10) for name in ("b", "a")]


def tracks(folder: Path, header: str = "Time,animal,pos_x,pos_y") -> Path:
    rows = [(k / 25, name, x, y) for k, name, x, y in ROWS]
    return written(folder, rows, header)


def test_columns_and_times_are_found(tmp_path: Path) -> None:
    facts = survey(tracks(tmp_path))
    assert facts.columns == {
        "individual": "animal",
        "time": "Time",
        "x": "pos_x",
        "y": "pos_y",
    }
    assert (facts.time_step, facts.is_regular) == (0.04, True)
    assert (facts.rows, facts.individuals) == (20, 2)
    assert (facts.width, facts.height) == (9.0, 18.0)


def test_the_spec_is_a_study_of_the_file(tmp_path: Path) -> None:
    begun = begin_with_recording(tracks(tmp_path), tmp_path / "herd.yaml")
    study = load_spec(begun.path)
    assert study.name == "my/herd"
    assert study.trials_per_point == 1
    assert study.preset_settings["steps"] == 9
    assert study.preset_settings["dt"] == 0.04
    text = begun.path.read_text(encoding="utf-8")
    assert "The first 20 rows have 2 individuals" in text
    for line in ("columns: {individual: animal,", "time_step: 0.04", "gaps: 0"):
        assert f"  {line}" in text


@pytest.mark.parametrize(
    ("header", "length"),
    [
        ("Seconds,Fish,X (cm),Y (cm)", "cm"),
        ("timestamp,individual-local-identifier,easting,northing", "m"),
        ("time_s,track_id,pos_x_mm,pos_y_mm", "mm"),
    ],
)
def test_names_with_units_and_other_signs_are_found(
    header: str, length: str, tmp_path: Path
) -> None:
    begun = begin_with_recording(tracks(tmp_path, header), tmp_path / "herd.yaml")
    study = load_spec(begun.path)
    assert study.preset_settings["dt"] == 0.04
    assert study.catalogue.models[study.model].length == length


def test_irregular_times_and_other_delimiters_are_found(tmp_path: Path) -> None:
    file = tmp_path / "t.csv"
    rows = "".join(f"a;{time};1;1\n" for time in (0, 0.11, 0.2, 0.3, 0.4))
    file.write_text(f"id;t;x;y\n{rows}", encoding="utf-8")
    facts = survey(file)
    assert (facts.delimiter, facts.is_regular) == ("semicolon", False)
    assert load_spec(begin_with_recording(file).path).trials_per_point == 1


@pytest.mark.parametrize("x", ["x{}", "x_{}", "{}_x", "{}.x"])
def test_columns_of_each_individual_are_found(x: str, tmp_path: Path) -> None:
    names = [form.format(fish) for fish in (1, 2) for form in (x, x.replace("x", "y"))]
    file = tmp_path / "trajectories.csv"
    rows = "".join(f"{t / 25},1,2,{t},4\n" for t in range(5))
    file.write_text(f"time,{','.join(names)}\n{rows}", encoding="utf-8")
    assert survey(file).individuals == 2
    study = load_spec(begin_with_recording(file).path)
    (event,) = study.catalogue.models[study.model].events
    assert (event.individuals, event.steps) == (("1", "2"), 4)


def test_a_file_of_movebank_is_projected(tmp_path: Path) -> None:
    file = tmp_path / "storks.csv"
    file.write_text(
        "event-id,timestamp,location-long,location-lat,individual-local-identifier\n"
        "1,2014-05-01 06:00:00.000,9.0,47.0,Ada\n"
        "2,2014-05-01 06:01:00.000,9.0,47.01,Ada\n",
        encoding="utf-8",
    )
    study = load_spec(begin_with_recording(file).path)
    assert study.preset_settings["dt"] == 60.0
    assert study.preset_settings["height"] == math.ceil(1111.8)
    assert study.catalogue.models[study.model].events[0].individuals == ("Ada",)


def test_numbers_of_frames_leave_the_time_step_to_the_user(tmp_path: Path) -> None:
    file = written(tmp_path, ROWS, "frame,id,x,y")
    assert survey(file).time_step is None
    with pytest.raises(SpecError, match='missing key "time_step"'):
        load_spec(begin_with_recording(file).path)


def test_rounded_times_of_a_camera_have_its_frame_rate(tmp_path: Path) -> None:
    rows = [("a", round(k / 30, 2), k, 1) for k in range(300)]
    facts = survey(written(tmp_path, rows))
    assert facts.time_step == pytest.approx(1 / 30, rel=1e-11)
    assert not facts.is_regular


def test_bursts_and_gaps_leave_the_usual_time_between_two_rows(tmp_path: Path) -> None:
    """A collar that records each minute sends a few rows in a second, and some late."""
    passed = ([60] * 20 + [1, 1, 1, 300]) * 10
    clock = np.cumsum(passed).tolist()
    facts = survey(written(tmp_path, [("a", t, k, 1) for k, t in enumerate(clock)]))
    assert facts.time_step == 60.0


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("t,id,x,height", "no column has a usual name of y; the columns are t, id, x"),
        ("clock,id,x,y", "no column has a usual name of time"),
    ],
)
def test_unusual_columns_are_an_error(
    header: str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(SpecError, match=message):
        begin_with_recording(tracks(tmp_path, header))
    assert not [*tmp_path.glob("*.yaml")]


def test_the_command_writes_the_spec_once(tmp_path: Path) -> None:
    file = tracks(tmp_path)
    command = ("init", "herd.yaml", "--recording", file.name)
    first = sweep(tmp_path, *command)
    assert first.returncode == 0
    assert "study my/herd, from" in first.stderr
    assert "exists" in sweep(tmp_path, *command).stderr
    assert sweep(tmp_path, *command, "--force").returncode == 0
    both = sweep(tmp_path, *command, "--model", "vicsek1995")
    assert "--model and --recording exclude each other" in both.stderr
