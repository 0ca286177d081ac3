"""The figures of nguyen2024, what the differences between its text and its program do,
and measures of its claims.

    python experiments/nguyen2024/figures.py STUDY [STUDY ...]

draws figure 2 of stored studies, e.g. nguyen2024/separation, into
results/<study>/figures.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib import style
from matplotlib.figure import Figure
from numpy.typing import NDArray

import sweep
from sweep.figures import (
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    draw_map,
    effects_figure,
    metric_curves,
    note,
    save,
)
from sweep.tables.stored_study import StoredStudy

Studies = dict[str, StoredStudy]

LATE_METRICS = {
    "speed_mean": "speed",
    "flock_radius_mean": "flock radius",
    "turn_rate_unwrapped_mean": "published turn rate",
    "dispersion_mean": "dispersion",
}
WEIGHTS = {1.0: "all weights 1", 2.0: "cohesion weight 2"}
HALF_TIME, END = 250, 500


def figure2(studies: Studies) -> Figure:
    """One panel of figure 2: the metrics of section 2.3 by the weight that the only
    study sweeps.
    """
    (study,) = studies.values()
    return metric_curves(study, study.varied[0])


def figure1(studies: Studies) -> Figure:
    """The flock of one trial halfway and at the end: boids are triangles that point
    where they fly.
    """
    study = studies["snapshot"]
    trial = study.trials["trial_id"].iloc[0]
    frames, bodies = study.trajectory(trial)
    world = study.world(trial)
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 2.75))
        for axes, frame in zip(
            figure.subplots(1, 2, sharey=True), (HALF_TIME, END), strict=True
        ):
            draw_map(axes, world, "px", face=VERMILION)
            draw_flock(axes, bodies[frames == frame][0], length=22.0)
            axes.set_title(f"after {frame} steps")
            axes.label_outer()
        counts = (
            f"{bodies.shape[2]} boids (triangles) and {len(world.obstacles)} obstacles"
            " (discs)"
        )
        note(figure, f"{study.name}: one trial of {counts}")
    return figure


def to_the_text(studies: Studies) -> Figure:
    """The factor by which each detail of the text changes what the program does in the
    last half of a trial.
    """
    return effects_figure(
        studies["ablation"],
        "as_written",
        LATE_METRICS,
        "cohesion_weight",
        WEIGHTS,
        factor=True,
    )


def to_the_program(studies: Studies) -> Figure:
    """The factor by which each detail of the program changes what the text's model does
    in the last half of a trial.
    """
    study = studies["ablation_reverse"]
    return effects_figure(
        study, "as_run", LATE_METRICS, "cohesion_weight", WEIGHTS, factor=True
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
        for weight in ("separation", "alignment", "cohesion")
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


def start_speed_spread(studies: Studies) -> NDArray[np.float64]:
    """The standard deviation over boids of their speed at
    the start, one value a trial.
    """
    study = studies["snapshot"]
    starts = [study.trajectory(trial)[1][0] for trial in study.trials["trial_id"]]
    return np.array([np.hypot(bodies[2], bodies[3]).std() for bodies in starts])


def late_displacement(studies: Studies) -> NDArray[np.float64]:
    """How far boids are, at the end, from where they were halfway, the shorter way
    round the torus: a mean a trial.
    """
    study = studies["snapshot"]
    size = study.trials[["width", "height"]].iloc[0].to_numpy(np.float64)[:, None]
    means = []
    for trial in study.trials["trial_id"]:
        frames, bodies = study.trajectory(trial)
        change = bodies[frames == END][0, :2] - bodies[frames == HALF_TIME][0, :2]
        means.append(np.hypot(*(change - size * np.round(change / size))).mean())
    return np.array(means)


def _alignment_effect(studies: Studies, metric: str) -> NDArray[np.float64]:
    """The change of a metric's late mean from alignment weight 0.5 to 2, one value a
    replicate.

    Its unit is the range of the metric's mean over the separation weights, taken as
    known.
    """
    column = f"{metric}_mean"
    separation = (
        studies["separation"].trials.groupby("separation_weight")[column].mean()
    )
    trials = studies["alignment"].trials.pivot(
        index="replicate", columns="alignment_weight", values=column
    )
    return np.asarray((trials[2.0] - trials[0.5]) / np.ptp(separation), np.float64)


def alignment_effect_on_speed(studies: Studies) -> NDArray[np.float64]:
    """Of the speed, in units of the effect of the separation weight."""
    return _alignment_effect(studies, "speed")


def alignment_effect_on_flock_radius(studies: Studies) -> NDArray[np.float64]:
    """Of the flock radius, in units of the effect of the separation weight."""
    return _alignment_effect(studies, "flock_radius")


def alignment_effect_on_turn_rate(studies: Studies) -> NDArray[np.float64]:
    """Of the published turn rate, in units of the effect of the separation weight."""
    return _alignment_effect(studies, "turn_rate_unwrapped")


def alignment_effect_on_dispersion(studies: Studies) -> NDArray[np.float64]:
    """Of the dispersion, in units of the effect of the separation weight."""
    return _alignment_effect(studies, "dispersion")


def main(names: list[str]) -> None:
    """Draw figure 2 for each stored study and print where it is."""
    results = Path("results")
    for name in names:
        figure = figure2({name: sweep.load(name)})
        for path in save(figure, results / name / "figures" / "figure2", below=results):
            print(path)


if __name__ == "__main__":
    main(sys.argv[1:])
