"""The status of the candidates of a search, and the choice among them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import nondominated, thinned
from sweep.methods.search.objectives import Constraint, Floats, Objective
from sweep.methods.search.trials_by_block import TrialsByBlock, by_block

if TYPE_CHECKING:
    from sweep.methods.search.asked_trials import AskedTrials

SEARCH = "search"
HELD_OUT = "held_out"
REFERENCES = "references"
COMPLETE = "complete"
RACED_OUT = "raced out"
CUT_SHORT = "cut short"
FAILED = "failed"


def objectives(asked_trials: "AskedTrials") -> list[Objective]:
    """Return the objectives of a search, in the order of its spec."""
    aims = [
        Objective.from_json(objective)
        for objective in asked_trials.description["objectives"]
    ]
    return [
        replace(objective, distribution=asked_trials.distributions[objective.column])
        for objective in aims
    ]


def constraints(asked_trials: "AskedTrials") -> list[Constraint]:
    """Return the constraints of a search, in the order of its spec."""
    return [
        Constraint.from_json(constraint)
        for constraint in asked_trials.description["constraints"]
    ]


def trials_of(asked_trials: "AskedTrials", run: str, phase: str) -> TrialsByBlock:
    """Return the trials of candidates, with the columns of objectives and constraints.

    Parameters
    ----------
    asked_trials : AskedTrials
        The search.
    run : str
        Name of the run.
    phase : str
        SEARCH or HELD_OUT.
    """
    rows = asked_trials.table[
        (asked_trials.table["run"] == run) & (asked_trials.table["phase"] == phase)
    ]
    columns = _columns(asked_trials)
    return by_block(rows, columns)


def _columns(asked_trials: "AskedTrials") -> list[str]:
    columns = [objective.column for objective in objectives(asked_trials)]
    return columns + [constraint.column for constraint in constraints(asked_trials)]


def candidates(asked_trials: "AskedTrials", run: str = SEARCH) -> pd.DataFrame:
    """Return a table of the candidates of a run, one row each, in the order asked.

    Columns: candidate, batch, the parameters, `same_as`, blocks, trials, violation,
    feasible, status, and the estimate of each objective over the search blocks of the
    candidate, under the name of its column. `same_as` is the first candidate with equal
    parameters, usually the candidate itself. `violation` is the largest violation of a
    constraint, in the unit of its metric. The status is

    - "complete": the candidate has all blocks that a candidate of this run can get;
    - "raced out": the candidate has fewer blocks, and is clearly worse than the
      leaders;
    - "cut short": the candidate has fewer blocks, and is of the last batch before the
      budget ended, or of an unfinished batch. The trials do not show whether the
      candidate was raced out;
    - "failed": a trial is not done, or a result is not finite.

    Unknown values are NaN. A candidate whose violation is not known is not feasible.
    """
    rows = asked_trials.table[
        (asked_trials.table["run"] == run) & (asked_trials.table["phase"] == SEARCH)
    ]
    searched = trials_of(asked_trials, run, SEARCH)
    first = rows.drop_duplicates("candidate").sort_values("candidate")
    parameters = list(asked_trials.description["parameters"])
    table: pd.DataFrame = first[["candidate", "batch", *parameters]].reset_index(
        drop=True
    )
    table["same_as"] = table.groupby(parameters, dropna=False)["candidate"].transform(
        "first"
    )
    table["blocks"] = searched.counts()
    table["trials"] = searched.stored.sum(axis=(1, 2))
    table["violation"] = _violations(searched, constraints(asked_trials))
    table["feasible"] = table["violation"] <= 0.0
    table["status"] = _statuses(asked_trials, run, table, searched)
    for objective in objectives(asked_trials):
        table[objective.column] = _estimates(searched, objective)
    return table


def undefined_shares(asked_trials: "AskedTrials") -> dict[str, float]:
    """Return the fraction of the done trials of all runs without a value, by column.

    The columns are of objectives and constraints for which some trials have no value.
    The candidates of such trials have failed.
    """
    columns = _columns(asked_trials)
    trials = asked_trials.table.drop_duplicates("trial_id")
    done = trials[trials["status"] == "done"]
    shares = {column: float(done[column].isna().mean()) for column in columns}
    return {column: share for column, share in shares.items() if share > 0.0}


def chosen(
    candidates: pd.DataFrame, objectives: Sequence[Objective], most: int
) -> list[int]:
    """Return the candidates that a search chooses; the winner comes first.

    A candidate counts if it is feasible, has not failed, and has the largest number of
    blocks of all such candidates: estimates over fewer blocks are luckier. No set of
    parameters comes twice.

    With one objective, the result has the best estimates in order; of equal estimates
    the first asked comes first. With several objectives, the result is the Pareto front
    in the order of the first objective. The front is thinned to `most`: one at a time,
    the member that adds least to the hypervolume is removed.

    Parameters
    ----------
    candidates : DataFrame
        The table of `candidates`.
    objectives : sequence of Objective
        Objectives of the search.
    most : int
        Largest number of chosen candidates.

    Returns
    -------
    list of int
        Numbers of candidates.
    """
    pool = eligible(candidates, objectives)
    if pool.empty or most < 1:
        return []
    values = values_of(pool, objectives)
    maximize = [objective.maximize for objective in objectives]
    if len(objectives) > 1:
        front = nondominated(values, maximize)
        reference = worst(values, maximize)
        pool = pool[front].iloc[thinned(values[front], maximize, reference, most)]
    ordered = pool.sort_values(
        [objectives[0].column, "candidate"], ascending=[not maximize[0], True]
    )
    return [int(number) for number in ordered["candidate"].head(most)]


def eligible(candidates: pd.DataFrame, objectives: Sequence[Objective]) -> pd.DataFrame:
    """Return the rows of `candidates` from which `chosen` chooses.

    The rows are feasible candidates with most blocks, without repeated parameters.
    """
    measured = (
        candidates[[objective.column for objective in objectives]].notna().all(axis=1)
    )
    pool = candidates[
        measured & candidates["feasible"] & (candidates["status"] != FAILED)
    ]
    with_most: pd.DataFrame = pool[pool["blocks"] == pool["blocks"].max()]
    return with_most.drop_duplicates("same_as")


def values_of(candidates: pd.DataFrame, objectives: Sequence[Objective]) -> Floats:
    """Return the estimates of candidates as an array (candidates, objectives)."""
    return candidates[[objective.column for objective in objectives]].to_numpy(
        np.float64
    )


def worst(values: Floats, maximize: Sequence[bool]) -> Floats:
    """Return the worst value of each column of `values` (k, m), k > 0; shape (m,)."""
    return np.asarray(np.where(maximize, values.min(axis=0), values.max(axis=0)))


def _violations(searched: TrialsByBlock, constraints: Sequence[Constraint]) -> Floats:
    """Return the largest violation of each candidate, shape (k,).

    The violation is zero or below for a feasible candidate, and minus infinity without
    constraints.
    """
    largest = np.full(len(searched.candidates), -np.inf)
    for constraint in constraints:
        each = [
            constraint.violation(searched.of(place, constraint.column))
            for place in range(len(largest))
        ]
        largest = np.maximum(largest, each)
    return largest


def _estimates(searched: TrialsByBlock, objective: Objective) -> list[float]:
    return [
        objective.value(searched.of(place, objective.column))
        for place in range(len(searched.candidates))
    ]


def _statuses(
    asked_trials: "AskedTrials", run: str, table: pd.DataFrame, searched: TrialsByBlock
) -> NDArray[Any]:
    full = asked_trials.description["blocks"][run]
    ended = table["batch"] == table["batch"].max()
    if (
        asked_trials.description["finished"]
        and asked_trials.description["budget"] - _spent(asked_trials, run)
        >= searched.stored.shape[2]
    ):
        ended &= False
    failed = (searched.stored & ~searched.done).any(axis=(1, 2))
    kinds = [failed, table["blocks"] >= full, ended]
    return np.select(kinds, [FAILED, COMPLETE, CUT_SHORT], RACED_OUT)


def _spent(asked_trials: "AskedTrials", run: str) -> int:
    """Return the number of trials that count against the budget of a run.

    A trial that candidates share counts once.
    """
    rows = asked_trials.table[
        (asked_trials.table["run"] == run) & (asked_trials.table["phase"] == SEARCH)
    ]
    return int(rows.loc[rows["status"] != "missing", "trial_id"].nunique())
