"""What each detail in which two presets differ does: paired effects of an axis that
ablates.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from sweep.analysis import paired_contrast, simultaneous_confidence
from sweep.spec.ablation import ALL, BUT
from sweep.spec.recorded import Over, column_over
from sweep.tables.stored_study import StoredStudy

PAIRED = ("seed", "replicate")
NOTHING = "nothing"
OTHERS = "all others"
"""To what a detail is added."""


def paired_effects(
    study: StoredStudy,
    preset: str,
    metrics: Sequence[str],
    by: str | None = None,
    *,
    factor: bool = False,
    over: Over = "last",
) -> pd.DataFrame:
    """The mean change of each metric that each detail of `preset` makes, with its
    simultaneous 95 % interval. Where the spec names the details, `preset` is the name
    of the axis.

    A trial is paired with the trial of the same seed, replicate and value of `by` in
    which no detail is changed. With `leave_out` the trials with all details are paired
    too, with those that have all but one: the change is what this one makes where all
    others are. It is their difference; with `factor` their ratio, for metrics above
    zero, and its mean is the geometric one.

    Columns: `by`, if any, detail, added_to, metric, value, low, high, n. `added_to` is
    `nothing` or `all others`. The intervals hold together (Bonferroni). A pair counts
    only if both of its trials are done and have a value. `over="half"` takes the means
    over the last half of each trial.
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
            found = (pairs.value, *pairs.interval(level))
            numbers = np.exp(found) if factor else found
            place = [where] if by else []
            rows.append((*place, detail, added_to, metric, *numbers, len(pairs.b)))
    columns = ["detail", "added_to", "metric", "value", "low", "high", "n"]
    return pd.DataFrame(rows, columns=[*apart, *columns])


def _compared(
    values: pd.DataFrame,
) -> Iterator[tuple[str, str, pd.DataFrame, pd.DataFrame]]:
    """Each detail, what it is added to, and the trials with it and without it."""
    of = {
        str(label): part.set_index(list(PAIRED))
        for label, part in values.groupby("detail", sort=False)
    }
    for label, part in of.items():
        if label.startswith(BUT):
            if ALL in of:
                yield label.removeprefix(BUT), OTHERS, of[ALL], part
        elif label and "" in of:
            yield label, NOTHING, part, of[""]
