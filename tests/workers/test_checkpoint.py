"""A trial that goes on from a checkpoint has the bits of an undisturbed one; what is
not a good one is not used.
"""

import json
import logging
import os
import zlib
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from itertools import cycle, islice
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from kernels import flight
from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.spec.study import parse_spec
from sweep.store.store import Store
from sweep.store.user_key import own_key
from sweep.trial import simulation
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, run
from sweep.workers import checkpoint, checkpoint_file
from sweep.workers.checkpoint import Checkpointed
from sweep.workers.checkpoint_folder import Checkpoints
from tests import builders, oscillators
from tests.cases import slow_but
from tests.faults.campaign import tables
from tests.studies import SMALL, relaunch
from tests.trial.test_trial import flown, in_another_process, small

TRIAL = "0123456789abcdef01234567"


class Killed(BaseException):
    """Stands for the end of the worker: nobody handles it, and nothing is tidied up."""


@pytest.fixture(autouse=True)
def _short_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many kernel calls a trial, and a checkpoint after every one."""
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 12 * 3)
    monkeypatch.setattr(checkpoint, "TIMES_LONGER", 0.0)


def named(a_job: Job) -> Job:
    return replace(a_job, trial_id=TRIAL)


def numbers(result: Result) -> dict[str, Any]:
    """Every bit of a result but the seconds it took."""

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return value.dtype.str, value.shape, value.tobytes()
        return (
            {name: plain(member) for name, member in value.items()}
            if isinstance(value, dict)
            else repr(value)
        )

    return {
        field.name: plain(getattr(result, field.name))
        for field in fields(Result)
        if field.name != "seconds"
    }


def killed_after(
    calls: int, a_job: Job, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Run a trial whose worker dies after so many kernel calls, each followed by a
    checkpoint.
    """
    look, left = checkpoint._Checkpoint.after_call, iter(range(calls - 1))

    def looking(self: Any, seconds: float) -> None:
        look(self, seconds)
        if next(left, None) is None:
            raise Killed

    with monkeypatch.context() as patched:
        patched.setattr(checkpoint._Checkpoint, "after_call", looking)
        with pytest.raises(Killed):
            Checkpointed(run, folder, 0.0)(a_job)


def step_of(folder: Path) -> int:
    """The step of the only checkpoint there is, as its header has it."""
    [path] = folder.glob("*.state")
    return int(json.loads(path.read_bytes().split(b"\n")[1])["step"])


def resumed(a_job: Job, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Result:
    """The result of a trial, which must go on from the step of its checkpoint and no
    other.
    """
    step, began = step_of(folder), []
    result_of = Simulation.result

    def noting(self: Simulation, *arguments: Any) -> Result:
        began.append(self.step)
        return result_of(self, *arguments)

    with monkeypatch.context() as patched:
        patched.setattr(Simulation, "result", noting)
        result = Checkpointed(run, folder, 1e9)(a_job)
    assert began == [step]
    assert step > 0
    return result


def jobs_of(model: str) -> Iterator[Job]:
    """Each preset, update, kind of borders and map at least once, and the start of a
    published program.
    """
    choices = [*MODELS[model].presets], builders.UPDATES, builders.BORDERS
    ways = zip(*map(cycle, choices), strict=True)
    for preset, update, borders in islice(ways, max(map(len, choices))):
        yield small(model, preset=preset, update=update, **borders)
    for name in builders.maps_of(model):
        size = builders.map_size(model, name)
        yield builders.job(
            model,
            metrics=("coverage", "escapes"),
            series=("speed",),
            map=name,
            **size,
            n=12,
            steps=20,
        )
    yield small(
        model,
        seed=2**40,
        literal=True,
        replicate=3,
        start_draws="python_random",
        every=7,
    )


ELSEWHERE = ["aziel_chen2025", "couzin2002", "strombom2014", "vasarhelyi2018"]
"""These go on from a last state among the fast tests: see test_last_state."""


@pytest.mark.parametrize("model", slow_but(MODELS.keys() - ELSEWHERE, MODELS))
def test_a_trial_goes_on_from_any_call_to_the_same_bits(
    model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Twice, once with and once without its trajectory, by way of files; where to is
    drawn.
    """
    random = Random(model)
    for number, a_job in enumerate(map(named, jobs_of(model))):
        wanted = flown(a_job) if number % 2 else a_job
        monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 12 * random.randint(1, 4))
        monkeypatch.setattr(flight, "FRAME_BYTES", random.choice([1, 5000, 10**6]))
        folder = tmp_path / str(number)
        for _ in range(2):
            killed_after(random.randint(1, 2), wanted, folder, monkeypatch)
        assert numbers(resumed(wanted, folder, monkeypatch)) == numbers(run(wanted)), (
            wanted
        )


def test_metrics_that_are_derived_go_on_to_the_same_bits_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    derive = 'derive: {gain: "polarization / speed", loss: "log(gain * start_speed)"}'
    spec = SMALL.replace("{series: [speed]", f"{{series: [speed, loss], {derive}")
    study = parse_spec(spec)
    for a_job in Jobs(study, expand(study))[:2]:
        killed_after(2, a_job, tmp_path, monkeypatch)
        result = resumed(a_job, tmp_path, monkeypatch)
        assert numbers(result) == numbers(run(a_job))
        assert {"gain", "loss"} <= result.mean.keys()
        assert np.isfinite(result.series["loss"]).all()


@pytest.fixture
def _oscillators() -> Iterator[None]:
    with builders.entered(oscillators.MODEL, order=oscillators.ORDER):
        yield


def oscillating(**changes: Any) -> Job:
    return named(builders.job("oscillators", series=("order",), **changes))


@pytest.mark.usefixtures("_oscillators")
@pytest.mark.parametrize("update", builders.UPDATES)
@pytest.mark.parametrize("calls", range(1, 7))
def test_the_state_of_boids_goes_on_to_the_same_bits(
    update: str, calls: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After each of its calls, the state from before a step too."""
    a_job = flown(oscillating(update=update))
    killed_after(calls, a_job, tmp_path, monkeypatch)
    result = resumed(a_job, tmp_path, monkeypatch)
    assert numbers(result) == numbers(run(a_job))
    assert result.states is not None
    assert result.states.shape == (21, 2, 12)


@pytest.mark.usefixtures("_oscillators")
def test_the_state_of_boids_is_kept_once_and_their_kinds_never() -> None:
    found = Simulation(oscillating()).state().arrays
    size = 2 * 12 * 8
    kept = {name: array.nbytes for name, array in found.items() if ".state" in name}
    del kept["record.watch.state"]
    assert kept == {"work.state": size, "work.state_before": size}
    assert not any("kind" in name for name in found)


@pytest.mark.usefixtures("_oscillators")
@pytest.mark.parametrize("name", ["work.state", "work.state_before"])
def test_a_checkpoint_with_a_state_that_is_not_finite_is_not_used(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    a_job = oscillating()
    put(broken_off(tmp_path, monkeypatch, a_job), name, NAN)
    with caplog.at_level(logging.WARNING, "sweep"):
        result = Checkpointed(run, tmp_path, 1e9)(a_job)
    [record] = caplog.records
    assert "impossible for a trial; the trial restarts at step 0" in record.message
    assert numbers(result) == numbers(run(a_job))


@pytest.mark.parametrize("model", MODELS)
def test_all_that_changes_is_in_a_checkpoint(model: str, tmp_path: Path) -> None:
    """Also what matters to a rare boid only, as the heading of one at rest."""
    earlier, later = (Simulation(named(small(model))) for _ in range(2))
    earlier.advance(9)
    earlier.take_frames()
    work = earlier.flight.work
    for number, array in enumerate((work.heading_x, work.before.x, work.near.dx)):
        array[:] = number + 0.5
    saved = checkpoint_file.Saved(earlier.state(), 1.5, 2, 3)
    checkpoint_file.write_state(tmp_path / "state", TRIAL, saved, own_key())
    found = checkpoint_file.read_state(
        tmp_path / "state", TRIAL, later.state(), own_key()
    )
    later.restore(found.state)
    assert found[1:] == saved[1:]
    assert (later.step, later.noise.state) == (9, earlier.noise.state)
    mine, theirs = later.state().arrays, earlier.state().arrays
    assert {name: array.tobytes() for name, array in mine.items()} == {
        name: array.tobytes() for name, array in theirs.items()
    }
    names = {f"flock.{name}" for name in earlier.flock._fields} | {
        "work.heading_x",
        "record.coverage.visits",
    }
    assert (
        names
        | {
            f"record.watch.{name}"
            for name in ("touching", "arrived", "in_step", "events")
        }
        <= mine.keys()
    )


def plain_job(**changes: Any) -> Job:
    """A trial with noise, of twenty steps in seven calls."""
    return named(small("aziel_chen2025", **changes))


def broken_off(
    folder: Path, monkeypatch: pytest.MonkeyPatch, a_job: Job | None = None
) -> Path:
    """The state of a trial that was killed after two of its calls."""
    killed_after(2, a_job or plain_job(), folder, monkeypatch)
    return folder / f"{TRIAL}.state"


def test_a_trial_goes_on_in_another_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_job = flown(plain_job())
    broken_off(tmp_path, monkeypatch, a_job)
    code = (
        "import pathlib\nfrom tests.workers import test_checkpoint as t\n"
        "t.simulation.BOID_STEPS_A_CALL = 36\n"
        f"result = t.Checkpointed(t.run, pathlib.Path({str(tmp_path)!r}),"
        " 1e9)(t.flown(t.plain_job()))\n"
        "print(t.zlib.crc32(repr(t.numbers(result)).encode()))"
    )
    assert int(in_another_process(code)) == zlib.crc32(
        repr(numbers(run(a_job))).encode()
    )
    assert [path.name for path in tmp_path.glob("*.state")] == [f"{TRIAL}.state"]


def test_a_gathered_flock_goes_on_with_lists_of_several_blocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A flock too large for blocks with room for everyone."""
    a_job = named(
        builders.job(
            "aziel_chen2025",
            n=300,
            steps=24,
            cohesion_weight=0.2,
            cohesion_range=150,
            fov=360,
        )
    )
    blocks = []

    def gathered(self: Simulation, *arguments: Any) -> Result:
        x, y = (400 + (place - 400) * 0.1 for place in (self.flock.x, self.flock.y))
        if self.step == 0:
            builders.place(self, x, y, self.flock.vx, self.flock.vy)
        grid = self.flight.work.grid
        lengths = grid.blocks[: grid.columns * grid.rows, 0]
        blocks.append(lengths.max() / (grid.blocks.shape[1] - 1))
        return result_of(self, *arguments)

    result_of = Simulation.result
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 300 * 4)
    monkeypatch.setattr(Simulation, "result", gathered)
    killed_after(3, a_job, tmp_path, monkeypatch)
    assert numbers(resumed(a_job, tmp_path, monkeypatch)) == numbers(run(a_job))
    assert min(blocks) > 1


def test_a_trial_of_one_call_is_run_without_a_look_at_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    checkpointed = Checkpointed(lambda _job: "run", tmp_path, 0.0)  # type: ignore[arg-type,return-value]
    monkeypatch.setattr(checkpoint, "_Checkpoint", None)
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 12 * 20)
    assert checkpointed(plain_job()) == "run"
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 12 * 20 - 1)
    assert checkpointed(plain_job()).status == "failed"


def test_checkpoints_come_when_it_is_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After so many seconds since the last one began, and not before 100 times what
    that took.
    """
    written = []
    monkeypatch.setattr(
        checkpoint._Checkpoint, "_write", lambda _self, seconds: written.append(seconds)
    )
    one = checkpoint._Checkpoint(tmp_path, Simulation(plain_job()), 60.0, own_key())
    for seconds in range(1, 200):
        one.after_call(float(seconds))
    assert written == [60.0, 121.0, 182.0]
    monkeypatch.setattr(checkpoint, "TIMES_LONGER", 1e12)
    one.after_call(1000.0)
    one.after_call(1e5)
    assert written[3:] == [1000.0]


def test_the_seconds_of_all_attempts_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = broken_off(tmp_path, monkeypatch)
    change(path, seconds=5000.0)
    result = Checkpointed(run, tmp_path, 1e9)(plain_job())
    assert 5000.0 < result.seconds < 6000.0
    Checkpoints(tmp_path).discard({TRIAL})
    broken_off(tmp_path, monkeypatch)
    change(path, seconds=5000.0)
    late = Checkpointed(run, tmp_path, 1e9)(replace(plain_job(), time_limit=4000.0))
    assert (late.status, late.step) == ("timeout", 9)


def change(path: Path, **header: Any) -> None:
    """Write other values into the header of a checkpoint, and its checksum so that they
    are believed.
    """
    _, about, arrays = path.read_bytes().split(b"\n", 2)
    content = json.dumps(json.loads(about) | header).encode() + b"\n" + arrays
    path.write_bytes(checkpoint_file._first_line(content, own_key()) + content)


def put(path: Path, name: str, value: int) -> None:
    """Write a number of 8 bytes at the beginning of an array, and the checksum so that
    it is believed.
    """
    content = path.read_bytes().split(b"\n", 1)[1]
    header, arrays = content.split(b"\n", 1)
    start = 0
    for array, (kind, *shape) in json.loads(header)["arrays"].items():
        if array == name:
            break
        start += int(np.dtype(kind).itemsize * np.prod(shape))
    content = (
        header
        + b"\n"
        + arrays[:start]
        + value.to_bytes(8, "little")
        + arrays[start + 8 :]
    )
    path.write_bytes(checkpoint_file._first_line(content, own_key()) + content)


def flip(path: Path) -> None:
    """Each file has its own place, drawn."""
    content = bytearray(path.read_bytes())
    place = Random(path.suffix).randrange(len(content))
    content[place] ^= 1 << (place % 8)
    path.write_bytes(content)


def frames_of(path: Path) -> Path:
    return path.with_suffix(".frames")


NAN = int.from_bytes(np.float64(np.nan).tobytes(), "little")
WRONG: dict[str, tuple[Callable[[Path], object], str]] = {
    "empty": (lambda path: os.truncate(path, 0), "is not a checkpoint"),
    "half": (lambda path: os.truncate(path, path.stat().st_size // 2), "is damaged"),
    "flipped": (flip, "is damaged"),
    "long": (lambda path: os.truncate(path, 2**22), "is larger than"),
    "something else": (
        lambda path: path.write_bytes(b"PK\x03\x04" * 100),
        "is not a checkpoint",
    ),
    "too new": (
        lambda path: path.write_bytes(
            path.read_bytes().replace(b"checkpoint 2", b"checkpoint 3", 1)
        ),
        "has an unknown format; this version reads format 2",
    ),
    "another trial's": (
        lambda path: change(path, trial_id="another"),
        "belongs to another trial",
    ),
    "another numpy's": (
        lambda path: change(
            path,
            code=json.dumps(
                json.loads(checkpoint_file.fingerprint()) | {"numpy": "9.9"}
            ),
        ),
        "was written by other code: numpy 9.9",
    ),
    "another processor's": (
        lambda path: change(path, machine=["an abacus"]),
        "on another kind of machine",
    ),
    "another shape": (
        lambda path: change(path, arrays={"flock.x": ["<f8", 10**12]}),
        "has other arrays",
    ),
    "no generator": (lambda path: change(path, generator={}), "restarts at step 0"),
    "another generator": (
        lambda path: change(path, generator={"bit_generator": "MT19937"}),
        "restarts at step 0",
    ),
    "a list": (lambda path: change(path, code=[1]), "restarts at step 0"),
    "not finite": (
        lambda path: put(path, "flock.x", NAN),
        "the state is impossible for a trial",
    ),
    "a step too far": (
        lambda path: put(path, "record.progress", 10**15),
        "the state is impossible for a trial",
    ),
    "an index too large": (
        lambda path: put(path, "record.watch.order", 2**40),
        "the state is impossible for a trial",
    ),
    "frames gone": (lambda path: frames_of(path).unlink(), "No such file"),
    "frames cut": (
        lambda path: os.truncate(frames_of(path), 10),
        "has fewer frames than its header declares",
    ),
    "frames flipped": (lambda path: flip(frames_of(path)), "has damaged frames"),
    "frames below zero": (
        lambda path: change(path, frames=-1),
        "has fewer frames than its header declares",
    ),
    "frames beyond": (
        lambda path: change(path, frames=10**30),
        "has more frames than the trial has steps",
    ),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_checkpoint_that_is_not_good_is_said_and_not_used(
    what: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    path = broken_off(tmp_path, monkeypatch)
    spoil, message = WRONG[what]
    spoil(path)
    with caplog.at_level(logging.WARNING, "sweep"):
        result = Checkpointed(run, tmp_path, 1e9)(plain_job())
    [record] = caplog.records
    assert message in record.message
    assert record.message.endswith("the trial restarts at step 0")
    assert numbers(result) == numbers(run(plain_job()))
    assert list(tmp_path.iterdir()) == []


def test_any_flipped_bit_of_a_checkpoint_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, own = broken_off(tmp_path, monkeypatch), Simulation(plain_job()).state()
    whole, random = path.read_bytes(), Random(1)
    for place in (
        0,
        21,
        23,
        30,
        40,
        *(random.randrange(len(whole)) for _ in range(100)),
    ):
        content = bytearray(whole)
        content[place] ^= 1 << random.randrange(8)
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"damaged|format"):
            checkpoint_file.read_state(path, TRIAL, own, own_key())


def test_what_was_added_to_the_frames_and_never_declared_is_cut_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = broken_off(tmp_path, monkeypatch)
    size = frames_of(path).stat().st_size
    with frames_of(path).open("ab") as file:
        file.write(b"x" * 1000)
    killed_after(1, plain_job(), tmp_path, monkeypatch)
    assert frames_of(path).stat().st_size == size * 10 // 7
    assert numbers(resumed(plain_job(), tmp_path, monkeypatch)) == numbers(
        run(plain_job())
    )


def test_a_trial_that_dies_on_going_on_begins_anew_at_the_third_attempt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    broken_off(tmp_path, monkeypatch)

    def dying(*_: object) -> None:
        raise Killed

    monkeypatch.setattr(Simulation, "restore", dying)
    for number in (1, 2):
        with pytest.raises(Killed):
            Checkpointed(run, tmp_path, 1e9)(plain_job())
        assert sorted(path.suffix for path in tmp_path.iterdir()) == [
            ".frames",
            f".tried-{number}",
        ]
    with caplog.at_level(logging.WARNING, "sweep"):
        assert numbers(Checkpointed(run, tmp_path, 1e9)(plain_job())) == numbers(
            run(plain_job())
        )
    assert (
        "its worker died twice when it resumed from its checkpoint;"
        " the trial restarts at step 0" in caplog.text
    )
    assert list(tmp_path.iterdir()) == []


def test_being_killed_again_and_again_later_loses_no_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = broken_off(tmp_path, monkeypatch, flown(plain_job()))
    before, look = path.read_bytes(), checkpoint._Checkpoint.after_call

    def looking(self: Any, seconds: float) -> None:
        look(self, seconds)
        raise Killed

    for _ in range(4):
        with monkeypatch.context() as patched:
            patched.setattr(checkpoint._Checkpoint, "after_call", looking)
            with pytest.raises(Killed):
                Checkpointed(run, tmp_path, 1e9)(flown(plain_job()))
        assert path.read_bytes() == before
    assert numbers(resumed(flown(plain_job()), tmp_path, monkeypatch)) == numbers(
        run(flown(plain_job()))
    )


def test_a_trial_that_raises_leaves_no_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken_off(tmp_path, monkeypatch)

    def broken(*_: object) -> None:
        raise RuntimeError("the metric of this test is broken")

    monkeypatch.setitem(METRICS, "speed", METRICS["speed"]._replace(measure=broken))
    monkeypatch.setattr(checkpoint._Checkpoint, "resume", lambda _self: 0.0)
    result = Checkpointed(run, tmp_path, 1e9)(plain_job())
    assert (result.status, list(tmp_path.iterdir())) == ("failed", [])


def no_folder(folder: Path, _monkeypatch: pytest.MonkeyPatch) -> Path:
    return folder / "no" / "checkpoints"


def a_link(folder: Path, _monkeypatch: pytest.MonkeyPatch) -> Path:
    (folder / "elsewhere").mkdir()
    (folder / "checkpoints").symlink_to(folder / "elsewhere")
    return folder / "checkpoints"


def linked_frames(folder: Path, _monkeypatch: pytest.MonkeyPatch) -> Path:
    (folder / "precious").write_text("precious")
    (folder / "checkpoints").mkdir()
    (folder / "checkpoints" / f"{TRIAL}.frames").symlink_to(folder / "precious")
    return folder / "checkpoints"


def full_disk(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    def failing(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", failing)
    return folder / "checkpoints"


@pytest.mark.parametrize("hindrance", [no_folder, a_link, linked_frames, full_disk])
def test_where_no_checkpoint_can_be_written_that_is_said_once_and_trials_run(
    hindrance: Callable[[Path, pytest.MonkeyPatch], Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    folder = hindrance(tmp_path, monkeypatch)
    with caplog.at_level(logging.WARNING, "sweep"):
        results = [
            Checkpointed(run, folder, 0.0)(plain_job(seed=seed)) for seed in (1, 2)
        ]
    assert [numbers(result) for result in results] == [
        numbers(run(plain_job(seed=seed))) for seed in (1, 2)
    ]
    [record] = caplog.records
    assert "cannot write checkpoints (" in record.message
    assert not list(tmp_path.glob("elsewhere/*"))
    assert not (tmp_path / "no").exists()
    if hindrance is linked_frames:
        assert (tmp_path / "precious").read_text() == "precious"


def test_a_folder_that_goes_before_the_first_file_is_there_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Another launch has just deleted the last checkpoint of its own, and the folder
    with it.
    """
    folder, make, made = tmp_path / "checkpoints", checkpoint.make_folder, []

    def making(path: Path) -> None:
        make(path)
        made.append(path)
        if len(made) == 1:
            Checkpoints(folder).keep_only(())

    monkeypatch.setattr(checkpoint, "make_folder", making)
    broken_off(folder, monkeypatch)
    assert made == [folder, folder]
    assert Checkpoints(folder).trials() == {TRIAL}
    assert not caplog.records


def test_checkpoints_are_listed_and_deleted_by_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "checkpoints"
    folder.mkdir()
    assert (
        Checkpoints(folder).trials() == Checkpoints(tmp_path / "none").trials() == set()
    )
    others = [
        "a" * 24 + ".state",
        "a" * 24 + ".frames",
        "b" * 24 + ".tried-1",
        "b" * 24 + ".frames",
    ]
    for name in others:
        (folder / name).touch()
    broken_off(folder, monkeypatch)
    assert Checkpoints(folder).trials() == {TRIAL, "a" * 24, "b" * 24}
    Checkpoints(folder).discard({TRIAL})
    assert sorted(path.name for path in folder.iterdir()) == sorted(others)
    Checkpoints(folder).discard({"a" * 24, "b" * 24})
    assert not folder.exists()
    Checkpoints(folder).discard({TRIAL})


def test_folders_that_are_links_are_left_alone(tmp_path: Path) -> None:
    folder = a_link(tmp_path, pytest.MonkeyPatch())
    (tmp_path / "elsewhere" / f"{TRIAL}.state").touch()
    assert Checkpoints(folder).trials() == set()
    Checkpoints(folder).discard({TRIAL})
    assert (tmp_path / "elsewhere" / f"{TRIAL}.state").exists()


LONG = SMALL.replace("steps: 9", "steps: 30") + "checkpoint: 1.0e-9\n"


def interrupted(spec: str, results: Path, monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Launch a study and be killed in its fourth trial; the trials that have a
    checkpoint, those of its chunk.
    """
    look, calls = checkpoint._Checkpoint.after_call, iter(range(3 * 9 + 1))

    def looking(self: Any, seconds: float) -> None:
        look(self, seconds)
        if next(calls, None) is None:
            raise Killed

    with monkeypatch.context() as patched:
        patched.setattr(checkpoint._Checkpoint, "after_call", looking)
        with pytest.raises(Killed):
            relaunch(spec, results)
    return Checkpoints(results / "small" / "checkpoints").trials()


@pytest.fixture
def whole(tmp_path: Path) -> dict[str, str]:
    """The tables of LONG without checkpoints."""
    relaunch(LONG.replace("1.0e-9", "false"), tmp_path / "whole")
    return tables(tmp_path / "whole" / "small")


def test_checkpoints_go_when_the_disk_holds_the_trial(
    tmp_path: Path, whole: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    append, folder, seen = Store.append, tmp_path / "small" / "checkpoints", []

    def appending(self: Store, parts: Any) -> Any:
        seen.append(
            Checkpoints(folder).trials() == set(parts["trials"]["trial_id"].to_pylist())
        )
        return append(self, parts)

    monkeypatch.setattr(Store, "append", appending)
    assert relaunch(LONG, tmp_path).statuses == {"done": 6}
    assert seen == [True]
    assert not folder.exists()
    assert tables(tmp_path / "small") == whole


def test_the_next_launch_goes_on_and_drops_what_nobody_asks_for(
    tmp_path: Path,
    whole: dict[str, str],
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """What is stored, and what is not in the plan."""
    folder = tmp_path / "small" / "checkpoints"
    going_on, stored = (
        interrupted(LONG, tmp_path, monkeypatch),
        Store(tmp_path / "small").trial_ids(),
    )
    assert going_on
    assert stored
    (folder / f"{next(iter(stored))}.state").touch()
    (folder / f"{'f' * 24}.state").touch()
    asked_for: list[set[str]] = []
    monkeypatch.setattr(
        checkpoint._Checkpoint, "resume", noting_presence(folder, asked_for)
    )
    with caplog.at_level(logging.WARNING, "sweep"):
        assert relaunch(LONG, tmp_path).stored == len(stored)
    assert asked_for[0] == going_on
    went_on = {
        message.split()[1].strip(":")
        for message in caplog.messages
        if "resumes at step" in message
    }
    assert went_on == going_on
    assert not folder.exists()
    assert tables(tmp_path / "small") == whole


def noting_presence(folder: Path, noted: list[set[str]]) -> Callable[[Any], float]:
    """A `resume` that takes note of the checkpoints that there are when it begins."""
    resume = checkpoint._Checkpoint.resume

    def noting(self: Any) -> float:
        noted.append(Checkpoints(folder).trials())
        return resume(self)

    return noting


def test_a_trial_that_took_too_long_is_tried_again_from_its_beginning(
    tmp_path: Path, whole: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    policy = "time_limit: 4000\non_error: retry\nretries: 1\n"
    for late in interrupted(LONG, tmp_path, monkeypatch):
        change(tmp_path / "small" / "checkpoints" / f"{late}.state", seconds=5000.0)
    assert set(relaunch(LONG + policy, tmp_path).statuses) == {"done"}
    assert tables(tmp_path / "small") == whole


def test_without_checkpoints_there_are_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpoint, "_Checkpoint", None)
    assert relaunch(LONG.replace("1.0e-9", "false"), tmp_path).statuses == {"done": 6}
