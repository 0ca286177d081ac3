"""Tracks: the rows of each individual in each event, in one place on the disk.

The rows of a track may be anywhere in the files, and the files may exceed the memory.
So a first pass counts the rows of each track, and a second pass writes each row to the
place of its track.
"""

import logging
import os
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from kernels.model import WORKING
from sweep.recordings.files import TrackFile
from sweep.recordings.row_errors import RowErrors
from sweep.recordings.rows import RowsOf, numbers, projected, texts, times
from sweep.spec import FILE, NAME, RecordingSpec
from sweep.text import shortened, so_many, unknown

LOG = logging.getLogger("sweep")
TIME, X, Y, VX, VY = range(5)
"""Rows of the numbers of a track."""
Floats = NDArray[np.float64]
Wholes = NDArray[np.int64]
ALL = "all"
"""Name of the only event, if each file is an individual."""
UNNAMED = ""
"""Kind of all individuals of a recording without kinds."""
MANY_ROWS = 5_000_000
"""Number of rows above which each tenth of the reading is reported."""
DIGITS = re.compile("([0-9]{1,18})")
"""Digits of a name that are a number."""
MOST_NAMES = 2**31
"""Upper bound of the numbers of names."""


class TrackRows(NamedTuple):
    """Rows of an individual in an event, in the order of the files.

    Attributes
    ----------
    event, individual, kind : str
    numbers : array of float, shape (5, R)
        Time, x, y, vx and vy of R rows; NaN for velocities that are not given.
    rows : array of int, shape (R,)
        Numbers of the rows in all files, from 0.
    """

    event: str
    individual: str
    kind: str
    numbers: Floats
    rows: Wholes


class _Names:
    """Numbers of names, in the order in which the names occur."""

    def __init__(self) -> None:
        self.names = list[str]()
        self._numbers = dict[str, int]()

    def of(self, column: pa.Array) -> Wholes:
        """Return the number of each name of a column."""
        encoded = column.dictionary_encode()
        codes = [self._number(name) for name in encoded.dictionary.to_pylist()]
        places: Wholes = np.array(codes, np.int64)[encoded.indices.to_numpy()]
        return places

    def _number(self, name: str) -> int:
        if name not in self._numbers:
            self._numbers[name] = len(self.names)
            self.names.append(name)
        return self._numbers[name]


@dataclass
class Tracks:
    """All tracks of a recording.

    Attributes
    ----------
    files : sequence of TrackFile
    spec : RecordingSpec
    errors : RowErrors
    kinds : tuple of str
        Kinds of individuals in order, after `count`; () for a recording without kinds.
    centre : tuple of float or None
        Longitude and latitude of the first position, for coordinates in degrees.
    """

    files: Sequence[TrackFile]
    spec: RecordingSpec
    errors: RowErrors
    kinds: tuple[str, ...] = ()
    centre: tuple[float, float] | None = None
    _events: _Names = field(default_factory=_Names)
    _individuals: _Names = field(default_factory=_Names)
    _present: set[str] = field(default_factory=set)
    _kinds: dict[int, str] = field(default_factory=dict)
    _counts: dict[tuple[int, int], int] = field(default_factory=dict)
    _ends: list[int] = field(default_factory=list)

    @property
    def columns(self) -> list[str]:
        """Names of all columns that are read."""
        return list(dict.fromkeys((*self._named, *self._measured)))

    @property
    def _named(self) -> list[str]:
        columns = self.spec.columns
        names = (columns.individual, columns.event, columns.kind)
        return [name for name in names if name not in (None, FILE)]

    @property
    def _measured(self) -> list[str]:
        columns = self.spec.columns
        names = [columns.frame or columns.time, columns.x, columns.y]
        if self.spec.velocities == "given":
            names += [name for name in (columns.vx, columns.vy) if name is not None]
        return names

    def _name(self, file: TrackFile) -> str:
        """Return the name of a file without its ending, with folders if necessary."""
        alike = [other for other in self.files if other.path.stem == file.path.stem]
        return (
            file.path.stem if len(alike) == 1 else str(Path(file.name).with_suffix(""))
        )

    def place(self, row: int) -> str:
        """Return the file and the row of a number of a row, in words."""
        file = int(np.searchsorted(self._ends, row, side="right"))
        first = self._ends[file - 1] if file else 0
        return self.files[file].place(row - first)

    def count(self) -> None:
        """Count the rows of each track, and note the kinds of individuals."""
        rows = 0
        named = dict.fromkeys(self._named or self._measured[:1])
        for file in self.files:
            begin = rows
            for piece in file.pieces([*named], self.errors):
                self._count_piece(file, piece, rows - begin)
                rows += piece.num_rows
            self._ends.append(rows)
        for kind in self.spec.kinds:
            if kind not in self._present:
                message = unknown("kind", kind, sorted(self._present))
                self.errors.note("an unknown kind", "kinds", message)
        self.kinds = self.spec.kinds or tuple(
            sorted({kind for kind in self._kinds.values() if kind})
        )

    def _count_piece(self, file: TrackFile, piece: pa.Table, first: int) -> None:
        self._check_names(file, piece, first)
        events, individuals = self._groups(file, piece)
        chosen = self._chosen(piece)
        keys = _pair(events[chosen], individuals[chosen])
        pairs, counts = np.unique(keys, return_counts=True)
        for pair, count in zip(pairs.tolist(), counts.tolist(), strict=True):
            key = divmod(pair, MOST_NAMES)
            self._counts[key] = self._counts.get(key, 0) + count
        column = self.spec.columns.kind
        if column is None:
            return
        kinds = _kinds(piece, column).dictionary_encode()
        names = kinds.dictionary.to_pylist()
        pairs = np.unique(_pair(individuals, kinds.indices.to_numpy()))
        for individual, kind in (divmod(pair, MOST_NAMES) for pair in pairs.tolist()):
            earlier = self._kinds.setdefault(individual, names[kind])
            if earlier != names[kind]:
                message = f'"{names[kind]}" and "{earlier}" are kinds of one individual'
                whose = self._individuals.names[individual]
                place = f"{file.name}, individual {whose}"
                self.errors.note("two kinds of one individual", place, message)

    def _check_names(self, file: TrackFile, piece: pa.Table, first: int) -> None:
        """Note rows without a name, and kinds that no column of a table can have."""
        for column in self._named:
            names = texts(piece[column])
            lacking = pc.or_kleene(pc.is_null(names), pc.equal(names, ""))
            if rows := np.flatnonzero(lacking.to_numpy(zero_copy_only=False)).tolist():
                place = file.place(first + rows[0])
                message = f"{column} is missing"
                self.errors.note("a missing name", place, message, len(rows))
        if self.spec.columns.kind is None:
            return
        kinds = _kinds(piece, self.spec.columns.kind).unique().to_pylist()
        self._present.update(filter(None, kinds))
        for kind in kinds:
            if self.spec.kinds and kind not in self.spec.kinds:
                continue
            if kind and (kind == WORKING or not NAME.fullmatch(kind)):
                message = (
                    f'a kind cannot be called "{shortened(kind)}"; allowed: lower-case'
                    f' letters, digits and _, with a letter first, but not "{WORKING}"'
                )
                self.errors.note("kinds of this name", file.name, message)

    def _chosen(self, piece: pa.Table) -> Wholes:
        """Return the indices of the rows whose kind is read."""
        if not self.spec.kinds or self.spec.columns.kind is None:
            return np.arange(piece.num_rows)
        chosen = pa.array(self.spec.kinds)
        is_chosen = pc.is_in(_kinds(piece, self.spec.columns.kind), value_set=chosen)
        rows: Wholes = np.flatnonzero(is_chosen.to_numpy(zero_copy_only=False))
        return rows

    def _groups(self, file: TrackFile, piece: pa.Table) -> tuple[Wholes, Wholes]:
        """Return the number of the event and of the individual of each row."""
        columns = self.spec.columns
        rows = piece.num_rows
        own = pa.array([self._name(file)])
        is_individual = columns.individual == FILE
        if is_individual:
            individuals = np.repeat(self._individuals.of(own), rows)
        else:
            individuals = self._individuals.of(texts(piece[columns.individual]))
        if columns.event is not None and columns.event != FILE:
            return self._events.of(texts(piece[columns.event])), individuals
        event = pa.array([ALL]) if is_individual and columns.event is None else own
        return np.repeat(self._events.of(event), rows), individuals

    def sort_into(self, folder: Path) -> Iterator[list[TrackRows]]:
        """Write all rows into a folder, and yield the tracks of each event.

        Events and individuals are in the order of their names, numbers by value.
        """
        keys = sorted(self._counts, key=self._order)
        firsts = np.cumsum([0, *(self._counts[key] for key in keys)])
        total = int(firsts[-1])
        shape = (VY + 1, max(total, 1))
        sorted_numbers = np.memmap(folder / "numbers", np.float64, "w+", shape=shape)
        sorted_rows = np.memmap(folder / "rows", np.int64, "w+", shape=shape[1:])
        for name in ("numbers", "rows"):
            reserve(folder / name)
        following = dict(zip(keys, firsts.tolist(), strict=False))
        ends = dict(zip(keys, firsts[1:].tolist(), strict=True))
        row = 0
        tenths = 0
        for file in self.files:
            begin = row
            for piece in file.pieces(self.columns, self.errors):
                rows = self._chosen(piece)
                chosen = piece if rows.size == piece.num_rows else piece.take(rows)
                places = self._places(file, chosen, following, ends)
                numbered = RowsOf(file, row - begin + rows)
                sorted_numbers[:, places] = self._numbers(numbered, chosen)
                sorted_rows[places] = row + rows
                row += piece.num_rows
                if self._ends[-1] > MANY_ROWS and 10 * row // self._ends[-1] > tenths:
                    tenths = 10 * row // self._ends[-1]
                    read = so_many(self._ends[-1], "row")
                    LOG.warning("%d %% of %s read", 10 * tenths, read)
        own_rows = {
            key: slice(end - self._counts[key], end) for key, end in ends.items()
        }
        by_event = defaultdict[int, list[tuple[int, int]]](list)
        for key in keys:
            by_event[key[0]].append(key)
        events = self._events.names
        individuals = self._individuals.names
        for number, own in by_event.items():
            yield [
                TrackRows(
                    events[number],
                    individuals[key[1]],
                    self._kinds.get(key[1], UNNAMED),
                    numbers=sorted_numbers[:, own_rows[key]],
                    rows=sorted_rows[own_rows[key]],
                )
                for key in own
            ]

    def _numbers(self, file: RowsOf, piece: pa.Table) -> Floats:
        values = np.full((VY + 1, piece.num_rows), np.nan)
        before = self.errors.count
        for row, name in enumerate(self._measured):
            read = times if row == TIME else numbers
            values[row] = read(piece, name, file, self.errors)
        lacking = np.flatnonzero(np.isnan(values[TIME]))
        if lacking.size and self.errors.count == before:
            place = file.place(int(lacking[0]))
            message = f"{self._measured[0]} is missing"
            self.errors.note("a missing time", place, message, len(lacking))
        if self.spec.columns.frame:
            values[TIME] *= self.spec.time_step
        if self.spec.coordinates == "degrees":
            self._project(file, values)
        values[X:] *= self.spec.scale
        return values

    def _project(self, file: RowsOf, values: Floats) -> None:
        """Replace degrees by m around the first position of the recording."""
        for row, most in ((X, 180.0), (Y, 90.0)):
            for wrong in np.flatnonzero(np.abs(values[row]) > most):
                name = self._measured[row]
                message = f"{name} is {values[row, wrong]:g}, beyond {most:g} degrees"
                place = file.place(int(wrong))
                self.errors.note("a position beyond the Earth", place, message)
                values[row, wrong] = np.nan
        present = np.flatnonzero(np.isfinite(values[[X, Y]]).all(axis=0))
        if self.centre is None and present.size:
            self.centre = (
                float(values[X, present[0]]),
                float(values[Y, present[0]]),
            )
        if self.centre is not None:
            values[X], values[Y] = projected(values[X], values[Y], self.centre)

    def _places(
        self,
        file: TrackFile,
        piece: pa.Table,
        following: dict[tuple[int, int], int],
        ends: Mapping[tuple[int, int], int],
    ) -> Wholes:
        """Return the place of each row among the sorted rows, and note it as taken.

        `following` has the next free place of each track, and `ends` the end of the
        places of the track. Raises SpecError for rows that the first pass has not seen.
        """
        events, individuals = self._groups(file, piece)
        order = np.lexsort((individuals, events))
        changes = (np.diff(events[order]) != 0) | (np.diff(individuals[order]) != 0)
        places = np.empty(piece.num_rows, np.int64)
        for own in np.split(order, np.flatnonzero(changes) + 1):
            if own.size:
                key = (int(events[own[0]]), int(individuals[own[0]]))
                begin = following.get(key, 0)
                if begin + own.size > ends.get(key, 0):
                    message = "changes while it is read; read a copy of the file"
                    self.errors.note("a file that changes", file.name, message)
                    self.errors.check()
                places[own] = np.arange(begin, begin + own.size)
                following[key] = begin + own.size
        return places

    def _order(self, key: tuple[int, int]) -> tuple[object, ...]:
        event = self._events.names[key[0]]
        individual = self._individuals.names[key[1]]
        kind = self.kinds.index(self._kinds[key[1]]) if self.kinds else 0
        return _by_value(event), kind, _by_value(individual)


def _kinds(piece: pa.Table, column: str) -> pa.Array:
    return pc.utf8_lower(texts(piece[column]))


def _pair(first: Wholes, second: Wholes) -> Wholes:
    """Return a number for each pair of numbers of names, for `divmod`."""
    return first * MOST_NAMES + second


def reserve(path: Path) -> None:
    """Give a sparse file all its blocks, so that a full disk is an error at once.

    Raises OSError if the disk is full. Later it would end the process.
    """
    if hasattr(os, "posix_fallocate"):
        with path.open("r+b") as file:
            os.posix_fallocate(file.fileno(), 0, path.stat().st_size)


def _by_value(name: str) -> tuple[tuple[bool, int, str], ...]:
    """Return a key that sorts numbers in names by value, and before texts."""
    parts = DIGITS.split(name)
    return tuple(
        (False, int(part), part) if DIGITS.fullmatch(part) else (True, 0, part)
        for part in parts
        if part
    )
