"""What the first trial of a process costs, as that of a worker: processor seconds, with
kernels that are compiled already; what each later trial costs besides its steps; and
what commands cost that a user waits for.

Python keeps the bytecode of what it imports, unless it is told not to. Here it does so
in a folder of its own, so that the numbers are those of an installed program.
"""

import os
import pickle
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.trial.simulation import Simulation
from tests import ROOT
from tests.bench.cases import BEST, covering
from tests.bench.scale import FULL, Scale
from tests.bench.timing import of_command
from tests.builders import job

PROCESSES, TRIALS = 5, 50
SPEC = """
study: small
model: vicsek1995
fixed: {n: 50, steps: 100}
replicates: 1
seed: 1
"""
COMMANDS = {
    "launch": "launch spec.yaml --workers 1 --results results{turn}",
    "plan": "plan spec.yaml --results results{turn}",
    "table": "table small --results results{turn}",
    "status": "status small --results results{turn}",
    "--help": "--help",
}
PROGRAM = """
import pickle, sys, time
import numpy, numba
libraries = time.process_time()
import sweep.workers.checkpoint, sweep.workers.worker
from sweep.trial.simulation import run
imported = time.process_time()
job = pickle.load(sys.stdin.buffer)
assert run(job).status == "done"
print(libraries, imported, time.process_time())
"""


def seconds(job: Job, bytecode: str) -> list[float]:
    """Processor seconds of a new process: until numpy and numba are imported, until all
    is imported, and until the first trial is done. `bytecode` is a folder.
    """
    settings = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": bytecode}
    finished = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=pickle.dumps(job),
        capture_output=True,
        check=True,
        cwd=ROOT,
        env=os.environ | settings,
    )
    return list(map(float, finished.stdout.split()))


class Metered(Simulation):
    """A simulation that knows the processor time of its steps."""

    flown = 0.0

    def advance(self, steps: int) -> bool:
        """Take steps, and note how long that takes."""
        began = time.thread_time()
        try:
            return super().advance(steps)
        finally:
            self.flown += time.thread_time() - began


def besides(one: Job) -> float:
    """Processor seconds of a trial besides its steps."""
    began = time.thread_time()
    simulation = Metered(one)
    simulation.result(time.perf_counter())
    return time.thread_time() - began - simulation.flown


def first(scale: Scale = FULL) -> None:
    """A line a model; then the trials of the gain study, one after the other."""
    models = list(MODELS)[: scale.of(len(MODELS))]
    jobs = {model: job(model, steps=1) for model in models}
    with tempfile.TemporaryDirectory() as bytecode:
        for one in jobs.values():
            seconds(one, bytecode)
        rounds = [
            {model: seconds(one, bytecode) for model, one in jobs.items()}
            for _ in range(scale.of(PROCESSES))
        ]
    for model in models:
        libraries, imported, whole = (
            median(times) for times in zip(*(one[model] for one in rounds), strict=True)
        )
        print(
            f"first, {model:16} {whole:.2f} s: numpy and numba {libraries:.2f}, ours"
            f" {imported - libraries:.2f}, the trial {whole - imported:.2f}"
        )
    for n in (50, 100):
        one = covering("cafeteria", n, scale.of(1500), BEST["cafeteria"])
        taken = median(besides(one) for _ in range(scale.of(TRIALS)))
        print(f"each, cafeteria, N={n:<4} {taken * 1e3:.2f} ms besides its steps")
    for name, costs in commands(scale.of(PROCESSES)).items():
        print(f"command, {name:7} {median(costs):.2f} s")


def commands(rounds: int) -> dict[str, list[float]]:
    """Processor seconds of COMMANDS, of a study of one small trial: those of all their
    processes, with compiled kernels, in turn.
    """
    costs: dict[str, list[float]] = {name: [] for name in COMMANDS}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        settings = {
            "PYTHONPATH": str(ROOT),
            "PYTHONPYCACHEPREFIX": str(folder / "code"),
        }
        settings["PYTHONDONTWRITEBYTECODE"] = ""
        (folder / "spec.yaml").write_text(SPEC)
        for turn in range(rounds + 1):
            for name, text in COMMANDS.items():
                words = text.format(turn=turn).split()
                taken = of_command(*words, folder=folder, settings=settings)
                assert taken is not None, (folder / "printed").read_text()
                if turn > 0:  # the first turn compiles
                    costs[name].append(taken)
    return costs
