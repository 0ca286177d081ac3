"""The findings of a search in plain words: the better candidate, and caveats."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from sweep.analysis import number, with_interval
from sweep.methods.search.objectives import Constraint, Objective
from sweep.spec import DISTRIBUTIONS, Distribution, Setting

EDGE = 0.02
"""Fraction of a range, from an end, within which a winner is at the edge."""
FEWEST_BLOCKS = 10
"""Number of held-out blocks below which the judgement of a candidate is weak."""

FEWEST_IN_TAIL = 10
"""Number of blocks in the tail of a statistic, below which intervals are too narrow."""


def objective_words(objective: Objective) -> str:
    """Return an objective in words, such as `mean coverage_total, to be large`."""
    return (
        f"{objective.statistic} {objective.column}, to be"
        f" {'large' if objective.maximize else 'small'}"
    )


def constraint_words(constraint: Constraint) -> str:
    """Return a constraint in words, such as `worst collisions at most 0`."""
    side = "at most" if constraint.at_most else "at least"
    return f"{constraint.statistic} {constraint.column} {side} {constraint.bound:g}"


def verdict(
    objective: Objective, difference: Mapping[str, Any], unit: str, who: str, whom: str
) -> str:
    """Return a sentence on the difference between two candidates.

    The sentence names the better candidate with the difference, or reports that no
    difference is shown.

    Parameters
    ----------
    objective : Objective
        Objective that was compared.
    difference : mapping
        `who` minus `whom`: difference, low and high, from
        `sweep.methods.search.held_out.differences`.
    unit : str
        Unit of the column; "" without a unit.
    who : str
        Name of the candidate, at the beginning of the sentence.
    whom : str
        Name of the other candidate.
    """
    value, low, high = (
        float(difference[name]) for name in ("difference", "low", "high")
    )
    unit = difference_unit(unit)
    column = objective.column
    if math.isnan(value):
        return (
            f"{who} cannot be compared with {whom} in {column}:"
            " held-out results are missing"
        )
    side = "better" if (value > 0.0) == objective.maximize else "worse"
    if math.isnan(low) and value != 0.0:
        return (
            f"{who} is {side} than {whom} in {column} by {number(abs(value))}{unit},"
            " without a confidence interval"
        )
    if math.isnan(low) or low <= 0.0 <= high:
        between = f"the difference is {with_interval(value, low, high)}{unit}"
        return f"{who} is not shown to differ from {whom} in {column}: {between}"
    size = (abs(value), *sorted((abs(low), abs(high))))
    return f"{who} is {side} than {whom} in {column} by {with_interval(*size)}{unit}"


def thin_tail(objective: Objective, blocks: int) -> str:
    """Return a warning if a statistic of the tail rests on few of the blocks, else "".

    The confidence interval of a statistic of the tail, for example a CVaR, is too
    narrow.
    """
    tail = objective.statistic.tail
    if tail is None or tail * blocks >= FEWEST_IN_TAIL:
        return ""
    enough = math.ceil(FEWEST_IN_TAIL / tail)
    return (
        f"The {objective.statistic} of {objective.column} rests on few of {blocks}"
        " held-out blocks, so the confidence interval is too narrow:"
        f" use {enough} held-out replicates."
    )


def difference_unit(unit: str) -> str:
    """Return the unit of a difference, after a space: points for percentages."""
    return {"": "", "%": " % points"}.get(unit, f" {unit}")


def edges(
    winner: Mapping[str, Any],
    ranges: Mapping[str, Mapping[str, Sequence[Any]]],
    settings: Mapping[str, Setting],
) -> list[str]:
    """Return a sentence for each parameter whose best value is at an end of its range.

    There may be better values beyond. An end does not count if the model allows no
    values beyond the end, or if the range has only two integers.

    Parameters
    ----------
    winner : mapping
        Row of the winner.
    ranges : mapping
        Distribution of each parameter: its form and arguments.
    settings : mapping of Setting
        Parameters of the model, with their limits.
    """
    sentences = []
    for name, distribution in ranges.items():
        ((form, arguments),) = distribution.items()
        entry = DISTRIBUTIONS[form]
        if entry.kind == "listed":
            continue
        low = float(arguments[0])
        high = float(arguments[1])
        share = _share(entry, float(winner[name]), low, high)
        for near, end, limit in (
            (share, low, settings[name].low),
            (1.0 - share, high, settings[name].high),
        ):
            if near <= EDGE and end != limit:
                side = "lower" if end == low else "upper"
                sentences.append(
                    f"{name} = {winner[name]:.6g} is at the {side} end of its range,"
                    f" {low:g} to {high:g}: widen the range, better values may exist"
                )
    return sentences


def counted(candidates: pd.DataFrame, rejected: int, repeated: int) -> str:
    """Return the number of candidates and of each status, in words.

    Parameters
    ----------
    candidates : DataFrame
        The table of candidates.
    rejected : int
        Number of proposals that the spec has rejected.
    repeated : int
        Number of proposals that were made before.
    """
    counts = candidates["status"].value_counts()
    parts = [
        f"{counts[kind]} {kind}"
        for kind in ("complete", "raced out", "cut short", "failed")
        if kind in counts
    ]
    infeasible = int(
        (~candidates["feasible"] & (candidates["status"] != "failed")).sum()
    )
    text = (
        f"{len(candidates)} asked: {', '.join(parts)}"
        if len(candidates)
        else "none asked"
    )
    text += f"; {infeasible} not feasible" if infeasible else ""
    text += f"; {rejected} more rejected by the spec" if rejected else ""
    return text + (f"; {repeated} more were proposed before" if repeated else "")


def _share(entry: Distribution, value: float, low: float, high: float) -> float:
    """Return the position of a value in a range, as a fraction from the lower end.

    The position is 0.5 for a range without ends to be near.
    """
    if entry.kind == "whole":
        return 0.5 if high - low < 2.0 else (value - low) / (high - low)
    if entry.logarithmic:
        value = math.log(value)
        low = math.log(low)
        high = math.log(high)
    return 0.5 if low == high else (value - low) / (high - low)
