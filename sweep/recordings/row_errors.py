"""Mistakes in the rows of a recording, each with file and row."""

from collections import defaultdict

from sweep.spec import Entry, Mistakes
from sweep.text import so_many

MOST_OF_A_KIND = 3
"""Number of rows with one mistake that are reported; further rows are counted."""


class RowErrors:
    """Collects the mistakes of rows, and raises all mistakes together.

    Parameters
    ----------
    entry : Entry
        Section of the spec; errors have the line of this entry.
    """

    def __init__(self, entry: Entry) -> None:
        self._entry = entry
        self._rows = defaultdict[str, list[str]](list)
        self._counts = defaultdict[str, int](int)

    def __bool__(self) -> bool:
        return bool(self._counts)

    @property
    def count(self) -> int:
        """Number of rows with a mistake so far."""
        return sum(self._counts.values())

    def note(self, kind: str, place: str, message: str, count: int = 1) -> None:
        """Note a mistake.

        Parameters
        ----------
        kind : str
            Kind of mistake in words; only the first rows of a kind are reported.
        place : str
            File and row.
        message : str
            The mistake, with the value.
        count : int, default 1
            Number of rows with the mistake, of which `place` is the first.
        """
        self._counts[kind] += count
        if len(self._rows[kind]) < MOST_OF_A_KIND:
            self._rows[kind].append(f"{place}: {message}")

    def check(self) -> None:
        """Raise SpecError with all mistakes, if there are any."""
        mistakes = Mistakes()
        for kind, rows in self._rows.items():
            for row in rows:
                with mistakes.noted():
                    raise self._entry.error(row)
            with mistakes.noted():
                if more := self._counts[kind] - len(rows):
                    more_rows = so_many(more, "more row")
                    raise self._entry.error(f"{more_rows}: {kind}")
        mistakes.check()
