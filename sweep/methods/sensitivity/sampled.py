"""Points of a sampled axis of a stored study: means over replicates, and their noise.

Seed and replicate number identify a replicate. Streams that are common to all points
change the trials of a replicate equally at all points. This common change is no effect
of a parameter and is subtracted.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.errors import ChoiceError, StoreError
from sweep.spec import Column
from sweep.store import AxisAbout
from sweep.tables import StoredStudy
from sweep.text import unknown

Floats = NDArray[np.float64]
Blocks = NDArray[np.intp]
"""Indices of blocks, (b, resamples): each column is one draw of the bootstrap."""

REPLICATE = ["seed", "replicate"]


@dataclass(frozen=True, eq=False)
class SampledAxis:
    """One sample of the parameters of an axis, at one value of each other axis.

    Attributes
    ----------
    at : dict
        Values of the parameters of the other axes.
    settings : DataFrame
        Values of the parameters of the axis, one row for each of the P points.
    means : array
        Means over replicates, (P,). NaN if no trial has a value.
    residuals : array
        Differences of the K replicates from the means, (P, K). NaN for no value.
    rows : array of int
        Points of each block, (B, size); single points if the axis has no blocks.
    levels : int or None
        Number of levels of a `morris` sample.
    trials : int
    without_value : int
        Number of trials without a value.
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
    def complete(self) -> NDArray[np.intp]:
        """The blocks (b, size) in which all points have a value."""
        return self.rows[np.isfinite(self.means[self.rows]).all(axis=1)]

    def counts(self) -> dict[str, int]:
        """Return the last columns of a table of the sample.

        The columns are the numbers of used blocks, of blocks left out, of trials, and
        of trials without a value.
        """
        used = len(self.complete)
        return {
            "blocks": used,
            "blocks_left_out": len(self.rows) - used,
            "trials": self.trials,
            "trials_without_value": self.without_value,
        }

    def noise(self, points: NDArray[np.intp], partners: NDArray[np.intp]) -> Floats:
        """Return the covariance of the replicate noise in the means of two points.

        The estimate uses the replicates that the two points have in common. A point
        with itself gives the variance of its mean, s^2 / n.

        Parameters
        ----------
        points, partners : array of int
            Indices of the first and of the second points, (b,) each.

        Returns
        -------
        array
            Covariances, (b,). NaN for fewer than two common replicates.
        """
        first = self.residuals[points]
        second = self.residuals[partners]
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
    """The estimates of an analysis of a sample.

    A table has the first columns `rows`, and an estimate for each of `names`.
    `estimate` returns the estimates for each choice of blocks, (names, rows,
    resamples).
    """

    rows: list[dict[str, object]]
    names: tuple[str, ...]
    estimate: Callable[[Blocks], Floats]


def sampled_axis(
    study: StoredStudy, axis: str | None, samplers: tuple[str, ...]
) -> str:
    """Return the axis of a study whose sampler is in `samplers`.

    Parameters
    ----------
    study : StoredStudy
    axis : str or None
        Name of the axis; None if only one axis qualifies.
    samplers : tuple of str
        Names of samplers.

    Returns
    -------
    str

    Raises
    ------
    ChoiceError
        The study joins several designs; no axis has a suitable sample or is named
        `axis`; several axes have a suitable sample and `axis` is None; or `where`
        chooses among the values of the sampled parameters.
    """
    axes = study.axes
    designs = study.about.designs
    if designs:
        raise ChoiceError(
            f"the study joins {len(designs)} designs: analyse the sample in a separate"
            " study",
            study.name,
            "sensitivity",
        )
    if study.asked is not None:
        raise ChoiceError(
            "trials were requested during the run, so the points are no sample",
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
            f"several axes are sampled; choose from: {', '.join(having)}", study.name
        )
    chosen = axis or having[0]
    within = (study.whole.chooser.names(condition) for condition in study.conditions)
    named = (*study.chosen, *chain.from_iterable(within))
    if fixed := [name for name in named if name in axes[chosen].settings]:
        raise ChoiceError(
            f"where uses {fixed[0]}, which {chosen} samples; allowed: parameters of"
            " other axes",
            study.name,
            "sensitivity",
        )
    return chosen


def samples(study: StoredStudy, metric: str, axis: str) -> Iterator[SampledAxis]:
    """Yield the samples of an axis, one for every combination of the other axes.

    Parameters
    ----------
    study : StoredStudy
    metric : str
        Name of a column, such as "speed" or "speed_mean".
    axis : str
        Name of a sampled axis.

    Yields
    ------
    SampledAxis

    Raises
    ------
    ChoiceError
        The metric is unknown.
    StoreError
        The plan lacks points of a block.
    """
    study.check_metric(Column.read(metric).metric)
    axes = study.axes
    grouping = [
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
    for key, part in plan.groupby(grouping, sort=False) if grouping else [((), plan)]:
        yield _sample(part, axes[axis], dict(zip(grouping, key, strict=True)))


def _sample(part: pd.DataFrame, axis: AxisAbout, at: dict[str, object]) -> SampledAxis:
    settings = part.drop_duplicates("point").set_index("point")[axis.settings]
    table = part.pivot(index="point", columns=REPLICATE, values="value").loc[
        settings.index
    ]
    means, residuals = _split(table.to_numpy(np.float64))
    rows = (
        np.arange(len(settings)) if axis.rows is None else np.array(axis.rows, np.intp)
    )
    if len(rows) % axis.size or rows.max(initial=-1) >= len(settings):
        raise StoreError(
            f"the plan does not have the {len(settings):,} points in whole blocks;"
            " launch the study again"
        )
    return SampledAxis(
        at=at,
        settings=settings.reset_index(drop=True),
        means=means,
        residuals=residuals,
        rows=rows.reshape(-1, axis.size),
        levels=axis.levels,
        trials=len(part),
        without_value=int(part["value"].isna().sum()),
    )


def _split(values: Floats) -> tuple[Floats, Floats]:
    """Return means (P,) and residuals (P, K) of values (P, K).

    The mean effect of each replicate is subtracted first.
    """
    alike = known_means(values - known_means(values, 1)[:, None], 0)
    adjusted = values - np.where(np.isfinite(alike), alike, 0.0)
    means = known_means(adjusted, 1)
    return means, adjusted - means[:, None]


def numbers(column: "pd.Series[float]", *, texts: bool) -> Floats:
    """Return a parameter as numbers.

    Strings become NaN, or with `texts` numbers that differ if the strings differ.
    """
    if pd.api.types.is_numeric_dtype(column):
        return np.asarray(column, np.float64)
    codes: Floats = pd.factorize(column)[0].astype(np.float64)
    return codes if texts else np.full_like(codes, np.nan)


def known_means(values: Floats, dimension: int) -> Floats:
    """Return means of finite values along a dimension; NaN without finite values."""
    finite = np.isfinite(values)
    count = finite.sum(axis=dimension)
    total = np.where(finite, values, 0.0).sum(axis=dimension)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
