"""What a search did and found: the history of its candidates, and its front."""

from collections.abc import Sequence
from functools import partial
from itertools import combinations

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.campaigns.search.asked_trials import AskedTrials, read_asked
from sweep.campaigns.search.fronts import nondominated
from sweep.campaigns.search.held_out import front, references, winners
from sweep.campaigns.search.outcome import FAILED, candidates, objectives
from sweep.campaigns.search.repetitions import best_so_far
from sweep.errors import ChoiceError
from sweep.figures.drawing import legend, note, quantity
from sweep.figures.planning import search_kind
from sweep.figures.style import BLUE, GREEN, GREY, ORANGE, STYLE, VERMILION
from sweep.spec.objectives import Floats, Objective
from sweep.tables.stored_study import StoredStudy

SHOWN = 0.75
"""The part of the estimates of one objective that are drawn in their own places. The
others lie at the edge, so that the best can be told apart.
"""
MARKERS = "s^vph"
ROOM = 0.06
"""Room for a held-out mark beyond the end, as a part of the width of an axis."""


def history_figure(study: StoredStudy) -> Figure:
    """Every candidate's estimate against the trials spent, a panel an objective. The
    candidates of a batch are in the order in which they were asked.

    With one objective a line shows the winner by then, and the worst candidates are
    triangles at the edge. Right of the end are held-out estimates: of the winner, or of
    the front, and of the references. Raises ChoiceError where the study is no search.
    """
    asked = read_asked(study)
    wanted = objectives(asked)
    with style.context(STYLE):
        figure = Figure(figsize=(6.4, 1.3 + 2.6 * len(wanted)))
        panels = figure.subplots(len(wanted), 1, sharex=True, squeeze=False)[:, 0]
        for axes, objective in zip(panels, wanted, strict=True):
            _history_panel(axes, asked, objective)
            axes.set_ylabel(_label(study, objective))
        panels[-1].set_xlabel("trials spent")
        legend(figure, panels[0], 3)
        note(figure, _history_note(study, asked))
    return figure


def front_figure(study: StoredStudy) -> Figure:
    """The candidates of a search for several objectives, and its front judged on held-
    out seeds. Each pair of objectives has a panel.

    Raises ChoiceError where the study is no search, or has one objective.
    """
    asked = with_front(study, "front")
    wanted = objectives(asked)
    pairs = list(combinations(wanted, 2))
    with style.context(STYLE):
        figure = Figure(figsize=(5.4 if len(pairs) == 1 else 3.4 * len(pairs), 4.4))
        panels = figure.subplots(1, len(pairs), squeeze=False)[0]
        for axes, pair in zip(panels, pairs, strict=True):
            _front_panel(axes, asked, pair, line=len(pairs) == 1)
            axes.set(xlabel=_label(study, pair[0]), ylabel=_label(study, pair[1]))
        legend(figure, panels[0], 3)
        note(
            figure,
            f"{study.name}: {len(candidates(asked)):,} candidates on the seeds of the"
            f" search; {_held_out_note(asked)}",
        )
    return figure


def with_front(study: StoredStudy, kind: str) -> AskedTrials:
    """What a search for several objectives has asked for, for a figure of this kind.

    Raises ChoiceError where the study is no search, or has one objective.
    """
    asked = read_asked(study)
    if len(objectives(asked)) < 2:
        raise ChoiceError(
            "needs two objectives and there is one; allowed: history", study.name, kind
        )
    return asked


def _history_panel(axes: Axes, asked: AskedTrials, objective: Objective) -> None:
    table = candidates(asked)
    spent = best_so_far(asked).set_index("step")["trials"]
    x = _places(table, spent)
    y = table[objective.column].to_numpy(np.float64)
    alone = len(objectives(asked)) == 1
    complete = (table["blocks"] == table["blocks"].max()).to_numpy()
    feasible = table["feasible"].to_numpy()
    edge = _edge(y[feasible], objective, _held_out_bounds(asked)) if alone else np.nan
    beyond = y < edge if objective.maximize else y > edge
    most = f"{table['blocks'].max()} blocks"
    kinds = (
        (feasible & ~complete & ~beyond, "o", GREY, 2.2, "fewer blocks"),
        (feasible & complete & ~beyond, "o", BLUE, 3.8, most),
        (~feasible & ~beyond, "x", VERMILION, 4.0, "not feasible"),
    )
    for chosen, marker, colour, size, label in kinds:
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
    if alone:
        best = best_so_far(asked)
        axes.step(
            best["trials"],
            best["value"],
            where="post",
            color=BLUE,
            linewidth=1.2,
            label="winner by then",
        )
    _held_out_marks(axes, asked, objective, float(spent.max()))
    axes.set_xlim(left=0)


def _places(table: pd.DataFrame, spent: "pd.Series[int]") -> Floats:
    """Where candidates lie on an axis of trials. Those of a batch are spread evenly,
    from the end of the batch before to the end of their own.
    """
    before = spent.shift(fill_value=0)
    groups = table.groupby("batch")["candidate"]
    share = (groups.cumcount() + 1) / groups.transform("size")
    start, end = (
        column.loc[table["batch"]].to_numpy(np.float64) for column in (before, spent)
    )
    return np.asarray(start + share * (end - start), np.float64)


def _held_out_marks(
    axes: Axes, asked: AskedTrials, objective: Objective, end: float
) -> None:
    """Draw held-out estimates with their intervals right of the end."""
    judged = winners(asked)
    judged = judged[judged["objective"] == objective.column]
    judged = judged if len(objectives(asked)) > 1 else judged[:1]
    label = "winner, held out" if len(judged) == 1 else "front, held out"
    _marks(
        axes, np.full(len(judged), (1.0 + ROOM) * end), judged, (VERMILION, "D", label)
    )
    others = references(asked)
    for place, (_, row) in enumerate(
        others[others["objective"] == objective.column].iterrows()
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


def _held_out_bounds(asked: AskedTrials) -> Floats:
    """The held-out estimates that a history of one objective draws, and the ends of
    their intervals.
    """
    tables = (winners(asked)[:1], references(asked))
    return np.concatenate(
        [
            table[[f"held_out{end}" for end in ("", "_low", "_high")]]
            .to_numpy(float)
            .ravel()
            for table in tables
        ]
    )


def _edge(values: Floats, objective: Objective, held_out: Floats) -> float:
    """The edge: the worst value that is drawn in its own place. NaN for no values.

    A part SHOWN of the values lies within the edge, and so does all that is held out.
    Worse candidates are drawn at the edge.
    """
    known, others = values[np.isfinite(values)], held_out[np.isfinite(held_out)]
    if not len(known):
        return np.nan
    edge = np.quantile(known, 1.0 - SHOWN if objective.maximize else SHOWN)
    return float(
        np.min([edge, *others]) if objective.maximize else np.max([edge, *others])
    )


def _front_panel(
    axes: Axes, asked: AskedTrials, pair: tuple[Objective, Objective], *, line: bool
) -> None:
    table, names = candidates(asked), [objective.column for objective in pair]
    for chosen, marker, colour, label in (
        (table["feasible"], "o", "0.6", "candidates"),
        (~table["feasible"], "x", ORANGE, "not feasible"),
    ):
        if chosen.any():
            part = table[chosen]
            axes.plot(
                part[names[0]],
                part[names[1]],
                marker,
                color=colour,
                markersize=2.5,
                alpha=0.6,
                label=label,
            )
    judged = _wide(winners(asked), "candidate", names)
    _crosses(axes, judged, names, (BLUE, "o", "chosen, held out"))
    if line and len(judged):
        values = judged[names].to_numpy(np.float64)
        best = judged[
            nondominated(values, [objective.maximize for objective in pair])
        ].sort_values(names[0])
        where = "steps-pre" if pair[0].maximize else "steps-post"
        axes.plot(
            best[names[0]], best[names[1]], drawstyle=where, color=BLUE, linewidth=0.9
        )
    about = front(asked)
    knee = judged.loc[judged.index.isin(about.loc[about["knee"], "candidate"])]
    if len(knee):
        (ring,) = axes.plot(
            knee[names[0]], knee[names[1]], "o", color=VERMILION, label="knee"
        )
        ring.set(markersize=10, markerfacecolor="none")
    for place, (name, row) in enumerate(
        _wide(references(asked), "reference", names).iterrows()
    ):
        _crosses(
            axes,
            row.to_frame().T,
            names,
            (GREEN, MARKERS[place % len(MARKERS)], f"{name}, held out"),
        )


def _wide(table: pd.DataFrame, by: str, names: Sequence[str]) -> pd.DataFrame:
    """One row a candidate or reference, with the held-out estimates and bounds of each
    objective as columns.
    """
    parts = []
    for name in names:
        part = table[table["objective"] == name].set_index(by)
        parts.append(
            part[["held_out", "held_out_low", "held_out_high"]].set_axis(
                [name, f"{name}_low", f"{name}_high"], axis=1
            )
        )
    return pd.concat(parts, axis=1)


def _crosses(
    axes: Axes, table: pd.DataFrame, names: Sequence[str], look: tuple[str, str, str]
) -> None:
    """Points with intervals both ways."""
    colour, marker, label = look
    x, x_low, x_high = (
        table[names[0] + end].to_numpy(np.float64) for end in ("", "_low", "_high")
    )
    y, y_low, y_high = (
        table[names[1] + end].to_numpy(np.float64) for end in ("", "_low", "_high")
    )
    if np.isnan(x + y).all():
        return
    axes.hlines(y, x_low, x_high, color=colour, linewidth=1.0, alpha=0.7)
    axes.vlines(x, y_low, y_high, color=colour, linewidth=1.0, alpha=0.7)
    axes.plot(
        x, y, linestyle="none", marker=marker, color=colour, markersize=4, label=label
    )


def _label(study: StoredStudy, objective: Objective) -> str:
    what = objective.statistic.named(quantity(study, objective.column))
    return f"{what}\n{'more' if objective.maximize else 'less'} is better"


def _history_note(study: StoredStudy, asked: AskedTrials) -> str:
    table = candidates(asked)
    failed = int((table["status"] == FAILED).sum())
    text = f"{study.name}: {len(table):,} candidates" + (
        f", {failed} failed and not drawn" if failed else ""
    )
    return text + f", {int(table['trials'].sum()):,} trials; {_held_out_note(asked)}"


def _held_out_note(asked: AskedTrials) -> str:
    judged = winners(asked)
    blocks = int(judged["held_out_n"].max()) if len(judged) else 0
    if blocks == 0:
        return "no held-out trials"
    many = "1 block" if blocks == 1 else f"{blocks} blocks"
    return (
        f"{judged['candidate'].nunique()} held out, {many} each,"
        " simultaneous 95 % intervals (Bonferroni)"
    )


HISTORY = search_kind(
    "history",
    "the candidates of a search as they were asked",
    read_asked,
    history_figure,
)
FRONT = search_kind(
    "front",
    "the front that a search has chosen, on held-out seeds",
    partial(with_front, kind="front"),
    front_figure,
)
