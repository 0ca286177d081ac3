"""Who left which flock and joined which, frame by frame of stored trajectories."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa

from sweep.errors import ChoiceError
from sweep.store.parquet import table_writer
from sweep.tables.outputs import check_output, unfinished
from sweep.tables.safe_csv import as_csv
from sweep.tables.stored_study import StoredStudy
from sweep.trial.followed import followed

ENDINGS = (".csv", ".parquet")


class Changes(NamedTuple):
    """How many rows a table has, of how many trials; and how often flocks have parted
    and joined in them.
    """

    rows: int
    trials: int
    fissions: int
    fusions: int


def write_flock_changes(
    study: StoredStudy, path: Path, *, force: bool = False
) -> Changes:
    """Write a row for each boid that is in another flock than in the recorded frame
    before, see sweep.trial.followed: its trial, the frame and its time, the boid, and
    the numbers of both flocks.

    Raises OutputError for another ending than .csv and .parquet, and for a file that
    exists without `force`; ChoiceError where no trajectories are stored.
    """
    check_output(path, ENDINGS, force=force)
    if study.read("trajectories", study.plan["trial_id"].combine_chunks()).num_rows < 1:
        raise ChoiceError(
            "no trajectories of it are stored; record: {trajectories: true} in the spec"
            " keeps them",
            study.name,
        )
    parts, fissions, fusions = [], 0, 0
    for part, parted, joined in _of_trials(study):
        parts.append(part)
        fissions, fusions = fissions + parted, fusions + joined
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
    """Of each trial that is done, in the order of the spec, its rows, and how often
    flocks have parted and joined.
    """
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
