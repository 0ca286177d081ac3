"""Resilience of a stored study to failures of boids.

Trials in which some boids fail are compared with trials of equal seed and replicate
without failures.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from sweep.analysis import Recovery, recovery, resilience
from sweep.errors import ChoiceError
from sweep.tables import StoredStudy, as_names
from sweep.text import unknown

SHARE = "failing_share"
TIME = "failing_time"
HOW = "failing_how"
PARTS = ("kept", "recovered", "time")


def resilience_rows(
    study: StoredStudy, metrics: str | Sequence[str] = (), *, within: float = 0.1
) -> pd.DataFrame:
    """Return the resilience of each metric at each point with failing boids.

    Parameters
    ----------
    study : StoredStudy
        `where` chooses among the points.
    metrics : str or sequence of str, optional
        Names of recorded series; by default all.
    within : float, default 0.1
        Tolerance of a recovery: fraction of the level by which a recovered metric may
        differ from the level.

    Returns
    -------
    DataFrame
        One row per point and metric. Columns: the parameters that vary; metric;
        kept, recovered and time, see `sweep.analysis.resilience`, each with the bounds
        `_low` and `_high` of the 95 % confidence interval; pairs, the number of pairs
        of trials; lack, the number of trials without a partner or a value.

    Raises
    ------
    ChoiceError
        `within` is not between 0 and 1, no series is recorded, a metric is no recorded
        series, or boids fail at all points or at no point.
    """
    if not 0.0 < within < 1.0:
        raise ChoiceError(f"within must be between 0 and 1, not {within}", study.name)
    chosen = list(as_names(metrics)) or study.series_metrics
    for name in chosen:
        if name not in study.series_metrics:
            reason = unknown("recorded series", name, study.series_metrics)
            raise ChoiceError(reason, study.name)
    if not chosen:
        reason = "no series is recorded; add record: {series: [...]} to the spec"
        raise ChoiceError(reason, study.name)
    trials = study.trials[study.trials["status"] == "done"]
    fail = trials[SHARE].to_numpy(np.float64) > 0.0
    if fail.all() or not fail.any():
        reason = "no boid fails" if not fail.any() else "some boids fail"
        raise ChoiceError(
            f"at all points {reason}; vary {SHARE}, for example"
            f" sweep: {{{SHARE}: [0, 0.2]}}",
            study.name,
        )
    return _rows(study, trials[fail], trials[~fail], chosen, within=within)


def _rows(
    study: StoredStudy,
    failing: pd.DataFrame,
    intact: pd.DataFrame,
    metrics: list[str],
    *,
    within: float,
) -> pd.DataFrame:
    varied = [str(name) for name in study.points.columns if name in failing.columns]
    alike = [name for name in varied if name not in (SHARE, TIME, HOW)]
    partners = {
        _key(trial, alike): trial["trial_id"] for trial in intact.to_dict("records")
    }
    series = dict(iter(study.series.groupby("trial_id")))
    rows = []
    for key, group in failing.groupby(varied, sort=False):
        for name in metrics:
            pairs = [
                _pair(
                    series[trial["trial_id"]],
                    series.get(partners.get(_key(trial, alike), "")),
                    name,
                    trial,
                    within=within,
                )
                for trial in group.to_dict("records")
            ]
            means = resilience(pairs)
            row: dict[str, object] = dict(zip(varied, key, strict=True))
            row["metric"] = name
            for part, interval in zip(PARTS, means, strict=True):
                row[part] = interval.value
                row[f"{part}_low"] = interval.low
                row[f"{part}_high"] = interval.high
            row |= {"pairs": means.retained.n, "lack": len(pairs) - means.retained.n}
            rows.append(row)
    return pd.DataFrame(rows)


def _key(trial: Mapping[Any, Any], alike: list[str]) -> tuple[object, ...]:
    """Return the values that a trial and its partner have in common."""
    return (*(trial[name] for name in alike), trial["replicate"])


def _pair(
    failing: pd.DataFrame,
    intact: pd.DataFrame | None,
    name: str,
    trial: Mapping[Any, Any],
    *,
    within: float,
) -> Recovery:
    """Return the recovery of a metric after the failure; NaN without a partner.

    `failing` and `intact` are the series of the trial and of its partner.
    """
    if intact is None:
        return Recovery(np.nan, np.nan)
    both = intact.merge(failing, on="frame", suffixes=("_intact", "_failing"))
    return recovery(
        both["frame"].to_numpy() * trial["dt"],
        both[f"{name}_intact"].to_numpy(),
        both[f"{name}_failing"].to_numpy(),
        at=trial[TIME],
        within=within,
    )
