"""The figures of nguyen2024, and what the differences between its text and its program
do.
"""

import numpy as np
from matplotlib import style
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from sweep.figures import (
    SKY,
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    draw_map,
    effects_figure,
    metric_curves,
    note,
)

from .measures import (  # noqa: F401 (for published.yaml)
    END,
    HALF_TIME,
    METRICS,
    WEIGHTS,
    Floats,
    Studies,
    alignment_effect_on_dispersion,
    alignment_effect_on_flock_radius,
    alignment_effect_on_speed,
    alignment_effect_on_turn_rate,
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
TRAIL = 50
"""Steps."""


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
        for weight, line in zip(weights, axes.get_lines(), strict=True):
            chosen = points[points["weight"] == weight]
            axes.plot(
                chosen["frame"],
                chosen["published_value"],
                "o",
                ms=4.5,
                mfc="none",
                mec=line.get_color(),
                clip_on=False,
            )
    first = figure.axes[0]
    first.plot([], [], "o", ms=4.5, mfc="none", mec="0.3", label="published")
    handles, labels = first.get_legend_handles_labels()
    first.legend(handles[-1:], labels[-1:], fontsize=7, loc="best")
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
