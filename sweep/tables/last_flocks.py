"""The last flocks of the trials of a point, as a table of positions.

The replicates of another study start from these flocks with `start_draws: ./FILE.csv`.
"""

from pathlib import Path
from typing import NamedTuple

import pandas as pd

from sweep.design import LastFlock
from sweep.errors import ChoiceError
from sweep.spec import LAST_FLOCKS
from sweep.store import FLIGHT, last_flocks
from sweep.tables.choosing import Refusals
from sweep.tables.outputs import check_output, unfinished
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many

ENDING = ".csv"
REPLICATE = "replicate"


class Written(NamedTuple):
    """The number of replicates in a table, and of boids in each replicate."""

    replicates: int
    boids: int


def write_last_flocks(
    study: StoredStudy, path: Path, *, force: bool = False
) -> Written:
    """Write the last positions and velocities of the boids of each replicate.

    Columns: `replicate`, counted from 0, x, y, vx and vy, with all digits.

    Parameters
    ----------
    study : StoredStudy
        A study of one point, such as one restricted by `where`.
    path : Path
        The file, .csv.
    force : bool, default False
        Replace a file that exists.

    Returns
    -------
    Written

    Raises
    ------
    OutputError
        If the file has another ending, or exists and `force` is not set.
    ChoiceError
        If the study has several points, if trials are not done, if trials have no
        stored last flock, or if boids have a state, which the table cannot contain. The
        error has all reasons.
    StoreError
        If no launch writes such data.
    """
    check_output(path, [ENDING], force=force)
    trials = _trials(study)
    flocks = last_flocks(study.store, trials["trial_id"], [])
    if without := [trial for trial in trials["trial_id"] if trial not in flocks]:
        raise ChoiceError(
            f"{so_many(len(without), 'trial')} without stored {LAST_FLOCKS};"
            f" record: {{{LAST_FLOCKS}: true}} in the spec stores final flocks",
            study.name,
        )
    with unfinished(path) as file:
        file.write(f"{','.join((REPLICATE, *FLIGHT))}\n".encode())
        for number, trial in enumerate(trials["trial_id"]):
            file.write(_rows(number, flocks[trial]).encode())
    boids = flocks[trials["trial_id"].iloc[0]].bodies.shape[1]
    return Written(len(trials), boids)


def _trials(study: StoredStudy) -> pd.DataFrame:
    """Return the trials of the one point by replicate. Raises ChoiceError."""
    refusals = Refusals()
    trials = study.trials.sort_values(REPLICATE)
    with refusals.noted():
        _check_point(study)
    undone = trials[trials["status"] != "done"]
    left = study.plan.num_rows - len(trials) + len(undone)
    with refusals.noted():
        if left:
            why = f": {undone['error'].iloc[0]}" if len(undone) else ""
            raise ChoiceError(
                f"{so_many(left, 'trial')} of {study.plan.num_rows:,} not done{why}",
                study.name,
            )
    with refusals.noted():
        for name in trials["model"].unique():
            if state := [*study.known.models[name].state]:
                raise ChoiceError(
                    f"boids of {name} have a state ({', '.join(state)}), which a table"
                    " of positions cannot contain; use an axis with `continue`",
                    study.name,
                )
    refusals.check()
    return trials


def _check_point(study: StoredStudy) -> None:
    """Raise ChoiceError for a study of several points."""
    points = study.points
    if len(points) == 1:
        return
    settings = [name for name in points.columns if points[name].nunique() > 1]
    example = f"{settings[0]}={points[settings[0]].iloc[0]}"
    raise ChoiceError(
        f"has {len(points):,} points, which differ in {', '.join(settings)}; choose one"
        f" point, for example with --where {example}",
        study.name,
    )


def _rows(replicate: int, flock: LastFlock) -> str:
    bodies = flock.bodies.T.tolist()
    return "".join(f"{replicate},{','.join(map(repr, body))}\n" for body in bodies)
