"""What the figures of a search share, drawn or as marks: where a candidate lies, which
groups there are, and what is said of it.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.campaigns.search.asked_trials import AskedTrials, read_asked
from sweep.campaigns.search.fronts import nondominated
from sweep.campaigns.search.held_out import references, winners
from sweep.campaigns.search.outcome import FAILED, candidates, objectives
from sweep.errors import ChoiceError
from sweep.figures.drawing import quantity
from sweep.spec.objectives import Floats, Objective
from sweep.tables.stored_study import StoredStudy

SHOWN = 0.75
"""The part of the estimates of one objective that are drawn in their own places. The
others lie at the edge, so that the best can be told apart.
"""
ROOM = 0.06
"""Room for a held-out mark beyond the end, as a part of the width of an axis."""


def places(table: pd.DataFrame, spent: "pd.Series[int]") -> Floats:
    """Where candidates lie on an axis of trials. Those of a batch are spread evenly,
    from the end of the batch before to the end of their own.
    """
    before = spent.shift(fill_value=0)
    groups = table.groupby("batch")["candidate"]
    share = (groups.cumcount() + 1) / groups.transform("size")
    start, end = (
        column.loc[table["batch"]].to_numpy(np.float64) for column in (before, spent)
    )
    return np.asarray(start + share * (end - start), np.float64)


def held_out_bounds(asked: AskedTrials) -> Floats:
    """The held-out estimates that a history of one objective draws, and the ends of
    their intervals.
    """
    tables = (winners(asked)[:1], references(asked))
    return np.concatenate(
        [
            table[[f"held_out{end}" for end in ("", "_low", "_high")]]
            .to_numpy(float)
            .ravel()
            for table in tables
        ]
    )


def edge_of(values: Floats, objective: Objective, held_out: Floats) -> float:
    """The edge: the worst value that is drawn in its own place. NaN for no values.

    A part SHOWN of the values lies within the edge, and so does all that is held out.
    Worse candidates are drawn at the edge.
    """
    known, others = values[np.isfinite(values)], held_out[np.isfinite(held_out)]
    if not len(known):
        return np.nan
    edge = np.quantile(known, 1.0 - SHOWN if objective.maximize else SHOWN)
    return float(
        np.min([edge, *others]) if objective.maximize else np.max([edge, *others])
    )


def wide(table: pd.DataFrame, by: str, names: Sequence[str]) -> pd.DataFrame:
    """One row a candidate or reference, with the held-out estimates and bounds of each
    objective as columns.
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
    """The label of the axis of an objective, in two lines."""
    what = objective.statistic.named(quantity(study, objective.column))
    return f"{what}\n{'more' if objective.maximize else 'less'} is better"


def history_note(study: StoredStudy, asked: AskedTrials) -> str:
    """What the figure of a history says of itself."""
    table = candidates(asked)
    failed = int((table["status"] == FAILED).sum())
    text = f"{study.name}: {len(table):,} candidates" + (
        f", {failed} failed and not drawn" if failed else ""
    )
    return text + f", {int(table['trials'].sum()):,} trials; {held_out_note(asked)}"


def held_out_note(asked: AskedTrials) -> str:
    """How many were judged on held-out seeds, and with how many blocks."""
    judged = winners(asked)
    blocks = int(judged["held_out_n"].max()) if len(judged) else 0
    if blocks == 0:
        return "no held-out trials"
    many = "1 block" if blocks == 1 else f"{blocks} blocks"
    return (
        f"{judged['candidate'].nunique()} held out, {many} each,"
        " simultaneous 95 % intervals (Bonferroni)"
    )


def with_front(study: StoredStudy, kind: str) -> AskedTrials:
    """What a search for several objectives has asked for, for a figure of this kind.

    Raises ChoiceError where the study is no search, or has one objective.
    """
    asked = read_asked(study)
    if len(objectives(asked)) < 2:
        raise ChoiceError(
            "needs two objectives and there is one; allowed: history", study.name, kind
        )
    return asked


def groups_of(table: pd.DataFrame) -> dict[str, NDArray[np.bool_]]:
    """Which candidates have fewer blocks, which have most, and which are not feasible,
    by what a legend calls them.
    """
    most, feasible = table["blocks"].max(), table["feasible"].to_numpy()
    complete = (table["blocks"] == most).to_numpy()
    return {
        "fewer blocks": feasible & ~complete,
        f"{most} blocks": feasible & complete,
        "not feasible": ~feasible,
    }


def judged_of(asked: AskedTrials, objective: Objective) -> tuple[str, pd.DataFrame]:
    """The held-out estimates of one objective that a history shows, and what a legend
    calls them: of the winner, or with several objectives of the front.
    """
    judged = winners(asked)
    judged = judged[judged["objective"] == objective.column]
    judged = judged if len(objectives(asked)) > 1 else judged[:1]
    return f"{'winner' if len(judged) == 1 else 'front'}, held out", judged


def edge_of_history(asked: AskedTrials, objective: Objective) -> float:
    """The edge of the history of one objective, see `edge_of`; NaN with several
    objectives, of which all is drawn in its own place.
    """
    if len(objectives(asked)) > 1:
        return np.nan
    table = candidates(asked)
    values = table.loc[table["feasible"], objective.column].to_numpy(np.float64)
    return edge_of(values, objective, held_out_bounds(asked))


def best_of(judged: pd.DataFrame, pair: Sequence[Objective]) -> pd.DataFrame:
    """Those of a table of `wide` that no other beats, in the order of the first
    objective.
    """
    names, maximize = [one.column for one in pair], [one.maximize for one in pair]
    front = nondominated(judged[names].to_numpy(np.float64), maximize)
    return judged[front].sort_values(names[0])


def front_note(study: StoredStudy, asked: AskedTrials) -> str:
    """What the figure of a front says of itself."""
    seen = f"{len(candidates(asked)):,} candidates on the seeds of the search"
    return f"{study.name}: {seen}; {held_out_note(asked)}"
