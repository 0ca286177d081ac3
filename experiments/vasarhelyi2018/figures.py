"""The flocks of Vasarhelyi et al. (2018) in ideal and in real conditions, beside runs
of the authors' own simulator.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sweep.analysis import contrast, jointly
from sweep.figures import (
    BLUE,
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    draw_map,
    note,
)
from sweep.published.definitions import as_defined
from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]
Studies = Mapping[str, StoredStudy]

PROGRAMS = Path(__file__).with_name("programs.csv")
"""Means over 300..600 s of 8 to 24 runs each of the authors' simulator; of the distance
of the two nearest robots the least.
"""
WINNERS = Path(__file__).with_name("winners.csv")
"""The published set and what the searches found, written by winners.py."""
LATE = 0.5
"""The share of a trial's frames before those that count."""
LIMITS = {"scaled": ("scaled to v_flock", BLUE), "cut": ("cut at v_max", VERMILION)}
MEASURES = {
    "velocity_correlation": "velocity correlation",
    "speed": "speed (m/s)",
    "nearest_neighbour_distance": "to the nearest (m)",
}


SLOW = {"real": 3.7, "lossy": 5.0}
"""Between the speeds, in m/s, of the usual regime and of one that is slower: no run of
the simulator is within 0.09 m/s of it.
"""


def usual_velocity(studies: Studies) -> Floats:
    """The velocity correlation of trials of the usual regime at 4 m/s, scaled."""
    return _usual(studies, "velocity_correlation")


def usual_speed(studies: Studies) -> Floats:
    """Their speed."""
    return _usual(studies, "speed")


def usual_nearest(studies: Studies) -> Floats:
    """Their distance to the nearest."""
    return _usual(studies, "nearest_neighbour_distance")


def field_velocity(studies: Studies, packet_loss: float) -> Floats:
    """The velocity correlation of trials of the usual regime with the parameters of
    flights outdoors.
    """
    return _usual_field(studies, packet_loss, "velocity_correlation")


def field_speed(studies: Studies, packet_loss: float) -> Floats:
    """Their speed."""
    return _usual_field(studies, packet_loss, "speed")


def field_nearest(studies: Studies, packet_loss: float) -> Floats:
    """Their distance to the nearest."""
    return _usual_field(studies, packet_loss, "nearest_neighbour_distance")


def usual_share(studies: Studies) -> Floats:
    """100 for each trial in the usual regime at 4 m/s, scaled, and 0 for another."""
    trials = studies["real"].trials
    speed = trials.loc[trials["speed_limit"] == "scaled", "speed_mean"]
    return 100.0 * (speed > SLOW["real"]).to_numpy(np.float64)


def _usual(studies: Studies, metric: str) -> Floats:
    trials = studies["real"].trials
    fast = (trials["speed_limit"] == "scaled") & (trials["speed_mean"] > SLOW["real"])
    return trials.loc[fast, f"{metric}_mean"].to_numpy(np.float64)


def _usual_field(studies: Studies, packet_loss: float, metric: str) -> Floats:
    trials = studies["lossy"].trials
    of = trials["packet_loss"] == packet_loss
    fast = of & (trials["speed_mean"] > SLOW["lossy"])
    return trials.loc[fast, f"{metric}_mean"].to_numpy(np.float64)


def closest_tuned(studies: Studies, flock_speed: float, speed_limit: str) -> Floats:
    """The least distance of two robots in the last half of a trial, by trial."""
    return _closest(studies["tuned"], flock_speed, speed_limit)


def closest_field(studies: Studies, flock_speed: float, speed_limit: str) -> Floats:
    """The same with the parameters of flights outdoors."""
    return _closest(studies["field"], flock_speed, speed_limit)


def _closest(study: StoredStudy, flock_speed: float, speed_limit: str) -> Floats:
    series, trials = study.series, study.trials
    of = (trials["flock_speed"] == flock_speed) & (trials["speed_limit"] == speed_limit)
    late = series[series["frame"] >= LATE * series["frame"].max()]
    late = late[late["trial_id"].isin(trials.loc[of, "trial_id"])]
    return late.groupby("trial_id")["least_distance"].min().to_numpy(np.float64)


def ideal(studies: Studies) -> Figure:
    """Correlation, speed and distance of trials by speed, with both limits, and the
    runs of the authors' simulator.
    """
    known = pd.read_csv(PROGRAMS)
    known = known[known["conditions"] == "ideal"]
    with style.context(STYLE):
        figure = Figure(figsize=(8.4, 5.6))
        panels = figure.subplots(2, 3)
        for line, name in zip(panels, ("tuned", "field"), strict=True):
            for axes, (metric, label) in zip(line, MEASURES.items(), strict=True):
                _draw_trials(axes, studies[name].trials, metric)
                theirs = known[known["parameters"] == name]
                axes.plot(theirs["flock_speed"] + 0.45, theirs[metric], "kx", ms=4)
                axes.set(ylabel=label, xlabel=f"v_flock (m/s), {name}")
        panels[0, 0].legend(fontsize=7)
        note(
            figure,
            "vasarhelyi2018: trials without noise, delay and loss, each a dot, means"
            " over their last 300 s; crosses: runs of the authors' simulator",
        )
    return figure


def _draw_trials(axes: Axes, trials: pd.DataFrame, metric: str) -> None:
    """Each trial at its speed, those of one limit beside those of the other."""
    for k, (limit, (text, colour)) in enumerate(LIMITS.items()):
        rows = trials[trials["speed_limit"] == limit]
        axes.plot(
            rows["flock_speed"] + (0.15, -0.25)[k],
            rows[f"{metric}_mean"],
            "o",
            ms=3,
            color=colour,
            alpha=0.6,
            label=text,
        )


REAL = (
    ("real", "speed_limit", "scaled", ("tuned", "real", "scaled"), "tuned, scaled"),
    ("real", "speed_limit", "cut", ("tuned", "real", "cut"), "tuned, cut"),
    ("lossy", "packet_loss", 0.0, ("field", "real", "scaled"), "field"),
    ("lossy", "packet_loss", 1.0, ("field", "lossy", "scaled"), "field, packets lost"),
)
"""Which trials of which study are beside which runs of the simulator."""


def real(studies: Studies) -> Figure:
    """Correlation by speed of each trial and of each run of the simulator."""
    known = pd.read_csv(PROGRAMS).set_index(["parameters", "conditions", "speed_limit"])
    known = known.sort_index()
    with style.context(STYLE):
        figure = Figure(figsize=(8.4, 2.8))
        for axes, (name, setting, value, key, text) in zip(
            figure.subplots(1, 4), REAL, strict=True
        ):
            trials, theirs = studies[name].trials, known.loc[key]
            ours = trials[trials[setting] == value]
            axes.plot(
                ours["speed_mean"],
                ours["velocity_correlation_mean"],
                "o",
                ms=4,
                color=BLUE,
                alpha=0.6,
                label="trials",
            )
            axes.plot(
                theirs["speed"],
                theirs["velocity_correlation"],
                "kx",
                ms=4,
                label="simulator",
            )
            axes.set_xlabel("speed (m/s)")
            axes.set_title(text, loc="left", fontsize=8)
        figure.axes[0].set_ylabel("velocity correlation")
        figure.axes[0].legend(fontsize=7)
        note(
            figure,
            "vasarhelyi2018: noise, a delay of 1 s and gusts, means over 300..600 s;"
            " crosses: runs of the authors' simulator",
        )
    return figure


CHOSEN = {
    "fitness": "fitness",
    "speed": "speed (m/s)",
    "flock_correlation": "order of velocities",
}


def against_published(trials: pd.DataFrame) -> pd.DataFrame:
    """By how much each set of winners.csv differs from the published one, the first, in
    the metrics of CHOSEN: value, low and high, by set and metric. Trials are paired by
    seed; all intervals hold together with 95 % (Bonferroni).
    """
    sets = pd.read_csv(WINNERS).set_index("set")["repulsion_range"]
    asked = [(name, metric) for name in sets.index[1:] for metric in CHOSEN]
    sides = [
        contrast(
            trials,
            f"{metric}_mean",
            a={"repulsion_range": sets.iloc[0]},
            b={"repulsion_range": sets[name]},
        )
        for name, metric in asked
    ]
    family = jointly(sides, together="bonferroni")
    return pd.DataFrame(
        {
            "value": [side.value for side in sides],
            "low": family.low,
            "high": family.high,
        },
        index=pd.MultiIndex.from_tuples(asked, names=["set", "metric"]),
    )


def winners(studies: Studies) -> Figure:
    """Each trial of the sets that were found and of the published one, with the paired
    differences.
    """
    trials = studies["winners"].trials
    sets = pd.read_csv(WINNERS).set_index("set")["repulsion_range"]
    differences = against_published(trials)
    with style.context(STYLE):
        figure = Figure(figsize=(8.4, 2.8))
        panels = figure.subplots(1, len(CHOSEN), sharey=True)
        for axes, (metric, label) in zip(panels, CHOSEN.items(), strict=True):
            for k, (name, value) in enumerate(sets.items()):
                rows = trials[trials["repulsion_range"] == value]
                x = rows[f"{metric}_mean"]
                colour = VERMILION if k == 0 else BLUE
                axes.plot(x, [k] * len(x), "o", ms=3, color=colour, alpha=0.4)
                axes.plot(x.mean(), k, "k|", ms=12)
                if k > 0:
                    off = differences.loc[(name, metric)]
                    text = f"{off.value:+.3f} ({off.low:+.3f} to {off.high:+.3f})"
                    axes.annotate(text, (x.mean(), k + 0.18), ha="center", fontsize=6)
            axes.set(xlabel=label, ylim=(-0.5, len(sets) - 0.4))
        panels[0].set_yticks(range(len(sets)), list(sets.index))
        note(
            figure,
            "vasarhelyi2018/winners: 300..600 s on seeds that no search has seen;"
            " paired differences to the published set, with 95 % intervals that hold"
            " together",
        )
    return figure


def obstacles(studies: Studies) -> Figure:
    """The last frame of a trial with two squares, for both limits."""
    study = studies["obstacles"]
    with style.context(STYLE):
        figure = Figure(figsize=(8.4, 4.6))
        for axes, (limit, (text, colour)) in zip(
            figure.subplots(1, 2), LIMITS.items(), strict=True
        ):
            trial = study.trials[study.trials["speed_limit"] == limit].iloc[0]
            bodies = study.trajectory(str(trial["trial_id"]))[1][-1]
            draw_map(axes, study.world(str(trial["trial_id"])), "m", downwards=False)
            draw_flock(axes, bodies, 6.0, colour)
            axes.set_title(
                f"{text}: correlation {trial['velocity_correlation_mean']:.2f},"
                f" {trial['speed_mean']:.2f} m/s",
                loc="left",
                fontsize=8,
            )
        note(figure, f"{study.name}: the first trial of each limit after 600 s")
    return figure


recorded_as_defined = partial(as_defined, spec="field")

FIGURES = {
    "ideal": Drawing(
        ideal,
        ("tuned", "field"),
        "Correlation, speed and distance by speed and limit of the wanted velocity.",
    ),
    "real": Drawing(
        real,
        ("real", "lossy"),
        "Correlation by speed in the conditions that the program is shipped with.",
    ),
    "winners": Drawing(
        winners,
        ("winners",),
        "Fitness, speed and order of what searches found and of the published set.",
    ),
    "obstacles": Drawing(obstacles, ("obstacles",), "Flocks round two squares."),
}
