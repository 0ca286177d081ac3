"""One trial at full resolution: its frames one after the other, or all in a file."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sweep.design.jobs import Job
from sweep.spec.study import RecordSpec
from sweep.store.parquet import table_writer
from sweep.store.rows import boid_columns, trajectories_schema
from sweep.tables.exporting import csv_writer, write_about
from sweep.tables.outputs import unfinished
from sweep.trial.simulation import BOID_STEPS_A_CALL, Simulation
from sweep.trial.state import Taken

NOTHING = RecordSpec(())
"""Records nothing but where boids are."""
Report = Callable[[int, int], None]
"""Is told how many of how many steps are done."""
FLIGHTS: dict[str, Callable[..., Any]] = {".parquet": table_writer, ".csv": csv_writer}
"""How files of flights end, and what writes them: a row a frame with lists, as
trajectories are stored, or a row a frame and boid.
"""


def frames(
    job: Job, every: int, report: Report, record: RecordSpec = NOTHING
) -> Iterator[Taken]:
    """The frames 0, `every`, 2 `every`, ... and the last of a trial, some at a time.

        job      the trial
        every    steps between two frames
        report   is told how many of how many steps are done
        record   the metrics that are measured at each frame

    Each `Taken` has the values of the metrics (M, F), x, y, vx and vy (F, 4, N), in the
    model's length and length/time, and the state of boids (F, S, N). The flight is the
    same whatever is recorded. A trial that diverges ends with its last finite frame.
    """
    steps = int(job.settings["steps"])
    whole = replace(record, every=every, trajectories=True)
    simulation = Simulation(replace(job, record=whole))
    going = True
    yield simulation.take_frames()
    while going and simulation.steps_left > 0:
        going = simulation.advance(max(1, BOID_STEPS_A_CALL // int(job.settings["n"])))
        report(simulation.step, steps)
        yield simulation.take_frames()


class ShownFrame(NamedTuple):
    """A frame of a flight: its step, x, y, vx and vy (4, N), and the visits of pixels
    (rows, columns), -1 in obstacles; None where the trial records no coverage.
    """

    step: int
    bodies: NDArray[np.float64]
    visits: NDArray[np.int32] | None = None


def seen(job: Job, every: int, report: Report) -> Iterator[ShownFrame]:
    """The frames of a trial one by one, at steps as `frames` has them.

    Visits of pixels are counted if a metric that the job records is of them.
    """
    metrics = (job.known.metrics[name] for name in job.record.metrics)
    if not any(metric.covers for metric in metrics):
        for taken in frames(job, every, report):
            yield from map(ShownFrame, taken.steps.tolist(), taken.bodies)
        return
    steps = int(job.settings["steps"])
    whole = replace(NOTHING, every=every, trajectories=True, heatmaps=True)
    simulation = Simulation(replace(job, record=whole))
    going = True
    while True:
        taken = simulation.take_frames()
        for step, bodies in zip(taken.steps.tolist(), taken.bodies, strict=True):
            yield ShownFrame(step, bodies, simulation.visits)
        if not going or simulation.steps_left == 0:
            return
        going = simulation.advance(every)
        report(simulation.step, steps)


def write_flight(
    job: Job, path: Path, every: int, about: dict[bytes, bytes], report: Report
) -> list[Path]:
    """Write the frames of a trial as a table like `trajectories`. Returns the files: a
    CSV file has one beside it with units and provenance.

    job     the trial
    path    the new file, which ends in one of FLIGHTS
    every   steps between two frames
    about   the metadata of the table
    report  is told how many of how many steps are done
    """
    schema = trajectories_schema(job.known.models[job.model], {}).with_metadata(about)
    with unfinished(path) as file, FLIGHTS[path.suffix](file, schema) as writer:
        for taken in frames(job, every, report):
            writer.write_table(_table(job, taken, schema))
    return [path, write_about(path, schema)] if path.suffix == ".csv" else [path]


def _table(job: Job, taken: Taken, schema: pa.Schema) -> pa.Table:
    count, _, n = taken.bodies.shape
    offsets = pa.array(np.arange(count + 1) * n, pa.int32())
    ids = pa.array([job.trial_id] * count, pa.string())
    columns: list[Any] = [ids, pa.array(taken.steps)]
    columns += [
        pa.ListArray.from_arrays(offsets, pa.array(values))
        for values in boid_columns(job, taken.bodies, taken.state).values()
    ]
    return pa.Table.from_arrays(columns, schema=schema)
