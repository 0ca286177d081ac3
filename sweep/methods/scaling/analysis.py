"""Finite-size scaling of a stored study: a transition in flocks of several sizes.

The state of each point shows whether its series are stationary, as the analysis needs.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import (
    CONFIDENCE,
    DRIFT_LEVEL,
    ENOUGH_SERIES,
    FEWEST_FRAMES,
    BinderCrossing,
    BinderMinimum,
    BurnIn,
    Collapse,
    SizeCurve,
    SusceptibilityPeak,
    TransitionOrder,
    TwoPeaks,
    binder_crossings,
    binder_minimum,
    burn_in,
    collapse,
    drift,
    holm,
    integrated_time,
    order_samples,
    susceptibility_peak,
    transition_order,
    two_peaks,
)
from sweep.errors import ChoiceError
from sweep.tables import StoredStudy
from sweep.text import unknown

Floats = NDArray[np.float64]

NUMBER = "n"
SIDES = ["width", "height"]
LENGTHS = {"side": "L = sqrt(width height)", "n": "L = n"}
"""Definition of the length of a size, in words."""
FEWEST_TRIALS = 2
CURVES = ("order", "susceptibility", "binder")
DRIFTS = "its mean drifts"
ENDLESS = "no end of a burn-in was found"
"""A problem of points of fewer than ten trials; more show a drift if there is one."""
FEW = f"fewer than {FEWEST_FRAMES} frames count"
"""A problem that leaves open whether a point is stationary."""


@dataclass(frozen=True, eq=False)
class Scaling:
    """Finite-size scaling of a study.

    Attributes
    ----------
    metric : str
        The order parameter, a recorded series.
    control : str
        The control parameter.
    length : str
        Definition of the length of a size, a key of LENGTHS: "side", the root of width
        times height, or "n" if worlds do not grow with n.
    burn_in : int or None
        Steps that do not count; None for the first half of each trial.
    curves : tuple of SizeCurve
        One per size, the smallest first.
    states : DataFrame
        One row per point. Columns: n; the control parameter; trials; frames and tau, in
        steps, of the part that counts; burn_in, in steps, by MSER-5 in the complete
        series; drift_p, adjusted for all points; problems, in words. tau, burn_in and
        drift_p are NaN for fewer than 20 frames.
    left_out : int
        Number of trials that are not done, lack a value, or are of points that have too
        few.
    confidence : float
    """

    metric: str
    control: str
    length: str
    burn_in: int | None
    curves: tuple[SizeCurve, ...]
    states: pd.DataFrame
    left_out: int
    confidence: float

    @cached_property
    def points(self) -> pd.DataFrame:
        """One row per point, with confidence intervals of each point alone.

        Columns: n, length and the control parameter; order, susceptibility and binder,
        each with _low and _high; and the columns of `states`.
        """
        rows = []
        for curve in self.curves:
            columns: dict[str, object] = {NUMBER: curve.n, "length": curve.length}
            columns[self.control] = curve.x
            for name in CURVES:
                means = getattr(curve, name)
                low, high = means.bounds(self.confidence)
                columns |= {name: means.value, f"{name}_low": low, f"{name}_high": high}
            rows.append(pd.DataFrame(columns))
        return pd.concat(rows).merge(self.states, on=[NUMBER, self.control])

    @cached_property
    def crossings(self) -> list[BinderCrossing]:
        """The crossings of cumulants of neighbouring sizes."""
        return binder_crossings(self.curves, self.confidence)

    @cached_property
    def peaks(self) -> list[SusceptibilityPeak]:
        """The peak of the susceptibility of each size."""
        return [susceptibility_peak(curve, self.confidence) for curve in self.curves]

    @cached_property
    def minima(self) -> list[BinderMinimum]:
        """The smallest cumulant of each size."""
        return [binder_minimum(curve, self.confidence) for curve in self.curves]

    @cached_property
    def two_peaks(self) -> list[TwoPeaks]:
        """The test for two peaks of the order of each size."""
        return [two_peaks(curve, self.confidence) for curve in self.curves]

    @cached_property
    def collapse(self) -> Collapse:
        """The exponents with which the curves collapse; takes seconds to compute."""
        return collapse(self.curves, self.confidence)

    @property
    def stationary(self) -> bool:
        """True if no point has a problem."""
        return bool((self.states["problems"] == "").all())

    @cached_property
    def order(self) -> TransitionOrder:
        """The order of the transition; "not decided" if a series is not stationary."""
        if self.stationary:
            return transition_order(self.curves, self.confidence)
        return TransitionOrder("not decided", "not all series are stationary")


def finite_size_scaling(
    study: StoredStudy,
    metric: str | None = None,
    by: str | None = None,
    burn_in: int | None = None,
    confidence: float = CONFIDENCE,
) -> Scaling:
    """Analyse a transition in flocks of several sizes.

    Parameters
    ----------
    study : StoredStudy
    metric : str, optional
        The order parameter, a recorded series; by default the first series.
    by : str, optional
        The control parameter; by default the only number that varies in addition to n
        and the parameters that change with n.
    burn_in : int, optional
        Steps that do not count; by default the first half of each trial.
    confidence : float, default 0.95

    Returns
    -------
    Scaling

    Raises
    ------
    ChoiceError
        The study has a single size, no series, or further parameters that vary; a name
        or `burn_in` is not allowed; or fewer than two sizes have two points of two
        trials.
    """
    metric = _metric(study, metric)
    points = study.points
    if NUMBER not in points or points[NUMBER].nunique() < 2:
        raise ChoiceError(
            'has flocks of a single size; add "sizes" to the spec', study.name
        )
    control = _control(study, by)
    samples = order_samples(study, metric)
    last = int(study.series["frame"].max())
    if burn_in is not None and not 0 <= burn_in < last:
        raise ChoiceError(
            f"burn-in: {burn_in:,} steps; allowed: 0 to {last - 1:,}", study.name
        )
    late = (
        {point: series[:, series.shape[1] // 2 :] for point, series in samples.items()}
        if burn_in is None
        else order_samples(study, metric, burn_in)
    )
    enough = {
        point
        for point, series in late.items()
        if len(series) >= FEWEST_TRIALS and series.size
    }
    points = points[points.index.isin(enough)].sort_values([NUMBER, control])
    curves, length = _curves(study, points, control, late)
    counted = {point: late[point] for point in points.index}
    trials = sum(len(series) for series in counted.values())
    return Scaling(
        metric=metric,
        control=control,
        length=length,
        burn_in=burn_in,
        curves=curves,
        states=_states(study, points, control, samples, counted=counted),
        left_out=len(study.trials) - trials,
        confidence=confidence,
    )


def _metric(study: StoredStudy, metric: str | None) -> str:
    recorded = study.series_metrics
    if not recorded:
        raise ChoiceError(
            "has recorded no series, which an order parameter needs; add a series"
            ' under "record" in "series"',
            study.name,
        )
    if metric is None:
        return recorded[0]
    if metric not in recorded:
        raise ChoiceError(unknown("recorded series", metric, recorded), study.name)
    return metric


def _control(study: StoredStudy, by: str | None) -> str:
    """Return the control parameter: the only varied number in addition to n."""
    points = study.points
    varied = [
        name
        for name in study.varied
        if name != NUMBER and points.groupby(NUMBER)[name].nunique().max() > 1
    ]
    numbers = [
        name
        for name in varied
        if pd.api.types.is_numeric_dtype(points[name])
        and not pd.api.types.is_bool_dtype(points[name])
    ]
    if by is not None and by not in numbers:
        raise ChoiceError(
            unknown("number that varies in addition to n", by, numbers), study.name
        )
    if not numbers:
        raise ChoiceError("varies no number in addition to n", study.name)
    if by is None and len(numbers) > 1:
        raise ChoiceError(
            "varies several numbers in addition to n; choose from:"
            f" {', '.join(numbers)}",
            study.name,
        )
    control = by or numbers[0]
    if points.duplicated([NUMBER, control]).any():
        more = ", ".join(name for name in varied if name != control)
        raise ChoiceError(
            f"has several points per n and {control}; choose with where: {more}",
            study.name,
        )
    return control


def _curves(
    study: StoredStudy,
    points: pd.DataFrame,
    control: str,
    samples: dict[str, Floats],
) -> tuple[tuple[SizeCurve, ...], str]:
    """Return the curve of each size, and the definition of its length."""
    trials = study.trials.drop_duplicates("point").set_index("point")
    area = trials.loc[points.index, SIDES].prod(axis=1)
    grows = bool((area.groupby(points[NUMBER]).first().diff().iloc[1:] > 0.0).all())
    curves = []
    for number, rows in points.groupby(NUMBER):
        if len(rows) < FEWEST_TRIALS:
            continue
        n = int(np.float64(number))  # type: ignore[arg-type]
        length = float(np.sqrt(area[rows.index[0]])) if grows else float(n)
        x = rows[control].to_numpy(np.float64)
        curves.append(SizeCurve(n, length, x, tuple(samples[p] for p in rows.index)))
    if len(curves) < 2:
        raise ChoiceError(
            "needs two sizes with two points of two done trials each", study.name
        )
    return tuple(curves), "side" if grows else NUMBER


def _states(
    study: StoredStudy,
    points: pd.DataFrame,
    control: str,
    samples: dict[str, Floats],
    counted: dict[str, Floats],
) -> pd.DataFrame:
    """Return `Scaling.states`, from complete series and the part that counts."""
    frames = np.unique(study.series["frame"])
    steps = int(frames[1] - frames[0]) if len(frames) > 1 else 1
    rows = []
    for point, series in counted.items():
        count = series.shape[1]
        enough = count >= FEWEST_FRAMES
        start = burn_in(samples[point]) if enough else BurnIn(0, True)
        tau = integrated_time(series).tau if enough else np.nan
        rows.append(
            {
                NUMBER: points.at[point, NUMBER],
                control: points.at[point, control],
                "trials": len(series),
                "frames": count,
                "tau": tau * steps,
                "burn_in": start.frames * steps
                if enough and start.end_found
                else np.nan,
                "endless": not start.end_found and len(series) < ENOUGH_SERIES,
                "drift_p": drift(series).p if enough else np.nan,
            }
        )
    table = pd.DataFrame(rows)
    table["drift_p"] = holm(table["drift_p"].to_numpy(np.float64))
    problems = {
        DRIFTS: table["drift_p"] < DRIFT_LEVEL,
        ENDLESS: table.pop("endless"),
        FEW: table["frames"] < FEWEST_FRAMES,
    }
    table["problems"] = [
        "; ".join(text for text, is_so in zip(problems, row, strict=True) if is_so)
        for row in zip(*problems.values(), strict=True)
    ]
    return table
