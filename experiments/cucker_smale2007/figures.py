"""What Cucker and Smale (2007) prove: flocks that agree for beta < 1/2, and velocities
that never come farther apart.
"""

from collections.abc import Mapping
from functools import partial

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sweep.figures import COLOURS, STYLE, Drawing, note
from sweep.published.definitions import as_defined
from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]
Studies = Mapping[str, StoredStudy]

STEEP = 2
"""So many frames from the start the rate of the decay is taken at."""


def _flights(studies: Studies, spec: str, metric: str, exponent: float) -> pd.DataFrame:
    """A series of the trials with one beta, a row a trial, a column a frame."""
    study = studies[spec]
    trials = study.trials
    chosen = trials.loc[np.isclose(trials["exponent"], exponent), "trial_id"]
    series = study.series[study.series["trial_id"].isin(chosen)]
    return series.pivot(index="trial_id", columns="frame", values=metric)


def _rise(studies: Studies, spec: str, exponent: float) -> Floats:
    """By how much the velocity diameter grows at most from one frame to the next, by
    trial, as a share of the first one.
    """
    found = _flights(studies, spec, "velocity_diameter", exponent).to_numpy(np.float64)
    with np.errstate(invalid="ignore"):  # of a flight that diverged
        rises: Floats = np.diff(found, axis=1).max(axis=1) / found[:, 0]
    return rises


def _drift(studies: Studies, spec: str, exponent: float) -> Floats:
    """The greatest change of the length of the mean velocity, by trial, as a share."""
    found = _flights(studies, spec, "group_speed", exponent).to_numpy(np.float64)
    first = found[:, :1]
    changes: Floats = np.abs(found / first - 1.0).max(axis=1)
    return changes


rise_near, rise_far = partial(_rise, spec="near"), partial(_rise, spec="far")
drift_near, drift_far = partial(_drift, spec="near"), partial(_drift, spec="far")


def left_far(studies: Studies, exponent: float) -> Floats:
    """The velocity diameter at the end, by trial, as a share of that at the start."""
    found = _flights(studies, "far", "velocity_diameter", exponent).to_numpy(np.float64)
    shares: Floats = found[:, -1] / found[:, 0]
    return shares


def rate(studies: Studies, exponent: float) -> Floats:
    """The rate at which the velocity diameter falls in the end, by trial, in 1/time."""
    found = _flights(studies, "near", "velocity_diameter", exponent)
    dt = float(studies["near"].trials["dt"].iloc[0])
    first, last = found.columns[-STEEP - 1], found.columns[-1]
    falls: Floats = np.log(found[first] / found[last]).to_numpy(np.float64)
    return falls / (dt * (last - first))


def agreement(studies: Studies) -> Figure:
    """The velocity diameter against time, for boids that begin far apart and near."""
    panels = (("far", "far apart, weights mean"), ("near", "near, weights sum"))
    with style.context(STYLE):
        figure = Figure(figsize=(8.4, 3.8))
        for axes, (spec, text) in zip(figure.subplots(1, 2), panels, strict=True):
            study = studies[spec]
            dt = float(study.trials["dt"].iloc[0])
            exponents = sorted(set(study.trials["exponent"]))
            for colour, exponent in zip(COLOURS, exponents, strict=False):
                flights = _flights(studies, spec, "velocity_diameter", exponent)
                shares = flights.div(flights.iloc[:, 0], axis=0)
                axes.plot(
                    shares.columns * dt,
                    np.exp(np.log(shares.clip(lower=1e-17)).mean()),
                    color=colour,
                    label=f"β = {exponent:g}",
                )
            axes.set(
                yscale="log",
                xlabel="time (t)",
                ylabel="velocity diameter / its start",
            )
            axes.set_title(text, loc="left", fontsize=8)
        far, near = figure.axes
        far.set_ylim(1e-16, 2)
        far.legend(fontsize=7, ncols=2, loc="upper right", bbox_to_anchor=(1.0, 0.94))
        near.legend(fontsize=7, loc="lower left")
        count = studies["far"].trials.groupby("point").size().max()
        note(
            figure,
            f"{studies['far'].name} and {studies['near'].name}: geometric means of"
            f" {count} trials; below 1e-15 only rounding is left",
        )
    return figure


recorded_as_defined = partial(as_defined, spec="near")

FIGURES = {
    "agreement": Drawing(
        agreement,
        ("far", "near"),
        "The greatest difference of velocities against time, for several beta.",
    ),
}
