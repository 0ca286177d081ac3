"""Finite-size scaling of a stored study: what flocks of several sizes tell of a
transition, and whether their series can tell it.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis.coexistence import (
    BinderMinimum,
    TransitionOrder,
    TwoPeaks,
    binder_minimum,
    transition_order,
    two_peaks,
)
from sweep.analysis.collapse import Collapse, collapse
from sweep.analysis.estimate import CONFIDENCE
from sweep.analysis.order import order_samples
from sweep.analysis.series import (
    ENOUGH_SERIES,
    FEWEST_FRAMES,
    BurnIn,
    burn_in,
    drift,
    integrated_time,
)
from sweep.analysis.simultaneous import holm
from sweep.analysis.size_curves import (
    BinderCrossing,
    SizeCurve,
    SusceptibilityPeak,
    binder_crossings,
    susceptibility_peak,
)
from sweep.analysis.steady import DRIFT_LEVEL
from sweep.errors import ChoiceError
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

Floats = NDArray[np.float64]

NUMBER, SIDES = "n", ["width", "height"]
LENGTHS = {"side": "L = sqrt(width height)", "n": "L = n"}
"""What the length of a size is, in words."""
FEWEST_TRIALS = 2
CURVES = ("order", "susceptibility", "binder")
DRIFTS, ENDLESS, FEW = (
    "its mean drifts",
    "no end of a burn-in was found",
    f"fewer than {FEWEST_FRAMES} frames count",
)
"""What speaks against a steady state, or leaves it open. Of ten trials or more drift
alone tells whether there is no end of a burn-in.
"""


@dataclass(frozen=True, eq=False)
class Scaling:
    """What the sizes of a study tell, by the recorded series `metric` against the
    setting `control`.

    `curves` are those of the sizes, the smallest first; their length is the setting
    `length`: `side`, the root of width times height, or `n` where worlds do not grow.
    `burn_in` is in steps, None for the first half of each trial. `states` has a row for
    each point: n, the control, trials, frames and `tau` (both of the part that counts,
    tau in steps), `burn_in` (steps, as MSER-5 finds it in the whole series), `drift_p`
    (adjusted for all points) and `problems`, in words; fewer than 20 frames tell none.
    `left_out` counts trials that are not done or lack a value, and points of fewer than
    two trials.
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
        """A row for each point: n, length, the control, then order, susceptibility and
        binder, each with _low and _high, and what `states` has. The intervals are those
        of each point alone.
        """
        rows = []
        for one in self.curves:
            columns: dict[str, object] = {NUMBER: one.n, "length": one.length}
            columns[self.control] = one.x
            for name in CURVES:
                means = getattr(one, name)
                low, high = means.bounds(self.confidence)
                columns |= {name: means.value, f"{name}_low": low, f"{name}_high": high}
            rows.append(pd.DataFrame(columns))
        return pd.concat(rows).merge(self.states, on=[NUMBER, self.control])

    @cached_property
    def crossings(self) -> list[BinderCrossing]:
        """Where cumulants of neighbouring sizes cross."""
        return binder_crossings(self.curves, self.confidence)

    @cached_property
    def peaks(self) -> list[SusceptibilityPeak]:
        """Where the susceptibility of each size is largest."""
        return [susceptibility_peak(one, self.confidence) for one in self.curves]

    @cached_property
    def minima(self) -> list[BinderMinimum]:
        """The smallest cumulant of each size."""
        return [binder_minimum(one, self.confidence) for one in self.curves]

    @cached_property
    def two_peaks(self) -> list[TwoPeaks]:
        """Whether the order of each size has two peaks."""
        return [two_peaks(one, self.confidence) for one in self.curves]

    @cached_property
    def collapse(self) -> Collapse:
        """The exponents with which the curves collapse; it takes seconds."""
        return collapse(self.curves, self.confidence)

    @property
    def stationary(self) -> bool:
        """Whether nothing speaks against a steady state of any point."""
        return bool((self.states["problems"] == "").all())

    @cached_property
    def order(self) -> TransitionOrder:
        """Of which order the transition is, not decided where a series is not
        stationary.
        """
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
    """What flocks of several sizes tell of a transition.

    metric    the order parameter, a recorded series; by default the first
    by        the setting against which it is seen; by default the only number that
              varies beside n, and what changes with n
    burn_in   steps that do not count; by default the first half of each trial

    Raises ChoiceError for a study without several sizes, without series, where other
    settings vary too, and where fewer than two points of two sizes have two trials.
    """
    metric = _metric(study, metric)
    points = study.points
    if NUMBER not in points or points[NUMBER].nunique() < 2:
        raise ChoiceError(
            'has flocks of one size; "sizes" in its spec gives several', study.name
        )
    control = _control(study, by)
    whole = order_samples(study, metric)
    last = int(study.series["frame"].max())
    if burn_in is not None and not 0 <= burn_in < last:
        raise ChoiceError(
            f"burn-in: {burn_in:,} steps; allowed: 0 to {last - 1:,}", study.name
        )
    used = (
        {point: one[:, one.shape[1] // 2 :] for point, one in whole.items()}
        if burn_in is None
        else order_samples(study, metric, burn_in)
    )
    enough = {
        point for point, one in used.items() if len(one) >= FEWEST_TRIALS and one.size
    }
    points = points[points.index.isin(enough)].sort_values([NUMBER, control])
    curves, length = _curves(study, points, control, used)
    kept = {point: used[point] for point in points.index}
    table = _states(study, points, control, whole, kept)
    counted = sum(len(one) for one in kept.values())
    left_out = len(study.trials) - counted
    return Scaling(
        metric, control, length, burn_in, curves, table, left_out, confidence
    )


def _metric(study: StoredStudy, metric: str | None) -> str:
    recorded = study.series_metrics
    if not recorded:
        raise ChoiceError(
            "has recorded no series, of which an order parameter needs one; name it"
            ' under "record" in "series"',
            study.name,
        )
    if metric is None:
        return recorded[0]
    if metric not in recorded:
        raise ChoiceError(unknown("recorded series", metric, recorded), study.name)
    return metric


def _control(study: StoredStudy, by: str | None) -> str:
    """The setting against which the order is seen, alone beside n."""
    points = study.points
    others = [
        name
        for name in study.varied
        if name != NUMBER and points.groupby(NUMBER)[name].nunique().max() > 1
    ]
    numbers = [
        name
        for name in others
        if pd.api.types.is_numeric_dtype(points[name])
        and not pd.api.types.is_bool_dtype(points[name])
    ]
    if by is not None and by not in numbers:
        raise ChoiceError(
            unknown("number that varies beside n", by, numbers), study.name
        )
    if not numbers:
        raise ChoiceError("varies no number beside n", study.name)
    if by is None and len(numbers) > 1:
        raise ChoiceError(
            f"varies several numbers beside n, say by which: {', '.join(numbers)}",
            study.name,
        )
    control = by or numbers[0]
    if points.duplicated([NUMBER, control]).any():
        more = ", ".join(name for name in others if name != control)
        raise ChoiceError(
            f"has several points of one n and {control}; choose with where: {more}",
            study.name,
        )
    return control


def _curves(
    study: StoredStudy,
    points: pd.DataFrame,
    control: str,
    samples: dict[str, Floats],
) -> tuple[tuple[SizeCurve, ...], str]:
    """The curve of each size, and what its length is."""
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
            "has no two sizes with two points of two trials that are done", study.name
        )
    return tuple(curves), "side" if grows else NUMBER


def _states(
    study: StoredStudy,
    points: pd.DataFrame,
    control: str,
    whole: dict[str, Floats],
    used: dict[str, Floats],
) -> pd.DataFrame:
    """What the series of each point say of a steady state."""
    frames = np.unique(study.series["frame"])
    steps = int(frames[1] - frames[0]) if len(frames) > 1 else 1
    rows = []
    for point, samples in used.items():
        count = samples.shape[1]
        enough = count >= FEWEST_FRAMES
        start = burn_in(whole[point]) if enough else BurnIn(0, True)
        tau = integrated_time(samples).tau if enough else np.nan
        rows.append(
            {
                NUMBER: points.at[point, NUMBER],
                control: points.at[point, control],
                "trials": len(samples),
                "frames": count,
                "tau": tau * steps,
                "burn_in": start.frames * steps
                if enough and start.end_found
                else np.nan,
                "endless": not start.end_found and len(samples) < ENOUGH_SERIES,
                "drift_p": drift(samples).p if enough else np.nan,
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
