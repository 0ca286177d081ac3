"""The figures of nguyen2024, and what the differences between its text and its program
do.
"""

from functools import partial

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from sweep.analysis import Declaration, Support, mean_interval
from sweep.figures import (
    BLUE,
    COLOURS,
    LINE_STYLES,
    SKY,
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    draw_map,
    draw_values,
    effects_figure,
    metric_curves,
    name_rows,
    note,
)
from sweep.published.definitions import as_defined

from .measures import (  # noqa: F401 (for published.yaml)
    END,
    HALF_TIME,
    METRICS,
    PUBLISHED_TRIALS,
    WEIGHTS,
    Floats,
    Studies,
    alignment_effect_on_dispersion,
    alignment_effect_on_flock_radius,
    alignment_effect_on_speed,
    alignment_effect_on_turn_rate,
    energies,
    energy_equal_weights,
    energy_separation_double,
    energy_separation_half,
    late_displacement,
    left_of_both_forces,
    panel_alignment_dispersion,
    panel_alignment_flock_radius,
    panel_alignment_speed,
    panel_alignment_turn_rate,
    panel_cohesion_dispersion,
    panel_cohesion_flock_radius,
    panel_cohesion_speed,
    panel_cohesion_turn_rate,
    panel_separation_dispersion,
    panel_separation_flock_radius,
    panel_separation_speed,
    panel_separation_turn_rate,
    published_points,
    settled_speed_combinations,
    settled_turn_rate_combinations,
    start_speed_spread,
)

LATE_METRICS = {
    "speed_mean": "speed",
    "flock_radius_mean": "flock radius",
    "turn_rate_unwrapped_mean": "published turn rate",
    "dispersion_mean": "dispersion",
}
COHESION = {1.0: "all weights 1", 2.0: "cohesion weight 2"}
RUN_INTO = {
    "collisions": "obstacles entered in a trial",
    "in_contact_mean": "boids in contact (%)",
    "flock_count": "groups at the end",
}
TRAIL = 50
"""Steps."""

ENERGIES = Declaration("skewed", Support(low=0.0))


def figure2(studies: Studies) -> Figure:
    """One row of figure 2: the metrics of section 2.3 by the weight that the only study
    sweeps, and the points of the published curves.
    """
    (study,) = studies.values()
    setting = study.varied[0]
    figure = metric_curves(study, setting, METRICS)
    weights = np.unique(study.trials[setting])
    for axes, metric in zip(figure.axes, METRICS, strict=True):
        points = published_points(setting, metric)
        lines = zip(weights, axes.get_lines(), strict=True)
        colours = {weight: line.get_color() for weight, line in lines}
        axes.scatter(
            points["frame"],
            points["published_value"],
            s=22,
            facecolors="none",
            edgecolors=[colours[weight] for weight in points["weight"]],
            clip_on=False,
            zorder=3,
        )
    note(
        figure,
        f"{figure.get_supxlabel()}; circles: published means of {PUBLISHED_TRIALS}"
        " trials",
    )
    return figure


def figure1(studies: Studies) -> Figure:
    """The flock of one trial halfway and at the end: boids are triangles that point
    where they fly, and lines show whence they come.
    """
    study = studies["snapshot"]
    chosen = study.trials.iloc[0]
    frames, bodies = study.trajectory(chosen["trial_id"])
    world = study.world(chosen["trial_id"])
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 2.9))
        for axes, frame in zip(
            figure.subplots(1, 2, sharey=True), (HALF_TIME, END), strict=True
        ):
            draw_map(axes, world, "px", face=VERMILION)
            recent = bodies[(frames >= frame - TRAIL) & (frames <= frame), :2]
            ways = _ways(recent, world.width, world.height)
            axes.add_collection(LineCollection(ways, colors=SKY, lw=0.7, zorder=2))
            draw_flock(axes, bodies[frames == frame][0], length=22.0)
            axes.set_title(f"after {frame} steps")
            axes.label_outer()
        weights = ", ".join(f"{name} {chosen[f'{name}_weight']:g}" for name in WEIGHTS)
        note(
            figure,
            f"{study.name}: one trial of {bodies.shape[2]} boids (triangles) and"
            f" {len(world.obstacles)} obstacles (discs); lines: the last {TRAIL} steps;"
            f" weights: {weights}",
        )
    return figure


def _ways(places: Floats, width: float, height: float) -> Floats:
    """The straight pieces (k, 2, 2) of ways through `places` (F, 2, N), without those
    that cross the border of the torus.
    """
    pieces = np.stack([places[:-1], places[1:]], axis=1)
    pieces = pieces.transpose(0, 3, 1, 2).reshape(-1, 2, 2)
    size = np.array([width, height])
    inside = np.all(np.abs(pieces[:, 1] - pieces[:, 0]) < size / 2, axis=1)
    return pieces[inside]


def to_the_text(studies: Studies) -> Figure:
    """The factor by which each detail of the text changes what the program does in the
    last half of a trial.
    """
    return effects_figure(
        studies["ablation"],
        "as_written",
        LATE_METRICS,
        "cohesion_weight",
        COHESION,
        factor=True,
    )


def to_the_program(studies: Studies) -> Figure:
    """The factor by which each detail of the program changes what the text's model does
    in the last half of a trial.
    """
    study = studies["ablation_reverse"]
    return effects_figure(
        study, "as_run", LATE_METRICS, "cohesion_weight", COHESION, factor=True
    )


def rules(studies: Studies) -> Figure:
    """What boids run into and in how many groups they fly, with all rules and without
    some.
    """
    study = studies["rules"]
    table = study.means(list(RUN_INTO))
    with style.context(STYLE):
        figure = Figure(figsize=(9.6, 2.6))
        panels = figure.subplots(1, len(RUN_INTO), sharey=True)
        for axes, (column, words) in zip(panels, RUN_INTO.items(), strict=True):
            rows = tuple(table[f"{column}{end}"] for end in ("", "_low", "_high"))
            draw_values(axes, range(len(table)), rows, BLUE)
            name_rows(axes, [_left_out(row) for _, row in table.iterrows()])
            axes.set(xlabel=words, xlim=(0, None))
        number = len(study.trials) // len(table)
        note(
            figure,
            f"{study.name}: {number} trials of 200 boids a value, mean with 95 %"
            " interval; contact: nearer than 5 px",
        )
    return figure


def _left_out(weights: "pd.Series[float]") -> str:
    off = [name for name in (*WEIGHTS, "obstacle") if weights[f"{name}_weight"] == 0]
    if len(off) > 1:
        return "no flocking rule"
    if off:
        return f"no {off[0]} rule"
    cohesion = weights["cohesion_weight"]
    return "all rules" if cohesion == 1 else f"all, cohesion weight {cohesion:g}"


def energy(studies: Studies) -> Figure:
    """The kinetic energy against time for three weights of separation."""
    study = studies["motion"]
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 3.4))
        axes = figure.subplots()
        for k, weight in enumerate(np.unique(study.trials["separation_weight"])):
            found = energies(studies, weight)
            frames = found[0][0]
            bounds = [
                mean_interval(at, distribution=ENERGIES)[:3]
                for at in np.array([values for _, values in found]).T
            ]
            mean, low, high = np.array(bounds).T
            axes.plot(
                frames, mean, color=COLOURS[k], ls=LINE_STYLES[k], label=f"{weight:g}"
            )
            axes.fill_between(frames, low, high, color=COLOURS[k], alpha=0.2, lw=0)
        axes.axvspan(HALF_TIME, END, color="0.95", zorder=0)
        axes.set(
            xlabel="frame (steps)",
            ylabel="mean of v² (px²/step²)",
            ylim=(0, None),
            xlim=(0, END),
        )
        axes.legend(title="separation weight", fontsize=8)
        number = int(study.trials.groupby("point").size().min())
        note(
            figure,
            f"{study.name}: {number} trials a curve, mean with pointwise 95 % interval;"
            " grey: the half that is judged",
        )
    return figure


recorded_as_defined = partial(as_defined, spec="snapshot")

FIGURES = {
    "figure1": Drawing(
        figure1, ("snapshot",), "Figure 1: where the boids are and where they fly."
    ),
    **{
        f"figure2_{weight}": Drawing(
            figure2,
            (weight,),
            f"Figure 2: the four metrics against iteration by {weight} weight, the"
            " other two being 1.",
        )
        for weight in WEIGHTS
    },
    "rules": Drawing(
        rules, ("rules",), "What boids run into without each rule, and their groups."
    ),
    "energy": Drawing(energy, ("motion",), "Kinetic energy against iteration."),
    "ablation": Drawing(
        to_the_text,
        ("ablation",),
        "From the program to the text, one detail at a time.",
    ),
    "ablation_reverse": Drawing(
        to_the_program,
        ("ablation_reverse",),
        "From the text to the program, one detail at a time.",
    ),
}
