"""Ids of trials in memory: 12 bytes each, in arrays that are sorted and searched.

In tables an id is a string of 24 hexadecimal digits, which takes more than twice the
memory. A Python string takes six times the memory. So a run of millions of trials has
the strings of one block at a time.
"""

import re
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # workers need no tables
    import pyarrow as pa

DIGITS = 24
TRIAL_ID = re.compile(f"[0-9a-f]{{{DIGITS}}}")
Ids = NDArray[np.bytes_]
"""Array of shape (n,), 12 bytes each."""
BYTES = "S12"
NO_IDS = np.empty(0, BYTES)
BLOCK = 100_000
"""Number of ids that are looked up, or are strings, at once."""


def packed(texts: Iterable[str]) -> Ids:
    """Return the ids in strings. Raises ValueError if a string is not an id."""
    import pyarrow as pa

    return packed_array(pa.array(texts, pa.string()))


def packed_array(texts: "pa.Array") -> Ids:
    """Return the ids that an array of strings represents.

    No Python strings are created. Raises ValueError if a string is not an id.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    if not pc.all(are_ids(texts), min_count=0).as_py():
        raise ValueError(f"ids of trials have {DIGITS} hexadecimal digits")
    joined = pc.binary_join(pa.ListArray.from_arrays([0, len(texts)], texts), "")
    return np.frombuffer(bytes.fromhex(joined[0].as_py()), BYTES)


def are_ids(texts: "pa.Array") -> "pa.Array":
    """Return a mask of the strings that are ids."""
    import pyarrow.compute as pc

    return pc.match_substring_regex(texts, f"^{TRIAL_ID.pattern}$").fill_null(False)


def as_texts(ids: Ids) -> "pa.ChunkedArray":
    """Return the strings of ids."""
    import pyarrow as pa

    return pa.chunked_array([_texts(block) for block in blocks(ids)], pa.string())


def blocks(ids: Ids) -> Iterator[Ids]:
    """Yield blocks of at most BLOCK ids."""
    for first in range(0, len(ids), BLOCK):
        yield ids[first : first + BLOCK]


def _texts(ids: Ids) -> "pa.Array":
    import pyarrow as pa

    digits = ids.tobytes().hex().encode()
    ends = np.arange(0, len(digits) + 1, DIGITS, dtype=np.int32)
    return pa.StringArray.from_buffers(
        len(ids), pa.py_buffer(ends), pa.py_buffer(digits)
    )


def _sound(texts: "pa.ChunkedArray") -> Iterator[tuple[NDArray[np.int64], Ids]]:
    """Yield the rows of strings that are ids, and the ids, block after block."""
    for first in range(0, len(texts), BLOCK):
        block = texts.slice(first, BLOCK).combine_chunks()
        sound = are_ids(block)
        yield first + np.flatnonzero(sound), packed_array(block.filter(sound))


class KnownIds(NamedTuple):
    """Index of distinct ids, to look up the row of an id.

    Attributes
    ----------
    ids : array of bytes, shape (n,)
        Ids in ascending order.
    rows : array of int, shape (n,)
        Row of each id in the indexed array or column.
    """

    ids: Ids
    rows: NDArray[np.int32]

    @classmethod
    def of(cls, ids: Ids) -> "KnownIds":
        """Return the index of an array of ids."""
        order = np.argsort(ids).astype(np.int32)
        return cls(ids[order], order)

    @classmethod
    def of_column(cls, texts: "pa.ChunkedArray") -> "KnownIds":
        """Return the index of a column of a stored table.

        Strings that are not ids are left out: an untrusted file may contain them.
        """
        ids = np.empty(len(texts), BYTES)
        rows = np.empty(len(texts), np.int32)
        count = 0
        for sound_rows, sound_ids in _sound(texts):
            new = slice(count, count + len(sound_ids))
            ids[new] = sound_ids
            rows[new] = sound_rows
            count = new.stop
        index = cls.of(ids[:count])
        return cls(index.ids, rows[index.rows])

    def places(self, ids: Ids) -> NDArray[np.int64]:
        """Return the row of each id, -1 for an unknown id."""
        rows = np.full(len(ids), -1, np.int64)
        for first in range(0, len(ids) if len(self.ids) else 0, BLOCK):
            block = ids[first : first + BLOCK]
            nearest = self.ids.searchsorted(block).clip(max=len(self.ids) - 1)
            equal = self.ids[nearest] == block
            rows[first : first + BLOCK][equal] = self.rows[nearest[equal]]
        return rows

    def places_of_column(self, texts: "pa.ChunkedArray") -> NDArray[np.int64]:
        """Return the row of each id in a column of a stored table.

        The row is -1 for an unknown id, and for a string that is not an id.
        """
        rows = np.full(len(texts), -1, np.int64)
        for sound_rows, sound_ids in _sound(texts):
            rows[sound_rows] = self.places(sound_ids)
        return rows

    def where(self, chosen: NDArray[np.bool_]) -> Ids:
        """Return the ids of the rows where the mask `chosen` is true."""
        return self.ids[chosen[self.rows]]
