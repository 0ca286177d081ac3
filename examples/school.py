"""Make `school.csv`, an artificial recording of a school of fish.

A model swims in place of fish: eight trials of couzin2002, with a body length of 2 cm.
Then the positions get what trackers add: five frames per second, noise, lost fish.

    python examples/school.py school.csv
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import sweep

SPEC = {
    "study": "examples/school",
    "model": "couzin2002",
    "fixed": {"n": 10, "orientation_width": 8, "steps": 320},
    "replicates": 8,
    "seed": 2002,
    "record": {"metrics": ["polarization"], "every": 2, "trajectories": True},
}
FIRST = 202
"""First step of the recording: the school has formed."""
CENTIMETRES = 2.0
TRACKING_ERROR = 0.035
"""Largest error of a coordinate in cm; the standard deviation is 0.02 cm."""
LOST = 0.01
"""Share of frames in which the tracker loses a fish."""


def main(path: str) -> None:
    """Write the recording.

    Parameters
    ----------
    path : str
        File to write.
    """
    with TemporaryDirectory() as folder:
        study = sweep.run(SPEC, folder)
        frames = study.trajectories.query(f"frame >= {FIRST}")
    random = np.random.default_rng(1)
    lines = ["trial,fish,seconds,x_cm,y_cm"]
    for trial, (_, rows) in enumerate(frames.groupby("trial_id", sort=False)):
        for frame, (x, y) in enumerate(zip(rows["x"], rows["y"], strict=True)):
            positions = CENTIMETRES * np.array([x, y])
            positions += random.uniform(-1.0, 1.0, positions.shape) * TRACKING_ERROR
            seen = random.random(len(x)) >= LOST
            lines += [
                f"{trial},{fish},{frame / 5:.1f},{column[0]:.2f},{column[1]:.2f}"
                for fish, column in enumerate(positions.T)
                if seen[fish]
            ]
    text = "\n".join(lines) + "\n"
    Path(path).write_bytes(text.encode())


if __name__ == "__main__":
    main(sys.argv[1])
