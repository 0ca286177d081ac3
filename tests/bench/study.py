"""The wall time of the gain study, from a launch of a twentieth of it."""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import psutil

from sweep.campaigns.launching import launch
from sweep.campaigns.warming import warm_study
from sweep.spec.study import Study, parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Loky
from tests import ROOT
from tests.bench.scale import FULL, Scale

SPEC = ROOT / "experiments" / "aziel_chen2025" / "gains.yaml"
POINTS, SHARE = 100, 20
"""So many points are a twentieth of them."""
WORKERS = 2


@dataclass(frozen=True)
class Cost:
    """Of a launch: its trials, and seconds of wall time, of processor time in all its
    processes, and within trials.
    """

    trials: int
    wall: float
    processor: float
    inside: float


def study(scale: Scale = FULL) -> None:
    """Launch the study with a twentieth of its gain vectors, on all its maps and with
    all its sizes and seeds, by warm workers and into an empty folder; print what all of
    it would take.
    """
    engine, points = Loky(WORKERS), scale.of(POINTS)
    with tempfile.TemporaryDirectory() as folder:
        warm_study(_part(1))
        launch(_part(1), Path(folder) / "warm", engine)
        cost = _cost(_part(points), Path(folder) / "results", engine)
    engine.stop()
    outside = 1 - cost.inside / (WORKERS * cost.wall)
    share = SHARE * POINTS // points
    whole, every = share / 60, share * cost.trials
    print(
        f"study: {cost.trials:,} trials on {WORKERS} workers: {cost.wall:.1f} s of wall"
        f" time, {cost.processor:.1f} s of processor time; {cost.inside:.1f} s in"
        f" trials, so {outside:.1%} of the workers' time is the framework's"
    )
    print(
        f"study: all {every:,} trials would take {whole * cost.wall:.1f} min here, and"
        f" {whole * cost.processor / WORKERS:.1f} min on {WORKERS} idle cores, by"
        " processor time"
    )


def _part(points: int) -> Study:
    """The gain study with fewer points: the same maps, sizes and seeds."""
    text, all_ = SPEC.read_text(), f"points: {SHARE * POINTS}"
    assert text.count(all_) == 1, f"{SPEC} has no {all_}"
    return parse_spec(text.replace(all_, f"points: {points}"))


def _cost(part: Study, results: Path, engine: Loky) -> Cost:
    before, began = _processor_seconds(), time.perf_counter()
    launch(part, results, engine)
    wall = time.perf_counter() - began
    processor = _processor_seconds() - before
    trials = StoredStudy(part.name, str(results)).trials
    return Cost(len(trials), wall, processor, float(trials["seconds"].sum()))


def _processor_seconds() -> float:
    """Processor time so far of this process and of those that it has started."""
    here = psutil.Process()
    times = [one.cpu_times() for one in (here, *here.children(recursive=True))]
    return float(sum(one.user + one.system for one in times))
