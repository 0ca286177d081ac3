"""What measures a GPU runs to its end on an emulated one, and what fails is said."""

import json
import math
import time
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from sweep.design.jobs import Job
from sweep.trial import on_device
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, run
from tests.bench import device, jax_flock
from tests.bench.device import GRACE, PARTS, Found, as_markdown, measured, part
from tests.bench.device_parts import Machine, Row, Watched
from tests.builders import job, place, state, to_end

A_WEEK = 7 * 24 * 3600.0
SMALL = Machine(emulated=True, until=time.monotonic() + A_WEEK)
LATE = Machine(emulated=True, until=-math.inf)


def rows_of(name: str, machine: Machine = SMALL) -> list[Row]:
    return list(PARTS[name].rows(machine))


@pytest.mark.slow
def test_small_trials_are_flown_there_and_compared() -> None:
    [row] = rows_of("golden")
    assert row["trials"] == row["flown there"] == 3
    assert row["other bits"] == 0


def test_other_bits_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the first trial of each batch. All are flown here, where nothing has to be
    compiled; that a device has their bits is shown by tests/trial/test_on_device.py.
    """
    batches = list[int]()

    def off(jobs: list[Job], _device: object) -> list[Result]:
        batches.append(len(jobs))
        first, *others = (run(one) for one in jobs)
        last = {name: np.nextafter(x, 9) for name, x in first.last.items()}
        return [replace(first, last=last), *others]

    monkeypatch.setattr(on_device, "flown", off)
    [row] = rows_of("golden")
    assert row["other bits"] == len(batches) < sum(batches) == row["trials"]
    assert row["error"] == "first: as_written, seed 27, replicate 0"


@pytest.mark.slow
def test_boid_steps_are_counted_there_and_here() -> None:
    rows = rows_of("throughput")
    assert [row["N"] for row in rows] == list(SMALL.sizes)
    for row in rows:
        made = row["flights"] * row["N"] * 20
        assert row["GPU"] * row["seconds flying"] == pytest.approx(made)
        assert row["GPU / alone"] == row["GPU"] / row["alone"]
        assert "error" not in row


@pytest.mark.slow
def test_time_is_shared_out_and_batches_are_tried() -> None:
    rows = rows_of("limits")
    assert not [row for row in rows if "error" in row]
    shares = [row["share"] for row in rows if "share" in row]
    assert sum(shares) == pytest.approx(1)
    assert min(shares) > 0
    assert [row["flights"] for row in rows if "flights" in row] == [2, 2, 2, 2, 3]


def test_published_numbers_stand_beside_and_jax_if_it_is_there() -> None:
    *published, jax = rows_of("others")[:6]
    rates = [row["boid-steps/s"] for row in published]
    read_before = [2.5e6, 14.9e6, 73.8e6, 2.8e6, 18.2e6]  # to the digits given
    assert rates == pytest.approx(read_before, rel=0.02)
    assert ("boid-steps/s" in jax) != ("error" in jax)


def test_what_does_not_fit_is_said() -> None:
    for name in ("golden", "throughput"):
        rows = rows_of(name, LATE)
        assert {row["error"] for row in rows} == {"did not fit into the time"}


@pytest.mark.slow
def test_kernels_are_compiled() -> None:
    pytest.importorskip("numba_cuda", reason="the extra `gpu` is not installed")
    row, whole = rows_of("compiling")
    assert 0 < row["registers"] <= 255
    assert "error" not in row
    assert whole["seconds"] > 0


@pytest.mark.slow
def test_a_study_is_launched_and_verified() -> None:
    launched, sample, verified = rows_of("study")
    for row in (launched, sample):
        assert row["trials"] == row["done"] == 24
    assert "24 of 24 bitwise identical" in verified["words"]
    assert not [row for row in (launched, sample, verified) if "error" in row]


def test_a_part_is_written_row_by_row_in_its_own_process(tmp_path: Path) -> None:
    found = measured("others", True, tmp_path, 300)
    assert found.error == ""
    assert [row["N"] for row in found.rows[:5]] == [128, 1024, 8192, 128, 1024]


def test_a_part_without_its_gpu_fails_and_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("cuda.bindings", reason="the extra `gpu` is not installed")
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "")
    found = measured("limits", False, tmp_path, 300)
    assert "DeviceError" in found.error
    assert found.rows == []


def test_a_part_that_takes_too_long_is_ended(tmp_path: Path) -> None:
    found = measured("golden", True, tmp_path, -GRACE)
    assert found.error == "ended after 0 s; the rest did not fit"


def test_rows_are_kept_where_a_part_fails(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(_machine: Machine) -> object:
        yield {"what": "first", "N": 1}
        raise RuntimeError("an illegal address was met")

    failing = replace(PARTS["others"], rows=fails)  # type: ignore[arg-type]
    monkeypatch.setitem(PARTS, "others", failing)
    with pytest.raises(RuntimeError):
        part("others", SMALL, tmp_path / "rows")
    assert json.loads((tmp_path / "rows").read_text()) == {"what": "first", "N": 1}


def test_the_table_has_all_rows_and_errors() -> None:
    rows: list[Row] = [
        {"what": "a | b", "N": 10_000},
        {"what": "c", "N": 2, "error": "it\nfailed"},
        {"what": "d", "seconds": 0.12345},
    ]
    found = {"others": Found(rows, 2.0, "ended")}
    text = as_markdown({"GPU": "Test GPU 9"}, found)
    for line in (
        "| GPU | Test GPU 9 |",
        "| what | N | error |",
        "| a / b | 10,000 |  |",
        "| c | 2 | it failed |",
        "| what | seconds |",
        "| d | 0.123 |",
        "2 s.",
        "Ended early: ended",
    ):
        assert line in text.splitlines()


def test_files_have_the_name_of_the_gpu(tmp_path: Path) -> None:
    found = {"others": Found([{"N": 1}], 2.0)}
    device._write(tmp_path, {"GPU": "NVIDIA H100, capability 9.0"}, found)
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["device-nvidia-h100.json", "device-nvidia-h100.md"]
    stored = json.loads((tmp_path / names[0]).read_text())
    assert stored["parts"] == {"others": asdict(found["others"])}


def test_without_a_gpu_one_line_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(on_device, "problem", lambda: "no driver of a GPU is found")
    assert device.device() == 0
    assert capsys.readouterr().out == (
        "device: no driver of a GPU is found, skipped; --emulated runs all on the"
        " processor\n"
    )


def test_parts_take_less_than_ten_minutes() -> None:
    assert sum(one.seconds + GRACE for one in PARTS.values()) < 600


def test_work_of_a_device_is_counted_by_its_kind() -> None:
    watched = Watched(SMALL.device())
    room = watched.take(10, "f8")
    watched.send(np.arange(10.0), room)
    watched.bring(room, back := np.empty(10))
    assert back.tolist() == list(range(10))
    assert set(watched.seconds) == {"taking memory", "sending", "bringing back"}


def test_the_flock_for_jax_is_vicsek1995() -> None:
    """One step without noise, of boids of which some see each other over the border.
    Sums are in other orders, and own functions round in another way: of some ten
    operations on numbers up to 5, each is off by 2^-52 of these at most.
    """
    n, size = 60, 5.0
    rng = np.random.default_rng(4)
    x, y = rng.uniform(0, size, (2, n))
    angle = rng.uniform(-np.pi, np.pi, n)
    vx, vy = 0.03 * np.cos(angle), 0.03 * np.sin(angle)
    one = job("vicsek1995", "as_run", metrics=("speed",), n=n, steps=1, noise=0.0)
    ours = state(to_end(place(Simulation(one), x, y, vx, vy)).flock)
    flock = jax_flock.Flocks(x, y, vx, vy)
    theirs = jax_flock.step(np, flock, np.zeros(n), size, 1.0)
    np.testing.assert_allclose(np.stack(theirs), ours, rtol=0, atol=1e-13)
