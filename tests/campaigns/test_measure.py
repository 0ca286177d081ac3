"""`sweep measure`: further metrics of stored trials are, to the last bit, what a launch
that records them stores, or they are refused and nothing is stored.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from kernels.catalogue import BUILT_IN
from kernels.metrics import METRICS
from sweep.campaigns import campaign
from sweep.campaigns.launching import launch
from sweep.campaigns.measuring import MeasuredStudy, measure
from sweep.errors import ChoiceError, CodeError, SpecError, StoreError
from sweep.methods.adaptive import stopping
from sweep.methods.search.asked_trials import read_asked
from sweep.replays.verifying import verify
from sweep.spec.adding import with_metrics
from sweep.spec.built_in import EXPERIMENTS
from sweep.spec.recorded import lacks
from sweep.spec.strict_yaml import parse_document, read_documents
from sweep.store.buckets import Bucket
from sweep.store.folders import Folder
from sweep.store.locations import Location
from sweep.store.lock import Lock
from sweep.store.manifest import table_names
from sweep.store.parquet import load_table
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.tables.cleaning import clean, find_waste
from sweep.tables.stored_study import StoredStudy
from sweep.trial.remeasuring import what_lacks
from sweep.workers.executors import Serial
from tests import oscillators
from tests.cases import slow_but
from tests.commands import sweep
from tests.own_models import edited, written
from tests.searches import TINY, searched
from tests.store.test_whole_studies import in_memory
from tests.studies import (
    SMALL,
    launched,
    numbers,
    read,
    relaunch,
    share_of_each_point,
)

KEPT = "record: {series: [speed], every: 2}"
assert KEPT in SMALL
STUDIED = sorted(
    {
        path.relative_to(EXPERIMENTS).parts[0]
        for path in EXPERIMENTS.rglob("*.yaml")
        if path.name != "published.yaml"
    }
)
FLOWN = "record: {metrics: [speed], every: 2, trajectories: true}"
MODELS = {
    "nguyen2024": "fixed: {n: 12, steps: 9, n_obstacles: 2}",
    "patel2023": "fixed: {n: 12, steps: 9}",
}


def flown(text: str = SMALL, record: str = FLOWN) -> str:
    return text.replace(KEPT, record)


def more(text: str, *metrics: str) -> str:
    """A spec of `flown` that records these metrics too."""
    return text.replace("metrics: [speed]", f"metrics: [speed, {', '.join(metrics)}]")


def measured(results: Path, *asked: str, study: str = "small") -> MeasuredStudy:
    return measure(study, asked, results, Serial())


def check_same(one: StoredStudy, other: StoredStudy) -> None:
    """Every bit of every table, whatever the order of columns; and the ids."""
    for mine, theirs in zip(numbers(one), numbers(other), strict=True):
        assert set(mine.columns) == set(theirs.columns)
        pd.testing.assert_frame_equal(mine[theirs.columns], theirs, check_exact=True)
    for name in ("trajectories", "heatmaps"):
        mine, theirs = (getattr(study, name) for study in (one, other))
        pd.testing.assert_frame_equal(mine, theirs, check_exact=True)
    assert one.trials["trial_id"].equals(other.trials["trial_id"])
    assert set(one.metrics) == set(other.metrics)
    assert one.units == other.units


def of_model(model: str, every: int) -> str:
    return (
        flown(record=FLOWN.replace("every: 2", f"every: {every}"))
        .replace("model: nguyen2024", f"model: {model}")
        .replace("fixed: {n: 12, steps: 9}", MODELS[model])
        .replace("replicates: 3", "replicates: 1")
    )


@pytest.mark.parametrize(
    ("model", "every"),
    slow_but(
        [("nguyen2024", 1)], [("nguyen2024", 1), ("nguyen2024", 2), ("patel2023", 1)]
    ),
)
def test_each_metric_is_that_of_a_launch_to_the_last_bit_or_refused(
    tmp_path: Path, model: str, every: int
) -> None:
    here, spec = tmp_path / "here", of_model(model, every)
    before = launched(spec, here)
    fit = [
        name
        for name, metric in METRICS.items()
        if not lacks(BUILT_IN.models[model], metric)
    ]
    refused = [name for name in fit if what_lacks(METRICS[name], every)]
    assert {name for name in fit if not METRICS[name].looks} <= set(refused)
    assert ("turn_rate" in refused) == (every == 2)
    for name in refused:
        with pytest.raises(ChoiceError, match=f"{name} needs .*: add {name} under"):
            measured(here, name)
    assert StoredStudy("small", here).plan.equals(before.plan, check_metadata=True)
    wanted = [name for name in fit if name not in (*refused, "speed")]
    done = measured(here, *wanted)
    assert (done.metrics, done.measured, done.left) == (wanted, 2, 0)
    after = StoredStudy("small", here)
    check_same(after, launched(more(spec, *wanted), tmp_path / "there"))
    assert relaunch(more(spec, *wanted), here).missing == 0


def test_what_is_measured_is_verified_cleaned_and_served(tmp_path: Path) -> None:
    launched(flown(), tmp_path)
    measured(tmp_path, "polarization", "flock_radius")
    study = StoredStudy("small", tmp_path)
    assert study.apart() == 6
    found = verify(study, Serial(), fraction=1.0)
    assert (found.same, found.checked) == (True, {"done": 6})
    clean(study, find_waste(study))
    study = StoredStudy("small", tmp_path)
    assert study.statuses() == {"done": 6}
    assert len(study.store.trial_ids()) == 6
    assert study.store.trial_ids().keys() == set(study.trials["trial_id"])
    fewer = relaunch(more(flown(), "flock_radius"), tmp_path)
    assert (fewer.missing, fewer.stored) == (0, 6)
    assert "polarization" not in StoredStudy("small", tmp_path).trials


def test_expressions_are_of_frames_or_of_series(tmp_path: Path) -> None:
    record = "record: {metrics: [speed], series: [escapes], every: 2"
    spec = flown(record=f"{record}, trajectories: true}}")
    launched(spec, tmp_path / "here")
    asked = ("gain = polarization / speed", "both = escapes * gain")
    assert measured(tmp_path / "here", *asked).metrics == [
        "polarization",
        "gain",
        "both",
    ]
    derive = "derive: {gain: polarization / speed, both: escapes * gain}"
    there = launched(
        spec.replace("every: 2,", f"every: 2, {derive},"), tmp_path / "there"
    )
    check_same(StoredStudy("small", tmp_path / "here"), there)
    with pytest.raises(ChoiceError, match="needs escapes, collisions or arrivals"):
        measured(tmp_path / "here", "hits = collisions + 1")
    with pytest.raises(ChoiceError, match="gain is recorded already: choose another"):
        measured(tmp_path / "here", "gain = speed")
    with pytest.raises(ChoiceError, match="speed: recorded already, see `sweep table`"):
        measured(tmp_path / "here", asked[0])
    relaunch(spec, tmp_path / "here")  # its trials are listed without it again
    again = measured(tmp_path / "here", asked[0])
    assert again.metrics == ["polarization", "gain"]
    series = spec.replace("trajectories: true", "heatmaps: false")
    launched(series, tmp_path / "series")
    assert measured(tmp_path / "series", "left = 1 - escapes").measured == 6
    with pytest.raises(ChoiceError, match="dispersion needs trajectories, and the"):
        measured(tmp_path / "series", "dispersion")


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("polarisation", 'unknown metric "polarisation"'),
        ("potential", "a model with a pair potential"),
        ("gain = speed /", "gain"),
        ("speed", "speed: recorded already"),
        ("speed2 = n + 1", "contains no metric"),
    ],
)
def test_what_cannot_be_measured_is_refused(
    tmp_path: Path, asked: str, said: str
) -> None:
    before = launched(flown(), tmp_path)
    with pytest.raises(ChoiceError, match=said):
        measured(tmp_path, asked)
    after = StoredStudy("small", tmp_path)
    assert after.plan.equals(before.plan, check_metadata=True)
    assert after.store.trial_ids() == before.store.trial_ids()


OWN = FLOWN.replace("metrics: [speed]", "metrics: [./mine.py, speed]")
UNFIT = '''"""Metrics of one's own that need more than frames have."""

from kernels.jit import jit
from kernels.metrics import Metric
from kernels.recording import FIRST_EVENT


@jit
def turned(frames, filled, ground, observation, values):
    """Boids that have turned about."""
    for f in range(filled):
        values[f] = 0.0
        for i in range(frames.bodies.shape[2]):
            ahead = frames.bodies[f, 2, i] * frames.bodies[f, 4, i]
            ahead += frames.bodies[f, 3, i] * frames.bodies[f, 5, i]
            values[f] += ahead < 0.0


@jit
def left(frames, filled, ground, observation, values):
    """Reads a count, and does not say so."""
    for f in range(filled):
        values[f] = frames.counts[f, FIRST_EVENT] > 5


@jit
def idle(frames, filled, ground, observation, values):
    """Writes nothing."""


@jit
def together(frames, filled, ground, observation, values):
    """The number of frames."""
    values[:filled] = filled


@jit
def broken(frames, filled, ground, observation, values):
    """Raises."""
    raise ValueError("cannot be")


METRICS = {
    one.__name__: Metric(one, "", "of a test", "a test")
    for one in (turned, left, idle, together, broken)
}
'''


def test_a_metric_of_ones_own_joins_a_study_without_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.yaml").write_text(flown())
    here = tmp_path / "here"
    launched(tmp_path / "small.yaml", here)
    assert measured(here, "./mine.py:rightwards").metrics == ["rightwards"]
    study = StoredStudy("small", here)
    assert "record: {metrics: [speed, ./mine.py:rightwards], every: 2" in study.spec
    assert (here / "small" / "spec.yaml").read_text() == study.spec
    (tmp_path / "small.yaml").write_text(study.spec)
    assert relaunch(tmp_path / "small.yaml", here).missing == 0
    check_same(
        StoredStudy("small", here),
        launched(tmp_path / "small.yaml", tmp_path / "there"),
    )
    assert verify(StoredStudy("small", here), Serial(), fraction=1.0).same


@pytest.mark.slow
def test_a_metric_of_ones_own_joins_other_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file that the study has must be the one of then."""
    before = "record: {metrics: [./mine.py], series: [speed, rightwards], every: 2}"
    spec = written(tmp_path)
    spec.write_text(spec.read_text().replace(before, OWN))
    further = tmp_path / "further.py"
    further.write_text((tmp_path / "mine.py").read_text().replace("wards", "most"))
    monkeypatch.chdir(tmp_path)
    here = tmp_path / "here"
    launched(spec, here)
    both = 'METRICS["other"] = METRICS["rightmost"]'
    further.write_text(f"{further.read_text()}\n{both}\n")
    asked = ("./further.py:rightmost", "polarization", "./further.py:other")
    found = measured(here, *asked, study="drawn").metrics
    assert found == ["polarization", "rightmost", "other"]
    study = StoredStudy("drawn", here)
    spec.write_text(study.spec)
    assert relaunch(spec, here).missing == 0
    check_same(StoredStudy("drawn", here), launched(spec, tmp_path / "there"))
    assert verify(study, Serial(), fraction=1.0).same
    (tmp_path / "mine.py").write_text("# other words\n" + further.read_text())
    with pytest.raises(CodeError, match=r"mine.py has changed since the study"):
        measured(here, "./mine.py", study="drawn")
    elsewhere = tmp_path.parent / f"{tmp_path.name}-elsewhere.py"
    further.rename(elsewhere)
    with pytest.raises(CodeError, match="is outside"):
        measured(here, str(elsewhere), study="drawn")
    with pytest.raises(CodeError, match=r'there is no file "lost.py"'):
        measured(here, "./lost.py", study="drawn")


@pytest.mark.parametrize("name", ["turned", "left", "idle"])
def test_a_metric_that_needs_more_and_does_not_say_so_is_found_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / "unfit.py").write_text(UNFIT)
    (tmp_path / "small.yaml").write_text(flown())
    monkeypatch.chdir(tmp_path)
    before = launched(tmp_path / "small.yaml", tmp_path)
    with pytest.raises(ChoiceError, match=f"{name} needs more than trajectories have"):
        measured(tmp_path, f"./unfit.py:{name}")
    with pytest.raises(StoreError, match="cannot be measured: ValueError: cannot be"):
        measured(tmp_path, "./unfit.py:broken")
    with pytest.raises(ChoiceError, match=r"metric of unfit\.py"):
        measured(tmp_path, "./unfit.py:lost")
    after = StoredStudy("small", tmp_path)
    assert after.plan.equals(before.plan, check_metadata=True)
    assert after.store.trial_ids() == before.store.trial_ids()


@pytest.mark.slow
def test_velocities_of_before_are_those_that_the_model_keeps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And not those of the frame before: a launch of today refuses such a model."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(campaign, "check_promises", lambda _study: None)
    record = "record: {metrics: [speed], trajectories: true}"
    for name, value in (("well", "flock.vx[0]"), ("ill", "1.0")):
        spec = written(tmp_path / name)
        kept = "publish(flock, others, work)"
        edited(tmp_path / name, kept, f"{kept}; flock.previous_vx[0] = {value}")
        before = "record: {metrics: [./mine.py], series: [speed, rightwards], every: 2}"
        spec.write_text(spec.read_text().replace(before, record))
        launched(spec, tmp_path / name)
    assert measured(tmp_path / "well", "turn_rate", study="drawn").measured == 6
    with pytest.raises(ChoiceError, match="turn_rate needs more than trajectories"):
        measured(tmp_path / "ill", "turn_rate", study="drawn")
    assert measured(tmp_path / "ill", "polarization", study="drawn").measured == 6


def test_frames_are_met_in_the_same_portions_as_in_a_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here a metric says how many it gets."""
    for module in ("simulation", "remeasuring"):
        monkeypatch.setattr(f"sweep.trial.{module}.BOID_STEPS_A_CALL", 48)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "unfit.py").write_text(UNFIT)
    spec = tmp_path / "small.yaml"
    spec.write_text(of_model("nguyen2024", 1))
    launched(spec, tmp_path / "here")
    measured(tmp_path / "here", "./unfit.py:together", "turn_rate")
    study = StoredStudy("small", tmp_path / "here")
    spec.write_text(study.spec)
    check_same(study, launched(spec, tmp_path / "there"))
    assert study.trials["together"].tolist() == [1.0, 1.0]
    assert study.trials["together_mean"].tolist() == [3.4, 3.4]


def test_trials_that_keep_last_states_are_refused(tmp_path: Path) -> None:
    """A last state has the frames of what was recorded, and no launch could go on."""
    record = FLOWN.replace(
        "trajectories: true", "trajectories: true, last_states: true"
    )
    launched(flown(record=record) + "streams: {noise: lasting}\n", tmp_path)
    with pytest.raises(ChoiceError, match=r"record last.*add polarization under"):
        measured(tmp_path, "polarization")


def test_what_is_missing_or_failed_is_left_to_a_launch(tmp_path: Path) -> None:
    study = read(flown())
    launch(study, tmp_path, Serial(), share=share_of_each_point(study))
    before = StoredStudy("small", tmp_path)
    n = before.statuses()["done"]
    assert before.statuses() == {"done": n, "missing": 6 - n}
    assert 1 < n < 6
    failing = before.trials["trial_id"][0]
    (part,) = before.store.current_parts()
    tables = {name: load_table(part, name) for name in table_names(part)}
    trials = tables["trials"]
    place = trials.schema.get_field_index("status")
    statuses = [
        "failed" if trial == failing else "done"
        for trial in trials["trial_id"].to_pylist()
    ]
    field = trials.schema.field(place)
    tables["trials"] = trials.set_column(place, field, pa.array(statuses))
    before.store.append(tables)
    done = measured(tmp_path, "polarization")
    assert (done.measured, done.left) == (n - 1, 7 - n)
    after = StoredStudy("small", tmp_path)
    assert after.statuses() == {"done": n - 1, "failed": 1, "missing": 6 - n}
    assert after.trials["polarization"].notna().sum() == n - 1
    assert relaunch(more(flown(), "polarization"), tmp_path).missing == 7 - n
    alone = launched(more(flown(), "polarization"), tmp_path / "alone")
    check_same(StoredStudy("small", tmp_path), alone)


def test_what_diverged_stays_so(tmp_path: Path) -> None:
    spec = flown().replace("[0.5, 1]", "[1, 1.0e+308]")
    spec = spec.replace("n: 12", "n: 30, separation_range: 1000")
    assert launched(spec, tmp_path).statuses() == {"done": 3, "diverged": 3}
    assert measured(tmp_path, "polarization").measured == 6
    after = StoredStudy("small", tmp_path)
    alone = launched(more(spec, "polarization"), tmp_path / "alone")
    check_same(after, alone)
    assert relaunch(more(spec, "polarization"), tmp_path).missing == 0
    assert verify(after, Serial(), fraction=1.0).same


def test_a_study_without_a_trial_has_nothing_to_measure(tmp_path: Path) -> None:
    launch(read(flown()), tmp_path, Serial(), share=Share(1, 10**6))
    with pytest.raises(ChoiceError, match="no trial is done yet: launch the study"):
        measured(tmp_path, "polarization")


def test_trials_of_several_recordings_are_measured_together(tmp_path: Path) -> None:
    """Those that serve for the study have more already."""
    one = more(flown(), "polarization", "flock_radius").replace("[0.5, 1]", "[0.5]")
    launched(one, tmp_path)
    assert launched(flown(), tmp_path).statuses() == {"done": 6}
    done = measured(tmp_path, "polarization", "dispersion")
    assert (done.metrics, done.measured) == (["polarization", "dispersion"], 6)
    after = StoredStudy("small", tmp_path)
    alone = launched(more(flown(), "polarization", "dispersion"), tmp_path / "alone")
    for mine, theirs in zip(numbers(after), numbers(alone), strict=True):
        pd.testing.assert_frame_equal(mine[theirs.columns], theirs, check_exact=True)
    assert measured(tmp_path, "flock_radius").measured == 3
    assert verify(StoredStudy("small", tmp_path), Serial(), fraction=1.0).same


def test_what_is_there_already_is_only_listed(tmp_path: Path) -> None:
    launched(more(flown(), "polarization"), tmp_path)
    launched(flown(), tmp_path)
    ids = Store(tmp_path / "small").trial_ids()
    done = measured(tmp_path, "polarization")
    assert (done.metrics, done.measured, done.stored) == (["polarization"], 0, 6)
    assert Store(tmp_path / "small").trial_ids() == ids
    assert "polarization" in StoredStudy("small", tmp_path).trials


def test_a_rule_goes_on_with_what_is_measured(tmp_path: Path) -> None:
    until = "replicates: {until: {metric: speed, half_width: 0.0001}, min: 3, max: 6}"
    spec = flown().replace("replicates: 3", until)
    before = launched(spec, tmp_path)
    measured(tmp_path, "polarization")
    after = StoredStudy("small", tmp_path)
    assert stopping(after).equals(stopping(before))
    progress = relaunch(more(spec, "polarization"), tmp_path)
    assert (progress.missing, progress.troubled) == (0, 0)
    assert StoredStudy("small", tmp_path).trials.equals(after.trials)


def test_a_search_goes_on_with_what_is_measured(tmp_path: Path) -> None:
    assert FLOWN_SEARCH != TINY
    searched(FLOWN_SEARCH, tmp_path)
    before = read_asked(StoredStudy("tiny", tmp_path))
    assert measured(tmp_path, "polarization", study="tiny").measured > 0
    after = read_asked(StoredStudy("tiny", tmp_path))
    names = ["run", "candidate", "block", "status", "flock_radius"]
    pd.testing.assert_frame_equal(after.table[names], before.table[names])
    assert after.table["polarization"].notna().all()
    listed = StoredStudy("tiny", tmp_path).spec
    assert searched(listed, tmp_path).statuses.total() == 0


FLOWN_SEARCH = TINY.replace(
    "[flock_radius]", "[flock_radius], trajectories: true"
).replace("budget: 30", "budget: 8")


def in_two_files(study: StoredStudy, asked: pa.Table) -> None:
    """Store a search as versions up to 0.18 did, which were killed between them."""
    study.store.write_plan(study.plan.to_reader())
    pq.write_table(asked, study.store.folder / "asked.parquet")


@pytest.mark.parametrize("kind", slow_but([Folder], [Folder, Bucket]))
def test_what_a_search_asked_for_is_stored_with_its_plan_in_one_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: type[Folder | Bucket]
) -> None:
    """Wherever `sweep measure` is killed, the candidates have trials of the plan."""
    searched(FLOWN_SEARCH, tmp_path)
    place: Location = tmp_path if kind is Folder else in_memory(tmp_path)[1]
    put, left = kind.put, list[int]()

    def killed(store: Any, staged: Path) -> None:
        if not left:
            raise KeyboardInterrupt
        left.pop()
        put(store, staged)

    monkeypatch.setattr(kind, "put", killed)
    for writes in range(10):
        left[:] = range(writes)
        try:
            measure("tiny", ["polarization"], place, Serial())
            break
        except KeyboardInterrupt:
            study = StoredStudy("tiny", place)
            asked, columns = read_asked(study).table, read_asked(study).description
            assert set(asked["trial_id"]) == set(study.plan["trial_id"].to_pylist())
            assert asked[columns["parameters"]].notna().all(axis=None)
    assert writes == 2
    assert read_asked(StoredStudy("tiny", place)).table["polarization"].notna().all()


def test_a_search_whose_two_files_were_left_apart_is_healed_by_the_same_command(
    tmp_path: Path,
) -> None:
    searched(FLOWN_SEARCH, tmp_path)
    old = Store(tmp_path / "tiny").read_asked()
    measured(tmp_path, "polarization", study="tiny")
    study = StoredStudy("tiny", tmp_path)
    whole = read_asked(study).table
    in_two_files(study, old)
    assert not find_waste(study).rows, "what the search asked for would be deleted"
    said = sweep(tmp_path, "measure", "tiny", "polarization", "--results", ".")
    assert said.returncode == 0
    assert "tiny: an interrupted measurement is now complete" in said.stderr
    pd.testing.assert_frame_equal(read_asked(study).table, whole)
    assert StoredStudy("tiny", tmp_path).plan.equals(study.plan, check_metadata=True)
    assert sum(find_waste(study).trials.values()) == 17
    # Without the former trials nobody knows which ones were asked for.
    clean(study, find_waste(study))
    in_two_files(study, old)
    with pytest.raises(StoreError, match="the plan lacks 17 trials that the search"):
        measured(tmp_path, "polarization", study="tiny")
    assert searched(study.spec, tmp_path).statuses.total() == 0
    pd.testing.assert_frame_equal(read_asked(study).table, whole)


@pytest.mark.slow
def test_state_and_kinds_of_boids_are_met(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = Path(oscillators.__file__).read_text()
    (tmp_path / "circles.py").write_text(f"{source}\nMETRICS = {{'order': ORDER}}\n")
    spec = tmp_path / "circles.yaml"
    text = oscillators.SPEC.replace("model: oscillators", "model: ./circles.py")
    spec.write_text(text.replace("[order], series: [order]", "[speed]"))
    monkeypatch.chdir(tmp_path)
    launched(spec, tmp_path / "here")
    assert measured(tmp_path / "here", "order", study="circles").metrics == ["order"]
    study = StoredStudy("circles", tmp_path / "here")
    spec.write_text(study.spec)
    check_same(study, launched(spec, tmp_path / "there"))


def test_if_it_ends_before_the_plan_is_there_it_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = launched(flown(), tmp_path)

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Store, "write_plan", killed)
        with pytest.raises(KeyboardInterrupt):
            measured(tmp_path, "polarization")
    between = StoredStudy("small", tmp_path)
    assert between.plan.equals(before.plan, check_metadata=True)
    assert between.trials.equals(before.trials)
    done = measured(tmp_path, "polarization")
    assert (done.measured, done.stored) == (0, 6)
    alone = launched(more(flown(), "polarization"), tmp_path / "alone")
    check_same(StoredStudy("small", tmp_path), alone)


def test_nobody_else_changes_the_study_meanwhile(tmp_path: Path) -> None:
    study = launched(flown(), tmp_path)
    with (
        Lock(study.store.place, None),
        pytest.raises(StoreError, match="this study is being launched by"),
    ):
        measured(tmp_path, "polarization")
    with (
        Lock(study.store.place, Share(1, 2)),
        pytest.raises(StoreError, match="is being launched by"),
    ):
        measured(tmp_path, "polarization")


def stored_again(study: StoredStudy, column: str, change: float, first: int) -> None:
    """Store the part again, with other values in a column of its trajectories, from the
    frame at a step on.
    """
    (part,) = study.store.current_parts()
    tables = {name: load_table(part, name) for name in table_names(part)}
    rows = tables["trajectories"]
    place = rows.schema.get_field_index(column)
    frames = rows["frame"].to_pylist()
    values = [
        [one + change * (frame >= first) for one in row]
        for row, frame in zip(rows[column].to_pylist(), frames, strict=True)
    ]
    new = pa.array(values, rows.schema.field(place).type)
    tables["trajectories"] = rows.set_column(place, rows.schema.field(place), new)
    study.store.append(tables)


@pytest.mark.parametrize(
    ("column", "change", "first", "said"),
    [
        ("x", 1e-9, 0, "is not bitwise identical to a new run on this machine"),
        ("x", 1e-9, 8, "is not bitwise identical to a new run on this machine"),
        ("vy", np.nan, 8, "a number is not finite"),
        ("frame", 1, 0, "the steps are wrong"),
    ],
)
def test_a_changed_trajectory_is_refused(
    tmp_path: Path, column: str, change: float, first: int, said: str
) -> None:
    study = launched(flown(), tmp_path)
    if column == "frame":
        (part,) = study.store.current_parts()
        tables = {name: load_table(part, name) for name in table_names(part)}
        rows = tables["trajectories"]
        shifted = pa.array(rows["frame"].to_numpy() + change)
        tables["trajectories"] = rows.set_column(1, rows.schema.field(1), shifted)
        study.store.append(tables)
    else:
        stored_again(study, column, change, first)
    with pytest.raises(StoreError, match=said):
        measured(tmp_path, "polarization")
    assert StoredStudy("small", tmp_path).plan.equals(study.plan, check_metadata=True)


def test_trials_of_other_code_are_not_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    launched(flown(), tmp_path)
    monkeypatch.setattr("kernels.identity._flight_stamp", lambda: "other")
    with pytest.raises(StoreError, match="was computed by another version of the code"):
        measured(tmp_path, "polarization")


def test_the_command(tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text(flown())
    launched(tmp_path / "small.yaml", tmp_path / "results")
    done = sweep(tmp_path, "measure", "small", "polarization")
    assert (done.returncode, done.stdout) == (0, "")
    assert "small: polarization of 6 trials measured, 0 already stored\n" in done.stderr
    assert "small.yaml needs:\nrecord:\n  metrics: [speed, polarization]" in done.stderr
    quiet = sweep(tmp_path, "measure", "small", "dispersion", "--json", "--quiet")
    assert quiet.stderr == ""
    said = json.loads(quiet.stdout)
    assert said["metrics"] == ["dispersion"]
    assert said["record"] == {"metrics": ["speed", "polarization", "dispersion"]}
    again = sweep(tmp_path, "measure", "small", "dispersion")
    assert (again.returncode, again.stdout) == (2, "")


@pytest.mark.parametrize("folder", slow_but(["nguyen2024"], STUDIED))
def test_a_spec_keeps_all_else(folder: str) -> None:
    roots = [
        root
        for path in sorted((EXPERIMENTS / folder).rglob("*.yaml"))
        if path.name != "published.yaml"
        for root in read_documents(path)
    ]
    assert roots
    for root in roots:
        text = with_metrics(root.document.text, ["speed"], ["own"], {"a": "b / c"})
        record = root.value.get("record", {})
        metrics, derive = record.get("metrics", ["speed"]), record.get("derive", {})
        further = {"metrics": [*metrics, "own"], "derive": derive | {"a": "b / c"}}
        found = parse_document(text, root.document.path).value
        assert found == root.value | {"record": record | further}
        assert text.count("#") == root.document.text.count("#")


@pytest.mark.parametrize(
    "text",
    ["record: 5", "a: &b 1", "record: {metrics: speed}", "!!x {}", "a: " + "[" * 30],
)
def test_a_text_that_is_no_spec_is_refused(text: str) -> None:
    with pytest.raises(SpecError):
        with_metrics(text, ["speed"], ["own"], {})
