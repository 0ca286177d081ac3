"""Repetitions of a search against random searches.

Figures show the best value so far, the hypervolume, and held-out values of the winners.
"""

from collections.abc import Sequence
from functools import partial
from textwrap import wrap

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import Declared, mean_interval
from sweep.errors import ChoiceError
from sweep.figures import BLUE, GREY, ORANGE, STYLE, legend, note, quantity
from sweep.methods.search.asked_trials import AskedTrials, read_asked
from sweep.methods.search.figure_kind import search_kind
from sweep.methods.search.figure_layout import with_front
from sweep.methods.search.objectives import Floats
from sweep.methods.search.outcome import SEARCH, objectives
from sweep.methods.search.repetitions import (
    RANDOM,
    REPETITION,
    against_random,
    best_so_far,
    reference_point,
    runs,
)
from sweep.tables import StoredStudy

LETTERS_OF_A_LABEL = 44


def comparison_figure(study: StoredStudy) -> Figure:
    """Draw the best value so far against the trials spent.

    Curves are means over repetitions of the search, and over random searches. With
    several objectives the hypervolume is drawn. On the right are held-out values of the
    winners or fronts, one point per run, with means. Raises ChoiceError if the study is
    not a search, or has no repetitions.
    """
    asked_trials = with_repetitions(study)
    comparison = against_random(asked_trials)
    judged = "winners" if len(objectives(asked_trials)) == 1 else "fronts"
    with style.context(STYLE):
        figure = Figure(figsize=(7.0, 3.7))
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=[3.4, 1.0])
        sides = (
            (REPETITION, comparison.search, BLUE, "search"),
            (RANDOM, comparison.random, ORANGE, "random search"),
        )
        for place, (kind, values, colour, label) in enumerate(sides):
            curves = _curves(asked_trials, runs(asked_trials, kind))
            distribution = comparison.distribution
            _band(left, curves, colour, label, distribution=distribution)
            _strip(right, place, values, colour, distribution=distribution)
        left.set(
            xlim=(0, None),
            xlabel="trials spent",
            ylabel=_best_label(study, asked_trials),
            title="on the seeds of the search",
        )
        right.set(
            xticks=[0, 1],
            xticklabels=["search", "random"],
            xlim=(-0.6, 1.6),
            title=f"{judged}, held out",
        )
        right.grid(visible=False, axis="x")
        legend(figure, left)
        note(
            figure,
            f"{study.name}: {_runs_note(asked_trials)}; means with 95 % confidence"
            " intervals over runs",
        )
    return figure


def hypervolume_figure(study: StoredStudy) -> Figure:
    """Draw the hypervolume of a search for several objectives against trials.

    Repetitions and random searches are drawn too, if any. Raises ChoiceError if the
    study is not a search, or has a single objective.
    """
    asked_trials = with_front(study, "hypervolume")
    reference = reference_point(asked_trials)
    with style.context(STYLE):
        figure = Figure(figsize=(6.0, 3.7))
        axes = figure.subplots()
        for kind, colour, label in (
            (RANDOM, ORANGE, "random searches"),
            (REPETITION, BLUE, "repetitions"),
        ):
            for place, run in enumerate(runs(asked_trials, kind)):
                table = best_so_far(asked_trials, run, reference)
                axes.step(
                    table["trials"],
                    table["value"],
                    where="post",
                    color=colour,
                    alpha=0.35,
                    linewidth=0.8,
                    label="" if place else label,
                )
        table = best_so_far(asked_trials, SEARCH, reference)
        axes.step(
            table["trials"],
            table["value"],
            where="post",
            color=GREY,
            linewidth=2.0,
            label="the search",
        )
        axes.set(xlabel="trials spent", ylabel=_best_label(study, asked_trials))
        axes.set_xlim(left=0)
        axes.set_ylim(0, max(1.05 * axes.dataLim.y1, np.finfo(float).tiny))
        legend(figure, axes)
        note(
            figure,
            f"{study.name}: {_runs_note(asked_trials)}; on the seeds of the search,"
            f" without confidence intervals; {_point(asked_trials)}",
        )
    return figure


def with_repetitions(study: StoredStudy) -> AskedTrials:
    """Return the trials of a search. Raises ChoiceError without repetitions."""
    asked_trials = read_asked(study)
    if not (runs(asked_trials, REPETITION) and runs(asked_trials, RANDOM)):
        raise ChoiceError(
            "has no repetitions; run the search with --repetitions 10", study.name
        )
    return asked_trials


def _curves(asked_trials: AskedTrials, repeated: Sequence[str]) -> pd.DataFrame:
    """Return the best value so far of each run, as columns.

    Rows are all numbers of trials at which a run has a value.
    """
    reference = (
        reference_point(asked_trials) if len(objectives(asked_trials)) > 1 else None
    )
    columns = {}
    for run in repeated:
        table = best_so_far(asked_trials, run, reference)
        columns[run] = table.groupby("trials")["value"].last()
    return pd.DataFrame(columns).sort_index().ffill()


def _band(
    axes: Axes,
    curves: pd.DataFrame,
    colour: str,
    label: str,
    distribution: Declared,
) -> None:
    complete = curves.dropna()
    means = [
        mean_interval(row, distribution=distribution) for row in complete.to_numpy()
    ]
    mean, low, high, _ = np.reshape(means, (-1, 4)).T
    axes.step(complete.index, mean, where="post", color=colour, label=label)
    axes.fill_between(
        complete.index,
        low,
        high,
        step="post",
        color=colour,
        alpha=0.2,
        lw=0,
    )


def _strip(
    axes: Axes, place: int, values: Floats, colour: str, distribution: Declared
) -> None:
    """Draw the values of runs side by side, with mean and confidence interval."""
    spread = (
        np.linspace(-0.2, 0.2, len(values))
        if len(values) > 1
        else np.zeros(len(values))
    )
    axes.plot(place + spread, values, "o", color=colour, markersize=3, alpha=0.5)
    mean, low, high, _ = mean_interval(values, distribution=distribution)
    axes.vlines(place, low, high, color=colour, linewidth=1.6)
    axes.plot([place], [mean], "D", color=colour, markersize=5)


def _best_label(study: StoredStudy, asked_trials: AskedTrials) -> str:
    aims = objectives(asked_trials)
    if len(aims) == 1:
        column = quantity(study, aims[0].column)
        return f"best {aims[0].statistic.named(column)}"
    sides = [quantity(study, objective.column) for objective in aims]
    return "\n".join(["hypervolume,", *wrap(" x ".join(sides), LETTERS_OF_A_LABEL)])


def _runs_note(asked_trials: AskedTrials) -> str:
    counts = [len(runs(asked_trials, kind)) for kind in (REPETITION, RANDOM)]
    budget = f"{asked_trials.description['budget']:,} trials"
    return (
        f"{counts[0]} repetitions and {counts[1]} random searches of {budget} each"
        if counts[0]
        else budget
    )


def _point(asked_trials: AskedTrials) -> str:
    """Return the reference point in words."""
    point = reference_point(asked_trials)
    if point is None:
        return "no candidate has all blocks"
    values = ", ".join(
        f"{objective.column} {value:.4g}"
        for objective, value in zip(objectives(asked_trials), point, strict=True)
    )
    return f"from the worst values seen: {values.replace('_', ' ')}"


COMPARISON = search_kind(
    "comparison",
    "repetitions of a search against random searches",
    with_repetitions,
    comparison_figure,
)
HYPERVOLUME = search_kind(
    "hypervolume",
    "the hypervolume of a search by trials spent",
    partial(with_front, kind="hypervolume"),
    hypervolume_figure,
)
