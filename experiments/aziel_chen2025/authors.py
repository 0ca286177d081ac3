"""What the authors of aziel_chen2025 stored: their search, 2000 gain vectors a map and
size, and the mean visits and the CV of their heatmaps. Ours beside them, row by row.

The tables are from their repository, see authors_LICENSE.txt. Gains are rounded to six
digits, coverage to four.
"""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from .search import GAINS, Studies, Values, done

SEEDS = ("seed_27", "seed_729", "seed_4913")


@cache
def _table(name: str) -> pd.DataFrame:
    return pd.read_csv(Path(__file__).with_name(f"authors_{name}.csv"))


def searched(map_name: str, n: int) -> pd.DataFrame:
    """Their search in one map with `n` boids: gains, and coverage in per cent of all
    pixels by seed.
    """
    table = _table("search")
    return table[(table["map"] == map_name) & (table["n"] == n)]


def heatmaps(map_name: str, n: int) -> pd.DataFrame:
    """The mean visits of a pixel and the CV of their heatmaps, by seed."""
    table = _table("visits")
    chosen = table[(table["map"] == map_name) & (table["n"] == n)]
    return chosen.set_index("seed")


def both(studies: Studies, **settings: Any) -> pd.DataFrame:
    """The mean coverage over the three seeds, `ours` and `theirs`, of the rows of their
    search that were flown again.
    """
    gains = list(GAINS)
    ours = done(studies["authors_rows"], **settings).groupby(gains)["coverage_total"]
    theirs = searched(settings["map"], settings["n"]).set_index(gains)[list(SEEDS)]
    return pd.DataFrame({"ours": ours.mean(), "theirs": theirs.mean(axis=1)}).dropna()


def rows_bias(studies: Studies, **settings: Any) -> Values:
    """Ours less theirs, by row."""
    rows = both(studies, **settings)
    return (rows["ours"] - rows["theirs"]).to_numpy(np.float64)


def rows_square(studies: Studies, **settings: Any) -> Values:
    """The square of ours less theirs, by row."""
    return rows_bias(studies, **settings) ** 2


def rows_rank(studies: Studies, **settings: Any) -> Values:
    """By row its part of the rank correlation of ours and theirs, which is the mean of
    them.
    """
    ranks = both(studies, **settings).rank()
    off = (ranks["ours"] - ranks["theirs"]).to_numpy(np.float64)
    return 1.0 - 6.0 * off**2 / (len(off) ** 2 - 1.0)
