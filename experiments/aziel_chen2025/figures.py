"""The figures of aziel_chen2025, and its Table 1 as a figure."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sweep.analysis import mean_interval
from sweep.figures import (
    BLUE,
    GREEN,
    LINE_STYLES,
    ORANGE,
    STYLE,
    VERMILION,
    Drawing,
    draw_map,
    draw_values,
    draw_visits,
    effects_figure,
    legend,
    name_rows,
    note,
)
from sweep.published.claims import shown
from sweep.published.definitions import as_defined
from sweep.published.verdicts import Region
from sweep.tables.stored_study import StoredStudy

from .authors import (  # noqa: F401 (for published.yaml)
    SEEDS,
    both,
    heatmaps,
    rows_bias,
    rows_rank,
    rows_square,
    searched,
)
from .search import (  # noqa: F401 (for published.yaml)
    GAINS,
    SIZES,
    Studies,
    Values,
    better_than_published,
    cohesion_outweighed,
    done,
    doubling,
    doubling_among_obstacles,
    gain_spread,
    loss_beyond_and_before,
    loss_of_50_less_that_of_100,
    moderate_cohesion,
    moderate_separation,
    near_maximal,
    periphery,
    seed_spread,
    seed_spread_of_50_less_that_of_100,
    separation_outweighed,
)

PUBLISHED = Path(__file__).with_name("published.yaml")
MAPS = {
    "dense_cafeteria": "dense cafeteria",
    "cafeteria": "cafeteria",
    "narrow_corridor": "narrow corridor",
    "empty": "empty",
}
FIGURE_5 = (
    *((2, 33.5), (5, 58.6), (10, 75.0), (15, 80.9), (20, 83.6), (30, 86.2)),
    *((40, 87.6), (50, 88.3), (58, 88.7)),
)
"""Seconds, and coverage in % of all pixels, as read from the published curves, whose
lines are 0.5 to 1 % wide.
"""
BEST = (("map", "cafeteria"), ("n", 100))


class Published(NamedTuple):
    """A row of Table 1: coverage in % of all pixels, and the CV."""

    coverage_total: float
    coverage_cv: float


TABLE_1 = {
    ("dense_cafeteria", 50): Published(57.30, 1.0102),
    ("dense_cafeteria", 100): Published(58.02, 0.9791),
    ("cafeteria", 50): Published(86.50, 0.6398),
    ("cafeteria", 100): Published(85.76, 0.5609),
    ("narrow_corridor", 50): Published(75.13, 0.7485),
    ("narrow_corridor", 100): Published(76.36, 0.8178),
    ("empty", 50): Published(96.23, 0.4542),
    ("empty", 100): Published(96.81, 0.4441),
}
COLUMNS = {
    "coverage_total": "coverage (% of all pixels)",
    "coverage_cv": "CV of the visits",
}
OURS = {
    "fitted_steps": ("ours, steps fitted to their coverage", BLUE, "o", -0.24),
    "equal_steps": ("ours, 3600 steps each", VERMILION, "s", 0.24),
    "visit_steps": ("ours, steps from their mean visits", GREEN, "D", 0.0),
}
DRAWN_ANEW = {"dense_cafeteria": "dense_cafeteria_heatmap"}
"""The map of the heatmaps, where it is another one than that of the search."""
DRAWN_BLOCKS = {"narrow_corridor": (100.0, 270.0)}
"""Width and height of obstacles as the program draws them, where its physics has
others, with the same centres.
"""
NOT_BY_VISITS = "narrow_corridor"
"""Boids leave it, so that mean visits do not give the steps."""
SECONDS, MOST_VISITS, BINS = 60.0, 60.0, 20


def figure3(studies: Studies) -> Figure:
    """The four maps as the physics has them and as they are drawn, with the margin
    inside which boids start.
    """
    study = studies["equal_steps"]
    trials = study.trials.drop_duplicates("map").set_index("map")
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 2.0))
        for axes, (name, words) in zip(
            figure.subplots(1, 4, sharey=True), MAPS.items(), strict=True
        ):
            trial = trials.loc[name]
            world, margin = study.world(trial["trial_id"]), trial["start_margin"]
            draw_map(axes, world, "px", face="0.45")
            start = (world.width - 2 * margin, world.height - 2 * margin)
            _frame(axes, (margin, margin), start, BLUE, ":")
            if name in DRAWN_BLOCKS:
                wide, high = DRAWN_BLOCKS[name]
                for x, y in world.obstacles[:, :2]:
                    corner = (x - wide / 2, y - high / 2)
                    _frame(axes, corner, (wide, high), VERMILION, "--")
            axes.set_title(words)
            axes.set_xticks([0, 400, 800])
            axes.label_outer()
        note(
            figure,
            "obstacles as the physics has them, dashed as the program draws them, where"
            " that differs; boids start uniformly inside the dotted line",
        )
    return figure


def _frame(
    axes: Axes,
    corner: tuple[float, float],
    size: tuple[float, float],
    colour: str,
    dashes: str,
) -> None:
    axes.add_patch(
        Rectangle(corner, *size, fill=False, ec=colour, ls=dashes, lw=0.9, zorder=2)
    )


def figure4(studies: Studies) -> Figure:
    """Coverage against each gain in the cafeteria with 100 boids, theirs above ours."""
    study = studies["gains"]
    ours = _points(study, dict(BEST))
    theirs = _published_points("cafeteria", 100)
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 4.6))
        panels = figure.subplots(2, len(GAINS), sharex="col", sharey=True)
        rows = (("published", theirs), ("ours, 3600 steps", ours))
        for row, (whose, points) in zip(panels, rows, strict=True):
            for axes, (gain, symbol) in zip(row, GAINS.items(), strict=True):
                axes.hexbin(
                    points[gain],
                    points["coverage_total"],
                    gridsize=(28, 20),
                    extent=(0.0, 0.1 if gain == "alignment_weight" else 0.5, 0, 100),
                    mincnt=1,
                    cmap="YlGnBu",
                    linewidths=0,
                )
                axes.set_xlabel(f"{gain.replace('_', ' ')} {symbol}")
                axes.set_title(
                    f"{whose}: rank correlation {_rank(points, gain)}", fontsize=7.5
                )
                axes.set(ylim=(0, 100), ylabel=COLUMNS["coverage_total"])
                axes.grid(visible=False)
                axes.label_outer()
        note(
            figure,
            f"{study.name}: cafeteria, 100 boids, {len(theirs):,} points above,"
            f" {len(ours):,} below, each the mean of 3 seeds; darker: more points",
        )
    return figure


def figure4_everywhere(studies: Studies) -> Figure:
    """Coverage against each gain in every map, for both sizes, theirs and ours."""
    study = studies["gains"]
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 8.2))
        panels = figure.subplots(len(MAPS), len(GAINS), sharex="col", sharey=True)
        for row, (name, words) in zip(panels, MAPS.items(), strict=True):
            for axes, (gain, symbol) in zip(row, GAINS.items(), strict=True):
                _both_sizes(axes, study, name, gain)
                axes.set_xlabel(f"{gain.replace('_', ' ')} {symbol}")
                axes.set_ylabel(f"{words}\ncoverage (% of all pixels)")
                axes.label_outer()
        legend(figure, panels[0, 0])
        number = len(_points(study, {"map": "empty", "n": 100}))
        note(
            figure,
            f"{study.name}: {number:,} points a panel and size, each the mean of 3"
            f" seeds at 3600 steps; medians and the middle 80 % in {BINS} classes of a"
            " gain; published: 2,000 points, medians; titles: our rank correlations",
        )
    return figure


def _both_sizes(axes: Axes, study: StoredStudy, name: str, gain: str) -> None:
    correlations = []
    for n, colour in zip(SIZES, (ORANGE, BLUE), strict=True):
        points = _points(study, {"map": name, "n": n})
        places, (low, middle, high) = _classes(points, gain)
        axes.fill_between(places, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(places, middle, color=colour, label=f"{n} boids")
        places, (_, middle, _) = _classes(_published_points(name, n), gain)
        axes.plot(places, middle, ":", color=colour, label=f"{n} boids, published")
        correlations.append(f"{_rank(points, gain)} ({n})")
    axes.set_title(", ".join(correlations), fontsize=8)
    axes.set(xlim=(0, None), ylim=(0, 100))


def _classes(points: pd.DataFrame, gain: str) -> tuple[Values, Values]:
    """The middles of BINS classes of a gain, and the quantiles 0.1, 0.5 and 0.9 of the
    coverage of their points, (3, classes with points).
    """
    most = 0.1 if gain == "alignment_weight" else 0.5
    edges = np.linspace(0.0, most, BINS + 1)
    classes = points.groupby(np.digitize(points[gain], edges))["coverage_total"]
    table = classes.quantile([0.1, 0.5, 0.9]).unstack().sort_index()
    places = (table.index.to_numpy(np.float64) - 0.5) * most / BINS
    return places, table.to_numpy(np.float64).T


def figure5(studies: Studies) -> Figure:
    """Coverage over time in the cafeteria with 100 boids and the best gains, one line a
    seed.
    """
    study = studies["wall_clock"]
    trials = done(study, **dict(BEST))
    series = study.series
    with style.context(STYLE):
        figure = Figure(figsize=(4.2, 3.0))
        axes = figure.subplots()
        for dashes, (trial, seed) in zip(
            LINE_STYLES,
            zip(trials["trial_id"], trials["seed"], strict=True),
            strict=False,
        ):
            curve = series[series["trial_id"] == trial]
            axes.plot(
                curve["frame"] * (SECONDS / curve["frame"].max()),
                curve["coverage_total"],
                linestyle=dashes,
                label=f"seed {seed}",
            )
        axes.plot(*zip(*FIGURE_5, strict=True), "k+", label="published")
        steps = trials["steps"].iloc[0]
        axes.set(
            xlabel=f"wall clock (s): {SECONDS:g} s are {steps:,} steps",
            ylabel=COLUMNS["coverage_total"],
            xlim=(0, SECONDS),
            ylim=(0, 100),
        )
        axes.legend(loc="lower right")
        note(
            figure,
            f"{study.name}: cafeteria, 100 boids, one trial a line; the steps follow"
            " from the mean visits of the published heatmaps; crosses: read from the"
            " published curves",
        )
    return figure


def figure6(studies: Studies) -> Figure:
    """How often each pixel was visited, for the three seeds of figure 5."""
    study = studies["wall_clock"]
    trials = done(study, **dict(BEST))
    visits = study.heatmaps.set_index("trial_id")["visits"]
    published = heatmaps("cafeteria", 100)
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 2.6))
        panels = figure.subplots(1, len(trials), sharey=True, squeeze=False)[0]
        for axes, trial in zip(panels, trials.itertuples(), strict=True):
            image = draw_visits(
                axes, visits[trial.trial_id], study.world(trial.trial_id), MOST_VISITS
            )
            counts = np.asarray(visits[trial.trial_id])
            theirs = published.loc[trial.seed]
            axes.set_title(
                f"seed {trial.seed}: mean {counts[counts >= 0].mean():.1f}, CV"
                f" {trial.coverage_cv:.3f}\npublished: {theirs['mean_visits']:.1f},"
                f" {theirs['coverage_cv']:.3f}",
                fontsize=7.5,
            )
            axes.set_xticks([0, 400, 800])
            axes.label_outer()
        figure.colorbar(
            image,
            ax=list(panels),
            label="visits a pixel",
            extend="max",
            shrink=0.9,
            pad=0.02,
        )
        steps = int(trials["steps"].iloc[0])
        note(
            figure,
            f"{study.name}: cafeteria, 100 boids, {steps:,} steps; white: never"
            " visited; blue: obstacles; the scale ends where the published one does",
        )
    return figure


def table1(studies: Studies) -> Figure:
    """Table 1 with its seeds, and ours at three numbers of steps."""
    names = [f"{MAPS[name]}, {n}" for name, n in TABLE_1]
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 4.4))
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (column, words) in zip(panels, COLUMNS.items(), strict=True):
            for place, ((name, n), row) in enumerate(TABLE_1.items()):
                seeds = _published_seeds(name, n, column)
                axes.plot(
                    *(seeds, [place] * len(seeds), "|"),
                    markersize=7,
                    color="0.55",
                    label="published, by seed" if place == 0 else None,
                )
                axes.plot(
                    *(getattr(row, column), place, "|"),
                    markersize=17,
                    markeredgewidth=1.6,
                    color="0.1",
                    label="published, mean" if place == 0 else None,
                )
            for spec, (label, colour, marker, shift) in OURS.items():
                places = [i for i, (name, _) in enumerate(TABLE_1) if _has(spec, name)]
                found = [
                    _interval(studies[spec], _where(spec, *list(TABLE_1)[i]), column)
                    for i in places
                ]
                table = tuple(np.array(found, np.float64)[:, :3].T)
                draw_values(
                    axes, np.array(places) + shift, table, colour, marker, label
                )
                for i in places:
                    for allowed in _allowed(spec, column, *list(TABLE_1)[i]):
                        _band(axes, i + shift, allowed, colour)
            axes.set_xlabel(words)
        for axes in panels:
            name_rows(axes, names)
        legend(figure, panels[0], columns=3)
        note(
            figure,
            f"map and number of boids; ours: {_trials(studies['fitted_steps'])} trials"
            " a row, mean with 95 % interval; band: the margin of a claim about the"
            " published number; the steps were fitted to the coverage; in the corridor,"
            " which boids leave, mean visits give none",
        )
    return figure


def _allowed(spec: str, column: str, name: str, n: int) -> list[Region]:
    """What the claim about a number of Table 1 allows, in the trials of a spec; none
    where no claim tests it there.
    """
    measure = {"mean": column, "for": _where(spec, name, n)}
    return [
        one.region
        for one in shown(PUBLISHED, "table1")
        if one.kind in ("number", "fit") and (one.spec, one.measure) == (spec, measure)
    ][:1]


def _band(axes: Axes, place: float, allowed: Region, colour: str) -> None:
    """What is allowed, as a band behind the values at a height."""
    axes.barh(
        place,
        allowed.most - allowed.least,
        left=allowed.least,
        height=0.22,
        color=colour,
        alpha=0.22,
        linewidth=0,
        zorder=0.5,
    )


def _has(spec: str, name: str) -> bool:
    return spec != "visit_steps" or name != NOT_BY_VISITS


def _where(spec: str, name: str, n: int) -> dict[str, object]:
    """The settings of a row of Table 1 in a spec."""
    drawn = DRAWN_ANEW.get(name, name) if spec == "visit_steps" else name
    return {"map": drawn, "n": n}


def _published_seeds(name: str, n: int, column: str) -> Values:
    """A column of Table 1 by seed: the coverage of the best gains of their search, or
    the CV of their heatmaps.
    """
    if column == "coverage_cv":
        values = heatmaps(DRAWN_ANEW.get(name, name), n)[column]
    else:
        coverage = searched(name, n)[list(SEEDS)]
        values = coverage.loc[coverage.mean(axis=1).idxmax()]
    return values.to_numpy(np.float64)


def swarm_size(studies: Studies) -> Figure:
    """What doubling the swarm changes: published, at the fitted numbers of steps, and
    at an equal one.
    """
    names = list(MAPS.values())
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 3.0))
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (column, words) in zip(panels, COLUMNS.items(), strict=True):
            axes.axvline(0.0, color="0.5", linewidth=0.8)
            published = [
                getattr(TABLE_1[name, 100], column) - getattr(TABLE_1[name, 50], column)
                for name in MAPS
            ]
            places = np.arange(len(names))
            seeds = np.array(
                [
                    _published_seeds(name, 100, column)
                    - _published_seeds(name, 50, column)
                    for name in MAPS
                ]
            )
            axes.plot(
                *(seeds.ravel(), places.repeat(seeds.shape[1]), "|"),
                markersize=8,
                color="0.55",
                label="published, by seed",
            )
            axes.plot(
                published,
                places,
                "|",
                markersize=19,
                markeredgewidth=1.6,
                color="0.1",
                label="published, means",
            )
            for spec, (label, colour, marker, shift) in OURS.items():
                chosen = [i for i, name in enumerate(MAPS) if _has(spec, name)]
                changes = [
                    doubling(
                        studies[spec], column, map=_where(spec, list(MAPS)[i], 0)["map"]
                    )
                    for i in chosen
                ]
                declared = studies[spec].distributions[column].of_differences
                found = [
                    mean_interval(change, distribution=declared) for change in changes
                ]
                draw_values(
                    axes,
                    places[chosen] + shift,
                    tuple(np.array(found, np.float64)[:, :3].T),
                    colour,
                    marker,
                    label,
                )
            _shade_expected(axes, column)
            axes.set_xlabel(f"change from 50 to 100 boids:\n{words}")
            axes.locator_params(axis="x", nbins=6)
        for axes in panels:
            name_rows(axes, names)
        legend(figure, panels[0], columns=3)
        pairs = f"{_trials(studies['fitted_steps'])} pairs of trials a row"
        note(
            figure,
            f"below zero: less coverage, but more even visits; shaded: what the claims"
            f" expect; ours: {pairs}, mean with 95 % interval",
        )
    return figure


def _shade_expected(axes: Axes, column: str) -> None:
    """Shade the changes of a column that claims expect, as far as the axis reaches."""
    regions = {
        one.region
        for one in shown(PUBLISHED, "swarm_size")
        if "difference" in one.measure
        and all(side["mean"] == column for side in one.measure["difference"])
    }
    left, right = axes.get_xlim()
    for allowed in regions:
        ends = max(allowed.least, left), min(allowed.most, right)
        axes.axvspan(*ends, color="0.93", linewidth=0, zorder=0)
    axes.set_xlim(left, right)


def authors_rows(studies: Studies) -> Figure:
    """Ours against theirs, row by row, for the hundred rows of each of their tables."""
    study = studies["authors_rows"]
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 4.6))
        panels = figure.subplots(len(SIZES), len(MAPS), sharex=True, sharey=True)
        for row, n in zip(panels, SIZES, strict=True):
            for axes, (name, words) in zip(row, MAPS.items(), strict=True):
                rows = both(studies, map=name, n=n)
                axes.plot([0, 100], [0, 100], color="0.6", linewidth=0.8)
                axes.plot(rows["theirs"], rows["ours"], ".", markersize=3, color=BLUE)
                off = rows["ours"] - rows["theirs"]
                rank = rows["ours"].rank().corr(rows["theirs"].rank())
                axes.set_title(
                    f"{words}, {n}\nrms {np.sqrt((off**2).mean()):.2f}, mean"
                    f" {off.mean():+.2f},\nrank correlation {rank:.3f}",
                    fontsize=7,
                )
                axes.set(xlim=(0, 100), ylim=(0, 100), aspect="equal")
                axes.set(xlabel="theirs (% of all pixels)", ylabel="ours")
                axes.label_outer()
        note(
            figure,
            f"{study.name}: random rows of the authors' search, coverage as a mean over"
            " the seeds 27, 729 and 4913; titles: ours less theirs in points",
        )
    return figure


def ablation(studies: Studies) -> Figure:
    """What each detail of the text changes in the program, with the best gains."""
    names = {
        "cafeteria": "cafeteria, 100 boids",
        "dense_cafeteria": "dense cafeteria, 50 boids",
    }
    metrics = {
        "coverage": "coverage",
        "coverage_cv": "CV",
        "escapes": "escapes",
        "collisions": "collisions",
    }
    return effects_figure(studies["ablation"], "as_written", metrics, "map", names)


recorded_as_defined = partial(as_defined, spec="visit_steps")

FIGURES = {
    "figure3": Drawing(figure3, ("equal_steps",), "Figure 3: the four maps."),
    "figure4": Drawing(
        figure4,
        ("gains",),
        "Figure 4: coverage against each gain, cafeteria, 100 boids, theirs and ours.",
    ),
    "figure4_everywhere": Drawing(
        figure4_everywhere, ("gains",), "As figure 4, for all maps and both sizes."
    ),
    "figure5": Drawing(
        figure5, ("wall_clock",), "Figure 5: coverage over time for the three seeds."
    ),
    "figure6": Drawing(
        figure6, ("wall_clock",), "Figure 6: visits for the three seeds."
    ),
    "table1": Drawing(table1, tuple(OURS), "Table 1, published and ours."),
    "swarm_size": Drawing(swarm_size, tuple(OURS), "What 100 boids do better than 50."),
    "authors_rows": Drawing(
        authors_rows, ("authors_rows",), "Rows of the authors' tables, flown again."
    ),
    "ablation": Drawing(
        ablation, ("ablation",), "From the program to the text, one detail at a time."
    ),
}


def _interval(
    study: StoredStudy, settings: Mapping[str, object], column: str
) -> tuple[float, float, float, int]:
    return study.mean_of(column, done(study, **settings)[column])


def _trials(study: StoredStudy) -> int:
    return len(done(study, **dict(BEST)))


def _points(study: StoredStudy, settings: Mapping[str, object]) -> pd.DataFrame:
    """Gains and coverage of every point with these settings, a mean over its seeds, in
    the order of the sample.
    """
    columns = [*GAINS, "coverage", "coverage_total"]
    return done(study, **settings).groupby("point", sort=False)[columns].mean()


def _published_points(map_name: str, n: int) -> pd.DataFrame:
    """Gains and coverage of their search, a mean over its seeds."""
    table = searched(map_name, n)
    coverage = table[list(SEEDS)].mean(axis=1)
    return table[list(GAINS)].assign(coverage_total=coverage)


def _rank(points: pd.DataFrame, gain: str) -> str:
    return f"{points[gain].rank().corr(points['coverage_total'].rank()):.2f}".replace(
        "-", "\N{MINUS SIGN}"
    )
