"""Changes of boids from flock to flock, frame by frame of stored trajectories."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa

from sweep.errors import ChoiceError
from sweep.store import table_writer
from sweep.tables.outputs import check_output, unfinished
from sweep.tables.safe_csv import as_csv
from sweep.tables.stored_study import StoredStudy
from sweep.trial import followed

ENDINGS = (".csv", ".parquet")


class Changes(NamedTuple):
    """The size of a table of changes: the numbers of rows, trials and events."""

    rows: int
    trials: int
    fissions: int
    fusions: int


def write_flock_changes(
    study: StoredStudy, path: Path, *, force: bool = False
) -> Changes:
    """Write one row per boid and recorded frame in which the boid changes its flock.

    The flock is compared with the flock in the previous recorded frame, see
    sweep.trial.following. Columns: `trial_id`, `frame`, `time`, `boid`, and the numbers
    of the two flocks, `from_flock` and `to_flock`.

    Parameters
    ----------
    study : StoredStudy
    path : Path
        The file, .csv or .parquet.
    force : bool, default False
        Replace a file that exists.

    Returns
    -------
    Changes

    Raises
    ------
    OutputError
        If the file has another ending, or exists and `force` is not set.
    ChoiceError
        If no trajectories are stored.
    """
    check_output(path, ENDINGS, force=force)
    if study.read("trajectories", study.plan["trial_id"].combine_chunks()).num_rows < 1:
        raise ChoiceError(
            "no trajectories are stored; record: {trajectories: true} in the spec"
            " stores trajectories",
            study.name,
        )
    parts = []
    fissions = 0
    fusions = 0
    for part, parted, joined in _of_trials(study):
        parts.append(part)
        fissions += parted
        fusions += joined
    table = pd.concat(parts, ignore_index=True)
    with unfinished(path) as file:
        if path.suffix == ".csv":
            file.write(as_csv(table).encode())
        else:
            stored = pa.Table.from_pandas(table, preserve_index=False)
            with table_writer(file, stored.schema) as writer:
                writer.write_table(stored)
    return Changes(len(table), len(parts), fissions, fusions)


def _of_trials(study: StoredStudy) -> Iterator[tuple[pd.DataFrame, int, int]]:
    """Yield the rows, fissions and fusions of each done trial, in the spec's order."""
    trials = study.trials
    done = trials.loc[trials["status"] == "done", ["trial_id", "flock_range", "dt"]]
    for trial, reach, dt in done.to_numpy().tolist():
        steps, bodies = study.trajectory(trial)
        flock, fissions, fusions = followed(bodies, reach)
        frame, boid = np.nonzero(flock[1:] != flock[:-1])
        step = steps[frame + 1]
        table = pd.DataFrame(
            {
                "trial_id": trial,
                "frame": step,
                "time": step * dt,
                "boid": boid,
                "from_flock": flock[frame, boid],
                "to_flock": flock[frame + 1, boid],
            }
        )
        yield table, int(fissions[-1]), int(fusions[-1])
