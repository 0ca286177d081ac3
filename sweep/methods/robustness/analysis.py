"""Whether the conclusions of a study hold with other numerics: a shorter time step,
another search for neighbours, another order of updates. `sweep validity STUDY`.

The conclusions are the signs of differences. Along each axis, and with all other axes
as they are, each point is compared with the first one, and so in each variant of the
study. All these differences are one family, whose intervals hold together.
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
from sweep.spec.recorded import Column, columns_of
from sweep.tables.choosing import as_names
from sweep.tables.stored_study import StoredStudy

SURVIVES, TURNS, OPEN, UNJUDGED = "survives", "turns", "not decided", "not judged"
OUTCOMES = (SURVIVES, TURNS, OPEN, UNJUDGED)
AS_IT_IS = "as it is"
HIGHER, LOWER = "higher", "lower"
ESTIMATED = ("difference", "low", "high", "p", "verdict")


class Bits(NamedTuple):
    """How many trials are stored of a study and of a variant with the same ids, and
    how many of them have the same bits in all metrics.
    """

    trials: int
    same: int

    @property
    def differ(self) -> bool:
        """Whether any trial has other bits."""
        return self.same < self.trials


@dataclass(frozen=True, eq=False)
class Validity:
    """What the variants of a study make of its conclusions.

    `variants` says by name what differs, in words; the study itself comes first, as
    AS_IT_IS. `rows` has a row for each conclusion and variant: metric and unit; the
    `axis`; the settings of the point; `against`, the point that it is compared with, in
    words; `variant`; `difference`, with `low` and `high`, which hold together; `p`,
    adjusted for all; the `verdict`, of the point: higher, lower or no difference shown;
    and the `outcome`, one of OUTCOMES. `bits` has by name the variants whose trials are
    to have the same bits, `missing` by name how many trials are not stored.
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
        """A row for each conclusion, with the outcome of all variants together: it
        turns where one turns it, and survives where all that judge it leave it.
        """
        keys = ["metric", "unit", "axis", *self.settings, "against"]
        others = self.rows[self.rows["variant"] != AS_IT_IS]
        per = len(self.variants)
        outcomes = others["outcome"].to_numpy().reshape(-1, per)
        base = self.rows[self.rows["variant"] == AS_IT_IS].reset_index(drop=True)
        found = base[keys].copy()
        found["outcome"] = [_together(set(row)) for row in outcomes]
        return found


def check_conclusions(
    study: StoredStudy,
    metrics: str | Sequence[str] = (),
    *,
    half: bool = False,
    confidence: float = CONFIDENCE,
) -> Validity:
    """The conclusions of a study whose spec has `validate`, with each of its variants.

    A conclusion survives in a variant where both differences are known to have the same
    sign, turns where they are known to have opposite ones, and is not decided where one
    of them is not known. All intervals of the study and of its variants hold together
    with `confidence` (Bonferroni): so the chance that any conclusion is said to survive
    or to turn which does not is at most 1 - `confidence`. `half` takes means over the
    last half of a trial. Metrics that measure what one step changes are not judged with
    another step. Raises ChoiceError for a study without `validate` and for unknown
    metrics, and StoreError where a variant is not stored, or was launched from another
    spec.
    """
    asked = study.about.sections.get("validate")
    if asked is None:
        raise ChoiceError('it has no variants; the spec has no "validate"', study.name)
    if not 0.5 <= confidence < 1.0:
        raise ChoiceError(
            f"confidence: {confidence:g}; allowed: from 0.5 to below 1, as 0.95"
        )
    names = as_names(metrics) or study.metrics
    for name in names:
        study.check_metric(name)
    words = {one["name"]: one["words"] for one in asked}
    others = {name: _variant(study, name, said) for name, said in words.items()}
    bits = {name: found for name, one in others.items() if (found := _bits(study, one))}
    pairs, columns = _pairs(study), [str(Column(name, half)) for name in names]
    judged = _judged(study, others, bits, columns, pairs, confidence)
    rows = _repeated(_rows(study, columns, pairs), len(others) + 1)
    rows = pd.concat([rows, judged], axis="columns")
    _enter_outcomes(rows, [one["unjudged"] for one in asked])
    missing = {one.name: one.missing for one in (study, *others.values())}
    settings = _axis_settings(study)
    return Validity(study, words, confidence, settings, rows, bits, missing)


def _variant(study: StoredStudy, name: str, words: str) -> StoredStudy:
    """A stored variant. Raises StoreError where there is none, or without trials."""
    try:
        found = StoredStudy(f"{study.name}/{name}", study.store.results)
    except StoreError as error:
        raise StoreError(
            f"it is not stored with {words}: {error.reason}; launch it again",
            study.name,
        ) from None
    if found.trials.empty:
        raise StoreError(
            f"no trial of it is stored with {words}; launch it again", study.name
        )
    return found


def _axis_settings(study: StoredStudy) -> list[str]:
    """The settings of the axes that differ between points, in the plan's order."""
    on_axes = {name for axis in study.axes.values() for name in axis.settings}
    return [name for name in study.about.varied if name in on_axes]


def _matched(study: StoredStudy, variant: StoredStudy) -> dict[str, str]:
    """By the id of each point that of the variant: they come in the same order. Raises
    StoreError where they do not belong together.
    """
    one, other = study.whole.points, variant.points
    kept = [
        name
        for name in _axis_settings(study)
        if not (study.settings[name].in_steps or study.settings[name].each_step)
    ]
    if len(one) != len(other) or not all(
        name in other and np.array_equal(one[name], other[name]) for name in kept
    ):
        raise StoreError(
            f"{variant.name} has other points: launch the study again, and with it its"
            " variants",
            study.name,
        )
    return dict(zip(map(str, one.index), map(str, other.index), strict=True))


class _Along(NamedTuple):
    """By the axis along which they lie, pairs of points (ids): the first one with the
    same other settings, and another.
    """

    axes: list[str]
    points: list[tuple[str, str]]


def _pairs(study: StoredStudy) -> _Along:
    """All pairs of a study. Raises ChoiceError where there is none."""
    axes, points, every = list[str](), list[tuple[str, str]](), _axis_settings(study)
    for name, axis in study.axes.items():
        others = [one for one in every if one not in axis.settings]
        groups: Any = (
            [group for _, group in study.points.groupby(others, sort=False)]
            if others
            else [study.points]
        )
        for first, *rest in (group.index for group in groups):
            points += [(str(first), str(point)) for point in rest]
            axes += [name] * len(rest)
    if not points:
        raise ChoiceError(
            "it has no two points that differ along one axis alone", study.name
        )
    return _Along(axes, points)


def _rows(study: StoredStudy, columns: Sequence[str], pairs: _Along) -> pd.DataFrame:
    """What each conclusion is of: metric by metric, a row a pair."""
    names = _axis_settings(study)
    at = study.points[names].loc[[point for _, point in pairs.points]]
    table = at.reset_index(drop=True)
    table.insert(0, "axis", pairs.axes)
    first = study.points[names]
    table["against"] = [
        ", ".join(f"{name} = {_brief(first.loc[one, name])}" for name in of.settings)
        for (one, _), of in zip(
            pairs.points, (study.axes[axis] for axis in pairs.axes), strict=True
        )
    ]
    whole = pd.concat([table] * len(columns), ignore_index=True)
    repeats = len(pairs.points)
    whole.insert(0, "metric", np.repeat(columns, repeats))
    units = [study.units.get(column, "") for column in columns]
    whole.insert(1, "unit", np.repeat(units, repeats))
    return whole


def _brief(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _repeated(rows: pd.DataFrame, times: int) -> pd.DataFrame:
    """Each row so many times in a row."""
    return rows.loc[rows.index.repeat(times)].reset_index(drop=True)


def _judged(
    study: StoredStudy,
    others: Mapping[str, StoredStudy],
    bits: Mapping[str, Bits],
    columns: Sequence[str],
    pairs: _Along,
    confidence: float,
) -> pd.DataFrame:
    """Of each conclusion the differences in the study and in its variants, which are
    one family. A variant with the same bits has the differences of the study, and is no
    further occasion to err.
    """
    itself = {point: point for pair in pairs.points for point in pair}
    found = {AS_IT_IS: [*_contrasts(study, itself, columns, pairs)]}
    for name, one in others.items():
        points = _matched(study, one)
        if name not in bits or bits[name].differ:
            found[name] = [*_contrasts(one, points, columns, pairs)]
    contrasts = [one for part in found.values() for one in part]
    table = judge(contrasts, Inference(confidence, "bonferroni"))[list(ESTIMATED)]
    each = len(columns) * len(pairs.points)
    first = {name: number * each for number, name in enumerate(found)}
    names = [AS_IT_IS, *others]
    order = [first.get(name, 0) + row for row in range(each) for name in names]
    table = table.iloc[order].reset_index(drop=True)
    table.insert(0, "variant", names * each)
    return table


def _contrasts(
    study: StoredStudy,
    points: Mapping[str, str],
    columns: Sequence[str],
    pairs: _Along,
) -> Iterator[Contrast]:
    """The differences in one study, column by column."""
    side = Side(study.name, study, study.trials, frozenset[str]())
    at: NDArray[np.object_] = np.array(
        [[points[one], points[other]] for one, other in pairs.points], object
    )
    sharing = bool(streams_in_common(side, side))
    places = places_of(side, side, at, sharing=sharing)
    for column in columns:
        yield from contrasts_of(side, side, column, places)


def _enter_outcomes(rows: pd.DataFrame, unjudged: Sequence[Sequence[str]]) -> None:
    """Enter the column `outcome`, "" for the study as it is. `unjudged` has of each
    variant the metrics that are of something else there.
    """
    per = len(unjudged) + 1
    verdicts = rows["verdict"].to_numpy().reshape(-1, per)
    metrics = rows["metric"].to_numpy().reshape(-1, per)[:, 0]
    outcomes = list[str]()
    for metric, (own, *others) in zip(metrics, verdicts, strict=True):
        name = Column.read(str(metric)).metric
        outcomes.append("")
        for verdict, left in zip(others, unjudged, strict=True):
            outcomes.append(UNJUDGED if name in left else outcome_of(own, verdict))
    rows["outcome"] = outcomes


def outcome_of(own: str, other: str) -> str:
    """What a variant makes of a conclusion, by both verdicts."""
    if not {own, other} <= {HIGHER, LOWER}:
        return OPEN
    return SURVIVES if own == other else TURNS


def _together(outcomes: set[str]) -> str:
    """The outcome of all variants."""
    judged = outcomes - {UNJUDGED}
    if TURNS in judged:
        return TURNS
    if not judged:
        return UNJUDGED
    return SURVIVES if judged == {SURVIVES} else OPEN


def _bits(study: StoredStudy, variant: StoredStudy) -> Bits | None:
    """How many trials have the same bits; None of a variant that has trials of its
    own.
    """
    columns = columns_of(study.metrics)
    kept = ["trial_id", *columns]
    both = study.trials[kept].merge(variant.trials[kept], on="trial_id")
    if both.empty:
        return None
    one, other = (
        both[[f"{name}_{side}" for name in columns]].to_numpy(np.float64)
        for side in "xy"
    )
    same = (one == other) | (np.isnan(one) & np.isnan(other))
    return Bits(len(both), int(same.all(axis=1).sum()))
