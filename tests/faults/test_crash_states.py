"""Whenever the power fails, what was promised is there; a launch brings the rest."""

from collections.abc import Callable, Iterable, Iterator
from itertools import chain, pairwise
from pathlib import Path
from random import Random

import pyarrow as pa
import pyarrow.fs
import pyarrow.parquet as pq
import pytest

from sweep.spec.study_folder import ASKED
from sweep.store.durable import flush_to_disk
from sweep.store.held_store import custody
from sweep.store.store import Store
from tests.cases import slow_but
from tests.faults.crash_disk import Disk, Recorder, Step, held, now, put
from tests.faults.crash_states import (
    KINDS,
    MEASURED_KINDS,
    ONE,
    OWN,
    SOUGHT,
    Campaign,
    Kind,
    Recording,
    State,
    crash_states,
    launched,
    record,
    small_world,
    states,
)

CERTAIN = ("all names", "all but what is promised")
LOSSES = (
    *("nothing", "content", "content zeroed", "second half zeroed"),
    *("all names", "one name", "many names", "a torn write"),
)


def recorded(kind: Kind, root: Path) -> Recording:
    """A launch into a new folder, which holds what was stored before it."""
    root.mkdir()
    if kind.before:
        with small_world():
            launched(kind.before, root / "results")
    return record(kind, root)


def chosen(states: list[State], most: int, seed: int) -> list[State]:
    """At most so many states of each loss, drawn, in their order."""
    random, places = Random(seed), dict[str, list[int]]()
    for place, state in enumerate(states):
        places.setdefault(state.loss, []).append(place)
    drawn = [random.sample(found, min(most, len(found))) for found in places.values()]
    return [states[place] for place in sorted(chain.from_iterable(drawn))]


def kill_points(recording: Recording) -> Iterator[int]:
    """After how many steps a name is there that is about to be flushed."""
    for number, (step, following) in enumerate(pairwise(recording.steps)):
        new = step.other or step.path
        names = step.what in ("folder", "rename") and "/writing/" not in new
        if names and following == Step("flush", new.rpartition("/")[0]):
            yield number + 1


def launched_again(first: Recording, point: int, root: Path) -> Recording:
    """The launch after one that was killed, and whose last name may still be lost."""
    disk = Disk()
    for step in first.steps[:point]:
        disk.do(step)
    put(disk.left(now, lambda file: file.content), root, age=0.0)
    return record(first.kind, root, first.steps[:point])


def check_all_promises(campaign: Campaign, kind: Kind, states: Iterable[State]) -> None:
    """What is certain after each step has all that was promised by then."""
    for state in states:
        if state.loss in CERTAIN:
            campaign.look(kind, state)


@pytest.mark.parametrize("kind", slow_but(["first launch"], KINDS))
def test_states_of_every_loss_end_as_in_peace(kind: str, tmp_path: Path) -> None:
    campaign = Campaign(tmp_path)
    recording = recorded(KINDS[kind], tmp_path / "recorded")
    states = list(crash_states(recording, seed=1))
    check_all_promises(campaign, recording.kind, states)
    for state in chosen(states, most=1, seed=1):
        campaign.check(recording.kind, state)
    assert {f"lost: {loss}" for loss in LOSSES} <= campaign.counts.keys()


@pytest.mark.parametrize(
    ("spec", "first", "last"),
    slow_but(
        [(OWN, 4, 6), (SOUGHT, 0, 1)],
        [(ONE, 0, 7), (OWN, 4, 6), (OWN, 0, 7), (SOUGHT, 0, 1), (SOUGHT, 0, 100)],
    ),
    ids=["launch", "code and plan", "own code", "search", "whole search"],
)
def test_a_launch_flushes_what_a_killed_one_had_not(
    spec: str, first: int, last: int, tmp_path: Path
) -> None:
    """A launch that finds all stored says so: then a power cut must not take it away.

    The first names are those of four folders. A search stores its first part before it
    has flushed any other name in its folder.
    """
    campaign, killed = Campaign(tmp_path), recorded(Kind(spec), tmp_path / "recorded")
    found = list(kill_points(killed))
    assert len(found) > 6
    for number, point in enumerate(found[first:last]):
        again = launched_again(killed, point, tmp_path / f"again-{number}")
        promised = crash_states(again, seed=1, certain=True)
        check_all_promises(campaign, again.kind, promised)


def test_a_damaged_part_is_always_somewhere(tmp_path: Path) -> None:
    """It may hold what can still be saved by hand."""
    with small_world():
        launched(ONE, tmp_path / "results")
    store = Store(tmp_path / "results" / "small")
    [part] = store.all_parts()
    (part / "trials.parquet").write_bytes(b"precious")
    recorder = Recorder(tmp_path)
    begin, disk = len(recorder.steps), Disk()
    with recorder.recording(), custody(store):
        pass
    for number, step in enumerate(recorder.steps):
        disk.do(step)
        if number >= begin:
            left = disk.left(held, lambda file: file.held)
            assert b"precious" in left.values(), step
    assert (tmp_path / "results" / "small" / "damaged").is_dir()


@pytest.mark.parametrize("searches", [True, False])
def test_a_new_plan_never_gets_what_an_earlier_search_asked_for(
    searches: bool, tmp_path: Path
) -> None:
    """Up to version 0.18 it was a file of its own. Nor does a search lose its own."""
    earlier, later = (pa.table({"trial_id": [name]}) for name in ("a", "b"))
    folder = tmp_path / "recorded" / "study"
    Store(folder).write_plan(earlier.to_reader())
    pq.write_table(earlier.append_column("block", pa.array([1])), folder / ASKED)
    recorder = Recorder(folder.parent)
    begin, disk, random = len(recorder.steps), Disk(), Random(1)
    with recorder.recording():
        requests = later.append_column("block", pa.array([2])) if searches else None
        Store(folder).write_plan(later.to_reader(), requests)
    found = set()
    for number, step in enumerate(recorder.steps):
        disk.do(step)
        left = states(disk, random) if number >= begin - 1 else ()
        for at, (_, tree) in enumerate(left):
            place = tmp_path / f"{number}-{at}"
            put(tree, place, age=0.0)
            store = Store(place / "study")
            asked = store.read_asked()
            blocks = None if asked is None else asked["block"].to_pylist()
            found.add((*store.read_plan()["trial_id"].to_pylist(), str(blocks)))
    between = set() if searches else {("a", "None")}
    last = ("b", "[2]" if searches else "None")
    assert found == {("a", "[1]"), last} | between


def test_the_recorder_sees_what_is_written_elsewhere_and_takes_nothing_on_trust(
    tmp_path: Path,
) -> None:
    """What pyarrow writes in C++ is seen; a name that it changes ends the recording."""
    files, recorder = pyarrow.fs.LocalFileSystem(), Recorder(tmp_path)
    with recorder.recording():
        with files.open_output_stream(str(tmp_path / "one")) as stream:
            stream.write(b"1")
        flush_to_disk(tmp_path / "one")
    assert [step.what for step in recorder.steps] == ["flush", "file", "write", "flush"]
    unseen: list[Callable[[], object]] = [
        lambda: files.move(str(tmp_path / "one"), str(tmp_path / "two")),
        lambda: files.create_dir(str(tmp_path / "folder")),
    ]
    for number, change in enumerate(unseen):
        with (
            pytest.raises(AssertionError, match=r"unseen|not seen"),
            recorder.recording(),
        ):
            change()
        assert number or not (tmp_path / "one").exists()


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS | MEASURED_KINDS)
def test_thousands_of_states_end_as_in_peace(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    campaign = Campaign(tmp_path)
    recording = recorded((KINDS | MEASURED_KINDS)[kind], tmp_path / "recorded")
    states = list(crash_states(recording, seed=2))
    check_all_promises(campaign, recording.kind, states)
    for state in chosen(states, most=100, seed=2):
        campaign.check(recording.kind, state)
    with capsys.disabled():
        counts = sorted(campaign.counts.items())
        done = ", ".join(f"{count} {what}" for what, count in counts)
        steps = len(recording.steps) - recording.begin
        print(f"\ncrash states, {kind} of {steps} steps: {done}", flush=True)
