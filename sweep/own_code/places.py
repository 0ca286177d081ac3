"""Where boids start, from a table: a CSV file with a row for each boid.

Its columns are x and y, in the model's unit of length, and either `heading`, in degrees
from the x axis towards the y axis, or vx and vy. With a column `replicate` each
replicate, counted from 0, starts with the boids of its rows.
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
    """The start that a table gives. Raises CodeError, with the line, for what is none.

    file  what errors call it
    text  its text
    """
    rows = csv.reader(io.StringIO(text))
    flocks = dict[int, list[tuple[float, ...]]]()
    try:
        order, which = _columns(file, [name.strip() for name in next(rows, [])])
        for row in filter(None, rows):
            line = f"{file}, line {rows.line_num}"
            replicate = _replicate(line, row, which)
            place = _place(line, row, order, others=which is not None)
            flocks.setdefault(replicate, []).append(place)
    except csv.Error as error:
        raise CodeError(f"{file}, line {rows.line_num}: {error}") from None
    return given_start([*_in_order(file, flocks)], file)


def _columns(file: str, header: list[str]) -> tuple[list[int], int | None]:
    """Where the numbers of a boid stand in a row, and where its replicate does."""
    names = {*header} - {REPLICATE}
    columns = next((one for one in COLUMNS if {*one} == names), None)
    if columns is None or len(header) != len({*header}):
        allowed = " or ".join(", ".join(one) for one in COLUMNS)
        raise CodeError(
            f"{file}, line 1: its columns must be {allowed}; {REPLICATE} may be added"
        )
    which = header.index(REPLICATE) if REPLICATE in header else None
    return [header.index(name) for name in columns], which


def _in_order(
    file: str, flocks: dict[int, list[tuple[float, ...]]]
) -> Iterator[Places]:
    """The flock of each replicate."""
    if not flocks:
        raise CodeError(f"{file} has no boid")
    for replicate in range(len(flocks)):
        if replicate not in flocks:
            raise CodeError(
                f"{file} has no boid of {REPLICATE} {replicate}, and some of"
                f" {max(flocks)}: replicates count from 0, and none is left out"
            )
        found, first = flocks[replicate], flocks[0]
        if len(found) != len(first):
            raise CodeError(
                f"{file} has {len(first)} boids of {REPLICATE} 0, and {len(found)} of"
                f" {REPLICATE} {replicate}: all must have the same number"
            )
        yield tuple(found)


def _replicate(line: str, row: list[str], which: int | None) -> int:
    """The replicate of a row; 0 in a table that does not tell."""
    if which is None:
        return 0
    text = row[which].strip() if which < len(row) else ""
    if not (text.isascii() and text.isdigit()):
        raise CodeError(
            f'{line}: {REPLICATE} "{text[:80]}" is no whole number from 0 on'
        )
    return int(text)


def _place(
    line: str, row: list[str], order: list[int], *, others: bool
) -> tuple[float, ...]:
    """The numbers of a boid; there may be `others` in its row: its replicate."""
    try:
        numbers = tuple(float(row[index]) for index in order)
        if len(row) == len(order) + others and all(map(math.isfinite, numbers)):
            return numbers
    except (ValueError, IndexError):
        pass
    raise CodeError(
        f"{line}: {', '.join(row)[:80]}: not {len(order) + others} finite numbers"
    )
