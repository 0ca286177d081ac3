"""How large a study may be. What a spec asks for is counted before memory is taken.

Measured, in bytes: a point takes 190 in a launch, a trial 90, a cell 16 to 24, and 34
while some samplers draw it. A plan at all of these limits takes at most some 4 GB.
"""

from sweep.spec.document import Entry

MOST_POINTS = 10_000_000
MOST_TRIALS = 20_000_000
MOST_CELLS = 100_000_000
"""Points, or trials, times the settings that vary."""
MOST_SEARCHED = 1_000_000
"""Trials of a search, its repetitions and held-out seeds: it keeps 3 kB of each."""
MOST_OPERATIONS = 2_000_000_000
"""Points times the parts of all expressions. So many take ten seconds, or minutes where
they are powers.
"""

MOST_BEFORE = 10**9
"""Up to version 0.4.0 a study could have so many trials."""
MOST_DERIVED = 100
"""Derived metrics. Each is a column over all frames of a trial."""


def beyond(asked: str, most: int) -> str:
    """The sentence that refuses what is `asked` for, of which `most` are allowed."""
    return (
        f"{asked}; at most {most:,} are allowed: split the study into several,"
        " by seeds or by an axis"
    )


def check_cells(entry: Entry, points: int, settings: int) -> None:
    """Raise SpecError, with the line of `entry`, for too many cells."""
    cells = points * settings
    if cells > MOST_CELLS:
        asked = f"{points:,} points of {settings} settings make {cells:,} cells"
        raise entry.error(beyond(asked, MOST_CELLS))
