"""A program that runs a model without compilation, in a separate process.

NUMBA_DISABLE_JIT=1 python -m sweep.testing.interpreted REFERENCE FILE.npz
"""

import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from sweep.testing.elsewhere import mishaps_said
from sweep.testing.flights import Flown, every_way, fly
from sweep.testing.subject import subject

BODIES = "bodies"
TAKEN = "steps"


def write(flown: Iterator[Flown], file: Path) -> None:
    """Write trials into a file."""
    arrays: dict[str, Any] = {}
    for number, trial in enumerate(flown):
        named = {BODIES: trial.bodies, TAKEN: trial.steps, **trial.last}
        for name, array in named.items():
            arrays[f"{number} {name}"] = array
    np.savez(file, **arrays)


def read(file: Path) -> list[Flown]:
    """Return the trials in a file."""
    trials: dict[str, dict[str, Any]] = {}
    with np.load(file) as arrays:
        for key in arrays.files:
            number, _, name = key.partition(" ")
            trials.setdefault(number, {})[name] = arrays[key]
    return [
        Flown(trial.pop(BODIES), trial.pop(TAKEN), trial) for trial in trials.values()
    ]


def main(reference: str, file: str) -> None:
    """Write the trials of a model into a file, or print the sentence of an error."""
    warnings.simplefilter("ignore", RuntimeWarning)  # compiled code has none
    checked = subject(reference)
    with mishaps_said():
        write(map(fly, every_way(checked)), Path(file))


if __name__ == "__main__":
    main(*sys.argv[1:])
