"""Launches that are recorded, and what a power cut may leave at each of their moments.
Where further metrics are measured, that is recorded in the same way.

After every step of a launch, and in the middle of what it writes, the disk may hold
more or less of what was not flushed: LOSSES. Each such state is read, then launched
again. All that had been promised must be there, and all that the launch in peace had
must come of it, with nothing left over.
"""

import logging
import re
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import pandas as pd
import pyarrow as pa
import pytest

from sweep.campaigns.launching import launch
from sweep.campaigns.measuring import measure
from sweep.errors import ChoiceError
from sweep.store import lock, merging
from sweep.store.parquet import load_table
from sweep.store.store import Store
from sweep.store.writer import Writer
from sweep.tables.stored_study import StoredStudy
from sweep.trial import simulation
from sweep.workers import checkpoint
from sweep.workers.chunks import Chunks
from sweep.workers.executors import Serial
from tests.faults.crash_disk import Disk, File, Recorder, Step, Tree, held, now, put
from tests.own_models import SPEC as OWN_SPEC
from tests.searches import TINY
from tests.studies import SMALL
from tests.studies import read as read_spec

NOBODY = 2**22 + 1
"""The id of no process: Linux has none above 2**22. So the recorded launch is dead."""

WITHOUT = "checkpoint: false\n"
FIRST = SMALL.replace("steps: 9", "steps: 3") + WITHOUT
FIRST = FIRST.replace("replicates: 3", "replicates: 2")
ONE = FIRST.replace("[0.5, 1]", "[1]").replace("replicates: 2", "replicates: 1")
MORE = FIRST.replace("[0.5, 1]", "[0.5, 1, 2]")
SOUGHT = TINY.replace("steps: 9", "steps: 3").replace("every: 9", "every: 3") + WITHOUT
SOUGHT = SOUGHT.replace("budget: 30", "budget: 4").replace("batch: 4", "batch: 1")
SOUGHT = SOUGHT.replace("replicates: 4", "replicates: 2")
SOUGHT = SOUGHT.replace("candidates: 2, replicates: 3", "candidates: 1, replicates: 1")
LONG = FIRST.replace("steps: 3", "steps: 16").replace("[0.5, 1]", "[1]")
LONG = LONG.replace("[speed], every", "[speed], trajectories: true, every")
LONG = LONG.replace(WITHOUT, "checkpoint: 1.0e-9\n")
FLOWN = FIRST.replace("series: [speed]", "metrics: [speed], trajectories: true")
SOUGHT_FLOWN = SOUGHT.replace("every: 3", "every: 3, trajectories: true")
OWN = OWN_SPEC.replace("steps: 9", "steps: 3") + WITHOUT
OWN = OWN.replace("replicates: 3", "replicates: 1")
OWN_MORE = OWN.replace("replicates: 1", "replicates: 2")
WENT_ON = re.compile(r"trial (\w+): resumes at step ([0-9,]+) of")


class Kind(NamedTuple):
    """A launch of `spec` where one of `before` has stored its results; or, with
    `further` metrics, a measurement of these.
    """

    spec: str
    before: str = ""
    further: tuple[str, ...] = ()


KINDS = {
    "first launch": Kind(FIRST),
    "extension": Kind(MORE, before=FIRST),
    "checkpoints": Kind(LONG),
    "search": Kind(SOUGHT),
    "own code": Kind(OWN),
    "more of own code": Kind(OWN_MORE, before=OWN),
}
MEASURED_KINDS = {
    "further metric": Kind(FLOWN, before=FLOWN, further=("polarization",)),
    "further metric of a search": Kind(
        SOUGHT_FLOWN, before=SOUGHT_FLOWN, further=("polarization",)
    ),
}


class Promise(NamedTuple):
    """What is certain after so many steps: of a study, its plan or a trial."""

    steps: int
    stored: frozenset[str] = frozenset()
    planned: frozenset[str] = frozenset()
    reached: tuple[str, int] = ("", 0)


class Told(NamedTuple):
    """All promises up to a moment; `reached` has the step of a checkpoint by trial."""

    stored: frozenset[str]
    planned: frozenset[str]
    reached: dict[str, int]


@contextmanager
def small_world() -> Iterator[None]:
    """Many parts, mergers and checkpoints of few short trials, and no waiting."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(Writer.__init__.__kwdefaults__, "seconds", 0.0)
        patch.setitem(Chunks.__init__.__kwdefaults__, "seconds", 1e-9)
        patch.setattr(merging, "MOST_GATHERED", 3)
        patch.setattr(simulation, "BOID_STEPS_A_CALL", 12 * 4)
        patch.setattr(checkpoint, "TIMES_LONGER", 0.0)
        patch.setattr("sweep.store.provenance.git_state", lambda _folder: {})
        patch.setattr(lock, "WATCH_SECONDS", 0.0)
        patch.setattr(lock, "GIVEN_BACK", set())
        yield


read = cache(read_spec)


def launched(spec: str, results: Path) -> Counter[str]:
    """Launch a study, or a search; the new trials by status."""
    study = read(spec)
    return launch(study, results, Serial()).statuses


def done(kind: Kind, results: Path) -> int:
    """Launch or measure a study; the number of new trials, or of measured ones."""
    if not kind.further:
        return launched(kind.spec, results).total()
    name = read(kind.spec).name
    if {*kind.further} <= {*StoredStudy(name, results).metrics}:
        with pytest.raises(ChoiceError, match="recorded already"):
            measure(name, kind.further, results, Serial())
        return 0
    return measure(name, kind.further, results, Serial()).measured


def tables(spec: str, results: Path) -> list[pd.DataFrame]:
    """What a study has stored, less how long it took; and what a search asked for."""
    study = StoredStudy(read(spec).name, results)
    found = [study.trials, study.series, study.trajectories]
    if (asked := study.store.read_asked()) is not None:
        found.append(asked.to_pandas())
    return [
        table.sort_values([name for name in ("trial_id", "frame") if name in table])
        .drop(columns=["seconds", "replay"], errors="ignore")
        .reset_index(drop=True)
        for table in found
    ]


@dataclass
class Recording:
    """A recorded launch; the steps before `begin` have led to what it found."""

    kind: Kind
    begin: int
    steps: list[Step]
    promises: list[Promise]

    def told(self, steps: int) -> Told:
        """What was promised when so many steps were done."""
        told = Told(frozenset(), frozenset(), {})
        for promise in self.promises:
            if promise.steps <= steps:
                reached = dict([promise.reached] if promise.reached[0] else [])
                told = Told(
                    told.stored | promise.stored,
                    told.planned | promise.planned,
                    told.reached | reached,
                )
        return told


def record(kind: Kind, root: Path, before: list[Step] | None = None) -> Recording:
    """Record a launch into `root`; `before` are the steps that led to what is there."""
    results = root / "results"
    recorder, promises = Recorder(root, before), list[Promise]()
    begin = len(recorder.steps)
    if before is None and kind.before:
        promises.append(everything(kind.spec, results, begin))
    with small_world(), pytest.MonkeyPatch.context() as patch:
        patch.setattr("os.getpid", lambda: NOBODY)
        for place, name, promised in (
            (Store, "append", lambda _, part: {"stored": ids(part["trials"])}),
            (Store, "write_plan", planned),
            (checkpoint._Checkpoint, "_write", reached),
        ):
            method = promising(place, name, promised, recorder, promises)
            patch.setattr(place, name, method)
        with recorder.recording():
            done(kind, results)
    promises.append(everything(kind.spec, results, len(recorder.steps)))
    return Recording(kind, begin, recorder.steps, promises)


def planned(store: Store, *_: Any) -> dict[str, Any]:
    """The trials of the plan that was written."""
    return {"planned": flights(store.read_plan())}


def flights(plan: pa.Table) -> frozenset[str]:
    """What tells the trials of a plan apart, whatever they record."""
    columns = [plan[name].to_pylist() for name in ("point", "replicate", "seed")]
    return frozenset(" ".join(map(str, row)) for row in zip(*columns, strict=True))


def ids(table: pa.Table) -> frozenset[str]:
    return frozenset(table["trial_id"].to_pylist())


def reached(one: Any, _seconds: float) -> dict[str, Any]:
    """The step of a checkpoint that was written."""
    return {"reached": (one.simulation.job.trial_id, one.simulation.step)}


def everything(spec: str, results: Path, steps: int) -> Promise:
    """What a launch promises that has come to its end."""
    study = StoredStudy(read(spec).name, results)
    return Promise(steps, frozenset(study.store.trial_ids()), flights(study.plan))


def promising(
    place: type,
    name: str,
    promised: Callable[..., Any],
    recorder: Recorder,
    to: list[Promise],
) -> Callable[..., Any]:
    """A method that takes note of what is certain when it returns."""
    original = getattr(place, name)

    def method(*arguments: Any) -> Any:
        result = original(*arguments)
        recorder.look()
        to.append(Promise(len(recorder.steps), **promised(*arguments)))
        return result

    return method


def states(
    disk: Disk, random: Random, *, certain: bool = False
) -> Iterator[tuple[str, Tree]]:
    """What may be left after a crash at this moment, and of what kind the loss is; or
    all that is written, and what is certain.
    """

    def written(file: File) -> bytes:
        return file.content

    yield "nothing", disk.left(now, written)
    if not certain:
        yield "content", disk.left(now, lambda file: file.held)
        yield "content zeroed", disk.left(now, lambda file: zeroed(file, 0))
        yield "second half zeroed", disk.left(now, lambda file: zeroed(file, 0.5))
    yield "all names", disk.left(held, written)
    yield "all but what is promised", disk.left(held, lambda file: file.held)
    if certain:
        return
    for number in range(len(disk.pending)):
        yield "one name", disk.left(disk.without(number.__eq__), written)
    gone = {number for number in range(len(disk.pending)) if random.random() < 0.6}
    yield "many names", disk.left(disk.without(gone.__contains__), written)


def zeroed(file: File, share: float) -> bytes:
    """The content of which all after a share of what was not flushed are zeros."""
    start = common(file.content, file.held)
    kept = start + int(share * (len(file.content) - start))
    return file.content[:kept].ljust(len(file.content), b"\0")


def common(one: bytes, other: bytes) -> int:
    """How many bytes both begin with."""
    size = min(len(one), len(other))
    if one[:size] == other[:size]:
        return size
    return next(place for place in range(size) if one[place] != other[place])


def torn(disk: Disk, step: Step) -> Tree:
    """What is left in the middle of writing."""
    tree = disk.left(now, lambda file: file.content)
    before = tree[step.path] or b""
    start = common(before, step.content)
    half = start + (len(step.content) - start) // 2
    return tree | {step.path: step.content[:half] + before[half:]}


class State(NamedTuple):
    """What a crash has left: after how many steps, of what loss, with what promised."""

    steps: int
    loss: str
    tree: Tree
    told: Told


def crash_states(
    recording: Recording, seed: int, *, certain: bool = False
) -> Iterator[State]:
    """All states that differ, at every step of a recording; or those of `states` that
    say what is certain.
    """
    random, disk, known = Random(seed), Disk(), set[int]()
    for number in range(len(recording.steps) + 1):
        told = recording.told(number)
        found = (
            list(states(disk, random, certain=certain))
            if number >= recording.begin
            else []
        )
        if number < len(recording.steps):
            step = recording.steps[number]
            if step.what == "write" and number >= recording.begin and not certain:
                found.append(("a torn write", torn(disk, step)))
            disk.do(step)
        for loss, tree in found:
            key = hash(
                (
                    frozenset(tree.items()),
                    told.stored,
                    told.planned,
                    *told.reached.items(),
                )
            )
            if key not in known:
                known.add(key)
                yield State(number, loss, tree, told)


class Campaign:
    """Crash states below `folder`, read and launched again; `counts` says which."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.counts: Counter[str] = Counter()
        self.whole: dict[Kind, list[pd.DataFrame]] = {}

    def check(self, kind: Kind, state: State) -> None:
        """All that was promised is there, and the same command ends as in peace."""
        self.counts["states"] += 1
        self.counts[f"lost: {state.loss}"] += 1
        root = self.folder / "state"
        put(state.tree, root, age=600.0)
        results, name = root / "results", read(kind.spec).name
        with small_world(), said() as messages, pytest.MonkeyPatch.context() as patch:
            patch.setattr("os.fsync", lambda _: None)  # recordings are about that
            before = self.read(results / name, state.told)
            done(kind, results)
            found = [one for message in messages for one in WENT_ON.findall(message)]
            went_on = {one: int(step.replace(",", "")) for one, step in found}
            for trial_id, step in state.told.reached.items():
                assert trial_id in before or went_on[trial_id] >= step
            self.compare(kind, results)
            assert not done(kind, results), "the command has run something again"
        shutil.rmtree(root)

    def look(self, kind: Kind, state: State) -> None:
        """All that was promised is there."""
        self.counts["states only read"] += 1
        put(state.tree, self.folder / "state", age=600.0)
        self.read(self.folder / "state" / "results" / read(kind.spec).name, state.told)
        shutil.rmtree(self.folder / "state")

    def read(self, folder: Path, told: Told) -> set[str]:
        """The trials stored; none that was promised is missing, and all can be read."""
        store = Store(folder)
        stored = set(store.trial_ids())
        assert told.stored <= stored, "trials are gone that were stored"
        if told.planned or (folder / "plan.parquet").exists():
            study = StoredStudy(folder.name, folder.parent)
            assert told.planned <= flights(study.plan)
            if (asked := study.store.read_asked()) is not None:
                assert ids(asked) == ids(study.plan), "candidates have other trials"
            assert set(study.trials["trial_id"]) == stored & ids(study.plan)
            assert set(study.series["trial_id"]) <= stored
        return stored

    def compare(self, kind: Kind, results: Path) -> None:
        """The tables are those of a launch in peace, and nothing is left over."""
        both = zip(tables(kind.spec, results), self.in_peace(kind), strict=True)
        assert all(found.equals(wanted) for found, wanted in both)
        folder = results / read(kind.spec).name
        store = Store(folder)
        parts = [load_table(part, "trials", ["trial_id"]) for part in store.all_parts()]
        assert sum(map(len, parts)) == len(store.trial_ids())
        assert list((folder / "writing").iterdir()) == []
        assert not (folder / "lock").exists()
        assert not (folder / "checkpoints").exists()

    def in_peace(self, kind: Kind) -> list[pd.DataFrame]:
        """The tables of an undisturbed launch."""
        if kind not in self.whole:
            results = self.folder / f"peace-{len(self.whole)}"
            if kind.further:
                launched(kind.before, results)
            done(kind, results)
            self.whole[kind] = tables(kind.spec, results)
        return self.whole[kind]


@contextmanager
def said() -> Iterator[list[str]]:
    """The messages that are logged inside."""
    messages = list[str]()

    class Handler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            messages.append(record.getMessage())

    handler = Handler()
    logging.getLogger("sweep").addHandler(handler)
    try:
        yield messages
    finally:
        logging.getLogger("sweep").removeHandler(handler)
