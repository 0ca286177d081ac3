"""Which trials make one independent value, and which of two selections belong together
by common random numbers.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Unit = Literal["trial", "point", "replicate"]

REPLICATE = ("seed", "replicate")
UNITS: Mapping[str, Sequence[str]] = {
    "trial": ["trial_id"],
    "replicate": list(REPLICATE),
    "point": ["point"],
}
SAME_NUMBER = 1e-9
OF_KIND: Mapping[str, type] = {"b": bool, "U": str}
"""What the values of an array of these kinds are."""


class Units(NamedTuple):
    """Independent values, NaN where one lacks a trial's result, by the keys that pair
    them with another selection's.

    `trials` is the number of results behind them, `left_out` that of trials without
    one, and `pairs` whether units with the same keys share their random numbers.
    """

    values: "pd.Series[float]"
    trials: int
    left_out: int
    pairs: bool

    def array(self) -> Floats:
        """The values (n,)."""
        return np.asarray(self.values, np.float64)


def agrees(values: ArrayLike, value: object) -> NDArray[np.bool_]:
    """Which of `values` are `value`; numbers about, so that 0.3 finds 3 * 0.1.

    True is not the number 1, and no text is a number.
    """
    array = np.asarray(values)
    value = value.item() if isinstance(value, np.generic) else value
    kind = array.dtype.kind
    if kind in "iuf" and isinstance(value, int | float) and not isinstance(value, bool):
        return np.isclose(array.astype(np.float64), value, rtol=SAME_NUMBER, atol=0.0)
    if kind == "O" or isinstance(value, OF_KIND.get(kind, ())):
        return np.asarray(array == value, np.bool_)
    return np.zeros(array.shape, np.bool_)


def chosen(trials: pd.DataFrame, settings: Mapping[str, Any]) -> pd.DataFrame:
    """The rows of `trials` that have all of `settings`."""
    for name, value in settings.items():
        trials = trials[agrees(trials[name].to_numpy(), value)]
    return trials


def units(
    trials: pd.DataFrame, values: "pd.Series[float]", unit: Unit, free: Sequence[str]
) -> Units:
    """The independent values among those of `trials`, one of `values` a row, NaN where
    it has no result.

    A unit is a trial, the mean over a point's trials, or the mean over the trials of a
    replicate. `free` are the varied settings that pair units beside seed and replicate:
    those that no selection names.
    """
    single = trials["point"].nunique() <= 1
    keys = {"trial": [*REPLICATE, *free], "replicate": [*REPLICATE], "point": [*free]}[
        unit
    ]
    keys = [*REPLICATE] if single else keys or ["point"]
    table = trials[list(dict.fromkeys([*UNITS[unit], *keys]))].assign(_value=values)
    groups = table.groupby(list(UNITS[unit]), sort=False)
    # A unit that lacks one of its trials would be the mean of something else.
    complete = groups["_value"].count() == groups.size()
    by_unit = groups["_value"].mean().where(complete).to_numpy(np.float64)
    index = pd.MultiIndex.from_frame(table.drop_duplicates(list(UNITS[unit]))[keys])
    common = bool(trials["streams"].str.contains("start=common").all())
    return Units(
        pd.Series(by_unit, index=index),
        int(values.notna().sum()),
        int(values.isna().sum()),
        common or "replicate" not in keys,
    )


def common_streams(trials: pd.DataFrame) -> frozenset[str]:
    """The random streams, of start, world and noise, that all `trials` take in common
    with those of other points.
    """
    streams = [
        dict(stream.split("=") for stream in text.split())
        for text in trials["streams"].unique()
    ]
    names = streams[0] if streams else ()
    return frozenset(
        name for name in names if all(each[name] == "common" for each in streams)
    )


def replicates(trials: pd.DataFrame) -> pd.MultiIndex:
    """What tells the random numbers of trials apart: seed and replicate, 0 for a listed
    seed, which stands for both.

    Streams in common have the same numbers where both are the same, in any study and at
    any point.
    """
    places = trials["replicate"].where(~trials["seed_listed"].astype(bool), 0)
    return pd.MultiIndex.from_arrays([trials["seed"], places], names=REPLICATE)


def pairable(one: Units, other: Units) -> bool:
    """Whether each unit has its partner: the same keys once on both sides, with common
    random numbers.
    """
    indices = one.values.index, other.values.index
    return (
        one.pairs
        and other.pairs
        and list(indices[0].names) == list(indices[1].names)
        and all(index.is_unique for index in indices)
        and set(indices[0]) == set(indices[1])
    )
