"""What failures of boids do to a stored study: trials in which some fail against those
of the same seed and replicate in which none does.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from sweep.analysis.resilience import Recovery, recovery, resilience
from sweep.errors import ChoiceError
from sweep.tables.choosing import as_names
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

SHARE, TIME, HOW = "failing_share", "failing_time", "failing_how"
PARTS = ("kept", "recovered", "time")


def resilience_rows(
    study: StoredStudy, metrics: str | Sequence[str] = (), *, within: float = 0.1
) -> pd.DataFrame:
    """A row for each point at which boids fail, and each metric: the settings that
    vary, `metric`, and with their 95 % intervals (`_low`, `_high`) `kept`, `recovered`
    and `time`, see sweep.analysis.resilience; `pairs` of trials, and how many `lack` a
    partner or a value.

    study    the stored study; `where` chooses among its points
    metrics  names of recorded series; () for all
    within   the part of the level by which a metric may differ and have come back

    Raises ChoiceError for a study without points at which nobody fails or at which
    some do, and for a metric that is no recorded series.
    """
    if not 0.0 < within < 1.0:
        raise ChoiceError(f"within must be between 0 and 1, not {within}", study.name)
    names = list(as_names(metrics)) or study.series_metrics
    for name in names:
        if name not in study.series_metrics:
            words = unknown("recorded series", name, study.series_metrics)
            raise ChoiceError(words, study.name)
    if not names:
        words = "no series are recorded: record: {series: [...]} in its spec does that"
        raise ChoiceError(words, study.name)
    trials = study.trials[study.trials["status"] == "done"]
    fail = trials[SHARE].to_numpy(np.float64) > 0.0
    if fail.all() or not fail.any():
        words = "nobody fails" if not fail.any() else "some boids fail"
        raise ChoiceError(
            f"at all points {words}; the way out is sweep: {{{SHARE}: [0, 0.2]}}",
            study.name,
        )
    return _rows(study, trials[fail], trials[~fail], names, within)


def _rows(
    study: StoredStudy,
    failing: pd.DataFrame,
    whole: pd.DataFrame,
    names: list[str],
    within: float,
) -> pd.DataFrame:
    varied = [str(name) for name in study.points.columns if name in failing.columns]
    alike = [name for name in varied if name not in (SHARE, TIME, HOW)]
    partners = {_key(one, alike): one["trial_id"] for one in whole.to_dict("records")}
    flown = dict(iter(study.series.groupby("trial_id")))
    rows = []
    for key, group in failing.groupby(varied, sort=False):
        for name in names:
            pairs = [
                _pair(
                    flown[trial["trial_id"]],
                    flown.get(partners.get(_key(trial, alike), "")),
                    name,
                    trial,
                    within,
                )
                for trial in group.to_dict("records")
            ]
            found = resilience(pairs)
            row: dict[str, object] = dict(zip(varied, key, strict=True))
            row["metric"] = name
            for part, interval in zip(PARTS, found, strict=True):
                row[part] = interval.value
                row[f"{part}_low"], row[f"{part}_high"] = interval.low, interval.high
            row |= {"pairs": found.retained.n, "lack": len(pairs) - found.retained.n}
            rows.append(row)
    return pd.DataFrame(rows)


def _key(trial: Mapping[Any, Any], alike: list[str]) -> tuple[object, ...]:
    """What a trial has in common with its partner."""
    return (*(trial[name] for name in alike), trial["replicate"])


def _pair(
    failing: pd.DataFrame,
    whole: pd.DataFrame | None,
    name: str,
    trial: Mapping[Any, Any],
    within: float,
) -> Recovery:
    """What the failure of a trial does; NaN without a partner."""
    if whole is None:
        return Recovery(np.nan, np.nan)
    both = whole.merge(failing, on="frame", suffixes=("_whole", "_failing"))
    return recovery(
        both["frame"].to_numpy() * trial["dt"],
        both[f"{name}_whole"].to_numpy(),
        both[f"{name}_failing"].to_numpy(),
        trial[TIME],
        within,
    )
