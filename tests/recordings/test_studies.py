"""A study of a recording is a study: tables, comparisons, figures, replays, packs."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep import load
from sweep.errors import StoreError
from sweep.figures import quantity
from sweep.own_code import load_spec
from sweep.recordings import as_model, open_frames
from sweep.recordings.kept_frames import FRAMES, _sha_of, frames_folder
from sweep.trial import run
from tests.commands import sweep
from tests.recordings.tracks import jobs_of, written

SPEC = """\
study: lab/drives
recording:
  files: [tracks.csv]
  time_step: 0.5
  columns: {event: drive, kind: species}
  gaps: 1
  source: "A. Author (2024), Drives, doi.org/10.1000/1"
fixed: {flock_range: 2}
record:
  metrics: [polarization, flock_radius, polarization_of_sheep]
  series: [polarization]
  trajectories: true
"""
MODEL = """\
study: lab/model
model: strombom2014
fixed: {n: 6, steps: 20}
replicates: 4
record: {metrics: [polarization, flock_radius]}
"""


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with three stored drives, one of which has a gap."""
    folder = tmp_path_factory.mktemp("lab")
    random = np.random.default_rng(1)
    rows = []
    for drive in range(3):
        way = np.cumsum(random.normal(0.3, 0.1, (20 + drive, 6, 2)), axis=0)
        for (frame, animal), (x, y) in zip(
            np.ndindex(way.shape[:2]), way.reshape(-1, 2), strict=True
        ):
            if drive == 1 and animal == 2 and 5 <= frame < 12:
                continue
            kind = "dog" if animal == 5 else "sheep"
            rows.append((animal, frame / 2, x, y, drive, kind))
    written(folder, rows, "id,t,x,y,drive,species")
    (folder / "spec.yaml").write_text(SPEC, encoding="utf-8")
    (folder / "model.yaml").write_text(MODEL, encoding="utf-8")
    for spec in ("spec.yaml", "model.yaml"):
        assert sweep(folder, "launch", spec).returncode == 0
    return folder


def told(lab: Path, *command: str) -> str:
    ended = sweep(lab, *command)
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


def test_a_trial_is_an_event_with_its_own_numbers(lab: Path) -> None:
    told(lab, "export", "lab/drives", "--to", "trials.parquet")
    trials = pd.read_parquet(lab / "trials.parquet")
    assert sorted(trials["steps"]) == [19, 20, 21]
    assert set(trials["n"]) == {6}
    assert set(trials["count_dog"]) == {1}
    assert sorted(trials["absent"] > 0) == [False, False, True]


def test_a_comparison_with_a_model_is_not_paired(lab: Path) -> None:
    text = told(lab, "compare", "lab/drives", "lab/model")
    assert "not paired: the trials of A and B share no random numbers" in text
    (differ,) = (line for line in text.splitlines() if "differ in" in line)
    assert "steps (" in differ
    for idle in ("start_draws", "obstacle_radius", "flock_range", "pixel"):
        assert idle not in differ


def test_ranges_of_one_recording_are_paired_by_event(lab: Path) -> None:
    swept = SPEC.replace("lab/drives", "lab/ranges").replace(
        "fixed: {flock_range: 2}", "sweep: {flock_range: [1, 2]}"
    )
    swept = swept.replace(
        "[polarization, flock_radius, polarization_of_sheep]", "[flock_count]"
    )
    (lab / "ranges.yaml").write_text(swept, encoding="utf-8")
    told(lab, "launch", "ranges.yaml")
    text = told(lab, "compare", "lab/ranges:flock_range=1", "lab/ranges:flock_range=2")
    assert "not paired" not in text


def test_stored_events_are_played_again_bit_for_bit(lab: Path) -> None:
    text = told(lab, "verify", "lab/drives", "--fraction", "1")
    assert "3 of 3 bitwise identical" in text


def test_figures_show_absent_individuals_as_gaps(lab: Path) -> None:
    told(lab, "plot", "lab/drives", "trajectories", "--out", "figures")
    assert (lab / "figures" / "trajectories.png").stat().st_size > 10_000


def test_the_reference_of_the_data_is_cited_and_described(lab: Path) -> None:
    assert "doi.org/10.1000/1" in told(lab, "cite", "lab/drives")
    page = told(lab, "odd", "lab/drives")
    assert "doi.org/10.1000/1" in page
    assert "Velocities are central differences, one-sided at the ends." in page
    assert "| 1 | 6 | 1 | 5 | 21 | 0 % | 5.6 % |" in page
    assert told(lab, "odd", "spec.yaml").splitlines()[0] == page.splitlines()[0]


def test_metrics_of_absent_individuals_need_a_launch(lab: Path) -> None:
    """A trajectory has no number for an absent individual."""
    ended = sweep(lab, "measure", "lab/drives", "flock_count")
    assert "individuals of the recording are absent in some frames" in ended.stderr


def test_a_packed_study_has_its_tables_elsewhere(lab: Path, tmp_path: Path) -> None:
    told(lab, "pack", "lab/drives", "--to", str(tmp_path / "drives.zip"))
    told(tmp_path, "load", "drives.zip")
    assert told(tmp_path, "table", "lab/drives") == told(lab, "table", "lab/drives")


def test_two_recordings_with_equal_settings_are_compared(tmp_path: Path) -> None:
    """Only what the files say differs, or how they are read."""
    rng = np.random.default_rng(5)
    rows = [
        (animal, frame / 10, frame / 10 + u, animal + v, event)
        for event in range(3)
        for animal in range(3)
        for frame, (u, v) in enumerate(rng.normal(0, 0.05, (40, 2)))
    ]
    written(tmp_path, rows, "id,t,x,y,event")
    recording = {"files": ["tracks.csv"], "time_step": 0.1}
    recording |= {"columns": {"event": "event"}, "origin": {"x": -1, "y": -1}}
    for name, smoothing in (("raw", 0), ("smooth", 1)):
        section = recording | {"smoothing": smoothing}
        spec = {"study": f"lab/{name}", "recording": section}
        spec |= {"fixed": {"width": 9, "height": 9}, "record": {"metrics": ["speed"]}}
        (tmp_path / "spec.yaml").write_text(json.dumps(spec), encoding="utf-8")
        told(tmp_path, "launch", "spec.yaml")
    found = told(tmp_path, "compare", "lab/raw", "lab/smooth", "--over", "half")
    assert "speed_mean, B against A: lower at 1 of 1 point" in found
    ended = sweep(tmp_path, "compare", "lab/raw", "lab/raw")
    assert "there is nothing to compare" in ended.stderr


def test_a_study_takes_up_new_events(lab: Path, tmp_path: Path) -> None:
    """Stored events keep their ids."""
    rows = (lab / "tracks.csv").read_text(encoding="utf-8")
    (tmp_path / "spec.yaml").write_text(SPEC, encoding="utf-8")
    (tmp_path / "tracks.csv").write_text(rows, encoding="utf-8")
    sweep(tmp_path, "launch", "spec.yaml")
    more = "".join(f"1,{k / 2},{k},{k},4,sheep\n" for k in range(5))
    (tmp_path / "tracks.csv").write_text(rows + more, encoding="utf-8")
    ended = sweep(tmp_path, "launch", "spec.yaml")
    assert "4 trials, 3 of them stored already" in ended.stderr


def test_frames_that_are_gone_or_damaged_are_read_again(
    lab: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    lost = sweep(lab, "verify", "lab/drives")
    assert "launch the study again where its files are" in lost.stderr
    told(lab, "launch", "spec.yaml")
    assert told(lab, "verify", "lab/drives")
    study = load_spec(lab / "spec.yaml")
    for file in frames_folder().glob(f"*{FRAMES}"):
        content = bytearray(file.read_bytes())
        content[-1] ^= 1
        file.write_bytes(content)
    _sha_of.cache_clear()
    assert "was damaged, and is deleted" in run(jobs_of(study)[0]).error
    assert run(jobs_of(load_spec(lab / "spec.yaml"))[0]).status == "done"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"sha"', '"../../secret"'),
        ('"steps"', "-1"),
        ('"boids"', "1000000"),
        ('"boids"', '"6"'),
        ('"absent"', "NaN"),
        ('"a", ', ""),
        ('"a"', "7"),
    ],
)
def test_facts_of_a_stranger_are_no_path_and_no_length(old: str, new: str) -> None:
    values = {"sha": f'"{"0" * 64}"', "boids": "6", "steps": "20", "absent": "0.5"}

    def text_of(event: str) -> str:
        for name, value in values.items():
            event = event.replace(f'"{name}"', value)
        facts = '"source": "", "length": "m", "time": "s", "dt": 0.1'
        facts += ', "width": 1, "height": 1'
        return f'{{{facts}, "kinds": ["dog", "sheep"], "events": [{event}]}}'

    event = '["drive", "sha", "boids", "steps", [1, 5], 0.0, "absent", '
    event += f"{json.dumps(list('abcdef'))}]"
    assert as_model(text_of(event)).events[0].boids == 6
    with pytest.raises(ValueError, match="not valid"):
        as_model(text_of(event.replace(old, new)))


def test_frames_of_another_size_are_not_played(lab: Path) -> None:
    """The kernel would read beyond the frames."""
    study = load_spec(lab / "spec.yaml")
    event = study.catalogue.models[study.model].events[0]
    with pytest.raises(StoreError, match="has other frames than the study says"):
        open_frames(event._replace(steps=event.steps + 100))


def test_a_mean_leaves_out_frames_without_a_value(tmp_path: Path) -> None:
    """All individuals are absent in one frame, and a mean covers all frames."""
    rows = [
        (animal, k / 2, k * (1 + animal), 0.0, 0, "sheep" if animal else "dog")
        for k in range(9)
        for animal in range(2)
        if k != 6
    ]
    written(tmp_path, rows, "id,t,x,y,drive,species")
    spec = SPEC.replace("gaps: 1", "gaps: 0.5")
    spec = spec.replace("polarization, flock_radius, polarization_of_sheep", "speed")
    spec = spec.replace("series: [polarization]", "series: [speed]")
    (tmp_path / "spec.yaml").write_text(spec, encoding="utf-8")
    result = run(jobs_of(load_spec(tmp_path / "spec.yaml"))[0])
    assert np.isnan(result.series["speed"][6])
    assert result.mean["speed"] == np.nanmean(result.series["speed"])


def test_a_mean_covers_the_whole_event_and_says_so(lab: Path) -> None:
    """A model has a transient, so a mean covers the second half of a trial."""
    drives = load("lab/drives", lab / "results")
    model = load("lab/model", lab / "results")
    assert (drives.averaged, model.averaged) == ("the whole event", "the second half")
    series = drives.series.groupby("trial_id")["polarization"].mean()
    means = drives.trials.set_index("trial_id")["polarization_mean"]
    pd.testing.assert_series_equal(
        means, series[means.index], check_names=False, rtol=1e-14
    )
    columns = drives.columns.set_index("column")["text"]
    assert columns["polarization_mean"].endswith(", mean over the whole event")
    assert quantity(drives, "polarization_mean") == "polarization, whole event"


def test_trials_have_the_names_of_their_events(lab: Path) -> None:
    """The name is a column, and models have no such column."""
    drives = load("lab/drives", lab / "results").trials
    assert drives.set_index("replicate")["event"].sort_index().tolist() == list("012")
    assert "event" not in load("lab/model", lab / "results").trials


def test_a_plan_describes_the_recording(lab: Path) -> None:
    """Wrong columns and units are seen before a launch."""
    said = sweep(lab, "plan", "spec.yaml").stdout
    assert "recording  3 events of 6 individuals, 63 frames of 0.5 s" in said
    assert "0 % interpolated, 1.9 % absent" in said


def test_more_steps_than_the_event_has_are_an_error(lab: Path) -> None:
    """A kernel would read memory beyond the frames."""
    job = jobs_of(load_spec(lab / "spec.yaml"))[0]
    longer = replace(job, settings=job.settings | {"steps": 1000})
    assert "has 19 steps, not 1000" in run(longer).error


def test_a_new_event_that_sorts_first_pairs_no_others(
    lab: Path, tmp_path: Path
) -> None:
    """Replicate k is event k, so the trials after it run again."""
    rows = (lab / "tracks.csv").read_text(encoding="utf-8")
    spec = SPEC.replace("fixed: {flock_range: 2}", "sweep: {flock_range: [1, 2]}")
    spec = spec.replace("flock_radius, polarization_of_sheep", "flock_count")
    (tmp_path / "spec.yaml").write_text(spec, encoding="utf-8")
    (tmp_path / "tracks.csv").write_text(rows, encoding="utf-8")
    sweep(tmp_path, "launch", "spec.yaml")
    before = "".join(f"1,{k / 2},{k},{k},-1,sheep\n" for k in range(5))
    header, _, rest = rows.partition("\n")
    (tmp_path / "tracks.csv").write_text(f"{header}\n{before}{rest}", encoding="utf-8")
    assert sweep(tmp_path, "launch", "spec.yaml").returncode == 0
    trials = load("lab/drives", str(tmp_path / "results")).trials
    assert not trials.duplicated(["point", "replicate"]).any()
    steps = trials.groupby("replicate")["steps"].nunique()
    assert steps.tolist() == [1, 1, 1, 1]
