"""The points of a sampled axis as a stored study has them: means over replicates, and
what is noise in them.

Replicates are told apart by seed and replicate. Streams that are common to all points
make the trials of one replicate alike at all of them; what they add everywhere is no
effect of a setting and is taken off.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.errors import ChoiceError, StoreError
from sweep.spec.recorded import Column
from sweep.store.plan_about import AxisAbout
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

Floats = NDArray[np.float64]
Blocks = NDArray[np.intp]
"""Indices of blocks, (b, resamples): each column is one draw of the bootstrap."""

REPLICATE = ["seed", "replicate"]


@dataclass(frozen=True, eq=False)
class SampledAxis:
    """One sample of the settings of an axis, at one value `at` of each setting of the
    other axes.

    `settings` has a row for each of the P points. `means` (P,) are those over
    replicates, NaN where no trial has a value, and `residuals` (P, K) what the K
    replicates differ by from them, NaN where there is none. `rows` (B, size) says which
    points form the blocks, single ones where the axis has no blocks. Of the T `trials`,
    `without_value` have none.
    """

    at: dict[str, object]
    settings: pd.DataFrame
    means: Floats
    residuals: Floats
    rows: NDArray[np.intp]
    levels: int | None
    trials: int
    without_value: int

    @property
    def whole(self) -> NDArray[np.intp]:
        """The blocks (b, size) of which every point has a value."""
        return self.rows[np.isfinite(self.means[self.rows]).all(axis=1)]

    def counts(self) -> dict[str, int]:
        """What a table says of the sample: blocks used and left out, trials, and those
        without a value.
        """
        used = len(self.whole)
        return {
            "blocks": used,
            "blocks_left_out": len(self.rows) - used,
            "trials": self.trials,
            "trials_without_value": self.without_value,
        }

    def noise(self, one: NDArray[np.intp], other: NDArray[np.intp]) -> Floats:
        """The covariance of the replicate noise in the means of points `one` and
        `other`, (b,) each.

        It is estimated from the replicates that both have, and NaN where these are
        fewer than two. A point with itself gives the variance of its mean, s^2 / n.
        """
        first, second = self.residuals[one], self.residuals[other]
        both = np.isfinite(first) & np.isfinite(second)
        products = np.where(both, first * second, 0.0).sum(axis=1)
        shared = both.sum(axis=1)
        counts = np.isfinite(first).sum(axis=1) * np.isfinite(second).sum(axis=1)
        enough = shared > 1
        return np.where(
            enough,
            products * shared / np.where(enough, counts * (shared - 1), 1),
            np.nan,
        )


class Analysis(NamedTuple):
    """What is asked of a sample: numbers with these `names` for each of `rows`, whose
    first columns these are.

    `estimate` gives them for each choice of blocks, (names, rows, resamples).
    """

    rows: list[dict[str, object]]
    names: tuple[str, ...]
    estimate: Callable[[Blocks], Floats]


def sampled_axis(
    study: StoredStudy, axis: str | None, samplers: tuple[str, ...]
) -> str:
    """The axis of `study` that one of `samplers` drew: the one named, or the only one
    there is. Raises ChoiceError.
    """
    axes, designs = study.axes, study.about.designs
    if designs:
        raise ChoiceError(
            f"its points are those of {len(designs)} designs: a sample is analysed in a"
            " study of its own",
            study.name,
            "sensitivity",
        )
    kinds = " or ".join(samplers)
    having = [name for name in axes if axes[name].sampler in samplers]
    if axis is not None and axis not in having:
        raise ChoiceError(
            unknown(f"axis with sample {kinds}", axis, having), study.name
        )
    if not having:
        raise ChoiceError(f"no axis has sample {kinds}", study.name)
    if axis is None and len(having) > 1:
        raise ChoiceError(
            f"several axes are sampled, say which: {', '.join(having)}", study.name
        )
    chosen = axis or having[0]
    within = (study.whole.chooser.names(one) for one in study.conditions)
    named = (*study.chosen, *chain.from_iterable(within))
    if fixed := [name for name in named if name in axes[chosen].settings]:
        raise ChoiceError(
            f"with where {fixed[0]}, which {chosen} samples; allowed: others",
            study.name,
            "sensitivity",
        )
    return chosen


def samples(study: StoredStudy, metric: str, axis: str) -> Iterator[SampledAxis]:
    """The samples of `axis`, one for every combination of the other axes. Raises
    ChoiceError for an unknown metric.
    """
    study.check_metric(Column.read(metric).metric)
    axes = study.axes
    others = [
        setting for name in axes if name != axis for setting in axes[name].settings
    ]
    done = study.trials[study.trials["status"] == "done"].set_index("trial_id")[metric]
    plan = study.plan.to_pandas()
    plan["value"] = (
        plan["trial_id"]
        .map(done)
        .astype(np.float64)
        .where(lambda value: np.isfinite(value))
    )
    for key, part in plan.groupby(others, sort=False) if others else [((), plan)]:
        yield _sample(part, axes[axis], dict(zip(others, key, strict=True)))


def _sample(part: pd.DataFrame, about: AxisAbout, at: dict[str, object]) -> SampledAxis:
    settings = part.drop_duplicates("point").set_index("point")[about.settings]
    table = part.pivot(index="point", columns=REPLICATE, values="value").loc[
        settings.index
    ]
    means, residuals = _split(table.to_numpy(np.float64))
    rows = (
        np.arange(len(settings))
        if about.rows is None
        else np.array(about.rows, np.intp)
    )
    if len(rows) % about.size or rows.max(initial=-1) >= len(settings):
        raise StoreError(
            f"the plan does not have the {len(settings):,} points in whole blocks;"
            " launch it again"
        )
    return SampledAxis(
        at=at,
        settings=settings.reset_index(drop=True),
        means=means,
        residuals=residuals,
        rows=rows.reshape(-1, about.size),
        levels=about.levels,
        trials=len(part),
        without_value=int(part["value"].isna().sum()),
    )


def _split(values: Floats) -> tuple[Floats, Floats]:
    """Means (P,) and residuals (P, K) of values (P, K) after the mean effect of each
    replicate is taken off.
    """
    alike = known_means(values - known_means(values, 1)[:, None], 0)
    adjusted = values - np.where(np.isfinite(alike), alike, 0.0)
    means = known_means(adjusted, 1)
    return means, adjusted - means[:, None]


def numbers(column: "pd.Series[float]", *, texts: bool) -> Floats:
    """A setting as numbers: for `texts` any that tell them apart, else NaN."""
    if pd.api.types.is_numeric_dtype(column):
        return np.asarray(column, np.float64)
    codes: Floats = pd.factorize(column)[0].astype(np.float64)
    return codes if texts else np.full_like(codes, np.nan)


def known_means(values: Floats, dimension: int) -> Floats:
    """Means along a dimension of what is not NaN; NaN where nothing is."""
    known = np.isfinite(values)
    count = known.sum(axis=dimension)
    total = np.where(known, values, 0.0).sum(axis=dimension)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
