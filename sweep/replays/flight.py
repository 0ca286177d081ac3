"""One trial at full resolution: single frames, or all frames in a file."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sweep.design import Job
from sweep.spec import RecordSpec
from sweep.store import boid_columns, table_writer, trajectories_schema
from sweep.tables import csv_writer, unfinished, write_about
from sweep.trial import BOID_STEPS_A_CALL, Simulation, Taken

NOTHING = RecordSpec(())
"""A record with positions and velocities only."""
Report = Callable[[int, int], None]
"""A callback with the number of steps done and the number of all steps."""
FLIGHTS: dict[str, Callable[..., Any]] = {".parquet": table_writer, ".csv": csv_writer}
"""Writers of trajectories by the ending of the file.

Parquet has one row per frame with lists, in the form of stored trajectories. CSV has
one row per frame and boid.
"""


def frames(
    job: Job, every: int, report: Report, record: RecordSpec = NOTHING
) -> Iterator[Taken]:
    """Simulate a trial and yield frames 0, `every`, 2 `every`, ... and the last one.

    Frames come in batches. The record does not change the simulation. A trial that
    diverges ends with its last finite frame.

    Parameters
    ----------
    job : Job
        The trial.
    every : int
        Steps between two frames.
    report : Report
        The callback that reports progress in steps.
    record : RecordSpec, optional
        The metrics that are measured at each frame; by default none.

    Yields
    ------
    Taken
        Values of the metrics (M, F); x, y, vx and vy (F, 4, N), in the length and
        length/time of the model; and the state of boids (F, S, N).
    """
    steps = int(job.settings["steps"])
    with_frames = replace(record, every=every, trajectories=True)
    simulation = Simulation(replace(job, record=with_frames))
    finite = True
    yield simulation.take_frames()
    while finite and simulation.steps_left > 0:
        finite = simulation.advance(max(1, BOID_STEPS_A_CALL // int(job.settings["n"])))
        report(simulation.step, steps)
        yield simulation.take_frames()


class ShownFrame(NamedTuple):
    """A frame of a trial: step, positions, velocities and visits.

    `bodies` are x, y, vx and vy (4, N). `visits` are the visits of pixels (rows,
    columns), -1 in obstacles; None if the trial records no coverage.
    """

    step: int
    bodies: NDArray[np.float64]
    visits: NDArray[np.int32] | None = None


def shown_frames(job: Job, every: int, report: Report) -> Iterator[ShownFrame]:
    """Simulate a trial and yield single frames, at the steps of `frames`.

    Visits of pixels are counted if the job records a metric of coverage.

    Parameters
    ----------
    job : Job
        The trial.
    every : int
        Steps between two frames.
    report : Report
        The callback that reports progress in steps.
    """
    metrics = (job.catalogue.metrics[name] for name in job.record.metrics)
    if not any(metric.covers for metric in metrics):
        for taken in frames(job, every, report):
            yield from map(ShownFrame, taken.steps.tolist(), taken.bodies)
        return
    steps = int(job.settings["steps"])
    with_visits = replace(NOTHING, every=every, trajectories=True, heatmaps=True)
    simulation = Simulation(replace(job, record=with_visits))
    finite = True
    while True:
        taken = simulation.take_frames()
        for step, bodies in zip(taken.steps.tolist(), taken.bodies, strict=True):
            yield ShownFrame(step, bodies, simulation.visits)
        if not finite or simulation.steps_left == 0:
            return
        finite = simulation.advance(every)
        report(simulation.step, steps)


def write_flight(
    job: Job, path: Path, every: int, metadata: dict[bytes, bytes], report: Report
) -> list[Path]:
    """Write the frames of a trial as a table in the form of `trajectories`.

    Parameters
    ----------
    job : Job
        The trial.
    path : Path
        The new file, which ends in one of FLIGHTS.
    every : int
        Steps between two frames.
    metadata : dict of bytes to bytes
        The metadata of the table.
    report : Report
        The callback that reports progress in steps.

    Returns
    -------
    list of Path
        The files: next to a CSV file is a file with units and provenance.
    """
    schema = trajectories_schema(job.catalogue.models[job.model], {})
    schema = schema.with_metadata(metadata)
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
