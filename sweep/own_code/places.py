"""Initial positions and velocities of boids, from a CSV file with one row per boid.

The columns are x, y and either `heading` or vx and vy. Lengths are in the unit of the
model, headings in degrees from the x axis towards the y axis. With a column `replicate`
each replicate, counted from 0, starts with the boids of its rows.
"""

import csv
import io
import math
from collections.abc import Iterator

from kernels.starts import Places, Start, given_start
from sweep.errors import CodeError

PLACES = ".csv"
REPLICATE = "replicate"
COLUMNS = (("x", "y", "heading"), ("x", "y", "vx", "vy"))


def read_places(file: str, text: str) -> Start:
    """Return the initial condition that a table defines.

    Parameters
    ----------
    file : str
        Name of the table in messages.
    text : str
        Text of the table.

    Raises
    ------
    CodeError
        If the table cannot be used; the message has the line if there is one.
    """
    rows = csv.reader(io.StringIO(text))
    flocks = dict[int, list[tuple[float, ...]]]()
    try:
        header = [name.strip() for name in next(rows, [])]
        order, replicate_column = _columns(file, header)
        length = len(order) + (replicate_column is not None)
        for row in filter(None, rows):
            line = f"{file}, line {rows.line_num}"
            replicate = _replicate(line, row, replicate_column)
            boid = _boid(line, row, order, length)
            flocks.setdefault(replicate, []).append(boid)
    except csv.Error as error:
        raise CodeError(f"{file}, line {rows.line_num}: {error}") from None
    return given_start([*_in_order(file, flocks)], file)


def _columns(file: str, header: list[str]) -> tuple[list[int], int | None]:
    """Return the indices of the columns of a boid, and of the column of the replicate.

    The second index is None in a table without that column.
    """
    names = {*header} - {REPLICATE}
    columns = next((columns for columns in COLUMNS if {*columns} == names), None)
    if columns is None or len(header) != len({*header}):
        allowed = " or ".join(", ".join(columns) for columns in COLUMNS)
        raise CodeError(
            f"{file}, line 1: wrong columns; allowed: {allowed}; {REPLICATE} may be"
            " added"
        )
    replicate_column = header.index(REPLICATE) if REPLICATE in header else None
    return [header.index(name) for name in columns], replicate_column


def _in_order(
    file: str, flocks: dict[int, list[tuple[float, ...]]]
) -> Iterator[Places]:
    """Yield the flock of each replicate; all have the same number of boids."""
    if not flocks:
        raise CodeError(f"{file} has no boid")
    for replicate in range(len(flocks)):
        if replicate not in flocks:
            raise CodeError(
                f"{file} has no boid of {REPLICATE} {replicate}, but boids of"
                f" {REPLICATE} {max(flocks)}: number replicates from 0, without gaps"
            )
        flock = flocks[replicate]
        first = flocks[0]
        if len(flock) != len(first):
            raise CodeError(
                f"{file} has {len(first)} boids of {REPLICATE} 0, and {len(flock)} of"
                f" {REPLICATE} {replicate}: the numbers must be equal"
            )
        yield tuple(flock)


def _replicate(line: str, row: list[str], column: int | None) -> int:
    """Return the replicate of a row; 0 in a table without that column."""
    if column is None:
        return 0
    text = row[column].strip() if column < len(row) else ""
    if not (text.isascii() and text.isdigit()):
        raise CodeError(f'{line}: {REPLICATE} "{text[:80]}" is not an integer from 0')
    return int(text)


def _boid(
    line: str, row: list[str], order: list[int], length: int
) -> tuple[float, ...]:
    """Return the numbers of a boid, from a row that must have `length` values."""
    try:
        numbers = tuple(float(row[index]) for index in order)
        if len(row) == length and all(map(math.isfinite, numbers)):
            return numbers
    except (ValueError, IndexError):
        pass
    raise CodeError(f"{line}: {', '.join(row)[:80]}: not {length} finite numbers")
