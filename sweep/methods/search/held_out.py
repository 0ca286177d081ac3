"""The candidates that a search has chosen, judged on new seeds.

The winner is the luckiest among good candidates, so its search estimate is too good:
the winner's curse. The held-out estimate is unbiased, because the choice was made
before.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd

from sweep.analysis import (
    Interval,
    knee,
    nondominated,
    paired_contrast,
    shares_on_front,
    simultaneous_confidence,
)
from sweep.methods.search.block_intervals import block_interval, difference_interval
from sweep.methods.search.objectives import Floats, Objective
from sweep.methods.search.outcome import (
    HELD_OUT,
    REFERENCES,
    SEARCH,
    candidates,
    chosen,
    constraints,
    objectives,
    trials_of,
)
from sweep.methods.search.trials_by_block import TrialsByBlock

if TYPE_CHECKING:
    from sweep.methods.search.asked_trials import AskedTrials

RESAMPLES = 2000
RESAMPLING_SEED = 20
UNFINISHED_SHOWN = 5
"""Number of candidates to show before any candidate is judged on held-out seeds."""
UNKNOWN = Interval(np.nan, np.nan, np.nan, 0)


class HeldOutDifference(NamedTuple):
    """A chosen candidate minus a reference, on common held-out blocks."""

    candidate: int
    reference: str
    objective: str
    difference: float
    low: float
    high: float
    n: int
    variance_reduction: float


def shown(asked_trials: "AskedTrials", run: str = SEARCH) -> list[int]:
    """Return the candidates that a run has chosen and judged, the winner first.

    Before any judgement on held-out seeds, the result has the best candidates.
    """
    judged = set(trials_of(asked_trials, run, HELD_OUT).candidates.tolist())
    order = chosen(
        candidates(asked_trials, run),
        objectives(asked_trials),
        len(judged) or UNFINISHED_SHOWN,
    )
    return [number for number in order if number in judged or not judged]


def winners(asked_trials: "AskedTrials", run: str = SEARCH) -> pd.DataFrame:
    """Return a table of chosen candidates, one row per candidate and objective.

    The order equals the order of `chosen`: the winner first. Columns: candidate,
    objective, then search and held_out, each with `_low`, `_high` and `_n`, the number
    of blocks, optimism, violation and not_done.

    Confidence intervals follow `block_interval`, at 95 %. Search intervals are not
    simultaneous, and ignore that the candidate was chosen. Held-out intervals are
    simultaneous (Bonferroni) over all rows and all references.

    `optimism` is the amount by which the search estimate is better. It is NaN for a
    worst value, which differs by the number of blocks alone. `violation` is the largest
    violation on held-out seeds, minus infinity without constraints. `not_done` is the
    number of held-out trials without a result, for which nothing is known.
    """
    numbers = shown(asked_trials, run)
    searched = trials_of(asked_trials, run, SEARCH)
    judged = trials_of(asked_trials, run, HELD_OUT)
    confidence = together(asked_trials, numbers)
    rows = []
    for number in numbers:
        for objective in objectives(asked_trials):
            search_estimate = block_interval(
                objective, searched.of(searched.find(number), objective.column)
            )
            held_out_estimate = held_out_interval(judged, number, objective, confidence)
            optimism = _optimism(objective, search_estimate, held_out_estimate)
            rows.append(
                (
                    number,
                    objective.column,
                    *search_estimate,
                    *held_out_estimate,
                    optimism,
                )
            )
    columns = [
        "candidate",
        "objective",
        *_interval_columns("search"),
        *_interval_columns("held_out"),
        "optimism",
    ]
    table = pd.DataFrame(rows, columns=columns)
    table["violation"] = [
        _violation(asked_trials, judged, number) for number in table["candidate"]
    ]
    table["not_done"] = [_not_done(judged, number) for number in table["candidate"]]
    return table


def references(asked_trials: "AskedTrials") -> pd.DataFrame:
    """Return a table of the references, one row per reference and objective.

    Columns: reference, objective, held_out with `_low`, `_high` and `_n`, violation and
    not_done, see `winners`. The confidence intervals are simultaneous with the
    intervals of the winners.
    """
    judged = trials_of(asked_trials, REFERENCES, HELD_OUT)
    confidence = together(asked_trials, shown(asked_trials))
    rows = [
        (
            name,
            objective.column,
            *held_out_interval(judged, place, objective, confidence),
            place,
        )
        for place, name in enumerate(asked_trials.description["references"])
        for objective in objectives(asked_trials)
    ]
    table = pd.DataFrame(
        rows,
        columns=["reference", "objective", *_interval_columns("held_out"), "place"],
    )
    places = table.pop("place")
    table["violation"] = [_violation(asked_trials, judged, place) for place in places]
    table["not_done"] = [_not_done(judged, place) for place in places]
    return table


def differences(asked_trials: "AskedTrials") -> pd.DataFrame:
    """Return a table of the winner minus each reference.

    The columns are the fields of HeldOutDifference. With several objectives, each
    member of the front replaces the winner. Pairs are held-out blocks with common
    seeds. `variance_reduction`, of means only, is the factor of independent blocks that
    common seeds save. The 95 % confidence intervals are simultaneous over all rows
    (Bonferroni).
    """
    aims = objectives(asked_trials)
    numbers = shown(asked_trials)
    numbers = numbers if len(aims) > 1 else numbers[:1]
    judged = trials_of(asked_trials, SEARCH, HELD_OUT)
    reference_trials = trials_of(asked_trials, REFERENCES, HELD_OUT)
    names = asked_trials.description["references"]
    confidence = simultaneous_confidence(max(1, len(numbers) * len(names) * len(aims)))
    rows = []
    for number in numbers:
        for place, name in enumerate(names):
            for objective in aims:
                first, second = (
                    _judged(side, who, objective)
                    for side, who in ((judged, number), (reference_trials, place))
                )
                rows.append(
                    _difference(
                        number,
                        name,
                        objective,
                        first,
                        second=second,
                        confidence=confidence,
                    )
                )
    return pd.DataFrame(rows, columns=list(HeldOutDifference._fields))


def front(asked_trials: "AskedTrials", run: str = SEARCH) -> pd.DataFrame:
    """Return a table of the Pareto front that a run has chosen, one row per member.

    Columns: candidate, on_front, share, beaten_by, knee. All columns are of the
    held-out estimates. The table is empty before held-out trials have run.

    `on_front` is true if no chosen candidate dominates the member. `share` is the
    fraction of 2000 bootstrap resamples of the blocks in which `on_front` is true.
    `beaten_by` is a candidate that is better in every objective, else -1. `knee` is
    true for the knee of the members on the front.

    A candidate is better only beyond the 95 % confidence intervals of the paired
    differences. The intervals are simultaneous over all pairs and objectives
    (Bonferroni).
    """
    aims = objectives(asked_trials)
    judged = trials_of(asked_trials, run, HELD_OUT)
    numbers = [
        number for number in shown(asked_trials, run) if number in judged.candidates
    ]
    maximize = [objective.maximize for objective in aims]
    values = held_out_values(judged, numbers, aims)
    on_front = nondominated(values, maximize)
    place = knee(values[on_front], maximize)
    table = pd.DataFrame({"candidate": numbers, "on_front": on_front})
    table["share"] = _shares(judged, numbers, aims)
    table["beaten_by"] = _beaten_by(judged, numbers, aims)
    table["knee"] = np.arange(len(numbers)) == (
        -1 if place is None else np.flatnonzero(on_front)[place]
    )
    return table


def together(asked_trials: "AskedTrials", numbers: list[int]) -> float:
    """Return the confidence level of each held-out interval, for simultaneous 95 %.

    The family has the intervals of the candidates `numbers` and of the references.
    """
    rows = (len(numbers) + len(asked_trials.description["references"])) * len(
        asked_trials.description["objectives"]
    )
    return simultaneous_confidence(max(1, rows))


def held_out_interval(
    judged: TrialsByBlock, number: int, objective: Objective, confidence: float
) -> Interval:
    """Return the held-out estimate of a candidate with its confidence interval.

    Parameters
    ----------
    judged : TrialsByBlock
        Held-out trials.
    number : int
        Number of the candidate.
    objective : Objective
        Objective to estimate.
    confidence : float
        Confidence level.

    Returns
    -------
    Interval
        NaN, with no blocks, if the candidate is not judged.
    """
    if number not in judged.candidates:
        return UNKNOWN
    return block_interval(objective, _judged(judged, number, objective), confidence)


def held_out_values(
    judged: TrialsByBlock, numbers: list[int], aims: list[Objective]
) -> Floats:
    """Return the held-out estimates of judged candidates.

    Parameters
    ----------
    judged : TrialsByBlock
        Held-out trials.
    numbers : list of int
        Numbers of k candidates.
    aims : list of Objective
        The m objectives.

    Returns
    -------
    array of float
        Estimates, shape (k, m).
    """
    values = [
        [objective.value(_judged(judged, number, objective)) for objective in aims]
        for number in numbers
    ]
    return np.array(values, np.float64).reshape(len(numbers), len(aims))


def _judged(judged: TrialsByBlock, number: int, objective: Objective) -> Floats:
    if number not in judged.candidates:
        return np.empty((0, 1))
    return judged.of(judged.find(number), objective.column)


def _difference(
    number: int,
    name: str,
    objective: Objective,
    first: Floats,
    second: Floats,
    confidence: float,
) -> HeldOutDifference:
    n = min(len(first), len(second))
    interval = difference_interval(objective, first[:n], second[:n], confidence)
    reduction = np.nan
    if objective.statistic.about.averages and n > 0:
        first_means, second_means = (
            pd.Series(side[:n].mean(axis=1)) for side in (first, second)
        )
        reduction = paired_contrast(first_means, second_means).variance_reduction
    return HeldOutDifference(
        number, name, objective.column, *interval, variance_reduction=reduction
    )


def _optimism(objective: Objective, searched: Interval, held_out: Interval) -> float:
    if objective.statistic.about.extreme:
        return np.nan
    return (
        searched.value - held_out.value
        if objective.maximize
        else held_out.value - searched.value
    )


def _violation(
    asked_trials: "AskedTrials", judged: TrialsByBlock, number: int
) -> float:
    if number not in judged.candidates:
        return np.nan
    place = judged.find(number)
    each = [
        constraint.violation(judged.of(place, constraint.column))
        for constraint in constraints(asked_trials)
    ]
    return float(np.max([-np.inf, *each]))


def _not_done(judged: TrialsByBlock, number: int) -> int:
    if number not in judged.candidates:
        return 0
    place = judged.find(number)
    return int((judged.stored[place] & ~judged.done[place]).sum())


def _shares(judged: TrialsByBlock, numbers: list[int], aims: list[Objective]) -> Floats:
    if not numbers:
        return np.empty(0)
    n = min(int(judged.counts()[judged.find(number)]) for number in numbers)
    if n == 0:
        return np.full(len(numbers), np.nan)
    drawn = np.random.default_rng(RESAMPLING_SEED).integers(0, n, (RESAMPLES, n))
    draws = np.empty((RESAMPLES, len(numbers), len(aims)))
    for row, number in enumerate(numbers):
        for column, objective in enumerate(aims):
            resampled = _judged(judged, number, objective)[drawn].reshape(RESAMPLES, -1)
            draws[:, row, column] = objective.statistic.along(
                resampled, maximize=objective.maximize
            )
    complete = ~np.isnan(draws).any(axis=(0, 2))
    shares = np.full(len(numbers), np.nan)
    if complete.any():
        shares[complete] = shares_on_front(
            draws[:, complete], [objective.maximize for objective in aims]
        )
    return shares


def _beaten_by(
    judged: TrialsByBlock, numbers: list[int], aims: list[Objective]
) -> list[int]:
    confidence = simultaneous_confidence(
        max(1, len(numbers) * (len(numbers) - 1) // 2 * len(aims))
    )
    better = {
        (rival, number): all(
            _better(judged, rival, number, objective, confidence=confidence)
            for objective in aims
        )
        for rival in numbers
        for number in numbers
        if rival != number
    }
    return [
        next((rival for rival in numbers if better.get((rival, number))), -1)
        for number in numbers
    ]


def _better(
    judged: TrialsByBlock,
    rival: int,
    number: int,
    objective: Objective,
    confidence: float,
) -> bool:
    first, second = (_judged(judged, side, objective) for side in (rival, number))
    n = min(len(first), len(second))
    difference = difference_interval(objective, first[:n], second[:n], confidence)
    return difference.low > 0.0 if objective.maximize else difference.high < 0.0


def _interval_columns(name: str) -> list[str]:
    return [name, f"{name}_low", f"{name}_high", f"{name}_n"]
