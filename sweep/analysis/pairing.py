"""Independent values of trials, and pairs by common random numbers."""

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
"""Relative difference up to which two numbers count as equal parameter values."""
OF_KIND: Mapping[str, type] = {"b": bool, "U": str}
"""Type of the values of an array, by its numpy kind."""


class Units(NamedTuple):
    """Independent values of a selection of trials.

    Attributes
    ----------
    values : Series
        Value of each unit; NaN if a trial of the unit has no result. The index contains
        the keys that pair the units of two selections.
    trials : int
        Number of results behind the values.
    left_out : int
        Number of trials without a result.
    pairs : bool
        True if units with equal keys have common random numbers.
    """

    values: "pd.Series[float]"
    trials: int
    left_out: int
    pairs: bool

    def array(self) -> Floats:
        """Return the values as an array (n,)."""
        return np.asarray(self.values, np.float64)


def agrees(values: ArrayLike, value: object) -> NDArray[np.bool_]:
    """Return where values equal a value.

    Numbers match to nine digits, so that 0.3 matches 3 * 0.1. True is not the number 1,
    and no string is a number.

    Parameters
    ----------
    values : array_like
        Values of any type, such as a column of parameter values.
    value : object
        Number, string or bool.

    Returns
    -------
    array of bool
        True where `values` equal `value`, in the shape of `values`.

    Examples
    --------
    >>> agrees([0.1, 0.2, 3 * 0.1], 0.3).tolist()
    [False, False, True]
    >>> agrees(["empty", "cafeteria"], "cafeteria").tolist()
    [False, True]
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
    """Return the rows of a table of trials with the given parameter values.

    Parameters
    ----------
    trials : DataFrame
        Rows are trials.
    settings : mapping
        Value by name of the parameter, such as `{"separation_weight": 2}`.

    Returns
    -------
    DataFrame
        The rows in which all parameters agree, with unchanged index.

    Examples
    --------
    >>> trials = sweep.load("my/first").trials
    >>> strong = chosen(trials, {"separation_weight": 2})
    >>> len(trials), len(strong)
    (30, 10)
    """
    for name, value in settings.items():
        trials = trials[agrees(trials[name].to_numpy(), value)]
    return trials


def units(
    trials: pd.DataFrame, values: "pd.Series[float]", unit: Unit, free: Sequence[str]
) -> Units:
    """Return the independent values of a selection of trials.

    Parameters
    ----------
    trials : DataFrame
        Rows are trials.
    values : Series
        Value of each row of `trials`; NaN if the trial has no result.
    unit : {"trial", "point", "replicate"}
        A unit is a trial, or the mean over the trials of a point or of a replicate.
    free : sequence of str
        Varied parameters that no selection names: keys of pairs, in addition to seed
        and replicate.

    Returns
    -------
    Units
        In the unit of `values`, in the order of `trials`.

    Examples
    --------
    >>> trials = sweep.load("my/first").trials
    >>> speeds = units(trials, trials["speed"], "replicate", ["separation_weight"])
    >>> len(speeds.array()), speeds.trials, speeds.left_out, speeds.pairs
    (10, 30, 0, True)
    """
    single = trials["point"].nunique() <= 1
    keys = {"trial": [*REPLICATE, *free], "replicate": [*REPLICATE], "point": [*free]}[
        unit
    ]
    keys = [*REPLICATE] if single else keys or ["point"]
    table = trials[list(dict.fromkeys([*UNITS[unit], *keys]))].assign(_value=values)
    groups = table.groupby(list(UNITS[unit]), sort=False)
    # Without all trials of a unit, the mean would estimate a different quantity.
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
    """Return the random streams that all points have in common.

    Parameters
    ----------
    trials : DataFrame
        Rows are trials.

    Returns
    -------
    frozenset of str
        Names of streams: start, world and noise.

    Examples
    --------
    >>> sorted(common_streams(sweep.load("my/first").trials))
    ['start', 'world']
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
    """Return the keys of the random numbers of trials: seed and replicate.

    The replicate is 0 for a listed seed, because the seed alone is then the key. Common
    streams have equal numbers for equal keys, in any study and at any point.

    Parameters
    ----------
    trials : DataFrame
        Rows are trials.

    Returns
    -------
    MultiIndex
        Levels seed and replicate; an entry per trial, in the order of `trials`.

    Examples
    --------
    >>> keys = replicates(sweep.load("my/first").trials)
    >>> list(keys.names), keys[:3].tolist(), keys.nunique()
    (['seed', 'replicate'], [(0, 0), (0, 1), (0, 2)], 10)
    """
    numbers = trials["replicate"].where(~trials["seed_listed"].astype(bool), 0)
    return pd.MultiIndex.from_arrays([trials["seed"], numbers], names=REPLICATE)


def pairable(a: Units, b: Units) -> bool:
    """Return whether each unit has a partner in the second selection.

    The two selections need equal, unique keys and common random numbers.
    """
    indices = a.values.index, b.values.index
    return (
        a.pairs
        and b.pairs
        and list(indices[0].names) == list(indices[1].names)
        and all(index.is_unique for index in indices)
        and set(indices[0]) == set(indices[1])
    )
