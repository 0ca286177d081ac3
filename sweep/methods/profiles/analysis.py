"""Means of profiles over trials, with confidence intervals for the whole curve."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import (
    CONFIDENCE,
    FEWEST_REPLICATES,
    Interval,
    independent_contrast,
    max_t,
    mean_estimate,
    mean_interval,
    simultaneous_confidence,
)
from sweep.errors import ChoiceError
from sweep.methods.comparison import Side
from sweep.spec import spelled
from sweep.store import AT
from sweep.tables import StoredStudy, brief
from sweep.text import unknown

Floats = NDArray[np.float64]
FEWEST_POSITIONS = 3
"""Fewest positive values of a profile from which an exponent follows."""
SIZE = ("n", "width", "height")
"""Parameters that `sizes` of a spec varies together."""


@dataclass(frozen=True, eq=False)
class MeanProfile:
    """Mean of a profile over the trials of a point.

    Attributes
    ----------
    name : str
    text : str
        Description of the profile.
    axis : str
        Quantity along the axis, such as "distance".
    unit, axis_unit : str
        Units of the values and of the positions, "" for none.
    point : str
        Id of the point.
    settings : dict
        Values of the parameters that vary.
    at : array of float, shape (K,)
        Positions along the axis.
    individuals : tuple of str
        Names of the K individuals of a recording; () for another axis.
    values : array of float, shape (trials, K)
        NaN where a trial has no value.
    value, low, high : array of float, shape (K,)
        Means with simultaneous 95 % confidence intervals; NaN if unknown.
    exponent, zero : Interval or None
        Mean over trials of the exponent, and of the first position with the value 0.
        None for a profile without. If some trials have no zero, the zero is that of the
        mean profile, without an interval.
    zeros : array of float, shape (trials,)
        First position with the value 0 in each trial, in `axis_unit`; NaN for none.
    """

    name: str
    text: str
    axis: str
    unit: str
    axis_unit: str
    point: str
    settings: dict[str, Any]
    at: Floats
    individuals: tuple[str, ...]
    values: Floats
    value: Floats
    low: Floats
    high: Floats
    exponent: Interval | None
    zero: Interval | None
    zeros: Floats

    @property
    def positions(self) -> list[str]:
        """Positions in words: names of individuals, or numbers."""
        return list(self.individuals) or [brief(float(at)) for at in self.at]


@dataclass(frozen=True, eq=False)
class SizeExponent:
    """Growth of the zero of a profile with the side of the world, as a power law.

    Attributes
    ----------
    name, axis : str
        The profile, and the quantity along its axis.
    settings : dict
        Values of the parameters that vary, except the size.
    sides : list of float
        Sides of the worlds, the smallest first; the roots of the areas, in the model's
        unit of length.
    exponent : Interval
        Slope of the logarithm of the zero over the logarithm of the side; NaN if a
        trial has no zero.
    """

    name: str
    axis: str
    settings: dict[str, Any]
    sides: list[float]
    exponent: Interval


@dataclass(frozen=True, eq=False)
class ProfileDifference:
    """Difference of the mean profiles of two sides, B - A.

    Attributes
    ----------
    a, b : MeanProfile
    value, low, high : array of float, shape (K,)
        Differences with simultaneous 95 % confidence intervals (Welch, Bonferroni).
    """

    a: MeanProfile
    b: MeanProfile
    value: Floats
    low: Floats
    high: Floats

    @property
    def apart(self) -> NDArray[np.bool_]:
        """Positions at which the confidence interval excludes 0, (K,)."""
        return (self.low > 0.0) | (self.high < 0.0)


def mean_profiles(
    study: StoredStudy,
    names: Sequence[str] = (),
    *,
    start: float | None = None,
    stop: float | None = None,
) -> list[MeanProfile]:
    """Return the mean of each profile at each point.

    Parameters
    ----------
    study : StoredStudy
    names : sequence of str
        Names of profiles; by default all recorded profiles.
    start, stop : float, optional
        Least and largest position of exponents and zeros.

    Returns
    -------
    list of MeanProfile
        Profile by profile; the points in the order of the study.

    Raises
    ------
    ChoiceError
        If no profile is stored, or a name is not recorded.
    """
    chosen = chosen_profiles(study, names)
    if start is not None and stop is not None and start > stop:
        raise ChoiceError(f"start {start:g} is above stop {stop:g}", study.name)
    trials = study.trials.set_index("trial_id")
    return [
        _mean_profile(
            study,
            name,
            trials.loc[part["trial_id"]],
            part,
            extent=(start, stop),
        )
        for name in chosen
        for _, part in rows_by_point(study, name)
    ]


def chosen_profiles(study: StoredStudy, profiles: Sequence[str] = ()) -> list[str]:
    """Return the named profiles of a study, or all.

    Raises ChoiceError if no profile is stored, or a name is not recorded.
    """
    stored = study.profiles
    recorded = recorded_profiles(stored)
    if stored.empty:
        raise ChoiceError(
            "stores no profiles of trials that are done; `record: {profiles: [...]}` in"
            " the spec records profiles, which `sweep metrics` lists",
            study.name,
        )
    for name in profiles:
        if name not in recorded:
            raise ChoiceError(unknown("profile", name, recorded), study.name)
    return list(profiles) or recorded


def profile_units(study: StoredStudy, name: str) -> tuple[str, str]:
    """Return the units of the values and of the positions of a profile."""
    profile = study.known.profiles[name]
    model = study.known.models[study.provenance["model"]]
    return spelled(profile.unit, model), spelled(profile.axis_unit, model)


def rows_by_point(study: StoredStudy, name: str) -> list[tuple[str, pd.DataFrame]]:
    """Return the rows of the trials that have a profile, by point.

    Stored trials of an earlier spec may lack a profile.
    """
    points = study.trials.set_index("trial_id")["point"]
    stored = study.profiles
    measured = stored[stored[name].notna() & stored["trial_id"].isin(points.index)]
    behind = points.loc[measured["trial_id"]].to_numpy()
    return [(str(point), rows) for point, rows in measured.groupby(behind, sort=False)]


def size_exponents(
    study: StoredStudy, profiles: Iterable[MeanProfile]
) -> list[SizeExponent]:
    """Return the growth of zeros with the side of the world.

    Each profile with a zero has one exponent per combination of the other parameters.
    The worlds need different sides.
    """
    trials = study.trials.drop_duplicates("point").set_index("point")
    sides = np.sqrt(trials["width"] * trials["height"])
    groups = defaultdict[tuple[Any, ...], dict[float, list[Floats]]](
        lambda: defaultdict(list)
    )
    axes = {}
    for profile in profiles:
        if profile.zero is not None:
            settings = profile.settings.items()
            parameters = [(key, value) for key, value in settings if key not in SIZE]
            side = float(sides[profile.point])
            groups[profile.name, *parameters][side].append(profile.zeros)
            axes[profile.name] = profile.axis
    return [
        SizeExponent(
            name,
            axes[name],
            dict(parameters),
            sorted(by_side),
            exponent=_slope({side: zeros for side, (zeros,) in by_side.items()}),
        )
        for (name, *parameters), by_side in groups.items()
        if len(by_side) > 1 and all(len(points) == 1 for points in by_side.values())
    ]


def _slope(zeros: Mapping[float, Floats]) -> Interval:
    """Return the slope of mean logarithms of zeros by side over those of the sides.

    The slope is a sum of independent means with known weights. So the confidence
    interval is Student's with Welch's degrees of freedom. If some trials have no zero,
    the slope is NaN, because the other trials are a selection.
    """
    number = sum(int(np.isfinite(sample).sum()) for sample in zeros.values())
    if number < sum(map(len, zeros.values())):
        return Interval(np.nan, np.nan, np.nan, number)
    x = np.log(list(zeros))
    x -= x.mean()
    weights = x / np.sum(x**2)
    *negative, last = (
        weight * np.log(sample)
        for weight, sample in zip(weights, zeros.values(), strict=True)
    )
    # An estimate is the last mean minus all other means.
    estimate = mean_estimate(*(-sample for sample in negative), last)
    return Interval(estimate.value, *estimate.interval(), number)


def with_unit(label: str, unit: str) -> str:
    """Return words with a unit in brackets; a quantity without a unit has none."""
    return f"{label} ({unit.replace('^2', '²')})" if unit else label


def _individuals(study: StoredStudy, axis: str) -> tuple[str, ...]:
    """Return the names of all individuals of a recording; () for another axis."""
    events = study.known.models[study.provenance["model"]].events
    if axis != "individual":
        return ()
    return tuple(dict.fromkeys(name for event in events for name in event.individuals))


def _named_positions(
    study: StoredStudy, replicates: Iterable[int], individuals: Sequence[str]
) -> list[Floats]:
    """Return, for each trial, the places of its individuals among all individuals."""
    events = study.known.models[study.provenance["model"]].events
    places = {name: float(place) for place, name in enumerate(individuals)}
    return [
        np.array([places[name] for name in events[replicate].individuals])
        for replicate in replicates
    ]


def recorded_profiles(stored: pd.DataFrame) -> list[str]:
    """Return the names of the profiles in a table of profiles."""
    return [str(name) for name in stored if f"{name}{AT}" in stored]


def _mean_profile(
    study: StoredStudy,
    name: str,
    trials: pd.DataFrame,
    rows: pd.DataFrame,
    extent: tuple[float | None, float | None],
) -> MeanProfile:
    profile = study.known.profiles[name]
    unit, axis_unit = profile_units(study, name)
    trial = trials.iloc[0]
    individuals = _individuals(study, profile.axis)
    own_at = rows[f"{name}{AT}"].tolist()
    if individuals:
        own_at = _named_positions(study, trials["replicate"], individuals)
    # The events of a recording differ in their individuals.
    at = np.unique(np.concatenate(own_at))
    values = np.full((len(rows), len(at)), np.nan)
    own = zip(own_at, rows[name], strict=True)
    for row, (positions, measured) in zip(values, own, strict=True):
        row[np.searchsorted(at, positions)] = measured
    if profile.axis == "individual":  # others are not of the measured kind
        is_measured = np.isfinite(values).any(axis=0)
        is_measured |= not is_measured.any()
        at = at[is_measured]
        values = values[:, is_measured]
    value, low, high = _band(values, (profile.low, profile.high))
    inside = np.ones(len(at), np.bool_)
    start, stop = extent
    if start is not None:
        inside &= at >= start
    if stop is not None:
        inside &= at <= stop
    used = values[:, inside]
    exponent = None
    if profile.exponent:
        slopes = [_exponent(at[inside], row, profile.exponent) for row in used]
        exponent = mean_interval(slopes)
    zero = None
    zeros = np.full(len(used), np.nan)
    if profile.zero:
        zeros = np.array([_zero(at[inside], row) for row in used])
        zero = mean_interval(zeros)
        if not np.isfinite(zeros).all():  # those that have a zero are a selection
            of_mean = _zero(at[inside], value[inside])
            zero = Interval(of_mean, np.nan, np.nan, int(np.isfinite(zeros).sum()))
    return MeanProfile(
        name,
        profile.text,
        profile.axis,
        unit=unit,
        axis_unit=axis_unit,
        point=str(trial["point"]),
        settings={str(setting): trial[setting] for setting in study.varied},
        at=at,
        individuals=tuple(individuals[int(place)] for place in at if individuals),
        values=values,
        value=value,
        low=low,
        high=high,
        exponent=exponent,
        zero=zero,
        zeros=zeros,
    )


def _band(
    values: Floats, possible: tuple[float, float]
) -> tuple[Floats, Floats, Floats]:
    """Return means (K,) with simultaneous confidence intervals.

    No interval extends beyond the `possible` values. The intervals are those of `max_t`
    for ten trials or more that all have values at the same positions. Otherwise each
    interval is Student's, with Bonferroni's correction.
    """
    measured = np.isfinite(values).any(axis=0)
    complete = np.isfinite(values[:, measured]).all()
    together = len(values) >= FEWEST_REPLICATES and measured.any()
    corrected = simultaneous_confidence(values.shape[1], CONFIDENCE)
    columns = [mean_interval(column, corrected) for column in values.T]
    value, low, high = (
        np.array([getattr(column, field) for column in columns])
        for field in ("value", "low", "high")
    )
    if together and complete:
        band = max_t(values[:, measured])
        finite = np.isfinite(band.low)
        places = np.flatnonzero(measured)[finite]
        low[places] = band.low[finite]
        high[places] = band.high[finite]
    return value, np.maximum(low, possible[0]), np.minimum(high, possible[1])


def _exponent(at: Floats, values: Floats, factor: float) -> float:
    """Return the slope of the logarithms times a factor; NaN for too few values."""
    positive = values > 0.0
    if np.count_nonzero(positive) < FEWEST_POSITIONS:
        return np.nan
    logarithms = np.log(values[positive])
    from_mean = np.log(at[positive])
    from_mean -= from_mean.mean()
    slope = np.sum(from_mean * logarithms) / np.sum(from_mean**2)
    return float(factor * slope)


def _zero(at: Floats, values: Floats) -> float:
    """Return the first position at which linear interpolation gives 0; NaN for none."""
    finite = np.isfinite(values)
    position = at[finite]
    value = values[finite]
    below = np.flatnonzero(value <= 0.0)
    if not below.size or below[0] == 0:
        return np.nan
    last = int(below[0])
    share = value[last - 1] / (value[last - 1] - value[last])
    return float(position[last - 1] + share * (position[last] - position[last - 1]))


def common_profiles(a: Side, b: Side) -> list[str]:
    """Return the profiles that two sides have. Raises ChoiceError if there is none."""
    theirs = recorded_profiles(b.study.profiles)
    common = [name for name in recorded_profiles(a.study.profiles) if name in theirs]
    if not common:
        raise ChoiceError(f"shares no profile with {a.study.name}", b.study.name)
    return common


def comparable(a: Side, b: Side) -> tuple[list[ProfileDifference], list[str]]:
    """Return the differences of all common profiles, and reasons for those left out.

    Raises ChoiceError if no profile can be compared.
    """
    differences = []
    reasons = []
    for name in common_profiles(a, b):
        try:
            differences.append(profile_difference(a, b, name))
        except ChoiceError as error:
            reasons.append(error.reason)
    if not differences:
        raise ChoiceError("; ".join(reasons), b.study.name)
    return differences, reasons


def profile_difference(a: Side, b: Side, name: str) -> ProfileDifference:
    """Return the difference of a profile between two sides, B - A.

    Parameters
    ----------
    a, b : Side
        Sides with one point each.
    name : str
        Name of the profile.

    Returns
    -------
    ProfileDifference

    Raises
    ------
    ChoiceError
        If a side has several points, or the axes or units of the sides differ.
    """
    if a.study.known.profiles[name].axis == "individual":
        message = f"{name}: individuals of A are not those of B"
        raise ChoiceError(message, b.study.name)
    first, second = (_of_side(side, name) for side in (a, b))
    for mine, theirs in (
        (first.unit, second.unit),
        (first.axis_unit, second.axis_unit),
    ):
        if mine != theirs:
            message = f"{name} is in {mine or 'no unit'} in A, in {theirs} in B"
            raise ChoiceError(message, b.study.name)
    if first.at.shape != second.at.shape or not np.allclose(first.at, second.at):
        raise ChoiceError(
            f"{name} has other positions in A than in B: record both with equal `to`,"
            " `bins` and time between frames; boxes and waves also need equal worlds",
            b.study.name,
        )
    corrected = simultaneous_confidence(len(first.at), CONFIDENCE)
    rows = []
    for mine, theirs in zip(first.values.T, second.values.T, strict=True):
        samples = [side[np.isfinite(side)] for side in (mine, theirs)]
        if min(map(len, samples)) < 2:
            rows.append((np.nan, np.nan, np.nan))
            continue
        contrast = independent_contrast(*samples)
        rows.append((contrast.value, *contrast.estimate.interval(corrected)))
    value, low, high = np.array(rows).T
    return ProfileDifference(first, second, value=value, low=low, high=high)


def _of_side(side: Side, name: str) -> MeanProfile:
    points = set(side.trials["point"])
    if len(points) > 1:
        raise ChoiceError(
            f"has {len(points):,} points; choose one, for example"
            f" {side.study.name}:{side.study.chooser.example}",
            side.study.name,
        )
    means = profiles_of_side(side, [name])
    if not means:
        raise ChoiceError(f"no trial of {side.text} has {name}", side.study.name)
    return means[0]


def profiles_of_side(
    side: Side, names: Sequence[str] = (), **extent: float | None
) -> list[MeanProfile]:
    """Return `mean_profiles` of the points of a side."""
    points = set(side.trials["point"])
    return [
        profile
        for profile in mean_profiles(side.study, names, **extent)
        if profile.point in points
    ]
