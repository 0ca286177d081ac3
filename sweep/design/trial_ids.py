"""Ids of trials in memory: 12 bytes each, in arrays that are sorted and searched.

In tables an id is a text of 24 hexadecimal digits, which takes more than twice as much,
and as an object of Python six times. So a launch of millions of trials has texts of one
block at a time.
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
"""(n,), of 12 bytes each."""
BYTES = "S12"
NO_IDS = np.empty(0, BYTES)
BLOCK = 100_000
"""So many ids are looked up, or are texts, at once."""


def packed(texts: Iterable[str]) -> Ids:
    """The ids that are written as these texts. Raises ValueError where one is no id."""
    import pyarrow as pa

    return packed_array(pa.array(texts, pa.string()))


def packed_array(texts: "pa.Array") -> Ids:
    """The same of an array of them, without a text of Python's for each."""
    import pyarrow as pa
    import pyarrow.compute as pc

    if not pc.all(are_ids(texts), min_count=0).as_py():
        raise ValueError(f"ids of trials have {DIGITS} hexadecimal digits")
    joined = pc.binary_join(pa.ListArray.from_arrays([0, len(texts)], texts), "")
    return np.frombuffer(bytes.fromhex(joined[0].as_py()), BYTES)


def are_ids(texts: "pa.Array") -> "pa.Array":
    """Which of some texts are ids."""
    import pyarrow.compute as pc

    return pc.match_substring_regex(texts, f"^{TRIAL_ID.pattern}$").fill_null(False)


def as_texts(ids: Ids) -> "pa.ChunkedArray":
    """The texts of ids."""
    import pyarrow as pa

    return pa.chunked_array([_texts(block) for block in blocks(ids)], pa.string())


def blocks(ids: Ids) -> Iterator[Ids]:
    """Some ids after the other, at most BLOCK at once."""
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
    """The ids among some texts and where they stand, some after the other."""
    for first in range(0, len(texts), BLOCK):
        some = texts.slice(first, BLOCK).combine_chunks()
        sound = are_ids(some)
        yield first + np.flatnonzero(sound), packed_array(some.filter(sound))


class KnownIds(NamedTuple):
    """Distinct ids that others are looked up among: `ids` (n,) in ascending order, and
    the `rows` (n,) in which they stood.
    """

    ids: Ids
    rows: NDArray[np.int32]

    @classmethod
    def of(cls, ids: Ids) -> "KnownIds":
        """Those in an array, by their places in it."""
        order = np.argsort(ids).astype(np.int32)
        return cls(ids[order], order)

    @classmethod
    def of_column(cls, texts: "pa.ChunkedArray") -> "KnownIds":
        """Those in a column of a stored table, by its rows. What is no id, as a file
        from anyone may have, is left out: nobody asks for it.
        """
        ids, rows = np.empty(len(texts), BYTES), np.empty(len(texts), np.int32)
        found = 0
        for there, some in _sound(texts):
            new = slice(found, found + len(some))
            ids[new], rows[new], found = some, there, new.stop
        known = cls.of(ids[:found])
        return cls(known.ids, rows[known.rows])

    def places(self, asked: Ids) -> NDArray[np.int64]:
        """The row of each of the ids `asked`, -1 where it is none of them."""
        found = np.full(len(asked), -1, np.int64)
        for first in range(0, len(asked) if len(self.ids) else 0, BLOCK):
            some = asked[first : first + BLOCK]
            nearest = self.ids.searchsorted(some).clip(max=len(self.ids) - 1)
            there = self.ids[nearest] == some
            found[first : first + BLOCK][there] = self.rows[nearest[there]]
        return found

    def places_of_column(self, texts: "pa.ChunkedArray") -> NDArray[np.int64]:
        """The same of the ids in a column of a stored table; -1 too for what is no id,
        as `of_column`.
        """
        found = np.full(len(texts), -1, np.int64)
        for there, some in _sound(texts):
            found[there] = self.places(some)
        return found

    def where(self, chosen: NDArray[np.bool_]) -> Ids:
        """The ids of the rows that are `chosen` (rows,)."""
        return self.ids[chosen[self.rows]]
