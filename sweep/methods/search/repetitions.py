"""A search against time and against plain random search.

The module compares the best candidate so far, and the results of independent
repetitions.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sweep.analysis import Declared, MeanEstimate, hypervolume, mean_estimate
from sweep.methods.search.held_out import held_out_values, shown
from sweep.methods.search.objectives import Floats, Objective
from sweep.methods.search.outcome import (
    COMPLETE,
    FAILED,
    HELD_OUT,
    SEARCH,
    candidates,
    objectives,
    trials_of,
    values_of,
    worst,
)

if TYPE_CHECKING:
    from sweep.methods.search.asked_trials import AskedTrials

REPETITION = "repetition"
RANDOM = "random"
HYPERVOLUME = "hypervolume"


@dataclass(frozen=True, eq=False)
class AgainstRandom:
    """Repetitions of a search against random searches with equal numbers of trials.

    Attributes
    ----------
    quantity : str
        Column of the objective, or "hypervolume".
    maximize : bool
        Whether larger values are better.
    search : array of float
        Held-out value of the winner of each repetition, shape (n,).
    random : array of float
        Held-out value of the winner of each random search, shape (n,).
    without : tuple of int
        Number of repetitions and of random searches that have no winner, or are not
        judged yet.
    distribution : Declared, default "normal"
        Distribution of the values.
    """

    quantity: str
    maximize: bool
    search: Floats
    random: Floats
    without: tuple[int, int]
    distribution: Declared = "normal"

    @property
    def estimate(self) -> MeanEstimate:
        """The search minus random search, with confidence interval and test.

        Interval and test follow the distribution of the objective: Welch's test if
        normal.
        """
        return mean_estimate(self.random, self.search, distribution=self.distribution)


def runs(asked_trials: "AskedTrials", kind: str) -> list[str]:
    """Return the names of the runs of a kind, in the order of their numbers.

    The kind is REPETITION or RANDOM.
    """
    repeated = [
        name
        for name in asked_trials.table["run"].unique()
        if name.rsplit(" ", 1)[0] == kind
    ]
    return sorted(repeated, key=lambda name: int(name.rsplit(" ", 1)[1]))


def against_random(asked_trials: "AskedTrials") -> AgainstRandom:
    """Compare the repetitions of a search with the random searches.

    The function compares the held-out values of the winners. A run is one independent
    value, with separate seeds for sampler and trials. The held-out seeds are common to
    all runs, so the confidence interval is for these seeds; the effect that a seed has
    on every candidate cancels out. With several objectives the value is the hypervolume
    of the held-out estimates of the front of the run, beyond the point of
    `reference_point`.
    """
    aims = objectives(asked_trials)
    several = len(aims) > 1
    reference = reference_point(asked_trials) if several else None
    each = [
        np.array(
            [
                _judged_value(asked_trials, run, reference)
                for run in runs(asked_trials, kind)
            ],
            np.float64,
        )
        for kind in (REPETITION, RANDOM)
    ]
    search, random = (values[~np.isnan(values)] for values in each)
    without = (len(each[0]) - len(search), len(each[1]) - len(random))
    quantity = HYPERVOLUME if several else aims[0].column
    single = len(aims) == 1 and aims[0].statistic.about.averages
    return AgainstRandom(
        quantity,
        several or aims[0].maximize,
        search=search,
        random=random,
        without=without,
        distribution=aims[0].distribution if single else "normal",
    )


def best_so_far(
    asked_trials: "AskedTrials", run: str = SEARCH, reference: Floats | None = None
) -> pd.DataFrame:
    """Return the search estimate of the best candidate after each batch of a run.

    Without batches, there is one row per candidate. The estimate is on the seeds of the
    search, and so too good.

    Parameters
    ----------
    asked_trials : AskedTrials
        The search.
    run : str, default SEARCH
        Name of the run.
    reference : array of float, optional
        Reference point of the hypervolume, shape (m,); by default from
        `reference_point`.

    Returns
    -------
    DataFrame
        Columns: step (batch or candidate), trials (spent by then, each counted once),
        candidate and value (the winner by then and its estimate). With several
        objectives candidate is -1, and value the hypervolume of the candidates with all
        blocks by then. Without any such candidate, value is NaN and candidate -1.
    """
    aims = objectives(asked_trials)
    table = candidates(asked_trials, run)
    table["step"] = table["batch"].where(table["batch"] >= 0, table["candidate"])
    spent = _spent(asked_trials, run, table)
    if len(aims) == 1:
        leading = _best(table, aims[0])
    else:
        leading = _volumes(
            table,
            aims,
            reference_point(asked_trials) if reference is None else reference,
        )
    last = leading.groupby(table["step"], sort=True).last()
    return last.assign(trials=spent.loc[last.index]).reset_index()[
        ["step", "trials", "candidate", "value"]
    ]


def reference_point(asked_trials: "AskedTrials") -> Floats | None:
    """Return the reference point (m,) of the hypervolumes of all runs of a search.

    The reference point has the worst search estimate of each objective, over all
    feasible candidates with all blocks of all runs; None without such candidates.
    """
    aims = objectives(asked_trials)
    searched = asked_trials.table.loc[
        asked_trials.table["phase"] == SEARCH, "run"
    ].unique()
    tables = [candidates(asked_trials, run) for run in searched]
    pools = [
        values_of(table[table["feasible"] & (table["status"] == COMPLETE)], aims)
        for table in tables
    ]
    values = np.concatenate(pools)
    values = values[~np.isnan(values).any(axis=1)]
    return (
        worst(values, [objective.maximize for objective in aims])
        if len(values)
        else None
    )


def _judged_value(
    asked_trials: "AskedTrials", run: str, reference: Floats | None
) -> float:
    aims = objectives(asked_trials)
    judged = trials_of(asked_trials, run, HELD_OUT)
    numbers = [
        number for number in shown(asked_trials, run) if number in judged.candidates
    ]
    if not numbers:
        return np.nan
    values = held_out_values(judged, numbers, aims)
    if len(aims) == 1:
        return float(values[0, 0])
    return (
        np.nan
        if reference is None
        else hypervolume(values, reference, [aim.maximize for aim in aims])
    )


def _spent(
    asked_trials: "AskedTrials", run: str, table: pd.DataFrame
) -> "pd.Series[int]":
    """Return the number of trials by the end of each step."""
    rows = asked_trials.table[
        (asked_trials.table["run"] == run) & (asked_trials.table["phase"] == SEARCH)
    ]
    rows = rows[rows["status"] != "missing"]
    steps = table.set_index("candidate")["step"]
    first = (
        steps.loc[rows["candidate"]].set_axis(rows["trial_id"]).groupby(level=0).min()
    )
    counts: pd.Series[int] = first.value_counts().reindex(
        sorted(set(steps)), fill_value=0
    )
    return counts.cumsum()


def _best(table: pd.DataFrame, objective: Objective) -> pd.DataFrame:
    """Return the winner among the candidates up to each, by the rule of `chosen`."""
    sign = 1.0 if objective.maximize else -1.0
    value = table[objective.column].to_numpy(np.float64)
    counts = table["feasible"] & (table["status"] != FAILED) & ~np.isnan(value)
    best = (-1, -np.inf)
    place = -1
    places = []
    for row, (allowed, n) in enumerate(zip(counts, table["blocks"], strict=True)):
        if allowed and (n, sign * value[row]) > best:
            best = (n, sign * value[row])
            place = row
        places.append(place)
    numbers = np.append(table["candidate"], -1)
    values = np.append(value, np.nan)
    return pd.DataFrame(
        {"candidate": numbers[places], "value": values[places]}, index=table.index
    )


def _volumes(
    table: pd.DataFrame, aims: list[Objective], reference: Floats | None
) -> pd.DataFrame:
    """Return the hypervolume of the candidates up to each that have all blocks.

    The hypervolume is known for the last candidate of each step.
    """
    counts = (table["feasible"] & (table["status"] == COMPLETE)).to_numpy()
    values = values_of(table, aims)
    maximize = [objective.maximize for objective in aims]
    volumes = np.full(len(table), np.nan)
    if reference is not None:
        for row in np.flatnonzero(table["step"] != table["step"].shift(-1)):
            volumes[row] = hypervolume(
                values[: row + 1][counts[: row + 1]], reference, maximize
            )
    return pd.DataFrame({"candidate": -1, "value": volumes}, index=table.index)
