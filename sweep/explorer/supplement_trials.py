"""Which stored trials stand behind a mark of a supplement: those in the middle, at the
ends, the worst or the best of the done ones by the metric that is shown.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import pandas as pd

from sweep.errors import ChoiceError
from sweep.spec.recorded import Column
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

PLACES = {"lowest": 0.0, "median": 0.5, "highest": 1.0}
"""Where a trial stands among those of its point, from the least value to the
largest.
"""
JUDGED = ("worst", "best")
ROLES = (*PLACES, *JUDGED)


class ShownTrial(NamedTuple):
    """A trial behind a mark: its `roles` among those of its point, its id, and its
    value of the metric.
    """

    roles: tuple[str, ...]
    trial_id: str
    value: float


def places(
    study: StoredStudy, column: Column, roles: Iterable[str]
) -> dict[str, float]:
    """Where the trial of each role stands among those of its point, from 0 to 1.

    Raises ChoiceError for an unknown role, and for the worst or the best by a metric
    without a direction, as a derived one.
    """
    found = {}
    for role in dict.fromkeys(roles):
        if role not in ROLES:
            raise ChoiceError(unknown("choice of trials", role, ROLES))
        found[role] = PLACES[role] if role in PLACES else _judged(study, column, role)
    return found


def _judged(study: StoredStudy, column: Column, role: str) -> float:
    metric = study.known.metrics.get(column.metric)
    if metric is None or metric.better == "neither":
        derived = "is derived, and nothing says" if metric is None else "does not say"
        raise ChoiceError(
            f"trials {role}: {column.metric} {derived} which of its values are better;"
            f" choose of {', '.join(PLACES)}",
            study.name,
        )
    return float((metric.better == "high") == (role == "best"))


def behind(
    trials: pd.DataFrame, column: Column, at: dict[str, float]
) -> list[ShownTrial]:
    """The trials behind a mark, the one with the least value first. `at` has a place
    for each role, and a trial that has several roles stands once. `trials` are all
    stored ones of the point: those that are not done, or have no value, are never
    chosen.

    Between two in the middle the median is the lower one, so that it is a trial. Of
    equal values the first id counts.
    """
    known = trials[(trials["status"] == "done") & trials[str(column)].notna()]
    ordered = known.sort_values([str(column), "trial_id"])
    if ordered.empty:
        return []
    roles: dict[int, list[str]] = {}
    for role, place in at.items():
        roles.setdefault(int(place * (len(ordered) - 1)), []).append(role)
    rows = [(ordered.iloc[place], names) for place, names in sorted(roles.items())]
    return [
        ShownTrial(tuple(names), str(row["trial_id"]), float(row[str(column)]))
        for row, names in rows
    ]


def why_none(trials: pd.DataFrame, column: Column) -> str:
    """Why no trial of a point can be shown, in words."""
    counts = trials["status"].value_counts()
    others = [f"{count:,} {name}" for name, count in counts.items() if name != "done"]
    if not counts.get("done", 0):
        return f"No trial of this point is done ({', '.join(others)}): none is shown."
    return f"No done trial of this point has a value of {column.metric}: none is shown."


def points_of(study: StoredStudy, shown: Sequence[str]) -> list[pd.DataFrame]:
    """The stored trials of the points to which the trials `shown` belong."""
    trials = study.trials
    point = trials.set_index("trial_id")["point"]
    groups = dict(list(trials.groupby("point", sort=False)))
    return [groups[point[one]] for one in shown]
