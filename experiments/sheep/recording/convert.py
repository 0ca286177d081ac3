"""Write the drives of Jadhav et al. (2024) as a table of tracks, drives.parquet.

Usage: python convert.py drives_data.mat

The drives with odd and with even numbers are also in odd.parquet and even.parquet.

The file `drives_data.mat` is part of the repository of the authors, see README.md in
the folder above. The file has positions (m) and velocities
(m/s) of 14 sheep, the dog and the shepherd, every 0.1 s. Arrays of an event hold
several drives, one after another.
"""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.io import loadmat

SHEEP = 14
OTHERS = ("dog", "shepherd")
TIME_STEP = 0.1


def drives(data: Mapping[str, Any]) -> Iterator[pd.DataFrame]:
    """Yield a table of tracks per drive.

    Parameters
    ----------
    data : mapping
        Contents of `drives_data.mat`: `len_drvs`, the numbers of steps of all drives,
        and `pos_ev_K` and `vel_ev_K` of event K, arrays (16, 2, frames).
    """
    steps = [int(number) for number in np.atleast_1d(data["len_drvs"])]
    event = 1
    begin = 0
    for drive, end in enumerate((number + 1 for number in steps), start=1):
        if begin == data[f"pos_ev_{event}"].shape[2]:
            event += 1
            begin = 0
        frames = slice(begin, begin + end)
        begin += end
        positions = data[f"pos_ev_{event}"][:, :, frames]
        velocities = data[f"vel_ev_{event}"][:, :, frames]
        for individual, (place, velocity) in enumerate(
            zip(positions, velocities, strict=True)
        ):
            is_sheep = individual < SHEEP
            yield pd.DataFrame(
                {
                    "drive": drive,
                    "id": individual + 1,
                    "kind": "sheep" if is_sheep else OTHERS[individual - SHEEP],
                    "t": np.round(TIME_STEP * np.arange(end), 1),
                    "x": place[0],
                    "y": place[1],
                    "vx": velocity[0],
                    "vy": velocity[1],
                }
            )


def main() -> None:
    """Convert the file that is named on the command line."""
    data = loadmat(sys.argv[1], simplify_cells=True)
    table = pd.concat(drives(data), ignore_index=True)
    is_odd = table["drive"] % 2 == 1
    parts = {"drives": table, "odd": table[is_odd], "even": table[~is_odd]}
    for name, rows in parts.items():
        rows.to_parquet(Path(__file__).with_name(f"{name}.parquet"))


if __name__ == "__main__":
    main()
