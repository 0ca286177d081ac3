"""Layout of the figures of a search, drawn or as marks: positions and groups."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import nondominated
from sweep.errors import ChoiceError
from sweep.figures import quantity
from sweep.methods.search.asked_trials import AskedTrials, read_asked
from sweep.methods.search.held_out import references, winners
from sweep.methods.search.objectives import Floats, Objective
from sweep.methods.search.outcome import FAILED, candidates, objectives
from sweep.tables import StoredStudy

SHOWN = 0.75
"""The fraction of the estimates of one objective that are drawn at their values.

The remaining estimates are at the edge, so that the best estimates are distinguishable.
"""
ROOM = 0.06
"""Room for a held-out mark beyond the end, as a fraction of the width of an axis."""


def places(table: pd.DataFrame, spent: "pd.Series[int]") -> Floats:
    """Return the positions of candidates on an axis of trials.

    The candidates of a batch are spread evenly, from the end of the previous batch to
    the end of this batch. `spent` has the trials spent at the end of each batch.
    """
    before = spent.shift(fill_value=0)
    groups = table.groupby("batch")["candidate"]
    fraction = (groups.cumcount() + 1) / groups.transform("size")
    start, end = (
        column.loc[table["batch"]].to_numpy(np.float64) for column in (before, spent)
    )
    return np.asarray(start + fraction * (end - start), np.float64)


def held_out_bounds(asked_trials: AskedTrials) -> Floats:
    """Return the held-out estimates in a history of one objective, with bounds.

    The estimates are of the winner and of the references.
    """
    tables = (winners(asked_trials)[:1], references(asked_trials))
    return np.concatenate(
        [
            table[[f"held_out{end}" for end in ("", "_low", "_high")]]
            .to_numpy(float)
            .ravel()
            for table in tables
        ]
    )


def edge_of(values: Floats, objective: Objective, held_out: Floats) -> float:
    """Return the edge: the worst value that is drawn at its own position.

    A fraction SHOWN of the values is within the edge, and so are all held-out
    estimates. Worse candidates are drawn at the edge.

    Parameters
    ----------
    values : ndarray
        Estimates of candidates.
    objective : Objective
    held_out : ndarray
        Held-out estimates and their bounds.

    Returns
    -------
    float
        NaN without finite values.
    """
    finite = values[np.isfinite(values)]
    bounds = held_out[np.isfinite(held_out)]
    if not len(finite):
        return np.nan
    edge = np.quantile(finite, 1.0 - SHOWN if objective.maximize else SHOWN)
    return float(
        np.min([edge, *bounds]) if objective.maximize else np.max([edge, *bounds])
    )


def wide(table: pd.DataFrame, by: str, names: Sequence[str]) -> pd.DataFrame:
    """Return one row per candidate or reference, with all objectives as columns.

    Parameters
    ----------
    table : DataFrame
        Held-out estimates, one row per candidate or reference and objective.
    by : str
        Column that becomes the index: "candidate" or "reference".
    names : sequence of str
        Columns of the objectives.

    Returns
    -------
    DataFrame
        For each name of an objective the columns name, name_low and name_high.
    """
    parts = []
    for name in names:
        part = table[table["objective"] == name].set_index(by)
        parts.append(
            part[["held_out", "held_out_low", "held_out_high"]].set_axis(
                [name, f"{name}_low", f"{name}_high"], axis=1
            )
        )
    return pd.concat(parts, axis=1)


def label_of(study: StoredStudy, objective: Objective) -> str:
    """Return the label of the axis of an objective, in two lines."""
    statistic = objective.statistic.named(quantity(study, objective.column))
    return f"{statistic}\n{'more' if objective.maximize else 'less'} is better"


def history_note(study: StoredStudy, asked_trials: AskedTrials) -> str:
    """Return the note of the figure of a history."""
    table = candidates(asked_trials)
    failed = int((table["status"] == FAILED).sum())
    text = f"{study.name}: {len(table):,} candidates" + (
        f", {failed} failed and not drawn" if failed else ""
    )
    return (
        text + f", {int(table['trials'].sum()):,} trials; {held_out_note(asked_trials)}"
    )


def held_out_note(asked_trials: AskedTrials) -> str:
    """Return the numbers of candidates and of blocks on held-out seeds, in words."""
    judged = winners(asked_trials)
    blocks = int(judged["held_out_n"].max()) if len(judged) else 0
    if blocks == 0:
        return "no held-out trials"
    many = "1 block" if blocks == 1 else f"{blocks} blocks"
    return (
        f"{judged['candidate'].nunique()} held out, {many} each,"
        " simultaneous 95 % confidence intervals (Bonferroni)"
    )


def with_front(study: StoredStudy, kind: str) -> AskedTrials:
    """Return the trials of a search for several objectives, for a kind of figure.

    Raises ChoiceError if the study is not a search, or has a single objective.
    """
    asked_trials = read_asked(study)
    if len(objectives(asked_trials)) < 2:
        raise ChoiceError(
            "needs two objectives; allowed for a single objective: history",
            study.name,
            kind,
        )
    return asked_trials


def groups_of(table: pd.DataFrame) -> dict[str, NDArray[np.bool_]]:
    """Return groups of candidates as masks, by the names in a legend.

    The groups are feasible candidates with fewer blocks, feasible candidates with the
    most blocks, and infeasible candidates.
    """
    most = table["blocks"].max()
    feasible = table["feasible"].to_numpy()
    complete = (table["blocks"] == most).to_numpy()
    return {
        "fewer blocks": feasible & ~complete,
        f"{most} blocks": feasible & complete,
        "not feasible": ~feasible,
    }


def judged_of(
    asked_trials: AskedTrials, objective: Objective
) -> tuple[str, pd.DataFrame]:
    """Return a name for a legend, and the held-out estimates of one objective.

    The estimates are of the winner, or with several objectives of the front.
    """
    judged = winners(asked_trials)
    judged = judged[judged["objective"] == objective.column]
    judged = judged if len(objectives(asked_trials)) > 1 else judged[:1]
    return f"{'winner' if len(judged) == 1 else 'front'}, held out", judged


def edge_of_history(asked_trials: AskedTrials, objective: Objective) -> float:
    """Return the edge of the history of an objective, see `edge_of`.

    NaN with several objectives: then each value is drawn at its own position.
    """
    if len(objectives(asked_trials)) > 1:
        return np.nan
    table = candidates(asked_trials)
    values = table.loc[table["feasible"], objective.column].to_numpy(np.float64)
    return edge_of(values, objective, held_out_bounds(asked_trials))


def best_of(judged: pd.DataFrame, pair: Sequence[Objective]) -> pd.DataFrame:
    """Return the rows of a table of `wide` that are not dominated.

    The rows are in ascending order of the first objective.
    """
    metrics = [objective.column for objective in pair]
    maximize = [objective.maximize for objective in pair]
    front = nondominated(judged[metrics].to_numpy(np.float64), maximize)
    return judged[front].sort_values(metrics[0])


def front_note(study: StoredStudy, asked_trials: AskedTrials) -> str:
    """Return the note of the figure of a front."""
    number = len(candidates(asked_trials))
    return (
        f"{study.name}: {number:,} candidates on the seeds of the search;"
        f" {held_out_note(asked_trials)}"
    )
