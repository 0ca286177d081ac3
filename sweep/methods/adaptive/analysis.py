"""Settled points: points with all trials that the rule of the study requires."""

from collections import Counter

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import undefined_shares
from sweep.errors import ChoiceError
from sweep.methods.adaptive.rule import SeenMetric, Until, from_json, look
from sweep.methods.adaptive.section import KEY as SECTION_KEY
from sweep.tables import StoredStudy

KEY = SECTION_KEY.name
NOT_YET = "not yet"
MOST = "max"
FEW = "too few values"
NARROW = "half width"
REASONS = (NOT_YET, MOST, FEW, NARROW)
"""Reasons for no further trials: the first reason that holds for one of the metrics."""


def rule_of(study: StoredStudy) -> Until:
    """Return the rule that adds trials.

    Raises ChoiceError for a study with a fixed number of trials.
    """
    if not has_rule(study):
        raise ChoiceError(
            f'the number of trials is fixed; "replicates" has no "{KEY}"', study.name
        )
    return from_json(study.about.sections[KEY])


def stopping(study: StoredStudy) -> pd.DataFrame:
    """Return the last look at each point of a study, and the reason for the end.

    Parameters
    ----------
    study : StoredStudy
        A stored study with a rule under `replicates`.

    Returns
    -------
    DataFrame
        One row per point and metric of the rule, in the order of the plan. Columns:

        - point
        - metric
        - n, the number of trials of the point at the last look
        - values, the number of these trials that have a value
        - undefined, the fraction of the done trials without a value
        - half_width of the repeated confidence interval, in the unit of the metric
        - allowed, the largest half-width that the rule allows, in the unit of the
          metric
        - reached, True if the confidence interval is narrow enough and final
        - why no trials follow, one of `REASONS`

    Raises
    ------
    ChoiceError
        If the study has a fixed number of trials.
    """
    rule = rule_of(study)
    metrics = list(rule.widths)
    stored = study.trials.set_index("trial_id")[metrics]
    ids = study.plan["trial_id"].to_pandas()
    point = study.plan["point"].to_pandas()
    missing = (~ids.isin(stored.index)).groupby(point, sort=False).sum()
    trials = point.value_counts(sort=False)[missing.index].to_numpy(np.int64)
    values = stored.reindex(ids)
    points = look(
        rule,
        next(iter(study.repeated.values())),
        trials,
        {name: values[name].to_numpy(np.float64) for name in metrics},
        distributions=study.distributions,
    )
    is_open = (missing.to_numpy() > 0) | (points.further > trials)
    tables = [
        pd.DataFrame(
            {
                "point": missing.index,
                "metric": name,
                "n": trials,
                "values": metric.values,
                "undefined": undefined_shares(study.trials, name)
                .reindex(missing.index, fill_value=0.0)
                .to_numpy(),
                "half_width": metric.half_width,
                "allowed": metric.allowed,
                "reached": metric.narrow & ~is_open,
                "why": _reasons(metric, is_open),
            }
        )
        for name, metric in points.metrics.items()
    ]
    # A point has its metrics one after the other.
    return pd.concat(tables).sort_index(kind="stable").reset_index(drop=True)


def _reasons(metric: SeenMetric, is_open: NDArray[np.bool_]) -> NDArray[np.str_]:
    """Return the reason for no further trials of each point, by one metric."""
    return np.select(
        [is_open, metric.narrow, ~metric.known], [NOT_YET, NARROW, FEW], MOST
    )


def settled_points(study: StoredStudy) -> str:
    """Return the number of settled points by reason, in words.

    Raises ChoiceError for a study with a fixed number of trials.
    """
    by_point = stopping(study).groupby("point")["why"]
    reasons = by_point.agg(lambda whys: min(whys, key=REASONS.index))
    counts = Counter(reasons[reasons != NOT_YET])
    by_reason = "".join(
        f", {count:,} by {why}" for why, count in sorted(counts.items())
    )
    return f"{counts.total():,} of {len(reasons):,} points{by_reason}"


def why_unfinished(study: StoredStudy) -> str:
    """Return the reason for further trials, in words; "" without further trials."""
    if has_rule(study) and (stopping(study)["why"] == NOT_YET).any():
        return f"the rule requires more trials of {study.name}"
    return ""


def has_rule(study: StoredStudy) -> bool:
    """Return whether a study adds trials until intervals are narrow."""
    return KEY in study.about.sections
