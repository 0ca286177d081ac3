"""The choice of the stored trials behind a mark of a supplement.

The choices are the median, the lowest, the highest, the worst and the best of the done
trials, by the metric of the figure, or all of these trials.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import pandas as pd

from sweep.errors import ChoiceError
from sweep.spec import Column
from sweep.tables import StoredStudy
from sweep.text import unknown

MIDDLE = "median"
PLACES = {"lowest": 0.0, MIDDLE: 0.5, "highest": 1.0}
"""Relative rank of a trial among the trials of a point.

The rank is 0 for the least value and 1 for the largest value.
"""
JUDGED = ("worst", "best")
ALL = "all"
ROLES = (*PLACES, *JUDGED, ALL)


class ShownTrial(NamedTuple):
    """A trial behind a mark.

    `roles` are the roles among the trials of the point, and `value` is the metric.
    """

    roles: tuple[str, ...]
    trial_id: str
    value: float


def places(
    study: StoredStudy, column: Column, roles: Iterable[str]
) -> dict[str, float]:
    """Return the relative rank of the trial of each role among the trials of a point.

    Parameters
    ----------
    study : StoredStudy
    column : Column
        The column of the metric.
    roles : iterable of str
        Names in ROLES.

    Returns
    -------
    dict of str to float
        A rank by role, from 0 for the least value to 1 for the largest. The role "all"
        has no rank, and gives the roles of PLACES.

    Raises
    ------
    ChoiceError
        If a role is unknown. Also if the role is worst or best, and the metric does not
        declare which values are better, such as a derived metric.
    """
    ranks: dict[str, float] = {}
    for role in dict.fromkeys(roles):
        if role not in ROLES:
            raise ChoiceError(unknown("choice of trials", role, ROLES))
        if role == ALL:
            ranks |= PLACES
            continue
        ranks[role] = PLACES[role] if role in PLACES else _judged(study, column, role)
    return ranks


def _judged(study: StoredStudy, column: Column, role: str) -> float:
    metric = study.known.metrics.get(column.metric)
    if metric is None or metric.better == "neither":
        derived = "is derived and so has no" if metric is None else "declares no"
        raise ChoiceError(
            f"trials {role}: {column.metric} {derived} direction of better values;"
            f" allowed: {', '.join(PLACES)}",
            study.name,
        )
    return float((metric.better == "high") == (role == "best"))


def behind(
    trials: pd.DataFrame, column: Column, at: dict[str, float], *, every: bool = False
) -> list[ShownTrial]:
    """Return the trials behind a mark, by ascending value.

    Trials that are not done, or have no value, are never chosen. For an even number of
    trials the median is the lower of the two middle trials, so that the median is a
    trial. Among equal values the order of the ids decides. A trial with several roles
    appears once.

    Parameters
    ----------
    trials : DataFrame
        All stored trials of the point.
    column : Column
        The column of the metric.
    at : dict of str to float
        A relative rank by role, from 0 to 1.
    every : bool, default False
        Also return the trials without a role. Their role is the replicate.

    Returns
    -------
    list of ShownTrial
        Empty if no trial is done and has a value.
    """
    measured = trials[(trials["status"] == "done") & trials[str(column)].notna()]
    ordered = measured.sort_values([str(column), "trial_id"])
    if ordered.empty:
        return []
    roles: dict[int, list[str]] = {}
    for role, place in at.items():
        roles.setdefault(int(place * (len(ordered) - 1)), []).append(role)
    if every:
        for place, replicate in enumerate(ordered["replicate"]):
            roles.setdefault(place, [f"replicate {replicate}"])
    rows = [(ordered.iloc[place], names) for place, names in sorted(roles.items())]
    return [
        ShownTrial(tuple(names), str(row["trial_id"]), float(row[str(column)]))
        for row, names in rows
    ]


def why_none(trials: pd.DataFrame, column: Column) -> str:
    """Return the reason why no trial of a point can be shown, in words."""
    counts = trials["status"].value_counts()
    not_done = [f"{count:,} {name}" for name, count in counts.items() if name != "done"]
    if not counts.get("done", 0):
        return f"No trial of this point is done ({', '.join(not_done)})."
    return f"No done trial of this point has a value of {column.metric}."


def points_of(study: StoredStudy, shown: Sequence[str]) -> list[pd.DataFrame]:
    """Return the stored trials of the points to which the trials `shown` belong."""
    trials = study.trials
    point = trials.set_index("trial_id")["point"]
    groups = dict(list(trials.groupby("point", sort=False)))
    return [groups[point[trial]] for trial in shown]
