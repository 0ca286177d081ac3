"""Writes winners.csv, the sets that winners.yaml flies at full size, from both stored
searches: python -m experiments.vasarhelyi2018.winners

A set is chosen by the trials of its search alone, before any on held-out seeds. Numbers
have four digits.
"""

from pathlib import Path

import pandas as pd

import sweep
from kernels.models import MODELS

WINNERS = Path(__file__).with_name("winners.csv")


def winners() -> pd.DataFrame:
    """A row a set, with its name and settings: the published one, the best of CMA-ES,
    and of the front of NSGA-II the one with the largest product of speed and order.
    """
    search = sweep.load("vasarhelyi2018/search").search
    front = sweep.load("vasarhelyi2018/front").search
    names = list(search.asked_trials.description["parameters"])
    of_front = front.winners.pivot(
        index="candidate", columns="objective", values="search"
    )
    balanced = of_front.prod(axis=1).idxmax()
    candidates = front.candidates.set_index("candidate")
    rows = {
        "published": MODELS["vasarhelyi2018"].presets["real"],
        "CMA-ES": search.best,
        "NSGA-II": candidates.loc[balanced],
    }
    table = pd.DataFrame(
        {
            name: {setting: float(f"{row[setting]:.4g}") for setting in names}
            for name, row in rows.items()
        }
    )
    return table.T.rename_axis("set").reset_index()


if __name__ == "__main__":
    winners().to_csv(WINNERS, index=False)
