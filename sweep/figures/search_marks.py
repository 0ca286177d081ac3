"""The history and the front of a search as marks, each with the points whose trials
stand behind it.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pandas as pd

from sweep.campaigns.search.asked_trials import AskedTrials, read_asked
from sweep.campaigns.search.held_out import front, references, winners
from sweep.campaigns.search.outcome import (
    HELD_OUT,
    REFERENCES,
    SEARCH,
    candidates,
    objectives,
)
from sweep.campaigns.search.points_behind import PointsBehind
from sweep.campaigns.search.repetitions import best_so_far
from sweep.figures.marks import FigureMarks, MarkedAxis, MarkedLine, MarkedPanel
from sweep.figures.search_layout import (
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
from sweep.figures.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from sweep.spec.objectives import Floats, Objective
from sweep.tables.stored_study import StoredStudy

GREY = "#595959"
OF_CANDIDATES = (GREY, BLUE, ORANGE)
OF_JUDGED = (VERMILION, GREEN, PURPLE, SKY)
"""The chosen, then one reference after the other."""
COLUMNS = ["x", "x_low", "x_high", "y", "low", "high", "n", "colour", "best", "point"]


def history_marks(study: StoredStudy) -> FigureMarks:
    """The history of `history_figure`: a mark a candidate, and a mark for each
    held-out estimate.
    """
    asked = read_asked(study)
    behind = PointsBehind(study, asked)
    groups = list(groups_of(candidates(asked)))
    label, _ = judged_of(asked, objectives(asked)[0])
    names = [label, *(f"{one}, held out" for one in asked.about["references"])]
    panels = [_history_panel(study, asked, one, behind) for one in objectives(asked)]
    return FigureMarks(
        "points",
        (),
        panels,
        history_note(study, asked),
        "candidates",
        (*groups, *names),
        _colours(OF_CANDIDATES, names),
    )


def front_marks(study: StoredStudy) -> FigureMarks:
    """The front of `front_figure`: a mark a candidate, and a mark for each held-out
    pair of estimates. The best of them is the knee.
    """
    asked = read_asked(study)
    behind = PointsBehind(study, asked)
    names = ["chosen, held out"]
    names += [f"{one}, held out" for one in asked.about["references"]]
    pairs = list(combinations(objectives(asked), 2))
    panels = [
        _front_panel(study, asked, pair, behind, line=len(pairs) == 1) for pair in pairs
    ]
    return FigureMarks(
        "points",
        (),
        panels,
        front_note(study, asked),
        "candidates; the knee has a ring" if _knee(asked) else "candidates",
        ("feasible", "not feasible", *names),
        _colours((GREY, ORANGE), names),
    )


def _colours(first: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """References beyond the last colour have that of the last one."""
    others = [
        OF_JUDGED[min(place, len(OF_JUDGED) - 1)] for place, _ in enumerate(names)
    ]
    return (*first, *others)


def _history_panel(
    study: StoredStudy, asked: AskedTrials, objective: Objective, behind: PointsBehind
) -> MarkedPanel:
    table, best = candidates(asked), best_so_far(asked)
    spent = best.set_index("step")["trials"]
    groups = groups_of(table)
    asked_for = pd.DataFrame(
        {
            "x": places(table, spent),
            "y": table[objective.column],
            "n": table["trials"],
            "colour": np.argmax([*groups.values()], axis=0),
            "point": behind.ids(SEARCH, SEARCH, table["candidate"].tolist()),
        }
    )
    end = float(spent.max())
    _, judged = judged_of(asked, objective)
    others = references(asked)
    others = others[others["objective"] == objective.column]
    first = len(groups)
    parts = [
        asked_for,
        _judged(asked, judged).assign(
            x=(1.0 + ROOM) * end,
            colour=first,
            point=behind.ids(SEARCH, HELD_OUT, judged["candidate"].tolist()),
        ),
        _judged(asked, others).assign(
            x=(1.0 + ROOM * (np.arange(len(others)) + 2)) * end,
            colour=first + 1 + np.arange(len(others)),
            point=behind.ids(REFERENCES, HELD_OUT, [*range(len(others))]),
        ),
    ]
    edge = edge_of_history(asked, objective)
    known = None if np.isnan(edge) else float(edge)
    axis = MarkedAxis(
        objective.column,
        label_of(study, objective).replace("\n", ", "),
        low=known if objective.maximize else None,
        high=None if objective.maximize else known,
    )
    alone = len(objectives(asked)) == 1
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
    asked: AskedTrials,
    pair: tuple[Objective, Objective],
    behind: PointsBehind,
    *,
    line: bool,
) -> MarkedPanel:
    table, names = candidates(asked), [one.column for one in pair]
    asked_for = pd.DataFrame(
        {
            "x": table[names[0]],
            "y": table[names[1]],
            "n": table["trials"],
            "colour": np.where(table["feasible"], 0, 1),
            "point": behind.ids(SEARCH, SEARCH, table["candidate"].tolist()),
        }
    )
    judged = wide(winners(asked), "candidate", names)
    others = len(asked.about["references"])
    parts = [
        asked_for,
        _two_ways(asked, winners(asked), names).assign(
            colour=2,
            best=judged.index.isin(_knee(asked)),
            point=behind.ids(SEARCH, HELD_OUT, judged.index.tolist()),
        ),
        _two_ways(asked, references(asked), names).assign(
            colour=3 + np.arange(others),
            point=behind.ids(REFERENCES, HELD_OUT, [*range(others)]),
        ),
    ]
    stairs = MarkedLine()
    if line and len(judged):
        best, late = best_of(judged, pair), not pair[0].maximize
        stairs = _stairs(best[names[0]], best[names[1]], "not dominated", late=late)
    x, y = (label_of(study, one).replace("\n", ", ") for one in pair)
    return MarkedPanel(
        "",
        MarkedAxis(names[0], x),
        MarkedAxis(names[1], y),
        _marks(parts),
        line=stairs,
    )


def _knee(asked: AskedTrials) -> list[int]:
    about = front(asked)
    return [int(number) for number in about.loc[about["knee"], "candidate"]]


def _judged(asked: AskedTrials, table: pd.DataFrame) -> pd.DataFrame:
    """Held-out estimates as marks: mean, interval and trials."""
    names = {"": "y", "_low": "low", "_high": "high"}
    held = {mark: table[f"held_out{end}"].to_numpy() for end, mark in names.items()}
    trials = table["held_out_n"].to_numpy() * asked.about["scenarios"]
    return pd.DataFrame({**held, "n": trials})


def _two_ways(
    asked: AskedTrials, table: pd.DataFrame, names: Sequence[str]
) -> pd.DataFrame:
    """Held-out estimates of two objectives as marks, in the order of the table."""
    first, second = (
        _judged(asked, table[table["objective"] == name]) for name in names
    )
    across = first[["y", "low", "high"]].set_axis(["x", "x_low", "x_high"], axis=1)
    return pd.concat([across, second], axis=1)


def _marks(parts: Sequence[pd.DataFrame]) -> pd.DataFrame:
    """One row a mark, of those that have a place."""
    rows = [{"best": False, **row} for part in parts for row in part.to_dict("records")]
    return pd.DataFrame(rows, columns=COLUMNS).dropna(subset=["x", "y"])


def _stairs(
    x: "pd.Series[float]", y: "pd.Series[float]", text: str, *, late: bool
) -> MarkedLine:
    """A line of steps through places: `late` holds a value up to the next place."""
    known = y.notna().to_numpy()
    across: Floats = np.repeat(x.to_numpy(np.float64)[known], 2)
    along: Floats = np.repeat(y.to_numpy(np.float64)[known], 2)
    if late:
        return MarkedLine(across[1:].tolist(), along[:-1].tolist(), text)
    return MarkedLine(across[:-1].tolist(), along[1:].tolist(), text)
