"""The conclusions of a study with different numerics.

Variants have a shorter time step, a different search for neighbours or a different
order of updates. `sweep validity STUDY` prints the result.

The conclusions are the signs of differences. Along each axis, with all other axes
unchanged, each point is compared with the first point, in the study and in each
variant. All differences are one family with simultaneous confidence intervals.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import CONFIDENCE, Contrast
from sweep.errors import ChoiceError, StoreError
from sweep.methods.comparison import (
    Inference,
    Side,
    contrasts_of,
    judge,
    places_of,
    streams_in_common,
)
from sweep.spec import Column, columns_of
from sweep.tables import StoredStudy, as_names

SURVIVES = "survives"
TURNS = "turns"
OPEN = "not decided"
UNJUDGED = "not judged"
OUTCOMES = (SURVIVES, TURNS, OPEN, UNJUDGED)
AS_IT_IS = "as it is"
HIGHER = "higher"
LOWER = "lower"
ESTIMATED = ("difference", "low", "high", "p", "verdict")


class Bits(NamedTuple):
    """Trials of a variant whose results should be identical to the study's.

    Attributes
    ----------
    trials : int
        Number of trials with equal ids in the study and in the variant.
    same : int
        Number of these trials with equal values of all metrics.
    """

    trials: int
    same: int

    @property
    def differ(self) -> bool:
        """True if any trial has different values."""
        return self.same < self.trials


@dataclass(frozen=True, eq=False)
class Validity:
    """The conclusions of a study in all its variants.

    Attributes
    ----------
    study : StoredStudy
    variants : mapping
        The difference from the study in words, by the name of the variant.
    confidence : float
        Simultaneous confidence of all intervals.
    settings : list of str
        Parameters of the axes that differ between points.
    rows : DataFrame
        One row per conclusion and variant; the study itself comes first, as AS_IT_IS.
        Columns: metric and unit; axis; the parameters of the point; against, the point
        that is subtracted, in words; variant; difference, with the bounds low and high
        of its simultaneous confidence interval; p, adjusted for all rows; verdict, of
        the point; outcome, an entry of OUTCOMES, "" for the study.
    bits : mapping
        `Bits` by name, of variants whose trials should be identical.
    missing : mapping
        Number of trials that are not stored, by the name of the study or variant.
    """

    study: StoredStudy
    variants: Mapping[str, str]
    confidence: float
    settings: list[str]
    rows: pd.DataFrame
    bits: Mapping[str, Bits]
    missing: Mapping[str, int]

    @property
    def conclusions(self) -> pd.DataFrame:
        """One row per conclusion, with the outcome of all variants together.

        A conclusion turns if any variant turns it. A conclusion survives if it survives
        in all variants that judge it.
        """
        keys = ["metric", "unit", "axis", *self.settings, "against"]
        in_variants = self.rows[self.rows["variant"] != AS_IT_IS]
        outcomes = in_variants["outcome"].to_numpy().reshape(-1, len(self.variants))
        base = self.rows[self.rows["variant"] == AS_IT_IS].reset_index(drop=True)
        table = base[keys].copy()
        table["outcome"] = [_together(set(row)) for row in outcomes]
        return table


def check_conclusions(
    study: StoredStudy,
    metrics: str | Sequence[str] = (),
    *,
    half: bool = False,
    confidence: float = CONFIDENCE,
) -> Validity:
    """Check each conclusion of a study, whose spec has `validate`, in each variant.

    A conclusion survives in a variant if the two differences are known to have equal
    signs. A conclusion turns if the signs are known to be opposite, and is not decided
    if a sign is not known. Metrics that measure the change in one step are not judged
    with a different time step.

    Parameters
    ----------
    study : StoredStudy
    metrics : str or sequence of str, optional
        By default all metrics of the study.
    half : bool, default False
        Compare means over the second half of each trial, not the last frame.
    confidence : float, default 0.95
        Simultaneous confidence of all intervals (Bonferroni), from 0.5 to below 1. The
        probability that any outcome "survives" or "turns" is wrong is at most 1 -
        `confidence`.

    Returns
    -------
    Validity

    Raises
    ------
    ChoiceError
        The spec has no `validate`, a metric is unknown, `confidence` is not allowed, or
        no two points differ along one axis alone.
    StoreError
        A variant is not stored, or a different spec has launched the variant.
    """
    recorded = study.about.sections.get("validate")
    if recorded is None:
        raise ChoiceError('no variants; the spec has no "validate"', study.name)
    if not 0.5 <= confidence < 1.0:
        raise ChoiceError(
            f"confidence: {confidence:g}; allowed: from 0.5 to below 1, such as 0.95"
        )
    chosen = as_names(metrics) or study.metrics
    for name in chosen:
        study.check_metric(name)
    descriptions = {record["name"]: record["words"] for record in recorded}
    variants = {
        name: _variant(study, name, text) for name, text in descriptions.items()
    }
    bits = {
        name: compared
        for name, variant in variants.items()
        if (compared := _bits(study, variant))
    }
    pairs = _pairs(study)
    columns = [str(Column(name, half)) for name in chosen]
    judged = _judged(study, variants, bits, columns, pairs=pairs, confidence=confidence)
    rows = _repeated(_rows(study, columns, pairs), len(variants) + 1)
    rows = pd.concat([rows, judged], axis="columns")
    _enter_outcomes(rows, [record["unjudged"] for record in recorded])
    missing = {stored.name: stored.missing for stored in (study, *variants.values())}
    return Validity(
        study=study,
        variants=descriptions,
        confidence=confidence,
        settings=_axis_settings(study),
        rows=rows,
        bits=bits,
        missing=missing,
    )


def _variant(study: StoredStudy, name: str, description: str) -> StoredStudy:
    """Return a stored variant. StoreError if not stored, or without trials."""
    try:
        variant = StoredStudy(f"{study.name}/{name}", study.store.results)
    except StoreError as error:
        raise StoreError(
            f"the variant with {description} is not stored: {error.reason};"
            " launch the study again",
            study.name,
        ) from None
    if variant.trials.empty:
        raise StoreError(
            f"no trial is stored with {description}; launch the study again", study.name
        )
    return variant


def _axis_settings(study: StoredStudy) -> list[str]:
    """Return the parameters of axes that differ between points, in the plan's order."""
    on_axes = {name for axis in study.axes.values() for name in axis.settings}
    return [name for name in study.about.varied if name in on_axes]


def _matched(study: StoredStudy, variant: StoredStudy) -> dict[str, str]:
    """Return the ids of the variant's points by the ids of the study's points.

    The two sets of points have an equal order. StoreError if the points do not match.
    """
    points = study.whole.points
    in_variant = variant.points
    unchanged = [
        name
        for name in _axis_settings(study)
        if not (study.settings[name].in_steps or study.settings[name].each_step)
    ]
    if len(points) != len(in_variant) or not all(
        name in in_variant and np.array_equal(points[name], in_variant[name])
        for name in unchanged
    ):
        raise StoreError(
            f"{variant.name} has different points: launch the study again to run all"
            " variants",
            study.name,
        )
    return dict(zip(map(str, points.index), map(str, in_variant.index), strict=True))


class _Along(NamedTuple):
    """Pairs of points along axes.

    Attributes
    ----------
    axes : list of str
        The axis of each pair.
    points : list of tuple of str
        Ids of two points that differ along this axis alone. The first id is of the
        first point along the axis.
    """

    axes: list[str]
    points: list[tuple[str, str]]


def _pairs(study: StoredStudy) -> _Along:
    """Return all pairs of a study. ChoiceError without a pair."""
    axes = list[str]()
    points = list[tuple[str, str]]()
    settings = _axis_settings(study)
    for name, axis in study.axes.items():
        fixed = [setting for setting in settings if setting not in axis.settings]
        groups: Any = (
            [group for _, group in study.points.groupby(fixed, sort=False)]
            if fixed
            else [study.points]
        )
        for first, *rest in (group.index for group in groups):
            points += [(str(first), str(point)) for point in rest]
            axes += [name] * len(rest)
    if not points:
        raise ChoiceError("no two points differ along one axis alone", study.name)
    return _Along(axes, points)


def _rows(study: StoredStudy, columns: Sequence[str], pairs: _Along) -> pd.DataFrame:
    """Return the subject of each conclusion: metric by metric, one row per pair."""
    settings = study.points[_axis_settings(study)]
    at = settings.loc[[point for _, point in pairs.points]]
    table = at.reset_index(drop=True)
    table.insert(0, "axis", pairs.axes)
    axes = [study.axes[name] for name in pairs.axes]
    table["against"] = [
        ", ".join(
            f"{name} = {_brief(settings.loc[first, name])}" for name in axis.settings
        )
        for (first, _), axis in zip(pairs.points, axes, strict=True)
    ]
    rows = pd.concat([table] * len(columns), ignore_index=True)
    repeats = len(pairs.points)
    rows.insert(0, "metric", np.repeat(columns, repeats))
    units = [study.units.get(column, "") for column in columns]
    rows.insert(1, "unit", np.repeat(units, repeats))
    return rows


def _brief(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _repeated(rows: pd.DataFrame, times: int) -> pd.DataFrame:
    """Return a table with each row repeated `times` times in a row."""
    return rows.loc[rows.index.repeat(times)].reset_index(drop=True)


def _judged(
    study: StoredStudy,
    variants: Mapping[str, StoredStudy],
    bits: Mapping[str, Bits],
    columns: Sequence[str],
    pairs: _Along,
    confidence: float,
) -> pd.DataFrame:
    """Return the differences of each conclusion in the study and in its variants.

    All differences are a family. An identical variant has the differences of the study,
    so the family does not become larger.
    """
    itself = {point: point for pair in pairs.points for point in pair}
    judged = {AS_IT_IS: [*_contrasts(study, itself, columns, pairs)]}
    for name, variant in variants.items():
        points = _matched(study, variant)
        if name not in bits or bits[name].differ:
            judged[name] = [*_contrasts(variant, points, columns, pairs)]
    family = [contrast for contrasts in judged.values() for contrast in contrasts]
    table = judge(family, Inference(confidence, "bonferroni"))[list(ESTIMATED)]
    conclusions = len(columns) * len(pairs.points)
    first = {name: number * conclusions for number, name in enumerate(judged)}
    versions = [AS_IT_IS, *variants]
    order = [
        first.get(name, 0) + row for row in range(conclusions) for name in versions
    ]
    table = table.iloc[order].reset_index(drop=True)
    table.insert(0, "variant", versions * conclusions)
    return table


def _contrasts(
    study: StoredStudy,
    points: Mapping[str, str],
    columns: Sequence[str],
    pairs: _Along,
) -> Iterator[Contrast]:
    """Yield the differences in one study, column by column."""
    side = Side(study.name, study, study.trials, frozenset[str]())
    at: NDArray[np.object_] = np.array(
        [[points[first], points[point]] for first, point in pairs.points], object
    )
    sharing = bool(streams_in_common(side, side))
    compared = places_of(side, side, at, sharing=sharing)
    for column in columns:
        yield from contrasts_of(side, side, column, compared)


def _enter_outcomes(rows: pd.DataFrame, unjudged: Sequence[Sequence[str]]) -> None:
    """Enter the column `outcome`, "" for the study itself.

    `unjudged` has, per variant, the metrics with a different meaning in the variant.
    """
    per_conclusion = len(unjudged) + 1
    verdicts = rows["verdict"].to_numpy().reshape(-1, per_conclusion)
    metrics = rows["metric"].to_numpy().reshape(-1, per_conclusion)[:, 0]
    outcomes = list[str]()
    for metric, (own, *of_variants) in zip(metrics, verdicts, strict=True):
        name = Column.read(str(metric)).metric
        outcomes.append("")
        for verdict, left in zip(of_variants, unjudged, strict=True):
            outcomes.append(UNJUDGED if name in left else outcome_of(own, verdict))
    rows["outcome"] = outcomes


def outcome_of(own: str, variant: str) -> str:
    """Return the outcome of the verdicts in the study and in a variant."""
    if not {own, variant} <= {HIGHER, LOWER}:
        return OPEN
    return SURVIVES if own == variant else TURNS


def _together(outcomes: set[str]) -> str:
    """Return the outcome of all variants together."""
    judged = outcomes - {UNJUDGED}
    if TURNS in judged:
        return TURNS
    if not judged:
        return UNJUDGED
    return SURVIVES if judged == {SURVIVES} else OPEN


def _bits(study: StoredStudy, variant: StoredStudy) -> Bits | None:
    """Return the number of identical trials of a variant.

    None for a variant that has no trial id in common with the study.
    """
    columns = columns_of(study.metrics)
    compared = ["trial_id", *columns]
    both = study.trials[compared].merge(variant.trials[compared], on="trial_id")
    if both.empty:
        return None
    # Suffixes of merge: x for the study, y for the variant.
    own, other = (
        both[[f"{name}_{suffix}" for name in columns]].to_numpy(np.float64)
        for suffix in "xy"
    )
    same = (own == other) | (np.isnan(own) & np.isnan(other))
    return Bits(len(both), int(same.all(axis=1).sum()))
