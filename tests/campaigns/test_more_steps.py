"""The same study with more steps goes on from the last states that its trials have
kept, to the bits of a launch that begins at step 0.
"""

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from sweep.campaigns.launching import launch
from sweep.campaigns.plan import plan_of
from sweep.campaigns.progress import Progress
from sweep.design.design import expand
from sweep.design.jobs import (
    Job,
    Jobs,
    Purpose,
    SomeJobs,
    ids_of_steps,
    steps_of,
    stream,
)
from sweep.design.recording import recorded_content
from sweep.design.trial_ids import as_texts
from sweep.errors import SpecError, StoreError
from sweep.replays.verifying import verify
from sweep.sharing.content import content_hash
from sweep.spec.study import parse_spec
from sweep.store.last_states import earlier_trials
from sweep.store.locations import ObjectPath, ObjectServer
from sweep.store.manifest import table_names
from sweep.store.parquet import load_table
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.tables.cleaning import clean, find_waste
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result
from sweep.workers import last_state
from sweep.workers.checkpoint import Checkpointed
from sweep.workers.executors import Serial
from tests.object_stores import Memory
from tests.searches import TINY, searched
from tests.studies import SMALL, launched, read, relaunch

KEPT = "record: {series: [speed], every: 2}"
LASTING = "streams: {noise: lasting}\n"


def of_steps(steps: int, text: str = SMALL) -> str:
    """A spec whose trials have so many steps, and keep their last states."""
    record = KEPT.replace("}", ", trajectories: true, last_states: true}")
    assert KEPT in text
    return LASTING + text.replace(KEPT, record).replace("steps: 9", f"steps: {steps}")


def gone_on(progress: Progress) -> tuple[int, int, int]:
    """How many trials were missing, how many went on, and the steps that saved."""
    return progress.missing, progress.continued, progress.steps_saved


def alone(text: str, results: Path) -> str:
    """The hash of all that a launch into an empty folder gives."""
    return content_hash(launched(text, results))


@pytest.mark.parametrize("model", ["nguyen2024", "rustamani2024"])
def test_more_steps_go_on_from_the_last_states_to_the_same_bits(
    model: str, tmp_path: Path
) -> None:
    text = SMALL.replace("nguyen2024", model)
    launched(of_steps(9, text), tmp_path / "here")
    progress = relaunch(of_steps(22, text), tmp_path / "here")
    assert gone_on(progress) == (6, 6, 6 * 9)
    study = StoredStudy("small", tmp_path / "here")
    assert content_hash(study) == alone(of_steps(22, text), tmp_path / "alone")
    assert verify(study, Serial(), fraction=1.0).same
    assert gone_on(relaunch(of_steps(30, text), tmp_path / "here")) == (6, 6, 6 * 22)


def test_a_trial_goes_on_from_the_longest_one_that_is_shorter(tmp_path: Path) -> None:
    for steps, saved in ((12, 0), (5, 0), (9, 5), (20, 12), (6, 5)):
        progress = relaunch(of_steps(steps), tmp_path)
        assert gone_on(progress) == (6, 6 if saved else 0, 6 * saved), steps


@pytest.mark.parametrize(
    "others",
    [
        ("seed: 5", "seed: 6"),
        ("drag: 0", "drag: 0.1"),
        ("series: [speed]", "series: [speed, polarization]"),
        ("every: 2", "every: 3"),
        ("noise: lasting", "noise: common"),
    ],
)
def test_trials_that_differ_in_more_begin_at_step_0(
    others: tuple[str, str], tmp_path: Path
) -> None:
    text = SMALL.replace("steps: 9", "steps: 9, drag: 0")
    launched(of_steps(9, text), tmp_path)
    assert others[0] in of_steps(22, text)
    progress = relaunch(of_steps(22, text).replace(*others), tmp_path)
    assert gone_on(progress) == (6, 0, 0)


def test_steps_that_are_an_axis_or_follow_from_a_setting_go_on_too(
    tmp_path: Path,
) -> None:
    axis = of_steps(9).replace("n: 12, steps: 9", "n: 12")
    axis = axis.replace("sweep:", "sweep:\n  steps: [6, 9]")
    launched(axis, tmp_path)
    longer = axis.replace("[6, 9]", "[7, 9, 30]")
    assert gone_on(relaunch(longer, tmp_path)) == (12, 12, 6 * 6 + 6 * 9)
    derived = of_steps(9).replace("n: 12, steps: 9", "n: 12") + "derive: {steps: 3 * n}"
    assert gone_on(relaunch(derived, tmp_path)) == (6, 6, 6 * 30)


def test_new_points_and_replicates_begin_at_step_0(tmp_path: Path) -> None:
    launched(of_steps(9), tmp_path)
    more = of_steps(22).replace("replicates: 3", "replicates: 5")
    progress = relaunch(more.replace("[0.5, 1]", "[0.5, 2]"), tmp_path)
    assert gone_on(progress) == (10, 3, 3 * 9)


def test_shares_go_on_too(tmp_path: Path) -> None:
    launched(of_steps(9), tmp_path)
    shares = [
        launch(read(of_steps(22)), tmp_path, Serial(), share=Share(number, 2))
        for number in (1, 2)
    ]
    assert sum(one.continued for one in shares) == 6


def test_a_search_goes_on_too(tmp_path: Path) -> None:
    keeping = TINY.replace("every: 9", "every: 9, last_states: true")
    keeping = keeping.replace("budget: 30", "budget: 8")
    longer = keeping.replace("steps: 9", "steps: 21")
    searched(keeping, tmp_path / "here")
    progress = searched(longer, tmp_path / "here")
    assert progress.continued > 0
    assert progress.steps_saved == 9 * progress.continued
    searched(longer, tmp_path / "alone")
    here, alone = (StoredStudy("tiny", tmp_path / name) for name in ("here", "alone"))
    assert content_hash(here) == content_hash(alone)


def test_a_study_in_an_object_store_goes_on_too(tmp_path: Path) -> None:
    server = ObjectServer()
    server.__dict__["files"] = Memory()
    bucket = ObjectPath(server, "bucket")
    launch(read(of_steps(9)), bucket, Serial())
    assert gone_on(launch(read(of_steps(22)), bucket, Serial())) == (6, 6, 54)
    hashed = content_hash(StoredStudy("small", bucket))
    assert hashed == alone(of_steps(22), tmp_path)


def test_a_rule_goes_on_too(tmp_path: Path) -> None:
    rule = "replicates: {until: {half_width: {speed: 0.001}}, min: 3, max: 4}"
    text = SMALL.replace("replicates: 3", rule)
    first = relaunch(of_steps(9, text), tmp_path)
    second = relaunch(of_steps(22, text), tmp_path)
    assert (second.missing, second.continued) == (first.missing, first.missing)


def test_a_plan_says_how_many_go_on_and_what_they_take(tmp_path: Path) -> None:
    plan = plan_of(read(of_steps(9)), 1, tmp_path)
    assert (plan.continued, "goes on" in plan.as_text()) == (0, False)
    study = launched(of_steps(9), tmp_path)
    (part,) = study.store.current_parts()
    taken = load_table(part, "last_states")["state"].nbytes
    assert 0.5 < plan.last_state_bytes / taken < 2.0
    assert plan.last_state_bytes < plan.result_bytes
    longer = plan_of(read(of_steps(22)), 1, tmp_path)
    assert (longer.continued, longer.steps_saved) == (6, 54)
    text = longer.as_text()
    assert "resumed    6 trials from last states, 54 steps less to run" in text
    assert "of last states" in text
    relaunch(of_steps(22), tmp_path)
    assert plan_of(read(of_steps(22)), 1, tmp_path).continued == 0


def test_ids_without_last_states_are_what_they_were(tmp_path: Path) -> None:
    """And trials that keep theirs serve for the same ones that do not."""
    lasting = LASTING + SMALL
    assert "last_states" not in recorded_content(read(lasting).record)
    assert "last_states" in recorded_content(read(of_steps(9)).record)
    launched(of_steps(9), tmp_path)
    assert relaunch(lasting, tmp_path).missing == 0
    assert relaunch(of_steps(9), tmp_path).missing == 0


def test_trials_that_kept_nothing_run_once_more(tmp_path: Path) -> None:
    launched(of_steps(9).replace(", last_states: true", ""), tmp_path)
    assert gone_on(relaunch(of_steps(9), tmp_path)) == (6, 0, 0)
    assert gone_on(relaunch(of_steps(22), tmp_path)) == (6, 6, 54)


def test_the_shorter_trials_go_when_nobody_asks_for_them(tmp_path: Path) -> None:
    launched(of_steps(9), tmp_path)
    relaunch(of_steps(22), tmp_path)
    study = StoredStudy("small", tmp_path)
    clean(study, find_waste(study))
    (part,) = study.store.current_parts()
    assert load_table(part, "last_states")["step"].to_pylist() == [22] * 6
    assert gone_on(relaunch(of_steps(30), tmp_path)) == (6, 6, 6 * 22)


def test_last_states_are_no_table_of_a_study(tmp_path: Path) -> None:
    study = launched(of_steps(9), tmp_path)
    assert "last_states" not in set(study.columns["table"])
    (part,) = study.store.current_parts()
    assert "last_states" in table_names(part)


def test_with_another_key_trials_begin_at_step_0_and_that_is_said_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    launched(of_steps(9), tmp_path / "here")
    last_state._say_once.cache_clear()
    with caplog.at_level(logging.WARNING, "sweep"), monkeypatch.context() as patched:
        patched.setattr("sweep.workers.flying.Checkpointed", strangely)
        relaunch(of_steps(22), tmp_path / "here")
    assert caplog.text.count("on a machine with another key; affected trials") == 1
    study = StoredStudy("small", tmp_path / "here")
    assert content_hash(study) == alone(of_steps(22), tmp_path / "alone")


def strangely(
    run: Callable[[Job], Result], folder: Path, every: float, together: bool
) -> Checkpointed:
    """As a launch of somebody with another key."""
    return Checkpointed(run, folder, every, bytes(32), together=together)


def test_a_part_whose_last_states_are_damaged_runs_again(tmp_path: Path) -> None:
    study = launched(of_steps(9), tmp_path)
    (part,) = study.store.current_parts()
    assert isinstance(part, Path)
    (part / "last_states.parquet").write_bytes(b"PAR1")
    assert gone_on(relaunch(of_steps(22), tmp_path)) == (6, 0, 0)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("step", pa.array(["9"] * 6)),
        ("step", pa.array([None] * 6, pa.int64())),
        ("state", pa.array([1.5] * 6)),
        ("state", pa.array([None] * 6, pa.large_binary())),
    ],
)
def test_last_states_that_no_launch_writes_are_refused(
    name: str, values: pa.Array, tmp_path: Path
) -> None:
    study = launched(of_steps(9), tmp_path)
    (part,) = study.store.current_parts()
    tables = {one: load_table(part, one) for one in table_names(part)}
    table = tables["last_states"]
    place = table.schema.get_field_index(name)
    tables["last_states"] = table.set_column(place, name, values)
    Store(study.store.folder, tmp_path).append(tables)
    study.store.discard(part)
    with pytest.raises(StoreError, match="last_states are not what a launch writes"):
        relaunch(of_steps(22), tmp_path)


def test_lasting_noise_is_other_at_each_point_and_the_same_for_any_steps() -> None:
    def numbers(spec: str, purpose: Purpose = "noise") -> list[int]:
        study = read(spec)
        jobs = Jobs(study, expand(study))
        return [int(stream(job, purpose).generate_state(1)[0]) for job in jobs]

    assert numbers(of_steps(9)) == numbers(of_steps(22))
    assert len(set(numbers(of_steps(9)))) == 6
    independent = SMALL.replace("steps: 9", "steps: 22")
    assert set(numbers(SMALL)).isdisjoint(numbers(independent))
    usual = parse_spec(SMALL).preset_settings["steps"]
    assert numbers(of_steps(9)) == numbers(SMALL.replace("steps: 9", f"steps: {usual}"))


@pytest.mark.parametrize(
    ("streams", "why"),
    [
        ("", "noise: lasting"),
        ("streams: {noise: independent}", "noise: lasting"),
        ("streams: {start: independent, noise: common}", "start: lasting"),
        (
            "streams: {start: independent, world: independent}",
            "start: lasting, world: lasting, noise: lasting",
        ),
    ],
)
def test_streams_that_depend_on_the_steps_are_refused(streams: str, why: str) -> None:
    text = of_steps(9).replace(LASTING, f"{streams}\n")
    with pytest.raises(SpecError, match="and cannot resume; write") as raised:
        parse_spec(text)
    line = 1 + text.splitlines().index(
        next(x for x in text.splitlines() if "last_" in x)
    )
    assert f"spec.yaml:{line}: " in str(raised.value)
    assert f"write `streams: {{{why}}}`, or common" in str(raised.value)


def test_the_ids_of_other_steps_are_those_of_such_jobs() -> None:
    study, other = read(of_steps(9)), read(of_steps(22))
    jobs, longer = Jobs(study, expand(study)), Jobs(other, expand(other))
    some = SomeJobs(longer, np.array([4, 0, 5]))
    ids = [jobs[place].trial_id for place in (4, 0, 5)]
    assert as_texts(ids_of_steps(other, some, 9)).to_pylist() == ids
    assert as_texts(ids_of_steps(other, list(some), 9)).to_pylist() == ids
    assert steps_of(some).tolist() == steps_of(list(some)).tolist() == [22] * 3


def test_nothing_is_looked_up_where_nothing_is_stored(tmp_path: Path) -> None:
    study = read(of_steps(9))
    jobs = Jobs(study, expand(study))
    found = earlier_trials(study, Store(tmp_path / "small", tmp_path), jobs)
    assert (found.count, len(found.ids), found.steps.tolist()) == (0, 6, [0] * 6)
