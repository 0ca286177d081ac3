"""Measures of the claims of nguyen2024, and the points of its figure 2.

Where a claim is about means of many trials, as a curve or a ratio, what is returned are
pseudo-values, one a replicate: their mean is the quantity, and their spread its error.
"""

from functools import cache, partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import pseudo_values
from sweep.tables.stored_study import StoredStudy

Studies = dict[str, StoredStudy]
Floats = NDArray[np.float64]

WEIGHTS = ("separation", "alignment", "cohesion")
METRICS = ("speed", "flock_radius", "turn_rate_unwrapped", "dispersion")
"""The rows and the panels of figure 2, in its order."""
PUBLISHED_TRIALS = 100
"""Of each point of figure 2."""
HALF_TIME, END = 250, 500
EARLY, LATE = (100, 150), (450, 500)
"""The steps from which speeds should have settled, and the last ones."""


@cache
def _figure2() -> pd.DataFrame:
    return pd.read_csv(Path(__file__).with_name("figure2.csv"), comment="#")


def published_points(setting: str, metric: str) -> pd.DataFrame:
    """The points of a panel of figure 2: weight, frame, published_value, reading_error,
    sd_between_trials.
    """
    table = _figure2()
    return table[(table["swept"] == setting) & (table["metric"] == metric)]


def _disagreement(studies: Studies, weight: str, metric: str) -> Floats:
    """How far our curves are from the points of a panel of figure 2: the root mean
    square over the points, in standard errors of a published point.

    That error is the standard deviation between trials over the root of 100, and the
    error of reading. The deviation is that of the author's program where it is known,
    and otherwise ours.
    """
    setting = f"{weight}_weight"
    points = published_points(setting, metric)
    study = studies[weight]
    frames = study.series[study.series["frame"].isin(points["frame"])]
    trials = study.trials.loc[
        study.trials["status"] == "done", ["trial_id", "replicate", setting]
    ]
    values = frames.merge(trials, on="trial_id").pivot(
        index="replicate", columns=[setting, "frame"], values=metric
    )
    places = pd.MultiIndex.from_frame(points[["weight", "frame"]])
    ours = values.reindex(columns=places).dropna().to_numpy(np.float64)
    between, reading, published = (
        points[name].to_numpy(np.float64)
        for name in ("sd_between_trials", "reading_error", "published_value")
    )

    def distance(*means: Floats) -> Floats:
        mean, square = np.split(np.stack(means, axis=1), 2, axis=1)
        ours_between = np.sqrt(np.maximum(square - mean * mean, 0.0))
        spread = np.where(np.isnan(between), ours_between, between)
        error = np.hypot(spread / PUBLISHED_TRIALS**0.5, reading)
        off = (mean - published) / error
        return np.sqrt((off * off).mean(axis=1))

    return pseudo_values(np.hstack([ours, ours * ours]), distance)


(
    panel_separation_speed,
    panel_separation_flock_radius,
    panel_separation_turn_rate,
    panel_separation_dispersion,
    panel_alignment_speed,
    panel_alignment_flock_radius,
    panel_alignment_turn_rate,
    panel_alignment_dispersion,
    panel_cohesion_speed,
    panel_cohesion_flock_radius,
    panel_cohesion_turn_rate,
    panel_cohesion_dispersion,
) = (
    partial(_disagreement, weight=weight, metric=metric)
    for weight in WEIGHTS
    for metric in METRICS
)


def start_speed_spread(studies: Studies) -> Floats:
    """The standard deviation over boids of their speed at the start, one value a
    trial.
    """
    study = studies["snapshot"]
    starts = [study.trajectory(trial)[1][0] for trial in study.trials["trial_id"]]
    return np.array([np.hypot(bodies[2], bodies[3]).std() for bodies in starts])


def late_displacement(studies: Studies) -> Floats:
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


def _alignment_effect(studies: Studies, metric: str) -> Floats:
    """The change of a metric's late mean from alignment weight 0.5 to 2, as a part of
    the range of these means over the separation weights.
    """
    separation, alignment = (
        _by_weight(studies[weight], f"{weight}_weight", f"{metric}_mean")
        for weight in ("separation", "alignment")
    )
    both = separation.join(alignment[[0.5, 2.0]], how="inner", rsuffix="_a").dropna()

    def effect(*means: Floats) -> Floats:
        *by_separation, low, high = means
        return (high - low) / np.ptp(np.stack(by_separation), axis=0)

    return pseudo_values(both.to_numpy(np.float64), effect)


def _by_weight(study: StoredStudy, setting: str, column: str) -> pd.DataFrame:
    """A column of the trials that are done: a row a replicate, a column a weight."""
    done = study.trials[study.trials["status"] == "done"]
    return done.pivot(index="replicate", columns=setting, values=column)


alignment_effect_on_speed = partial(_alignment_effect, metric="speed")
alignment_effect_on_flock_radius = partial(_alignment_effect, metric="flock_radius")
alignment_effect_on_turn_rate = partial(_alignment_effect, metric="turn_rate_unwrapped")
alignment_effect_on_dispersion = partial(_alignment_effect, metric="dispersion")


def _settled_share(studies: Studies, metric: str, most: float) -> Floats:
    """For each combination of weights 100 if the mean of a metric changes by less than
    `most` from EARLY to LATE steps, otherwise 0.
    """
    study = studies["combinations"]
    done = study.trials[study.trials["status"] == "done"]
    point = study.series["trial_id"].map(done.set_index("trial_id")["point"])
    early, late = (
        study.series[study.series["frame"].between(*frames)].groupby(point)[metric]
        for frames in (EARLY, LATE)
    )
    change = (late.mean() - early.mean()).to_numpy(np.float64)
    return np.where(np.abs(change) < most, 100.0, 0.0)


settled_speed_combinations = partial(_settled_share, metric="speed", most=0.15)
settled_turn_rate_combinations = partial(
    _settled_share, metric="turn_rate_unwrapped", most=5.0
)


def _flights(studies: Studies, weight: float) -> list[tuple[Floats, Floats]]:
    """Frames (F,) and bodies (F, 4 or more, N) of the trials of `motion` with this
    weight of separation.
    """
    study = studies["motion"]
    trials = study.trials[
        (study.trials["separation_weight"] == weight)
        & (study.trials["status"] == "done")
    ]
    return [study.trajectory(trial) for trial in trials["trial_id"]]


def energies(studies: Studies, weight: float) -> list[tuple[Floats, Floats]]:
    """Frames (F,) and the mean of v^2 over boids (F,), px^2/step^2, of each trial of
    `motion` with this weight of separation.
    """
    return [
        (frames, (bodies[:, 2] ** 2 + bodies[:, 3] ** 2).mean(axis=1))
        for frames, bodies in _flights(studies, weight)
    ]


def _energy_change(studies: Studies, weight: float) -> Floats:
    """By how many per cent the kinetic energy changes from the third quarter of a trial
    to the last: that of means over all boids and trials.
    """
    middle = (HALF_TIME + END) / 2
    means = [
        (
            energy[(frames >= HALF_TIME) & (frames < middle)].mean(),
            energy[frames >= middle].mean(),
        )
        for frames, energy in energies(studies, weight)
    ]
    return pseudo_values(
        np.array(means), lambda before, after: 100.0 * (after / before - 1.0)
    )


energy_separation_half = partial(_energy_change, weight=0.5)
energy_equal_weights = partial(_energy_change, weight=1.0)
energy_separation_double = partial(_energy_change, weight=2.0)


def left_of_both_forces(studies: Studies) -> Floats:
    """What is left of separation and cohesion in the last half of a trial at equal
    weights: the mean size of their sum over that of both sizes added, one value a
    trial. 0 if they annihilate each other, 1 if they agree.
    """
    settings = studies["motion"].trials.iloc[0]
    values = []
    for frames, bodies in _flights(studies, 1.0):
        total, added = 0.0, 0.0
        for x, y in bodies[frames >= HALF_TIME][:, :2]:
            separation, cohesion = _forces(x, y, settings)
            total += np.hypot(*(separation + cohesion)).sum()
            added += np.hypot(*separation).sum() + np.hypot(*cohesion).sum()
        values.append(total / added)
    return np.array(values)


def _forces(x: Floats, y: Floats, settings: "pd.Series") -> tuple[Floats, Floats]:
    """Eqs. (4) and (6) with the weights of Eq. (3): separation and cohesion, (2, N)."""
    away = np.stack([x[:, None] - x, y[:, None] - y])
    distance = np.hypot(*away)
    np.fill_diagonal(distance, np.inf)
    near, seen = (
        distance < settings[f"{rule}_range"] for rule in ("separation", "cohesion")
    )
    separation = np.sum(away / np.maximum(distance, 1.0) * near, axis=2)
    cohesion = -np.sum(away * seen, axis=2) / np.maximum(seen.sum(axis=1), 1)
    return (
        settings["separation_weight"] * _limited(separation, settings["max_force"]),
        settings["cohesion_weight"] * _limited(cohesion, settings["max_force"]),
    )


def _limited(force: Floats, most: float) -> Floats:
    """Eq. (9)."""
    size = np.hypot(*force)
    return force * np.minimum(1.0, most / np.maximum(size, most))
