"""Which sheep a dog can herd, and how it moves behind them (Strombom et al. 2014)."""

from collections.abc import Mapping
from functools import partial

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sweep.analysis import mean_interval
from sweep.figures import (
    BLUE,
    COLOURS,
    STYLE,
    VERMILION,
    Drawing,
    note,
    phase_figure,
)
from sweep.published.definitions import as_defined
from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]
Studies = Mapping[str, StoredStudy]

DRIVEN = 200
"""So many steps before the task is done the dog drives the flock."""


def _offsets(studies: Studies) -> Floats:
    """How far the dog is beside the line from the goal to the sheep, in the last DRIVEN
    steps before the task was done: a row a trial.
    """
    study = studies["path"]
    rows = []
    for _, series in study.series.groupby("trial_id"):
        offsets = series.sort_values("frame")
        done = offsets["herding_time"].to_numpy(np.float64)
        if done[-1] >= DRIVEN:
            last = int(done[-1])
            rows.append(
                offsets["dog_offset"].to_numpy(np.float64)[last - DRIVEN : last]
            )
    return np.array(rows).reshape(-1, DRIVEN)


def spectra(offsets: Floats) -> tuple[Floats, Floats]:
    """Frequencies, in 1/step, and the share of each in the variance, by row; with the
    window of von Hann, so that a trend does not leak.
    """
    centred = offsets - offsets.mean(axis=1, keepdims=True)
    window = np.hanning(offsets.shape[1])
    power = np.abs(np.fft.rfft(centred * window, axis=1)[:, 1:]) ** 2
    parts: Floats = power / power.sum(axis=1, keepdims=True)
    return np.fft.rfftfreq(offsets.shape[1])[1:], parts


def period(studies: Studies) -> Floats:
    """The period of the peak of the spectrum of the dog's offset, in steps."""
    frequencies, found = spectra(_offsets(studies))
    periods: Floats = 1.0 / frequencies[found.argmax(axis=1)]
    return periods


def phases(studies: Studies) -> Figure:
    """Where half of the trials succeed, over sizes of the flock and neighbours."""
    return phase_figure(studies["map"])


def shares(studies: Studies) -> Figure:
    """Success against the share of the flock to which a sheep is drawn."""
    study = studies["shares"]
    trials: pd.DataFrame = study.trials
    with style.context(STYLE):
        figure = Figure(figsize=(6.4, 4.0))
        axes = figure.subplots()
        for colour, (n, flock) in zip(COLOURS, trials.groupby("n"), strict=False):
            found = [
                (
                    nearest / (n - 1),
                    mean_interval(
                        points["herded"].to_numpy(np.float64), distribution="proportion"
                    ),
                )
                for nearest, points in flock.groupby("attraction_nearest")
            ]
            where = [share for share, _ in found]
            mean = np.array([one.value for _, one in found])
            low = np.array([one.low for _, one in found])
            high = np.array([one.high for _, one in found])
            axes.errorbar(
                where,
                mean,
                np.maximum([mean - low, high - mean], 0.0),
                fmt="o-",
                ms=3,
                lw=1.0,
                color=colour,
                label=f"{n - 1} sheep",
            )
        axes.axvline(0.53, color="0.6", lw=1.0, ls=":")
        axes.set(
            xlabel="nearest sheep that draw one / all sheep",
            ylabel="share of trials that succeed",
            xlim=(0, 1.02),
        )
        axes.legend(fontsize=8, loc="lower right")
        count = trials.groupby("point").size().max()
        note(
            figure,
            f"{study.name}: {count} trials a point with 95 % intervals; dotted: 0.53",
        )
    return figure


def path(studies: Studies) -> Figure:
    """The ways of the dog and of the centre of the sheep, and the spectrum of the dog's
    offset.
    """
    study = studies["path"]
    with style.context(STYLE):
        figure = Figure(figsize=(8.4, 4.0))
        left, right = figure.subplots(1, 2)
        trial = study.trials.sort_values("replicate").iloc[0]
        bodies = study.trajectory(str(trial["trial_id"]))[1]
        sheep = bodies[:, :2, :-1].mean(axis=2)
        left.plot(*bodies[:, :2, -1].T, color=VERMILION, lw=0.8, label="dog")
        left.plot(*sheep.T, color=BLUE, lw=1.2, label="centre of the sheep")
        left.plot(*bodies[0, :2, :-1], ".", color="0.6", ms=2, label="sheep at first")
        left.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
        left.legend(fontsize=7, loc="lower right")
        offsets = _offsets(studies)
        frequencies, found = spectra(offsets)
        right.plot(frequencies, found.mean(axis=0), color=VERMILION, lw=1.0)
        right.set(xlabel="frequency (1/step)", ylabel="share of the variance")
        right.set_title("offset of the dog while it drives", loc="left", fontsize=8)
        note(
            figure,
            f"{study.name}: left the first trial, right the mean of {len(offsets)},"
            f" over the last {DRIVEN} steps before the task is done",
        )
    return figure


recorded_as_defined = partial(as_defined, spec="path")

FIGURES = {
    "phase": Drawing(
        phases,
        ("map",),
        "Where half of the trials succeed, by boids and attracting neighbours.",
    ),
    "shares": Drawing(
        shares,
        ("shares", "local", "readings"),
        "Success by the share of the flock to which a sheep is drawn.",
    ),
    "path": Drawing(
        path, ("path",), "The way of the dog, and the spectrum of its offset."
    ),
}
