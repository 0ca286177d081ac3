"""Figures of patel2023 over many trials: the potential and the equilibrium of section
III-B, rocks and borders.
"""

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import curves, mean_interval
from sweep.figures import (
    BLUE,
    GREEN,
    LINE_STYLES,
    STYLE,
    VERMILION,
    draw_values,
    legend,
    name_rows,
    note,
)
from sweep.tables.stored_study import StoredStudy

from .flights import (
    BORDERS,
    FRAMES_A_SECOND,
    SECOND_HALF,
    TOLERANCE,
    WINDOW,
    Flight,
    Floats,
    Studies,
    Truths,
    flights,
    in_step,
    pair_potential,
    powers_above,
)

COLOURS = {"always": BLUE, "in_margin": VERMILION, "never": GREEN}
RULES = {
    (0.1, 0.15): "all rules",
    (0.0, 0.15): "no alignment",
    (0.0, 0.0): "no flocking rule",
}
MARKERS = ("o", "s", "^")
RULE_WEIGHTS = ["cohesion_weight", "separation_weight"]
DOUBLED = {
    (0.005, 0.15): "the document's weights",
    (0.01, 0.15): "twice the cohesion",
    (0.005, 0.3): "twice the separation",
}
DIFFERENCE = "allowed difference of velocities (%)"
TOLERANCES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.6)
WINDOWS = (0.1, 1.0, 2.0)
"""Seconds; the first is a frame."""
SECONDS = f"time (s, at {FRAMES_A_SECOND} frames/s)"


def potential(studies: Studies) -> Figure:
    """The pair potential whose gradient are the document's own rules, and the
    potentials of rovers and flocks.
    """
    study = studies["presets"]
    trials = study.trials[study.trials["alignment_weight"] > 0]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(10.2, 3.5))
        first, *others = figure.subplots(1, 3)
        _potential_panel(first)
        for axes, metric, name in zip(
            others, ("potential", "flock_potential"), ("rover", "flock"), strict=True
        ):
            _courses(axes, study, trials, metric)
            axes.set(
                ylabel=f"potential of a {name} (m²/s²)",
                title=f"mean potential of a {name}",
                ylim=(0, None),
            )
        legend(figure, others[0], 3)
        note(
            figure,
            f"{study.name}: {_count(trials)} trials a curve, mean with pointwise 95 %"
            " interval; flocks: of two or more",
        )
    return figure


def _potential_panel(axes: Axes) -> None:
    distance = np.linspace(0.0, 110.0, 2201)
    inset = axes.inset_axes((0.47, 0.42, 0.52, 0.5))
    for k, n in enumerate((1, 2, 5)):
        values = pair_potential(distance, 0.15, 50.0, 0.005 / n, 80.0)
        label = f"{n} neighbour" + ("s" if n > 1 else "")
        for panel in (axes, inset):
            panel.plot(
                distance / 10,
                values,
                color=(BLUE, VERMILION, GREEN)[k],
                ls=LINE_STYLES[k],
                label=label,
            )
    inset.set(xlim=(4.4, 10.5), ylim=(-1, 11.5))
    inset.tick_params(labelsize=7)
    axes.set(
        xlabel="distance of a pair (m)",
        ylabel="V (m²/s²)",
        title="pair potential",
        xlim=(0, 11),
    )
    axes.annotate(
        "finite at 0",
        (0.1, 180),
        (1.6, 176),
        fontsize=8,
        arrowprops={"arrowstyle": "->"},
        va="center",
    )
    inset.annotate(
        "0 beyond 8 m", (9.2, 0), (8.35, 4), fontsize=7, arrowprops={"arrowstyle": "->"}
    )
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.08), fontsize=7)


def _courses(axes: Axes, study: StoredStudy, trials: pd.DataFrame, metric: str) -> None:
    """The mean of a metric against time for each border rule, with its pointwise
    interval.
    """
    table = curves(
        study.series,
        trials,
        "border_adds_velocity",
        metric,
        distribution=study.distributions[metric],
    )
    for k, (border, name) in enumerate(BORDERS.items()):
        curve = table[table["border_adds_velocity"] == border]
        times = curve["frame"] / FRAMES_A_SECOND
        axes.plot(
            times, curve["mean"], color=COLOURS[border], ls=LINE_STYLES[k], label=name
        )
        axes.fill_between(
            times, curve["low"], curve["high"], color=COLOURS[border], alpha=0.2, lw=0
        )
    axes.set_xlabel(SECONDS)
    axes.margins(x=0)


def _count(trials: pd.DataFrame) -> str:
    counts = sorted(set(trials[trials["status"] == "done"].groupby("point").size()))
    return f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"


def equilibrium(studies: Studies) -> Figure:
    """Rovers in equilibrium: against time, and over the second half with fewer
    rules.
    """
    study = studies["presets"]
    trials = study.trials[study.trials["alignment_weight"] > 0]
    asked = study.trials.iloc[0]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(8.2, 3.7))
        course, rows = figure.subplots(1, 2)
        _courses(course, study, trials, "equilibrium")
        course.set_yscale("symlog", linthresh=1.0)  # two of the three are near 0
        course.set(ylabel="rovers in equilibrium (%)", title="all rules", ylim=(0, 100))
        course.set_yticks([0, 0.5, 1, 10, 100], ["0", "0.5", "1", "10", "100"])
        _shares(rows, study)
        legend(figure, course, 3)
        seconds = asked["equilibrium_steps"] / FRAMES_A_SECOND
        note(
            figure,
            f"{study.name}: {_count(study.trials)} trials a mean, 95 % intervals,"
            " pointwise; in every frame in step with all within 8 m, to"
            f" {100 * asked['equilibrium_tolerance']:g} %, for {seconds:g} s",
        )
    return figure


def _shares(axes: Axes, study: StoredStudy) -> None:
    """The share of rovers in equilibrium over the second half, by rules and by border
    rule.
    """
    table = study.means(["equilibrium_mean"], ["border_adds_velocity", *study.varied])
    table = table.loc[:, ~table.columns.duplicated()]
    for k, (border, colour) in enumerate(COLOURS.items()):
        for row, (alignment, separation) in enumerate(RULES):
            chosen = (table["border_adds_velocity"] == border) & (
                table["alignment_weight"] == alignment
            )
            one = table[chosen & (table["separation_weight"] == separation)]
            columns = tuple(
                one[f"equilibrium_mean{end}"] for end in ("", "_low", "_high")
            )
            draw_values(axes, [row + 0.22 * (k - 1)], columns, colour, MARKERS[k])
    name_rows(axes, list(RULES.values()))
    axes.set(
        xlabel="rovers in equilibrium, 12 to 24 s (%)",
        title="with fewer rules",
        xlim=(-0.5, None),
    )


def detector(studies: Studies) -> Figure:
    """Rovers in equilibrium as a curve over what counts as one: the allowed difference
    of velocities, how long it lasts, and over what time velocities are averaged.
    """
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(10.2, 3.9))
        lasting, *averaged = figure.subplots(1, 3, sharex=True)
        _lasting(lasting, studies["detector"])
        for axes, border in zip(averaged, ("always", "in_margin"), strict=True):
            _averaged(axes, studies["trials"], border)
        averaged[1].sharey(averaged[0])
        numbers = (_count(studies[name].trials) for name in ("detector", "trials"))
        note(
            figure,
            "left: {} trials a value, others: {}; mean with pointwise 95 % interval,"
            " second half of a trial; circle: what the claims take; trials without"
            " company are left out on the right".format(*numbers),
        )
    return figure


def _lasting(axes: Axes, study: StoredStudy) -> None:
    """Frame by frame, by the tolerance and the duration, as run: a share of all
    rovers.
    """
    names = [
        "border_adds_velocity",
        "alignment_weight",
        "equilibrium_tolerance",
        "equilibrium_steps",
    ]
    table = study.means(["equilibrium_mean"], names)
    table = table[
        (table["border_adds_velocity"] == "always") & (table["alignment_weight"] > 0)
    ]
    for k, (steps, one) in enumerate(table.groupby("equilibrium_steps")):
        rows = [one[f"equilibrium_mean{end}"] for end in ("", "_low", "_high")]
        label = f"for {steps / FRAMES_A_SECOND:g} s"
        _curve(axes, one["equilibrium_tolerance"], np.array(rows), k, label)
    axes.legend(fontsize=8)
    axes.set(
        ylabel="rovers in equilibrium (%)",
        xlabel=DIFFERENCE,
        title="as run, frame by frame",
        ylim=(0, None),
    )


def _averaged(axes: Axes, study: StoredStudy, border: str) -> None:
    """By the tolerance and the time over which velocities are averaged: a share of the
    rovers in company.
    """
    found = [
        (one, one.company[SECOND_HALF])
        for one in flights(study, border)
        if one.company[SECOND_HALF].any()
    ]
    for k, window in enumerate(WINDOWS):
        rows = [
            mean_interval(
                np.array(
                    [
                        100.0 * _in_step(one, tolerance, window)[company].mean()
                        for one, company in found
                    ]
                ),
                distribution="percentage",
            )[:3]
            for tolerance in TOLERANCES
        ]
        label = f"means over {window:g} s"
        _curve(axes, pd.Series(TOLERANCES), np.array(rows).T, k, label)
        if window == WINDOW:
            value = rows[TOLERANCES.index(TOLERANCE)][0]
            axes.plot(100 * TOLERANCE, value, "o", ms=12, mfc="none", mec=VERMILION)
    axes.axhline(50, color="0.5", ls=":", label="bound of the claim")
    axes.legend(fontsize=8)
    axes.set(
        ylabel="of the rovers in company (%)",
        xlabel=DIFFERENCE,
        title=f"{BORDERS[border]}, by averages",
        ylim=(0, None),
    )


def _in_step(flight: Flight, tolerance: float, window: float) -> Truths:
    return in_step(flight.x, flight.y, flight.near, tolerance, window)[SECOND_HALF]


def _curve(
    axes: Axes, tolerances: "pd.Series[float]", rows: Floats, k: int, label: str
) -> None:
    """A curve of value, low and high, (3, T), against tolerance in per cent."""
    value, low, high = rows
    places, colour = 100 * tolerances, (BLUE, VERMILION, GREEN)[k]
    axes.plot(
        places,
        value,
        color=colour,
        marker=MARKERS[k],
        ls=LINE_STYLES[k],
        ms=4,
        label=label,
    )
    axes.vlines(places, low, high, color=colour)


def safety(studies: Studies) -> Figure:
    """Rocks touched and arena left, with the rule against rocks and without it."""
    study = studies["safety"]
    table = study.means(["collisions", "escapes"])
    titles = {"collisions": "touches of a rock", "escapes": "exits from the arena"}
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(8.2, 2.9))
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (metric, title) in zip(panels, titles.items(), strict=True):
            for k, (weight, colour) in enumerate(((0.25, BLUE), (0.0, VERMILION))):
                one = (
                    table[table["obstacle_weight"] == weight]
                    .set_index("border_adds_velocity")
                    .loc[list(BORDERS)]
                )
                columns = tuple(one[f"{metric}{end}"] for end in ("", "_low", "_high"))
                label = ("with" if weight else "without") + " the rule against rocks"
                draw_values(
                    axes,
                    np.arange(3) + 0.24 * (k - 0.5),
                    columns,
                    colour,
                    MARKERS[k],
                    label,
                )
            name_rows(axes, list(BORDERS.values()))
            axes.axvline(0.05, color="0.5", ls=":", label="bound of the claim")
            axes.set(
                xlabel=f"{title} in a trial of 10 rovers and 24 s", xlim=(-0.03, None)
            )
        legend(figure, panels[0], 3)
        text = (
            f"{study.name}: {_count(study.trials)} trials a value, mean with 95 %"
            " interval"
        )
        note(figure, f"{text}; rocks of 1 m radius, looked at once a frame")
    return figure


def weights(studies: Studies) -> Figure:
    """Distances of rovers with twice the weight of a rule, and speeds without their
    limit.
    """
    study = studies["weights"]
    names = ["border_adds_velocity", *RULE_WEIGHTS]
    table = study.means(["nearest_neighbour_distance_mean"], names)
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(9.0, 2.9))
        near, fast = figure.subplots(1, 2)
        for k, border in enumerate(("always", "in_margin")):
            one = table[table["border_adds_velocity"] == border].set_index(RULE_WEIGHTS)
            rows = one.loc[list(DOUBLED)]
            columns = tuple(
                rows[f"nearest_neighbour_distance_mean{end}"] / 10
                for end in ("", "_low", "_high")
            )
            draw_values(
                near,
                np.arange(len(rows)) + 0.24 * (k - 0.5),
                columns,
                COLOURS[border],
                MARKERS[k],
                BORDERS[border],
            )
        name_rows(near, list(DOUBLED.values()))
        near.set(xlabel="distance of the nearest other,\n12 to 24 s (m)")
        _unlimited(fast, studies["limits"])
        legend(figure, near, 2)
        counts = [_count(studies[name].trials) for name in ("weights", "limits")]
        note(
            figure,
            f"left: {study.name}, {counts[0]} trials a value; right:"
            f" {studies['limits'].name}, {counts[1]} trials, powers of ten, dotted: the"
            " bound of the claim; mean with 95 % interval",
        )
    return figure


def _unlimited(axes: Axes, study: StoredStudy) -> None:
    """The mean speed at the end of a trial without its upper limit."""
    for k, (border, colour) in enumerate(COLOURS.items()):
        powers = powers_above(study, border)
        found = np.array([mean_interval(powers, distribution="normal")[:3]]).T
        columns = (found[0], found[1], found[2])
        draw_values(axes, [k], columns, colour, MARKERS[k])
    axes.axvline(1.0, color="0.5", ls=":")
    name_rows(axes, list(BORDERS.values()))
    axes.set_xscale("symlog", linthresh=1.0)
    axes.set_xticks([0, 1, 10, 100], ["0", "1", "10", "100"])
    axes.set(xlabel="speed at 24 s without a limit\n(powers of ten above V_max)")
