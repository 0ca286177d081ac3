"""A program that flies a model without compiling it, in a process of its own:

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

BODIES, TAKEN = "bodies", "steps"


def write(flown: Iterator[Flown], file: Path) -> None:
    """Keep flights in a file."""
    arrays: dict[str, Any] = {}
    for number, one in enumerate(flown):
        for name, array in {BODIES: one.bodies, TAKEN: one.steps, **one.last}.items():
            arrays[f"{number} {name}"] = array
    np.savez(file, **arrays)


def read(file: Path) -> list[Flown]:
    """The flights in a file."""
    found: dict[str, dict[str, Any]] = {}
    with np.load(file) as arrays:
        for key in arrays.files:
            number, _, name = key.partition(" ")
            found.setdefault(number, {})[name] = arrays[key]
    return [Flown(one.pop(BODIES), one.pop(TAKEN), one) for one in found.values()]


def main(reference: str, file: str) -> None:
    """Write the flights of a model into a file, or say what it raises."""
    warnings.simplefilter("ignore", RuntimeWarning)  # compiled code has none
    about = subject(reference)
    with mishaps_said():
        write(map(fly, every_way(about)), Path(file))


if __name__ == "__main__":
    main(*sys.argv[1:])
