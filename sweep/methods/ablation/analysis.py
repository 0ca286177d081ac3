"""Paired effects of the components in which two presets differ.

A component, or detail, is a group of parameters that an axis with `ablate` changes.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from sweep.analysis import paired_contrast, simultaneous_confidence
from sweep.spec import ALL, BUT, Over, column_over
from sweep.tables import StoredStudy

PAIRED = ("seed", "replicate")
NOTHING = "nothing"
OTHERS = "all others"
"""Possible bases to which a component is added."""


def paired_effects(
    study: StoredStudy,
    preset: str,
    metrics: Sequence[str],
    by: str | None = None,
    *,
    factor: bool = False,
    over: Over = "last",
) -> pd.DataFrame:
    """Return the mean change of each metric that each component makes.

    A trial is paired with the trial of equal seed, replicate and value of `by` in which
    no component is changed. With `leave_out` the trials with all components are also
    paired with the trials that lack a single component. This change is the effect of
    the component when added to all other components.

    Parameters
    ----------
    study : StoredStudy
    preset : str
        Preset whose components are added. If the spec names the components, the name of
        the axis.
    metrics : sequence of str
    by : str, optional
        Parameter with values that are kept apart.
    factor : bool, default False
        Return ratios instead of differences, and their geometric means. For metrics
        above zero.
    over : {"last", "half"}, default "last"
        The last frame, or the mean over the second half of each trial.

    Returns
    -------
    DataFrame
        One row per value of `by`, component, `added_to` and metric. Columns: `by`, if
        any, detail, added_to ("nothing" or "all others"), metric, value, low, high, and
        n, the number of pairs. A pair counts only if the two trials are done and have a
        value. The 95 % confidence intervals are simultaneous (Bonferroni).
    """
    metrics = [column_over(name, over) for name in metrics]
    trials = study.trials.assign(detail=study.details(preset).to_numpy())
    trials = trials[trials["status"] == "done"]
    apart = [by] if by else []
    values = trials[[*apart, *PAIRED, "detail", *metrics]].astype(
        dict.fromkeys(metrics, np.float64)
    )
    if factor:
        values[list(metrics)] = np.log(values[list(metrics)])
    compared = [
        (where, *pair)
        for where, part in (values.groupby(by, sort=False) if by else [("", values)])
        for pair in _compared(part)
    ]
    level = simultaneous_confidence(len(metrics) * len(compared))
    rows = []
    for where, detail, added_to, changed, before in compared:
        for metric in metrics:
            pairs = paired_contrast(
                before[metric],
                changed[metric],
                # Logarithms are about normal.
                distribution="normal" if factor else study.distributions[metric],
            )
            change = (pairs.value, *pairs.interval(level))
            numbers = np.exp(change) if factor else change
            group = [where] if by else []
            rows.append((*group, detail, added_to, metric, *numbers, len(pairs.b)))
    columns = ["detail", "added_to", "metric", "value", "low", "high", "n"]
    return pd.DataFrame(rows, columns=[*apart, *columns])


def _compared(
    values: pd.DataFrame,
) -> Iterator[tuple[str, str, pd.DataFrame, pd.DataFrame]]:
    """Yield each component, the base, and the trials with and without the component."""
    parts = {
        str(label): part.set_index(list(PAIRED))
        for label, part in values.groupby("detail", sort=False)
    }
    for label, part in parts.items():
        if label.startswith(BUT):
            if ALL in parts:
                yield label.removeprefix(BUT), OTHERS, parts[ALL], part
        elif label and "" in parts:
            yield label, NOTHING, part, parts[""]
