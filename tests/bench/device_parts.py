"""What `device.py` measures on a GPU, a part each. A part is given a Machine and gives
rows, one after the other, so that what was found is kept where it is ended.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import (
    Executor,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    as_completed,
)
from dataclasses import dataclass, field, replace
from itertools import chain, pairwise, product
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from kernels.catalogue import BUILT_IN
from kernels.device.batch import BOID_STEPS_A_CALL, Batch, Device
from kernels.device.host import Host
from kernels.device.kernel import TAKE
from kernels.models import MODELS
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.errors import StoreError
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.trial import on_device
from sweep.trial.simulation import run
from tests import ROOT
from tests.bench import jax_flock
from tests.bench.timing import alone, together
from tests.builders import exact_jobs, fingerprint, job

Row = dict[str, Any]

SPEC = ROOT / "experiments" / "aziel_chen2025" / "gains.yaml"
POINTS, STEPS = "points: 2000", "steps: 3600"
STUDY = "aziel_chen2025/gains"
SWEEP = [sys.executable, "-c", "from sweep.cli import main; main()"]
SIZES = 100, 1000, 20, 10_000, 200, 50, 500, 2000, 5000
"""The most telling first: time may not be enough for all."""
FLYING = "nguyen2024", "vicsek1995"
MEASURED = ("aziel_chen2025", *FLYING)
TRIED = "nguyen2024"
"""With other blocks, registers and batches."""
MOST_FLIGHTS, MOST_BYTES, DISTINCT = on_device.MOST_ON_DEVICE, 2**33, 256
"""Of a batch: flights, as a launch has them; bytes, since this machine has to hold them
too; and flights that differ. A batch has each of these several times, and no two of one
start in a warp of 32 threads.
"""
CALLS = 2
CPU_SECONDS = 0.4
BLOCKS, REGISTERS, BATCHES = (64, 32, 128), (255, 128), (8192, 2048, 32_768)
"""Threads of a block, registers of a thread and flights of a batch: the first is usual.
"""
SHARED = 2048
"""Trials whose time is shared out."""


class Emulated(Host):
    """This processor as the device, which has neither blocks nor a GPU's registers."""

    threads = registers = 0


@dataclass
class Machine:
    """Where parts are measured: on the GPU, or, `emulated`, all of it small and on this
    processor as the device. `until` is when a part should end, by time.monotonic.
    """

    emulated: bool
    until: float

    def device(self) -> Any:
        """The GPU of this process, or what stands for it."""
        return Emulated() if self.emulated else on_device.gpu()

    @property
    def left(self) -> float:
        """Seconds."""
        return self.until - time.monotonic()

    @property
    def models(self) -> Sequence[str]:
        return ("vicsek1995",) if self.emulated else list(MODELS)

    @property
    def flying(self) -> Sequence[str]:
        return ("vicsek1995",) if self.emulated else FLYING

    @property
    def sizes(self) -> Sequence[int]:
        return (20, 50) if self.emulated else SIZES

    @property
    def flights(self) -> int:
        return 3 if self.emulated else MOST_FLIGHTS

    @property
    def cores(self) -> int:
        return 1 if self.emulated else len(os.sched_getaffinity(0))

    @property
    def executor(self) -> list[str]:
        return ["--workers", "1"] if self.emulated else ["--executor", "cuda"]

    def exact_jobs(self, model: str) -> list[Job]:
        jobs = list(exact_jobs(model))
        return jobs[:3] if self.emulated else jobs

    def study(self, points: int) -> str:
        """The text of the gain study with so many of its gain vectors."""
        text = SPEC.read_text()
        assert text.count(POINTS) == text.count(STEPS) == 1, f"{SPEC} has changed"
        few = "steps: 20" if self.emulated else STEPS
        return text.replace(POINTS, f"points: {points}").replace(STEPS, few)

    def pool(self) -> Executor:
        """Processes that begin anew: none has a GPU of another."""
        if self.emulated:
            return ThreadPoolExecutor(1)
        return ProcessPoolExecutor(self.cores, mp_context=get_context("spawn"))


@dataclass
class Watched:
    """A device, and the seconds that each kind of its work takes. It waits until each
    is over, so that none counts for the next.
    """

    device: Device
    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    flights: int = 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self.device, name)

    def _timed(self, kind: str, work: Callable[..., Any], *given: Any) -> Any:
        began = time.perf_counter()
        found = work(*given)
        self.device.wait()
        self.seconds[kind] += time.perf_counter() - began
        return found

    def load(self, kernel: Any) -> Any:
        return self._timed("loading", self.device.load, kernel)

    def take(self, size: int, numbers: str) -> Any:
        return self._timed("taking memory", self.device.take, size, numbers)

    def send(self, *given: Any) -> None:
        self._timed("sending", self.device.send, *given)

    def bring(self, *given: Any) -> None:
        self._timed("bringing back", self.device.bring, *given)

    def call(self, program: Any, numbers: Any, rooms: Any, count: int) -> None:
        flying = numbers[0] == TAKE
        kind = "flying" if flying else "turning arrays round"
        self._timed(kind, self.device.call, program, numbers, rooms, count)
        self.flights = max(self.flights, count)


# Compiling: in all cores, before the GPU is asked for anything.


def compiling(machine: Machine) -> Iterator[Row]:
    """Each kernel that the other parts need, for the GPU, and for this processor."""
    capability = (9, 0) if machine.emulated else machine.device().capability
    began, pool = time.monotonic(), machine.pool()
    waiting = {
        pool.submit(_compiled, jobs, capability, most): f"{what}, kernel {place + 1}"
        for what, most, some in _wanted(machine)
        for place, jobs in enumerate(some)
    }
    for model in () if machine.emulated else MEASURED:
        waiting[pool.submit(_in_lanes, _flock(model, 100))] = f"{model}, in lanes"
    try:
        for done in as_completed(waiting, timeout=max(0.0, machine.left)):
            row = {"what": waiting[done]}
            try:
                yield row | done.result()
            except Exception as error:
                yield row | {"error": f"{type(error).__name__}: {error}"}
        yield {"what": "all, wall time", "seconds": time.monotonic() - began}
    except TimeoutError:
        left = sum(not one.done() for one in waiting)
        yield {"what": "all", "error": f"{left} kernels did not fit into the time"}
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _wanted(machine: Machine) -> Iterator[tuple[str, int, Iterable[list[Job]]]]:
    """What is compiled, for so many registers, of jobs that fly together."""
    usual, *fewer = REGISTERS
    for model in machine.flying if machine.emulated else MEASURED:
        jobs = [_flock(model, 100, seed=seed) for seed in (0, 1)]
        yield f"{model}, N=100", usual, [jobs]
        for most in () if machine.emulated else fewer:
            yield f"{model}, N=100, {most} registers", most, [jobs]
    if not machine.emulated:
        yield "the study", usual, _batches_of_study(machine)
        for model in machine.models:
            jobs = machine.exact_jobs(model)
            yield f"{model}, small trials", usual, _of_one_form(jobs)


def _in_lanes(one: Job) -> Row:
    """What is compiled for the lanes of this processor."""
    began = time.process_time()
    together(one)
    return {"seconds": time.process_time() - began}


def _compiled(jobs: Sequence[Job], capability: tuple[int, int], registers: int) -> Row:
    """What is compiled for jobs that fly together: seconds of processor time, and what
    a thread of a GPU needs.
    """
    from kernels.device.assembly import assembled
    from kernels.device.ptx import ptx_of

    began = time.process_time()
    kernel = on_device._batch(list(map(_ready, jobs))).kernel
    compiled = ptx_of(kernel, capability)
    row: Row = dict(assembled(compiled.text, capability, registers).needs._asdict())
    row["parameter bytes"] = 8 * (len(kernel.numbers) + len(kernel.arrays))
    row["seconds"] = time.process_time() - began
    run(jobs[0])
    return row | ({"error": compiled.refusal} if compiled.refusal else {})


def _of_one_form(jobs: Sequence[Job]) -> Iterator[list[Job]]:
    """Jobs that a device is given at once and flies together."""
    found = defaultdict[Any, list[Job]](list)
    for one in jobs:
        about = one.record, one.settings["n"], one.settings["steps"]
        found[*about, _ready(one).kind].append(one)
    yield from found.values()


def _batches_of_study(machine: Machine) -> Iterator[list[Job]]:
    """Small batches of the study that have different kernels: which numbers are alike
    in all flights depends on the maps of a batch. A launch asks first of single trials.
    """
    study = parse_spec(machine.study(2), SPEC)
    jobs, maps = list(Jobs(study, expand(study))), defaultdict[Any, list[Job]](list)
    for one in jobs:
        if one.settings["n"] == jobs[0].settings["n"]:
            maps[one.settings["map"]].append(one)
    first, second, *others = [some[:2] for some in maps.values()]
    mixed = [[*first, *second], [*first, *second, *chain(*others)]]
    found = dict[str, list[Job]]()
    alone = [some[:1] for some in (first, second, *others)]
    for some in [*mixed, first, second, *others, *alone]:
        found.setdefault(on_device._batch(list(map(_ready, some))).kernel.text, some)
    yield from found.values()


# Golden trials.


def golden(machine: Machine) -> Iterator[Row]:
    """Small trials of each model, that take every path, flown there and here."""
    device = machine.device()
    for model in machine.models:
        jobs = machine.exact_jobs(model)
        if machine.left < 0:
            yield {"model": model, "error": "did not fit into the time"}
            continue
        began, flown, other = time.monotonic(), 0, list[str]()
        try:
            for some in _of_one_form(jobs):
                watched = Watched(device)
                results = on_device.flown(some, watched)
                flown += watched.flights
                other += [
                    f"{one.preset}, seed {one.seed}, replicate {one.replicate}"
                    for one, mine in zip(some, results, strict=True)
                    if fingerprint(mine) != fingerprint(run(one))
                ]
        finally:
            row = {"model": model, "trials": len(jobs), "flown there": flown}
            row |= {"other bits": len(other), "seconds": time.monotonic() - began}
            yield row | ({"error": f"first: {other[0]}"} if other else {})


# Throughput.


def _flock(model: str, n: int, steps: int = 100, seed: int = 1) -> Job:
    """A trial of N boids at the density of the preset, measured at its end."""
    preset = BUILT_IN.models[model].presets["as_run"]
    larger = (n / float(preset["n"])) ** 0.5
    size = {side: float(preset[side]) * larger for side in ("width", "height")}
    where = {"map": "empty"} if model != "aziel_chen2025" else {"map": "cafeteria"}
    return job(
        model,
        metrics=("polarization",),
        seed=seed,
        every=steps,
        n=n,
        steps=steps,
        **(size if where["map"] == "empty" else {}),
        **where,
    )


def throughput(machine: Machine) -> Iterator[Row]:
    """Boid-steps a second, of both models at all sizes, there and here."""
    device = machine.device()
    with machine.pool() as pool:
        for n in machine.sizes:
            for model in machine.flying:
                row: Row = {"model": model, "N": n}
                if machine.left < 0:
                    yield row | {"error": "did not fit into the time"}
                    continue
                try:
                    row |= _rate(machine, device, model, n)
                    row |= _here(machine, pool, model, n)
                    for name in ("alone", "in lanes"):
                        row[f"GPU / {name}"] = row["GPU"] / row[name]
                except MemoryError as error:
                    row["error"] = str(error)
                yield row


def _steps_of(n: int) -> int:
    """Of some calls of a device."""
    return CALLS * max(1, BOID_STEPS_A_CALL // n)


def _rate(
    machine: Machine, device: Any, model: str, n: int, flights: int | None = None
) -> Row:
    """What a batch of trials of N boids does in a second, of its flying alone."""
    steps = 20 if machine.emulated else _steps_of(n)
    most = flights or machine.flights
    distinct = [
        _ready(_flock(model, n, steps, seed)) for seed in range(min(DISTINCT, most))
    ]
    bytes_each = _batch_of(distinct[:1], 1).bytes
    free = min(MOST_BYTES, int(0.8 * device.free_bytes()))
    count = max(1, min(most, free // bytes_each))
    batch, watched = _batch_of(distinct, count), Watched(device)
    for _ in batch.fly(watched, maps=False):
        pass
    lost = int((batch.states != 0).sum())
    seconds = watched.seconds["flying"]
    row = {"flights": count, "GPU": count * n * steps / seconds}
    row |= {"bytes a flight": bytes_each, "seconds flying": seconds}
    return row | ({"error": f"{lost} flights were lost"} if lost else {})


def _ready(one: Job) -> Any:
    prepared = on_device._prepared(one)
    assert prepared is not None, f"{one.model} cannot begin"
    return prepared


def _batch_of(distinct: Sequence[Any], count: int) -> Batch:
    """A batch of so many flights, of which some are the same."""
    some = [distinct[k % len(distinct)] for k in range(count)]
    return on_device._batch(some)


def _here(machine: Machine, pool: Executor, model: str, n: int) -> Row:
    """The same of this machine's processors, with all cores at work."""
    one = _flock(model, n, 20 if machine.emulated else _steps_of(n))
    row = {}
    for name, way in (("alone", alone), ("in lanes", together)):
        started = [
            pool.submit(_rate_here, way, one, seed) for seed in range(machine.cores)
        ]
        row[name] = sum(done.result() for done in started)
    return row


def _rate_here(way: Callable[[Job], float], one: Job, seed: int) -> float:
    """Boid-steps in a second of processor time of this core."""
    way(one)  # loads or compiles
    trials, seconds, began = 0, 0.0, time.monotonic()
    while trials == 0 or time.monotonic() - began < CPU_SECONDS:
        trials += 1
        seconds += way(replace(one, seed=1000 * seed + trials))
    return trials * float(one.settings["n"]) * float(one.settings["steps"]) / seconds


# The whole study.


class Ended(NamedTuple):
    """A command: its wall time, whether it ended by itself, its exit code and words."""

    seconds: float
    whole: bool
    code: int
    words: str


def study(machine: Machine) -> Iterator[Row]:
    """The gain study, launched there and here, and a sample of it flown again here."""
    with tempfile.TemporaryDirectory() as folder:
        whole, sample = Path(folder) / "whole.yaml", Path(folder) / "sample.yaml"
        points, share = (1, 1) if machine.emulated else (2000, 20)
        whole.write_text(machine.study(points))
        sample.write_text(machine.study(points // share))
        for times, spec, how, limit in (
            (1, whole, machine.executor, 0.5),
            (share, sample, ["--workers", f"{machine.cores}"], 0.7),
        ):
            results = Path(folder) / spec.stem
            ended = _command(
                ["launch", str(spec), "--results", str(results), "--quiet", *how],
                limit * machine.left,
            )
            trials, done = _stored(results)
            row: Row = {
                "what": f"launch {' '.join(how)}",
                "trials": trials,
                "done": done,
                "seconds": ended.seconds,
            }
            if ended.code or not ended.whole:
                row["error"] = ended.words or "it took too long, and was interrupted"
            else:
                row["scaled to all trials"] = times * ended.seconds
            yield row
        ended = _command(
            [
                *("verify", STUDY, "--results", str(Path(folder) / "whole")),
                *("--executor", "cpu", "--fraction", "1", "--most", "500"),
            ],
            machine.left,
        )
        row = {"what": "verify --executor cpu", "seconds": ended.seconds}
        row["words"] = " ".join(ended.words.split())
        yield row | ({"error": "see words"} if ended.code else {})


def _stored(results: Path) -> tuple[int, int]:
    """The trials of the study that are stored, and how many of them are done."""
    try:
        trials = StoredStudy(STUDY, str(results)).trials
    except StoreError:  # the launch has ended before it
        return 0, 0
    return len(trials), int((trials["status"] == "done").sum())


def _command(given: Sequence[str], limit: float) -> Ended:
    """A command, interrupted as by Ctrl-C after so many seconds: what is done is
    stored.
    """
    began = time.monotonic()
    process = subprocess.Popen(
        [*SWEEP, *given],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        cwd=ROOT,
    )
    try:
        words, whole = process.communicate(timeout=max(1.0, limit))[0], True
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        words, whole = process.communicate()[0], False
    return Ended(time.monotonic() - began, whole, process.returncode, words[-2000:])


# What limits it.


def limits(machine: Machine) -> Iterator[Row]:
    """Where the time of whole trials goes; warps that a multiprocessor has room for;
    and rates with other blocks and batches.
    """
    device = machine.device()
    for model in machine.flying if machine.emulated else MEASURED:
        yield from _shares(machine, device, model)
        if not machine.emulated:
            yield from _occupancy(device, model)
    tried = machine.flying[0] if machine.emulated else TRIED
    for device.threads, device.registers, count in _ways(machine):
        row: Row = {
            "what": f"{tried}, N=100",
            "threads a block": device.threads,
            "registers": device.registers,
        }
        if machine.left < 0:
            yield row | {"error": "did not fit into the time"}
            continue
        found = _rate(machine, device, tried, 100, count)
        yield row | {"flights": found["flights"], "boid-steps/s": found["GPU"]}


def _ways(machine: Machine) -> Iterator[tuple[int, int, int]]:
    """Threads of a block, registers of a thread, and flights of a batch: what is usual,
    and others one at a time.
    """
    flights = (2, 3) if machine.emulated else BATCHES
    yield BLOCKS[0], REGISTERS[0], flights[0]
    yield from ((threads, REGISTERS[0], flights[0]) for threads in BLOCKS[1:])
    yield from ((BLOCKS[0], registers, flights[0]) for registers in REGISTERS[1:])
    yield from ((BLOCKS[0], REGISTERS[0], count) for count in flights[1:])


def _occupancy(device: Any, model: str) -> Iterator[Row]:
    from cuda.bindings import driver

    ready = [_ready(_flock(model, 100, seed=seed)) for seed in (0, 1)]
    kernel = _batch_of(ready, 2).kernel
    ask = driver.cuOccupancyMaxActiveBlocksPerMultiprocessor
    for device.registers, threads in product(REGISTERS, BLOCKS):
        error, blocks = ask(device.load(kernel), threads, 0)
        row: Row = {
            "what": f"{model}, N=100",
            "threads a block": threads,
            "registers": device.registers,
        }
        if error != driver.CUresult.CUDA_SUCCESS:
            yield row | {"error": str(error)}
            continue
        yield row | {"warps a multiprocessor": blocks * threads // 32}
    device.registers = REGISTERS[0]


def _shares(machine: Machine, device: Any, model: str) -> Iterator[Row]:
    """Seconds of a batch of whole trials, by what they are spent for."""
    count = 2 if machine.emulated else SHARED
    steps = 20 if machine.emulated else 1000
    jobs = [_flock(model, 100, steps, seed) for seed in range(count)]
    clock = [time.perf_counter()]
    prepared = [_ready(one) for one in jobs]
    clock.append(time.perf_counter())
    watched = Watched(device)
    on_device._fly(prepared, watched)
    clock.append(time.perf_counter())
    results = [one.simulation.summary("done", 0.0) for one in prepared]
    clock.append(time.perf_counter())
    begun, flying, ended = (later - one for one, later in pairwise(clock))
    there = dict(watched.seconds)
    about = f"{count} trials of {model}, N=100, {steps} steps"
    for what, seconds in (
        ("preparing, one core", begun),
        ("laying out, and taking apart", flying - sum(there.values())),
        *there.items(),
        ("summarising, one core", ended),
    ):
        share = seconds / (clock[-1] - clock[0])
        yield {"what": f"{about}: {what}", "seconds": seconds, "share": share}
    assert len(results) == watched.flights == count


# Others.

FLAME_GPU = (
    ("A100", 128, "brute force", 1.547),
    ("A100", 1024, "brute force", 2.062),
    ("A100", 8192, "spatial", 3.332),
    ("V100", 128, "brute force", 1.385),
    ("V100", 1024, "brute force", 1.686),
)
"""Boids in three dimensions of FLAME GPU 2: the GPU, the boids of a simulation, how
neighbours are found, and the least seconds of 60 simulations of 500 steps at any number
of them at once. From `sample/data/a100-510.73.08/620e904-a100-11.4-beltsoff` and
`v100-515.65.01/2.0.0-rc-v100-11.0-beltsoff` of
https://github.com/FLAMEGPU/FLAMEGPU2-ensemble-benchmark at d28b976 (January 2023).
"""


def others(machine: Machine) -> Iterator[Row]:
    """FLAME GPU 2 as published, and a flock of vicsek1995 in JAX on this machine."""
    for gpu, n, how, seconds in FLAME_GPU:
        yield {
            "what": f"FLAME GPU 2, {how}, {gpu}, published",
            "N": n,
            "boid-steps/s": 60 * 500 * n / seconds,
        }
    preset = BUILT_IN.models["vicsek1995"].presets["as_run"]
    for n in (20, 50) if machine.emulated else (100, 1000):
        row: Row = {"what": "JAX, vicsek1995, all pairs", "N": n}
        size = float(preset["width"]) * (n / float(preset["n"])) ** 0.5
        try:
            count, rate = jax_flock.rate(n, float(preset["noise"]), size)
        except ImportError:
            yield row | {"error": "JAX is not installed"}
            return
        yield row | {"flights": count, "boid-steps/s": rate}
