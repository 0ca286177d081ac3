"""Figures of a search: the history of candidates, and the front."""

from collections.abc import Sequence
from functools import partial
from itertools import combinations

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.figures import BLUE, GREEN, GREY, ORANGE, STYLE, VERMILION, legend, note
from sweep.methods.search.asked_trials import AskedTrials, read_asked
from sweep.methods.search.figure_kind import search_kind
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
    with_front,
)
from sweep.methods.search.figure_marks import front_marks, history_marks
from sweep.methods.search.held_out import front, references, winners
from sweep.methods.search.objectives import Floats, Objective
from sweep.methods.search.outcome import candidates, objectives
from sweep.methods.search.repetitions import best_so_far
from sweep.tables import StoredStudy

MARKERS = "s^vph"


def history_figure(study: StoredStudy) -> Figure:
    """Draw the estimates of all candidates against the trials spent.

    Each objective has a panel. The candidates of a batch are in the order of their
    proposal. With one objective a line shows the best candidate so far, and the worst
    candidates are triangles at the edge. Held-out estimates of the winner or the front,
    and of the references, are on the right. Raises ChoiceError if the study is not a
    search.
    """
    asked_trials = read_asked(study)
    aims = objectives(asked_trials)
    with style.context(STYLE):
        figure = Figure(figsize=(6.4, 1.3 + 2.6 * len(aims)))
        panels = figure.subplots(len(aims), 1, sharex=True, squeeze=False)[:, 0]
        for axes, objective in zip(panels, aims, strict=True):
            _history_panel(axes, asked_trials, objective)
            axes.set_ylabel(label_of(study, objective))
        panels[-1].set_xlabel("trials spent")
        legend(figure, panels[0], 3)
        note(figure, history_note(study, asked_trials))
    return figure


def front_figure(study: StoredStudy) -> Figure:
    """Draw the candidates of a search and the front, one panel per pair of objectives.

    The front is estimated on held-out seeds. Raises ChoiceError if the study is not a
    search, or has a single objective.
    """
    asked_trials = with_front(study, "front")
    pairs = list(combinations(objectives(asked_trials), 2))
    with style.context(STYLE):
        figure = Figure(figsize=(5.4 if len(pairs) == 1 else 3.4 * len(pairs), 4.4))
        panels = figure.subplots(1, len(pairs), squeeze=False)[0]
        for axes, pair in zip(panels, pairs, strict=True):
            _front_panel(axes, asked_trials, pair, line=len(pairs) == 1)
            axes.set(xlabel=label_of(study, pair[0]), ylabel=label_of(study, pair[1]))
        legend(figure, panels[0], 3)
        note(figure, front_note(study, asked_trials))
    return figure


def _history_panel(axes: Axes, asked_trials: AskedTrials, objective: Objective) -> None:
    table = candidates(asked_trials)
    spent = best_so_far(asked_trials).set_index("step")["trials"]
    x = places(table, spent)
    y = table[objective.column].to_numpy(np.float64)
    edge = edge_of_history(asked_trials, objective)
    beyond = y < edge if objective.maximize else y > edge
    looks = (("o", GREY, 2.2), ("o", BLUE, 3.8), ("x", VERMILION, 4.0))
    for (label, group), look in zip(groups_of(table).items(), looks, strict=True):
        chosen = group & ~beyond
        marker, colour, size = look
        if chosen.any():
            axes.plot(
                x[chosen],
                y[chosen],
                marker,
                color=colour,
                markersize=size,
                alpha=0.75,
                label=label,
            )
    if beyond.any():
        marker = "v" if objective.maximize else "^"
        at = np.full(np.count_nonzero(beyond), edge)
        axes.plot(
            x[beyond],
            at,
            marker,
            color=GREY,
            markersize=2.5,
            alpha=0.5,
            clip_on=False,
            label="worse than this",
        )
    if len(objectives(asked_trials)) == 1:
        best = best_so_far(asked_trials)
        axes.step(
            best["trials"],
            best["value"],
            where="post",
            color=BLUE,
            linewidth=1.2,
            label="winner by then",
        )
    _held_out_marks(axes, asked_trials, objective, float(spent.max()))
    axes.set_xlim(left=0)


def _held_out_marks(
    axes: Axes, asked_trials: AskedTrials, objective: Objective, end: float
) -> None:
    """Draw held-out estimates with confidence intervals right of the end."""
    label, judged = judged_of(asked_trials, objective)
    _marks(
        axes, np.full(len(judged), (1.0 + ROOM) * end), judged, (VERMILION, "D", label)
    )
    estimates = references(asked_trials)
    for place, (_, row) in enumerate(
        estimates[estimates["objective"] == objective.column].iterrows()
    ):
        at = np.array([(1.0 + ROOM * (place + 2)) * end])
        _marks(
            axes,
            at,
            row.to_frame().T,
            (GREEN, MARKERS[place % len(MARKERS)], f"{row['reference']}, held out"),
        )


def _marks(
    axes: Axes, x: Floats, table: pd.DataFrame, look: tuple[str, str, str]
) -> None:
    colour, marker, label = look
    value, low, high = (
        table[f"held_out{end}"].to_numpy(np.float64) for end in ("", "_low", "_high")
    )
    if np.isnan(value).all():
        return
    axes.vlines(x, low, high, color=colour, linewidth=1.4)
    axes.plot(
        x,
        value,
        linestyle="none",
        marker=marker,
        color=colour,
        markersize=5,
        label=label,
    )


def _front_panel(
    axes: Axes,
    asked_trials: AskedTrials,
    pair: tuple[Objective, Objective],
    *,
    line: bool,
) -> None:
    table = candidates(asked_trials)
    metrics = [objective.column for objective in pair]
    for chosen, marker, colour, label in (
        (table["feasible"], "o", "0.6", "candidates"),
        (~table["feasible"], "x", ORANGE, "not feasible"),
    ):
        if chosen.any():
            part = table[chosen]
            axes.plot(
                part[metrics[0]],
                part[metrics[1]],
                marker,
                color=colour,
                markersize=2.5,
                alpha=0.6,
                label=label,
            )
    judged = wide(winners(asked_trials), "candidate", metrics)
    _crosses(axes, judged, metrics, (BLUE, "o", "chosen, held out"))
    if line and len(judged):
        best = best_of(judged, pair)
        where = "steps-pre" if pair[0].maximize else "steps-post"
        axes.plot(
            best[metrics[0]],
            best[metrics[1]],
            drawstyle=where,
            color=BLUE,
            linewidth=0.9,
        )
    members = front(asked_trials)
    knee = judged.loc[judged.index.isin(members.loc[members["knee"], "candidate"])]
    if len(knee):
        (ring,) = axes.plot(
            knee[metrics[0]], knee[metrics[1]], "o", color=VERMILION, label="knee"
        )
        ring.set(markersize=10, markerfacecolor="none")
    for place, (name, row) in enumerate(
        wide(references(asked_trials), "reference", metrics).iterrows()
    ):
        _crosses(
            axes,
            row.to_frame().T,
            metrics,
            (GREEN, MARKERS[place % len(MARKERS)], f"{name}, held out"),
        )


def _crosses(
    axes: Axes, table: pd.DataFrame, metrics: Sequence[str], look: tuple[str, str, str]
) -> None:
    """Draw points with confidence intervals in x and y."""
    colour, marker, label = look
    x, x_low, x_high = (
        table[metrics[0] + end].to_numpy(np.float64) for end in ("", "_low", "_high")
    )
    y, y_low, y_high = (
        table[metrics[1] + end].to_numpy(np.float64) for end in ("", "_low", "_high")
    )
    if np.isnan(x + y).all():
        return
    axes.hlines(y, x_low, x_high, color=colour, linewidth=1.0, alpha=0.7)
    axes.vlines(x, y_low, y_high, color=colour, linewidth=1.0, alpha=0.7)
    axes.plot(
        x, y, linestyle="none", marker=marker, color=colour, markersize=4, label=label
    )


HISTORY = search_kind(
    "history",
    "the candidates of a search in the order of proposal",
    read_asked,
    history_figure,
    marks=history_marks,
)
FRONT = search_kind(
    "front",
    "the front that a search has chosen, on held-out seeds",
    partial(with_front, kind="front"),
    front_figure,
    marks=front_marks,
)
