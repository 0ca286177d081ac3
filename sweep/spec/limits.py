"""Limits of the size of a study, checked before memory is allocated.

Measured memory, in bytes: 190 per point in a launch, 90 per trial, 16 to 24 per cell,
and 34 per cell during the draw of some samplers. A plan at all limits takes at most
about 4 GB.
"""

from sweep.spec.document import Entry

MOST_POINTS = 10_000_000
MOST_TRIALS = 20_000_000
MOST_CELLS = 100_000_000
"""Points, or trials, times the parameters that vary."""
MOST_SEARCHED = 1_000_000
"""Trials of a search, with repetitions and held-out seeds.

A search keeps 3 kB per trial.
"""
MOST_OPERATIONS = 2_000_000_000
"""Points times the parts of all expressions.

This number of operations takes ten seconds, or minutes for powers.
"""

MOST_BEFORE = 10**9
"""Largest number of trials of a study up to version 0.4.0."""
MOST_DERIVED = 100
"""Derived metrics. Each metric is a column over all frames of a trial."""


def beyond(size: str, most: int) -> str:
    """Return the message for a size beyond the limit `most`."""
    return (
        f"{size}; at most {most:,} are allowed: split the study into several,"
        " by seeds or by an axis"
    )


def check_cells(entry: Entry, points: int, settings: int) -> None:
    """Raise SpecError for too many cells.

    Parameters
    ----------
    entry : Entry
        The error has the line of this entry.
    points : int
    settings : int
        Number of parameters that vary.
    """
    cells = points * settings
    if cells > MOST_CELLS:
        size = f"{points:,} points of {settings} parameters make {cells:,} cells"
        raise entry.error(beyond(size, MOST_CELLS))
