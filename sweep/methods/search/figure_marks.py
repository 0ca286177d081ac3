"""The history and the front of a search as marks, with the points behind each mark."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd

from sweep.figures import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    FigureMarks,
    MarkedAxis,
    MarkedLine,
    MarkedPanel,
)
from sweep.methods.search.asked_trials import AskedTrials, read_asked
from sweep.methods.search.figure_layout import (
    ROOM,
    best_of,
    edge_of_history,
    front_note,
    groups_of,
    history_note,
    judged_of,
    label_of,
    places,
    wide,
)
from sweep.methods.search.held_out import front, references, winners
from sweep.methods.search.objectives import Floats, Objective
from sweep.methods.search.outcome import (
    HELD_OUT,
    REFERENCES,
    SEARCH,
    candidates,
    objectives,
)
from sweep.methods.search.points_behind import PointsBehind
from sweep.methods.search.repetitions import best_so_far
from sweep.tables import StoredStudy

GREY = "#595959"
OF_CANDIDATES = (GREY, BLUE, ORANGE)
OF_JUDGED = (VERMILION, GREEN, PURPLE, SKY)
"""Colours of the chosen candidates, then of the references in order."""
COLUMNS = ["x", "x_low", "x_high", "y", "low", "high", "n", "colour", "best", "point"]


def history_marks(study: StoredStudy) -> FigureMarks:
    """Return `history_figure` as marks, for each candidate and held-out estimate."""
    asked_trials = read_asked(study)
    behind = PointsBehind(study, asked_trials)
    groups = list(groups_of(candidates(asked_trials)))
    label, _ = judged_of(asked_trials, objectives(asked_trials)[0])
    labels = [label, *_reference_names(asked_trials)]
    panels = [
        _history_panel(study, asked_trials, objective, behind)
        for objective in objectives(asked_trials)
    ]
    return FigureMarks(
        "points",
        (),
        panels,
        history_note(study, asked_trials),
        by="candidates",
        values=(*groups, *labels),
        colours=_colours(OF_CANDIDATES, labels),
    )


def front_marks(study: StoredStudy) -> FigureMarks:
    """Return `front_figure` as marks, for each candidate and held-out pair.

    `best` marks the knee.
    """
    asked_trials = read_asked(study)
    behind = PointsBehind(study, asked_trials)
    labels = ["chosen, held out", *_reference_names(asked_trials)]
    pairs = list(combinations(objectives(asked_trials), 2))
    panels = [
        _front_panel(study, asked_trials, pair, behind, line=len(pairs) == 1)
        for pair in pairs
    ]
    return FigureMarks(
        "points",
        (),
        panels,
        front_note(study, asked_trials),
        by="candidates; the knee has a ring" if _knee(asked_trials) else "candidates",
        values=("feasible", "not feasible", *labels),
        colours=_colours((GREY, ORANGE), labels),
    )


def _reference_names(asked_trials: AskedTrials) -> list[str]:
    return [f"{name}, held out" for name in asked_trials.description["references"]]


def _colours(first: Sequence[str], labels: Sequence[str]) -> tuple[str, ...]:
    """Return colours for a legend; names beyond the last colour share it."""
    held_out = [
        OF_JUDGED[min(place, len(OF_JUDGED) - 1)] for place, _ in enumerate(labels)
    ]
    return (*first, *held_out)


def _history_panel(
    study: StoredStudy,
    asked_trials: AskedTrials,
    objective: Objective,
    behind: PointsBehind,
) -> MarkedPanel:
    table = candidates(asked_trials)
    best = best_so_far(asked_trials)
    spent = best.set_index("step")["trials"]
    groups = groups_of(table)
    proposed = pd.DataFrame(
        {
            "x": places(table, spent),
            "y": table[objective.column],
            "n": table["trials"],
            "colour": np.argmax([*groups.values()], axis=0),
            "point": behind.ids(SEARCH, SEARCH, table["candidate"].tolist()),
        }
    )
    end = float(spent.max())
    _, judged = judged_of(asked_trials, objective)
    compared = references(asked_trials)
    compared = compared[compared["objective"] == objective.column]
    first = len(groups)
    parts = [
        proposed,
        _judged(asked_trials, judged).assign(
            x=(1.0 + ROOM) * end,
            colour=first,
            point=behind.ids(SEARCH, HELD_OUT, judged["candidate"].tolist()),
        ),
        _judged(asked_trials, compared).assign(
            x=(1.0 + ROOM * (np.arange(len(compared)) + 2)) * end,
            colour=first + 1 + np.arange(len(compared)),
            point=behind.ids(REFERENCES, HELD_OUT, [*range(len(compared))]),
        ),
    ]
    edge = edge_of_history(asked_trials, objective)
    limit = None if np.isnan(edge) else float(edge)
    axis = MarkedAxis(
        objective.column,
        label_of(study, objective).replace("\n", ", "),
        low=limit if objective.maximize else None,
        high=None if objective.maximize else limit,
    )
    alone = len(objectives(asked_trials)) == 1
    return MarkedPanel(
        "",
        MarkedAxis("trials", "trials spent", low=0.0),
        axis,
        _marks(parts),
        line=_stairs(best["trials"], best["value"], "winner by then", late=True)
        if alone
        else MarkedLine(),
    )


def _front_panel(
    study: StoredStudy,
    asked_trials: AskedTrials,
    pair: tuple[Objective, Objective],
    behind: PointsBehind,
    *,
    line: bool,
) -> MarkedPanel:
    table = candidates(asked_trials)
    metrics = [objective.column for objective in pair]
    proposed = pd.DataFrame(
        {
            "x": table[metrics[0]],
            "y": table[metrics[1]],
            "n": table["trials"],
            "colour": np.where(table["feasible"], 0, 1),
            "point": behind.ids(SEARCH, SEARCH, table["candidate"].tolist()),
        }
    )
    judged = wide(winners(asked_trials), "candidate", metrics)
    number = len(asked_trials.description["references"])
    parts = [
        proposed,
        _two_ways(asked_trials, winners(asked_trials), metrics).assign(
            colour=2,
            best=judged.index.isin(_knee(asked_trials)),
            point=behind.ids(SEARCH, HELD_OUT, judged.index.tolist()),
        ),
        _two_ways(asked_trials, references(asked_trials), metrics).assign(
            colour=3 + np.arange(number),
            point=behind.ids(REFERENCES, HELD_OUT, [*range(number)]),
        ),
    ]
    stairs = MarkedLine()
    if line and len(judged):
        best = best_of(judged, pair)
        late = not pair[0].maximize
        stairs = _stairs(best[metrics[0]], best[metrics[1]], "not dominated", late=late)
    x, y = (label_of(study, objective).replace("\n", ", ") for objective in pair)
    return MarkedPanel(
        "",
        MarkedAxis(metrics[0], x),
        MarkedAxis(metrics[1], y),
        _marks(parts),
        line=stairs,
    )


def _knee(asked_trials: AskedTrials) -> list[int]:
    members = front(asked_trials)
    return [int(number) for number in members.loc[members["knee"], "candidate"]]


def _judged(asked_trials: AskedTrials, table: pd.DataFrame) -> pd.DataFrame:
    """Return held-out estimates as marks: mean, confidence interval and trials."""
    ends = {"": "y", "_low": "low", "_high": "high"}
    held = {mark: table[f"held_out{end}"].to_numpy() for end, mark in ends.items()}
    trials = table["held_out_n"].to_numpy() * asked_trials.description["scenarios"]
    return pd.DataFrame({**held, "n": trials})


def _two_ways(
    asked_trials: AskedTrials, table: pd.DataFrame, metrics: Sequence[str]
) -> pd.DataFrame:
    """Return held-out estimates of two objectives as marks, in the order of `table`."""
    first, second = (
        _judged(asked_trials, table[table["objective"] == name]) for name in metrics
    )
    across = first[["y", "low", "high"]].set_axis(["x", "x_low", "x_high"], axis=1)
    return pd.concat([across, second], axis=1)


def _marks(parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """Return one row per mark; marks without a position are left out."""
    rows = [{"best": False, **row} for part in parts for row in part.to_dict("records")]
    return pd.DataFrame(rows, columns=COLUMNS).dropna(subset=["x", "y"])


def _stairs(
    x: "pd.Series[float]", y: "pd.Series[float]", text: str, *, late: bool
) -> MarkedLine:
    """Return a line of steps; if `late`, a value holds up to the next position."""
    finite = y.notna().to_numpy()
    across: Floats = np.repeat(x.to_numpy(np.float64)[finite], 2)
    along: Floats = np.repeat(y.to_numpy(np.float64)[finite], 2)
    if late:
        return MarkedLine(across[1:].tolist(), along[:-1].tolist(), text)
    return MarkedLine(across[:-1].tolist(), along[1:].tolist(), text)
