"""What a change of a spec does is told exactly: the same as a launch of it finds."""

import json
from pathlib import Path
from typing import Any

import pytest

from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.study import Study, parse_spec
from sweep.tables.spec_difference import Change, Overlap, compare
from tests import ROOT
from tests.commands import sweep
from tests.searches import TINY
from tests.studies import SMALL, launched, relaunch


def spec(*changes: tuple[str, str]) -> Study:
    """The small study with some texts replaced."""
    text = SMALL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return parse_spec(text)


CASES: list[tuple[tuple[str, str], Overlap, Overlap]] = [
    (("replicates: 3", "replicates: 5"), Overlap(0, 2, 0), Overlap(4, 6, 0)),
    (("replicates: 3", "replicates: 2"), Overlap(0, 2, 0), Overlap(0, 4, 2)),
    (("[0.5, 1]", "[1, 2, 3]"), Overlap(2, 1, 1), Overlap(6, 3, 3)),
    (("[0.5, 1]", "[1, 0.5]"), Overlap(0, 2, 0), Overlap(0, 6, 0)),
    (("steps: 9", "steps: 10"), Overlap(2, 0, 2), Overlap(6, 0, 6)),
    (("seed: 5", "seed: 6"), Overlap(0, 2, 0), Overlap(6, 0, 6)),
    (("every: 2", "every: 3"), Overlap(0, 2, 0), Overlap(6, 0, 6)),
    (("series: [speed]", "metrics: [speed]"), Overlap(0, 2, 0), Overlap(0, 6, 0)),
    (("every: 2", "every: 2, heatmaps: true"), Overlap(0, 2, 0), Overlap(6, 0, 6)),
]


@pytest.mark.parametrize(("change", "points", "trials"), CASES)
def test_it_counts_what_is_added_kept_and_dropped_as_a_launch_does(
    tmp_path: Path, change: tuple[str, str], points: Overlap, trials: Overlap
) -> None:
    stored = launched(SMALL, tmp_path)
    for before in (stored, spec()):
        made = compare(before, spec(change), tmp_path)
        assert (made.points, made.trials) == (points, trials)
        assert (made.stored, made.to_run) == (trials.common, trials.added)
    progress = relaunch(spec(change).text, tmp_path)
    assert (progress.missing, progress.stored, progress.apart) == (
        trials.added,
        trials.common,
        trials.dropped,
    )


def test_it_names_the_keys_that_changed_with_both_values() -> None:
    changed = spec(
        ("steps: 9", "steps: 10, drag: 0.5"),
        ("replicates: 3", "seeds: [1, 2]"),
        ("[0.5, 1]", "[0.5]"),
    )
    made = compare(spec(), changed, Path("nowhere"))
    assert made.changes == (
        Change("fixed.steps", 9, 10),
        Change("fixed.drag", None, 0.5),
        Change("sweep.separation_weight", [0.5, 1], [0.5]),
        Change("replicates", 3, None),
        Change("seeds", None, [1, 2]),
    )
    text = made.as_text()
    assert "changed    fixed.drag: - -> 0.5" in text
    assert "changed    sweep.separation_weight: [0.5, 1] -> [0.5]" in text
    assert json.loads(made.as_json())["trials"] == {"added": 2, "kept": 0, "dropped": 6}


def test_comments_and_layout_change_nothing() -> None:
    made = compare(spec(), spec(("seed: 5", "seed: 5   # as agreed")), Path("nowhere"))
    assert (made.changes, made.notes, made.trials) == ((), (), Overlap(0, 6, 0))


def test_what_is_stored_already_counts_though_another_spec_was_launched_last(
    tmp_path: Path,
) -> None:
    relaunch(SMALL, tmp_path)
    stored = launched(spec(("[0.5, 1]", "[2]")).text, tmp_path)
    made = compare(stored, spec(), tmp_path)
    assert (made.trials, made.stored, made.to_run) == (Overlap(6, 0, 3), 6, 0)


def test_another_study_takes_no_trial_along(tmp_path: Path) -> None:
    launched(SMALL, tmp_path)
    made = compare(spec(), spec(("study: small", "study: other")), tmp_path)
    assert (made.trials, made.stored) == (Overlap(0, 6, 0), 0)
    assert "other has a separate folder and uses no trial of small" in made.as_text()


def test_changed_kernels_and_tables_are_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = SMALL.replace(
        "separation_weight: [0.5, 1]", "j: {sample: table, file: t.csv}"
    )
    table = tmp_path / "t.csv"
    table.write_text("drag\n0.1\n")
    first = parse_spec(text, tmp_path / "spec.yaml")
    table.write_text("drag\n0.1\n0.2\n")
    made = compare(first, parse_spec(text, tmp_path / "spec.yaml"), tmp_path)
    assert made.trials == Overlap(3, 3, 0)
    assert "a table or an image has changed" in made.notes[0]
    stored = launched(SMALL, tmp_path)
    monkeypatch.setattr("kernels.identity._flight_stamp", lambda: "other code")
    made = compare(stored, spec(), tmp_path)
    assert made.trials == Overlap(6, 0, 6)
    assert "the code has changed (the flight)" in made.notes[0]


def test_a_study_that_stops_by_itself_is_counted_at_its_most() -> None:
    until = "replicates: {until: {metric: speed, half_width: 0.5}, min: 3, max: 20}"
    made = compare(spec(), spec(("replicates: 3", until)), Path("nowhere"))
    assert made.trials == Overlap(34, 6, 0)
    assert "trials are counted at the maximum" in made.notes[0]


def test_what_a_search_would_add_is_not_known(tmp_path: Path) -> None:
    with pytest.raises(
        SpecError, match=r"spec\.yaml:\d+: \"search\" chooses trials during the run"
    ):
        compare(spec(), parse_spec(TINY), tmp_path)


@pytest.mark.slow
def test_a_hundred_thousand_points_are_compared_by_their_ids() -> None:
    axis = (
        "gains: {sample: random, points: 50000, separation_weight: {uniform: [0, 1]},"
        " drag: {uniform: [0, 1]}}"
    )
    more = axis.replace("50000", "60000")
    old = "separation_weight: [0.5, 1]"
    made = compare(spec((old, axis)), spec((old, more)), Path("nowhere"))
    assert (made.points, made.trials) == (
        Overlap(10_000, 50_000, 0),
        Overlap(30_000, 150_000, 0),
    )


def diff(folder: Path, *arguments: str) -> Any:
    return sweep(folder, "diff", *arguments)


def test_the_command_takes_one_spec_or_two(tmp_path: Path) -> None:
    launched(SMALL, tmp_path / "results")
    (tmp_path / "a.yaml").write_text(SMALL)
    (tmp_path / "b.yaml").write_text(SMALL.replace("replicates: 3", "replicates: 4"))
    two = diff(tmp_path, "a.yaml", "b.yaml")
    assert two.returncode == 0, two.stderr
    assert "trials     2 added, 6 kept, 0 dropped" in two.stdout
    one = json.loads(diff(tmp_path, "b.yaml", "--json").stdout)
    assert one["first"] == "small, as last launched"
    assert one["trials"] == {"added": 2, "kept": 6, "dropped": 0}
    (tmp_path / "b.yaml").write_text(SMALL.replace("study: small", "study: other"))
    unknown = diff(tmp_path, "b.yaml")
    assert unknown.returncode == 2
    assert "no study has been launched here" in unknown.stderr


OWN = """
study: own
model: ./vortex.py
preset: standard
fixed: {n: 12, steps: 9}
replicates: 3
seed: 5
record: {metrics: [./gain.py]}
"""
GAIN = """
from kernels.jit import jit
from kernels.metrics import Metric

@jit
def measure(frames, filled, ground, observation, values):
    for f in range(filled):
        values[f] = frames.bodies[f, 0, 0]

METRIC = Metric(measure, "length", "x of the first boid", "made up for a test")
METRICS = {"gain": METRIC}
"""


@pytest.mark.parametrize(
    ("edits", "notes"),
    [
        ([], []),
        (
            [("vortex.py", 'name="vortex"', 'name="swirl"')],
            ["model vortex -> swirl"],
        ),
        (
            [
                ("vortex.py", 'name="vortex"', 'name="swirl"'),
                (
                    "vortex.py",
                    "robot.cohesion_weight *",
                    "2 * robot.cohesion_weight *",
                ),
            ],
            ["model vortex is gone, model swirl is new"],
        ),
        ([("gain.py", '"gain":', '"win":')], ["metric gain -> win"]),
        (
            [("gain.py", "METRICS = {", 'METRICS = {"more": METRIC, ')],
            ["metric more is new"],
        ),
        (
            [
                ("vortex.py", '"standard"', '"other"'),
                ("spec.yaml", "standard", "other"),
            ],
            [],
        ),
    ],
)
def test_own_code_with_other_names_is_said(
    tmp_path: Path, edits: list[tuple[str, str, str]], notes: list[str]
) -> None:
    """Also where only a name differs, so that the spec and all stamps are the same."""
    model = (ROOT / "examples" / "vortex.py").read_text()
    files = {"vortex.py": model, "gain.py": GAIN, "spec.yaml": OWN}
    before = own_study(tmp_path, files)
    for file, old, new in edits:
        assert old in files[file]
        files[file] = files[file].replace(old, new)
    made = compare(before, own_study(tmp_path, files), tmp_path)
    said = [note for note in made.notes if not note.startswith("the code has changed")]
    wanted = [
        f"custom code has new names ({note}): trials with these names run again"
        for note in notes
    ]
    assert said == wanted
    assert (made.trials.added > 0) == bool(edits)


def own_study(folder: Path, files: dict[str, str]) -> Study:
    """The study of a spec with files of its own, as they are."""
    for file, text in files.items():
        (folder / file).write_text(text)
    return load_spec(folder / "spec.yaml")
