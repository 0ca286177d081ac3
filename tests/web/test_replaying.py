"""Stored trials as shows: every frame and number is the stored one, wherever one goes,
in whatever order.
"""

import base64
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sweep.web.track as track
from sweep.cli.reporting import print_report
from sweep.errors import ChoiceError, SpecError, StoreError
from sweep.spec.study import RecordSpec
from sweep.tables.means import point_means
from sweep.tables.means_text import means_report, point_rows
from sweep.tables.stored_study import StoredStudy
from sweep.tables.trial_rows import StoredTrial
from sweep.trial import looking
from sweep.trial.simulation import Simulation, simulate
from sweep.web import messages
from sweep.web.export import draw_frame
from sweep.web.filing import untold
from sweep.web.history import Cursor
from sweep.web.replaying import Replay
from tests.studies import COVERING, IMPOSSIBLE, SMALL, launched

FLOWN = SMALL.replace("every: 2", "every: 3, trajectories: true").replace(
    "n: 12,", "n: 12, n_obstacles: 3,"
)
OWN = """
study: own
model: aziel_chen2025
preset: as_run
maps:
  room:
    size: [240, 180]
    shapes:
      - disc: {x: 30, y: 40, radius: 10}
      - rectangle: {x: 90, y: 50, width: 7, height: 9}
fixed: {map: room, n: 6, steps: 12}
sweep: {cohesion_weight: [0.1, 0.3]}
seeds: [27, 729]
seed: 4
streams: {noise: common, start: independent}
record: {series: [coverage], heatmaps: true, every: 5, trajectories: true}
"""
CHANGING = [
    messages.Set("separation_weight", 2.0),
    messages.ChooseModel("patel2023", "as_run"),
    messages.Shapes([]),
    messages.Goal(1.0, 2.0),
    messages.Sweep("separation_weight", 0.0, 1.0, 3),
    messages.Continue(),
]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(FLOWN, tmp_path_factory.mktemp("flown"))


def trial_of(study: StoredStudy, index: int) -> str:
    return str(study.plan["trial_id"][index].as_py())


@pytest.fixture
def show(flown: StoredStudy) -> Replay:
    return Replay(flown, trial_of(flown, 2))


def to_end(show: Replay) -> None:
    """Play it as a page does."""
    while show.going:
        show.advance(2)


@pytest.mark.parametrize(
    ("spec", "index"), [(FLOWN, 2), (FLOWN, 3), (OWN, 0), (OWN, 3), (COVERING, 1)]
)
def test_every_number_is_the_stored_one(spec: str, index: int, tmp_path: Path) -> None:
    study = launched(spec, tmp_path)
    trial = trial_of(study, index)
    show = Replay(study, trial)
    told = show.status()["replay"]
    assert (told["study"], told["trial"], told["equal"]) == (study.name, trial, True)
    row = study.trials.set_index("trial_id").loc[trial]
    last = study.trials["replicate"].max()
    assert told["which"].endswith(f"replicate {row['replicate']} (of 0 to {last})")
    assert all(name.replace("_", " ") in told["which"] for name in study.varied)
    assert told["words"] == "Every number equals the stored one, bit for bit."
    series = study.series[study.series["trial_id"] == trial]
    steps = series["frame"].to_numpy()
    for name in study.metrics:
        if name in series:
            assert (
                show.track.values[name][steps].tobytes()
                == series[name].to_numpy().tobytes()
            )
        row = study.trials.set_index("trial_id").loc[trial]
        assert told["metrics"][name] == {"stored": row[name], "replayed": row[name]}
    if study.spec.find("trajectories") > 0:
        frames, bodies = study.trajectory(trial)
        for frame, stored in zip(frames.tolist(), bodies, strict=True):
            show.handle(messages.Seek(frame))
            assert (show.step, show.bodies.tobytes()) == (frame, stored.tobytes())


@pytest.mark.parametrize(
    ("apart", "most"), [(1, 2**28), (40, 2**28), (1, 1), (10**6, 2**28)]
)
def test_any_step_is_reached_from_anywhere_with_all_that_belongs_to_it(
    apart: int, most: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However far apart the states are that it goes on from; what is seen then is what
    is seen on the way.
    """
    monkeypatch.setattr(track, "BOID_STEPS_APART", apart)
    monkeypatch.setattr(track, "MOST_BYTES", most)
    study = launched(OWN, tmp_path)
    show = Replay(study, trial_of(study, 0))
    assert bool(show.track.states) == (apart < 10**6 and most > 1)
    straight = Simulation(
        replace(show.job, record=replace(show.job.record, trajectories=True))
    )
    seen = {}
    for step in range(13):
        state = np.stack(straight.flock[:4])
        view = looking.seen_by(straight, 3)
        seen[step] = state.tobytes(), looking.visits(straight).tobytes(), view
        straight.advance(1)
    for step in np.random.default_rng(1).permutation(13).tolist():
        show.handle(messages.Seek(step))
        found = show.bodies.tobytes(), looking.visits(show.simulation).tobytes()
        assert (*found, looking.seen_by(show.simulation, 3)) == seen[step]
        assert struct.unpack("<I", show.picture()[8:12]) == (step,)


def test_going_on_from_a_step_gives_the_same_run(show: Replay) -> None:
    frames = {}
    show.run()
    while show.going:
        show.advance(1)
        frames[show.step] = show.bodies.tobytes()
    assert list(frames) == list(range(1, 10))
    show.handle(messages.Seek(4))
    show.handle(messages.StartRun())
    to_end(show)
    assert show.bodies.tobytes() == frames[9]
    assert not show.running


def test_it_steps_pauses_resets_and_runs_again_from_the_beginning(show: Replay) -> None:
    show.handle(messages.Step(4))
    to_end(show)
    assert show.step == 4
    show.handle(messages.Step(100))
    to_end(show)
    assert show.step == 9
    show.handle(messages.StartRun())
    assert (show.step, show.running) == (0, True)
    show.advance(3)
    show.handle(messages.Seek(7))
    assert (show.step, show.running) == (7, False)
    show.handle(messages.Reset())
    assert show.step == 0
    show.handle(messages.Seek(10**9))
    assert show.step == 9


@pytest.mark.parametrize("message", CHANGING)
def test_nothing_changes_a_stored_trial(
    show: Replay, message: messages.Message
) -> None:
    before = show.status()
    with pytest.raises(SpecError, match="a stored trial cannot be changed"):
        show.handle(message)
    assert show.status() == before


def told_metrics(show: Replay, cursor: Cursor) -> tuple[dict[str, Any], Cursor]:
    told, cursor = show.news(cursor)
    return next(message for message in told if message["type"] == "metrics"), cursor


def test_metrics_of_the_whole_run_come_at_once_and_others_when_asked_for(
    show: Replay,
) -> None:
    metrics, cursor = told_metrics(show, Cursor())
    assert (metrics["steps"], list(metrics["values"])) == (
        list(range(10)),
        list(show.state.plots),
    )
    assert "flock_count" not in show.track.values
    show.handle(messages.Metrics(("flock_count", "speed")))
    metrics, _ = told_metrics(show, cursor)
    assert (metrics["steps"], metrics["reset"]) == (list(range(10)), True)
    names = ("flock_count", "speed")
    result = simulate(replace(show.job, record=RecordSpec(names, names)))
    assert metrics["values"] == {
        name: series.tolist() for name, series in result.series.items()
    }
    with pytest.raises(SpecError, match='did you mean "flock_count"'):
        show.handle(messages.Metrics(("flock_cuont",)))
    assert show.state.plots == names


@pytest.mark.parametrize(
    ("spec", "index", "number"), [(FLOWN, 1, 2), (OWN, 3, 1), (COVERING, 2, 1)]
)
def test_the_copied_spec_launches_the_very_trial(
    spec: str, index: int, number: int, tmp_path: Path
) -> None:
    study = launched(spec, tmp_path)
    show = Replay(study, trial_of(study, index))
    text = show.handle(messages.Spec())[0]["yaml"]
    which = (
        f"the last of the {number} trials of this spec"
        if number > 1
        else "the trial of this spec"
    )
    assert text.startswith(f"# {which} is {show.job.trial_id} of {study.name}\n")
    again = launched(text, tmp_path)
    assert again.plan.num_rows == number
    steps, bodies = again.trajectory(trial_of(again, number - 1))
    for step, copied in zip(steps.tolist(), bodies, strict=True):
        show.seek(step)
        assert show.bodies.tobytes() == copied.tobytes()


def tampered(monkeypatch: pytest.MonkeyPatch, **changes: object) -> None:
    """Let rows be read with other values."""
    read = StoredStudy.trial

    def stored(study: StoredStudy, trial: str) -> StoredTrial:
        found = read(study, trial)
        return found._replace(row=found.row | changes)

    monkeypatch.setattr(StoredStudy, "trial", stored)


def test_what_differs_from_the_stored_row_is_said(
    flown: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    tampered(monkeypatch, speed=1.0, flock_radius=2.0)
    told = Replay(flown, trial_of(flown, 2)).status()["replay"]
    assert not told["equal"]
    assert "trials.speed: stored 1.0, now " in told["words"]
    assert told["words"].endswith("; and 1 more columns.")
    assert told["metrics"]["speed"]["stored"] == 1.0


def test_a_trial_that_met_its_time_limit_is_shown_without_it(
    flown: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    tampered(
        monkeypatch,
        status="timeout",
        last_step=4,
        error="time limit of 1 s reached after step 4",
        speed=None,
    )
    show = Replay(flown, trial_of(flown, 2))
    words = (
        "Stored as timeout, after step 4: there is nothing to compare. The page shows"
        " the repeated trial."
    )
    assert show.status()["replay"]["words"] == words
    assert "speed" not in show.status()["replay"]["metrics"]
    assert show.track.last == 9


def test_a_trial_that_diverged_ends_with_its_last_finite_frame(tmp_path: Path) -> None:
    wild = SMALL.replace("n: 12, steps: 9", "n: 30, steps: 400, separation_range: 1000")
    study = launched(wild.replace("[0.5, 1]", "[1.0e+308]"), tmp_path)
    assert set(study.trials["status"]) == {"diverged"}
    show = Replay(study, trial_of(study, 0))
    told = show.status()["replay"]
    assert told["equal"]
    assert told["metrics"] == {}
    show.handle(messages.Seek(400))
    assert show.step == show.track.last < 400
    assert np.isfinite(show.bodies).all()
    show.handle(messages.StartRun())
    to_end(show)
    assert show.step == show.track.last


def test_what_cannot_be_shown_is_said(tmp_path: Path, flown: StoredStudy) -> None:
    with pytest.raises(ChoiceError, match="unknown trial"):
        Replay(flown, "0123")
    study = launched(IMPOSSIBLE, tmp_path)
    with pytest.raises(StoreError, match="cannot be shown, because the trial fails: "):
        Replay(study, trial_of(study, 0))


def test_a_file_of_it_is_of_the_stored_trial(show: Replay) -> None:
    show.seek(5)
    picture = show.export("png")(untold)
    assert picture["name"] == f"small-{show.job.trial_id[:8]}-step-5.png"
    assert (
        base64.b64decode(picture["data"])
        == draw_frame("small", show.job, 5, show.bodies, "png", show.spec()).content
    )
    page = base64.b64decode(show.export("html")(untold)["data"]).decode()
    assert show.job.trial_id in page
    assert '"steps":[0,1,2,3,4,5,6,7,8,9]' in page
    with pytest.raises(
        SpecError, match='unknown kind of file "pgn"; did you mean "png"'
    ):
        show.export("pgn")


def test_a_table_says_how_to_see_a_trial_of_each_point(
    flown: StoredStudy, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of one that is done, where there is one."""
    study = StoredStudy(flown.name, flown.store.folder.parent)
    trials = study.trials
    trials.loc[trials["replicate"] == 0, "status"] = "timeout"
    found = point_means(study, ["speed"])
    rows = point_rows(study, found)
    seen = trials.set_index("trial_id").loc[
        [command.split()[-1] for command in rows["view"]]
    ]
    assert rows["view"][0].startswith("sweep view small ")
    assert seen["separation_weight"].tolist() == rows["separation_weight"].tolist()
    assert seen["replicate"].tolist() == [1, 1]
    print_report(means_report(study, found))
    assert rows["view"][0] in capsys.readouterr().out


def test_one_goes_from_one_stored_trial_to_another(flown: StoredStudy) -> None:
    """By neighbours through all of them, by numbers, and by a value of what varies."""
    show = Replay(flown, trial_of(flown, 0))
    trials = flown.trials.set_index("trial_id")
    seen = [show.job.trial_id]
    while after := show.status()["trial"]["after"]:
        replies = show.handle(messages.ShowTrial(*after))
        assert [reply["type"] for reply in replies] == ["controls", "scene", "state"]
        state = replies[-1]
        assert state["replay"]["trial"] == show.job.trial_id
        assert state["replay"]["equal"]
        assert state["trial"]["before"] is not None
        row = trials.loc[show.job.trial_id]
        assert state["trial"]["replicate"] == row["replicate"]
        assert state["trial"]["values"] == {
            "separation_weight": row["separation_weight"]
        }
        seen.append(show.job.trial_id)
    assert sorted(seen) == sorted(trials.index)
    offered = show.greeting()[0]["trials"]
    assert (offered["points"], offered["replicates"]) == (2, 3)
    assert offered["axes"] == [
        {"name": "separation_weight", "values": [0.5, 1.0], "follows": ""}
    ]
    show.handle(messages.ShowValue("separation_weight", 0.5))
    state = show.status()
    assert (state["trial"]["point"], state["trial"]["replicate"]) == (0, 2)
    for wrong, words in (
        (messages.ShowTrial(0, 3), "no trial is stored for point 0, replicate 3"),
        (messages.ShowValue("separation_weight", 0.7), "no point has 0.7"),
        (messages.ShowValue("cohesion_weight", 1.0), "unknown varying parameter"),
    ):
        with pytest.raises(SpecError, match=words):
            show.handle(wrong)
        assert show.status() == state


def test_where_the_next_trial_fails_the_one_that_is_shown_stays(
    flown: StoredStudy, monkeypatch: pytest.MonkeyPatch
) -> None:
    show = Replay(flown, trial_of(flown, 0))
    show.seek(4)
    state, picture = show.status(), show.picture()

    def failing(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("sweep.web.replaying.simulate", failing)
    with pytest.raises(StoreError, match="because the trial fails: ZeroDivision"):
        show.handle(messages.ShowTrial(1, 0))
    assert (show.status(), show.picture()) == (state, picture)
