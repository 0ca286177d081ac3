"""The figures of aziel_chen2025, and its Table 1 as a figure."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import mean_interval
from sweep.figures import (
    BLUE,
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
from sweep.tables.stored_study import StoredStudy

from .search import (  # noqa: F401 (for published.yaml)
    GAINS,
    SIZES,
    Studies,
    Values,
    done,
    gain_spread_dense_cafeteria,
    gain_spread_narrow_corridor,
    loss_to_alignment_beyond_and_before,
    loss_to_alignment_of_50_less_that_of_100,
    near_maximal_in_the_empty_map,
    seed_spread_dense_cafeteria,
    seed_spread_narrow_corridor,
)

MAPS = {
    "dense_cafeteria": "dense cafeteria",
    "cafeteria": "cafeteria",
    "narrow_corridor": "narrow corridor",
    "empty": "empty",
}
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
    "fitted_steps": ("ours, steps fitted to their wall clock", BLUE, "o", -0.14),
    "equal_steps": ("ours, 3600 steps each", VERMILION, "s", 0.14),
}


def figure3(studies: Studies) -> Figure:
    """The four maps as the physics has them, with the
    margin inside which boids start.
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
            inside = [
                margin,
                world.width - margin,
                world.width - margin,
                margin,
                margin,
            ]
            heights = [
                margin,
                margin,
                world.height - margin,
                world.height - margin,
                margin,
            ]
            axes.plot(inside, heights, color=BLUE, linestyle=":", linewidth=0.9)
            axes.set_title(words)
            axes.set_xticks([0, 400, 800])
            axes.label_outer()
        note(
            figure,
            "obstacles as the physics has them; boids start uniformly inside the dotted"
            " line",
        )
    return figure


def figure4(studies: Studies) -> Figure:
    """Coverage against each gain in the cafeteria with 100 boids."""
    study = studies["gains"]
    points = _points(study, dict(BEST))
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 2.75))
        for axes, (gain, symbol) in zip(
            figure.subplots(1, 3, sharey=True), GAINS.items(), strict=True
        ):
            axes.scatter(
                points[gain],
                points["coverage_total"],
                s=5,
                color=BLUE,
                alpha=0.45,
                linewidths=0,
            )
            axes.set_xlabel(f"{gain.replace('_', ' ')} {symbol}")
            axes.set_title(f"rank correlation {_rank(points, gain)}", fontsize=8)
            axes.set(xlim=(0, None), ylim=(0, 100))
            axes.set_ylabel(COLUMNS["coverage_total"])
            axes.label_outer()
        note(
            figure,
            f"{study.name}: cafeteria, 100 boids, {len(points):,} points, each the mean"
            " of 3 seeds",
        )
    return figure


def figure4_everywhere(studies: Studies) -> Figure:
    """Coverage against each gain in every map, for both sizes."""
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
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="outside upper center", ncols=2, markerscale=3
        )
        number = len(_points(study, {"map": "empty", "n": 100}))
        note(
            figure,
            f"{study.name}: {number:,} points a panel and size, each the mean of 3"
            " seeds; titles: rank correlations",
        )
    return figure


def _both_sizes(axes: Axes, study: StoredStudy, name: str, gain: str) -> None:
    correlations = []
    for n, colour in zip(SIZES, (ORANGE, BLUE), strict=True):
        points = _points(study, {"map": name, "n": n})
        axes.scatter(
            points[gain],
            points["coverage_total"],
            s=3,
            color=colour,
            alpha=0.35,
            linewidths=0,
            label=f"{n} boids",
        )
        correlations.append(f"{_rank(points, gain)} ({n})")
    axes.set_title(", ".join(correlations), fontsize=8)
    axes.set(xlim=(0, None), ylim=(0, 100))


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
                curve["frame"],
                curve["coverage_total"],
                linestyle=dashes,
                label=f"seed {seed}",
            )
        axes.set(
            xlabel="frame (steps)",
            ylabel=COLUMNS["coverage_total"],
            xlim=(0, None),
            ylim=(0, 100),
        )
        axes.legend(loc="lower right")
        note(figure, f"{study.name}: cafeteria, 100 boids, one trial a line")
    return figure


def figure6(studies: Studies) -> Figure:
    """How often each pixel was visited, for the three seeds of figure 5."""
    study = studies["wall_clock"]
    trials = done(study, **dict(BEST))
    visits = study.heatmaps.set_index("trial_id")["visits"]
    most = max(
        float(np.quantile(visits[trial][visits[trial] > 0], 0.99))
        for trial in trials["trial_id"]
    )
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 2.45))
        panels = figure.subplots(1, len(trials), sharey=True, squeeze=False)[0]
        for axes, trial in zip(panels, trials.itertuples(), strict=True):
            image = draw_visits(
                axes, visits[trial.trial_id], study.world(trial.trial_id), most
            )
            axes.set_title(f"seed {trial.seed}: CV {trial.coverage_cv:.3f}")
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
            f"{study.name}: cafeteria, 100 boids, {steps} steps; white: never visited;"
            " blue: obstacles",
        )
    return figure


def table1(studies: Studies) -> Figure:
    """Table 1, ours at the fitted numbers of steps and at an equal one."""
    names = [f"{MAPS[name]}, {n}" for name, n in TABLE_1]
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 3.6))
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (column, words) in zip(panels, COLUMNS.items(), strict=True):
            axes.plot(
                [getattr(row, column) for row in TABLE_1.values()],
                range(len(names)),
                linestyle="none",
                marker="|",
                markersize=17,
                markeredgewidth=1.6,
                color="0.1",
                label="published",
            )
            for spec, (label, colour, marker, shift) in OURS.items():
                found = [
                    _interval(studies[spec], {"map": name, "n": n}, column)
                    for name, n in TABLE_1
                ]
                table = tuple(np.array(found, np.float64)[:, :3].T)
                draw_values(
                    axes, np.arange(len(names)) + shift, table, colour, marker, label
                )
            axes.set_xlabel(words)
        for axes in panels:
            name_rows(axes, names)
        legend(figure, panels[0])
        note(
            figure,
            f"map and number of boids; ours: {_trials(studies['fitted_steps'])} trials"
            " a row, mean with 95 % interval",
        )
    return figure


def swarm_size(studies: Studies) -> Figure:
    """What doubling the swarm changes: published, at the fitted numbers of steps, and
    at an equal one.
    """
    names = list(MAPS.values())
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 2.5))
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (column, words) in zip(panels, COLUMNS.items(), strict=True):
            axes.axvline(0.0, color="0.5", linewidth=0.8)
            published = [
                getattr(TABLE_1[name, 100], column) - getattr(TABLE_1[name, 50], column)
                for name in MAPS
            ]
            places = np.arange(len(names))
            axes.plot(
                published,
                places,
                "|",
                markersize=19,
                markeredgewidth=1.6,
                color="0.1",
                label="published",
            )
            for spec, (label, colour, marker, shift) in OURS.items():
                found = [
                    mean_interval(_doubling(studies[spec], name, column))
                    for name in MAPS
                ]
                draw_values(
                    axes,
                    places + shift,
                    tuple(np.array(found, np.float64)[:, :3].T),
                    colour,
                    marker,
                    label,
                )
            axes.set_xlabel(f"change from 50 to 100 boids:\n{words}")
            axes.locator_params(axis="x", nbins=6)
        for axes in panels:
            name_rows(axes, names)
        legend(figure, panels[0])
        pairs = f"{_trials(studies['fitted_steps'])} pairs of trials a row"
        note(
            figure,
            f"below zero: less coverage, but more even visits; ours: {pairs}, mean with"
            " 95 % interval",
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


FIGURES = {
    "figure3": Drawing(figure3, ("equal_steps",), "Figure 3: the four maps."),
    "figure4": Drawing(
        figure4,
        ("gains",),
        "Figure 4: coverage against each gain, cafeteria, 100 boids.",
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
    "table1": Drawing(
        table1, ("fitted_steps", "equal_steps"), "Table 1, published and ours."
    ),
    "swarm_size": Drawing(
        swarm_size, ("fitted_steps", "equal_steps"), "What 100 boids do better than 50."
    ),
    "ablation": Drawing(
        ablation, ("ablation",), "From the program to the text, one detail at a time."
    ),
}


def _interval(
    study: StoredStudy, settings: Mapping[str, object], column: str
) -> tuple[float, float, float, int]:
    return mean_interval(done(study, **settings)[column].to_numpy(np.float64))


def _trials(study: StoredStudy) -> int:
    return len(done(study, **dict(BEST)))


def _doubling(study: StoredStudy, name: str, column: str) -> Values:
    """The change from 50 to 100 boids, one value a replicate."""
    by_size = done(study, map=name).pivot(index="replicate", columns="n", values=column)
    return np.asarray(by_size[100] - by_size[50], np.float64)


def _points(study: StoredStudy, settings: Mapping[str, object]) -> pd.DataFrame:
    """Gains and coverage of every point with these settings, a mean over its seeds, in
    the order of the sample.
    """
    columns = [*GAINS, "coverage", "coverage_total"]
    return done(study, **settings).groupby("point", sort=False)[columns].mean()


def _rank(points: pd.DataFrame, gain: str) -> str:
    return f"{points[gain].rank().corr(points['coverage_total'].rank()):.2f}".replace(
        "-", "\N{MINUS SIGN}"
    )
