"""A search against time and against plain random search: the best so far, and what
independent repetitions found.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from sweep.analysis import Declared, MeanEstimate, mean_estimate
from sweep.analysis.fronts import hypervolume
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

REPETITION, RANDOM = "repetition", "random"
HYPERVOLUME = "hypervolume"


@dataclass(frozen=True, eq=False)
class AgainstRandom:
    """What repetitions of a search found against what random searches found, with as
    many trials each.

    `quantity` is the objective's column, or "hypervolume". `search` and `random` hold
    one held-out value a run, (n,) each, of its winner; `without` counts the runs of
    either kind that have found none, or are not judged yet.
    """

    quantity: str
    maximize: bool
    search: Floats
    random: Floats
    without: tuple[int, int]
    distribution: Declared = "normal"

    @property
    def estimate(self) -> MeanEstimate:
        """The search minus random search, with the interval and the test of the
        distribution of the objective: Welch's where it is normal.
        """
        return mean_estimate(self.random, self.search, distribution=self.distribution)


def runs(asked: "AskedTrials", kind: str) -> list[str]:
    """The names of the runs that are a "repetition", or "random", by their numbers."""
    names = [
        name for name in asked.table["run"].unique() if name.rsplit(" ", 1)[0] == kind
    ]
    return sorted(names, key=lambda name: int(name.rsplit(" ", 1)[1]))


def against_random(asked: "AskedTrials") -> AgainstRandom:
    """The repetitions of a search against the random searches, by the held-out values
    of their winners.

    A run is one independent value: it has seeds of its own for its sampler and its
    trials. The held-out seeds are common to all runs, so the interval is for these
    seeds; what a seed adds for every setting cancels out. With several objectives the
    value is the hypervolume of the held-out estimates of the run's front, beyond the
    point of `reference_point`.
    """
    wanted = objectives(asked)
    several = len(wanted) > 1
    reference = reference_point(asked) if several else None
    each = [
        np.array(
            [_judged_value(asked, run, reference) for run in runs(asked, kind)],
            np.float64,
        )
        for kind in (REPETITION, RANDOM)
    ]
    search, random = (values[~np.isnan(values)] for values in each)
    without = (len(each[0]) - len(search), len(each[1]) - len(random))
    quantity = HYPERVOLUME if several else wanted[0].column
    single = len(wanted) == 1 and wanted[0].statistic.about.averages
    return AgainstRandom(
        quantity,
        several or wanted[0].maximize,
        search,
        random,
        without,
        wanted[0].distribution if single else "normal",
    )


def best_so_far(
    asked: "AskedTrials", run: str = SEARCH, reference: Floats | None = None
) -> pd.DataFrame:
    """The search estimate of the best so far after each batch of a run, or after each
    candidate where there are none.

    Columns: step (batch or candidate), trials (spent by then, each counted once),
    candidate and value: the winner by then and its estimate, on the seeds of the search
    and so too good; with several objectives candidate is -1, and value the hypervolume
    of the candidates with all blocks by then, beyond `reference`, by default the point
    of `reference_point`. NaN, and -1, before there is any.
    """
    wanted = objectives(asked)
    table = candidates(asked, run)
    table["step"] = table["batch"].where(table["batch"] >= 0, table["candidate"])
    spent = _spent(asked, run, table)
    if len(wanted) == 1:
        found = _best(table, wanted[0])
    else:
        found = _volumes(
            table, wanted, reference_point(asked) if reference is None else reference
        )
    last = found.groupby(table["step"], sort=True).last()
    return last.assign(trials=spent.loc[last.index]).reset_index()[
        ["step", "trials", "candidate", "value"]
    ]


def reference_point(asked: "AskedTrials") -> Floats | None:
    """The point (m,) that hypervolumes of a search are measured from, the same for all
    of its runs.

    In each objective it is the worst search estimate of all feasible candidates with
    all blocks of all runs; None where there is none.
    """
    wanted = objectives(asked)
    searched = asked.table.loc[asked.table["phase"] == SEARCH, "run"].unique()
    tables = [candidates(asked, run) for run in searched]
    pools = [
        values_of(table[table["feasible"] & (table["status"] == COMPLETE)], wanted)
        for table in tables
    ]
    values = np.concatenate(pools)
    values = values[~np.isnan(values).any(axis=1)]
    return (
        worst(values, [objective.maximize for objective in wanted])
        if len(values)
        else None
    )


def _judged_value(asked: "AskedTrials", run: str, reference: Floats | None) -> float:
    wanted, judged = objectives(asked), trials_of(asked, run, HELD_OUT)
    numbers = [number for number in shown(asked, run) if number in judged.candidates]
    if not numbers:
        return np.nan
    values = held_out_values(judged, numbers, wanted)
    if len(wanted) == 1:
        return float(values[0, 0])
    return (
        np.nan
        if reference is None
        else hypervolume(values, reference, [one.maximize for one in wanted])
    )


def _spent(asked: "AskedTrials", run: str, table: pd.DataFrame) -> "pd.Series[int]":
    """The number of trials by the end of each step."""
    rows = asked.table[(asked.table["run"] == run) & (asked.table["phase"] == SEARCH)]
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
    """The winner among the candidates up to each, by the rule of `chosen`."""
    sign = 1.0 if objective.maximize else -1.0
    value = table[objective.column].to_numpy(np.float64)
    counts = table["feasible"] & (table["status"] != FAILED) & ~np.isnan(value)
    best, place, places = (-1, -np.inf), -1, []
    for row, (allowed, n) in enumerate(zip(counts, table["blocks"], strict=True)):
        if allowed and (n, sign * value[row]) > best:
            best, place = (n, sign * value[row]), row
        places.append(place)
    numbers, values = np.append(table["candidate"], -1), np.append(value, np.nan)
    return pd.DataFrame(
        {"candidate": numbers[places], "value": values[places]}, index=table.index
    )


def _volumes(
    table: pd.DataFrame, wanted: list[Objective], reference: Floats | None
) -> pd.DataFrame:
    """The hypervolume of the candidates up to each that have all blocks; known for the
    last of each step.
    """
    counts = (table["feasible"] & (table["status"] == COMPLETE)).to_numpy()
    values, maximize = (
        values_of(table, wanted),
        [objective.maximize for objective in wanted],
    )
    volumes = np.full(len(table), np.nan)
    if reference is not None:
        for row in np.flatnonzero(table["step"] != table["step"].shift(-1)):
            volumes[row] = hypervolume(
                values[: row + 1][counts[: row + 1]], reference, maximize
            )
    return pd.DataFrame({"candidate": -1, "value": volumes}, index=table.index)
