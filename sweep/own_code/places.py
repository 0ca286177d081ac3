"""Where boids start, from a table: a CSV file with a row for each boid.

Its columns are x and y, in the model's unit of length, and either `heading`, in degrees
from the x axis towards the y axis, or vx and vy.
"""

import csv
import io
import math

from kernels.starts import Places, Start, given_start
from sweep.errors import CodeError

PLACES = ".csv"
COLUMNS = (("x", "y", "heading"), ("x", "y", "vx", "vy"))


def read_places(file: str, text: str) -> Start:
    """The start that a table gives. Raises CodeError, with the line, for what is none.

    file  what errors call it
    text  its text
    """
    rows = csv.reader(io.StringIO(text))
    try:
        header = [name.strip() for name in next(rows, [])]
        columns = next((one for one in COLUMNS if set(one) == set(header)), None)
        if columns is None or len(columns) != len(header):
            allowed = " or ".join(", ".join(one) for one in COLUMNS)
            raise CodeError(f"{file}, line 1: its columns must be {allowed}")
        order = [header.index(name) for name in columns]
        places: Places = tuple(
            _place(file, rows.line_num, row, order) for row in rows if row
        )
    except csv.Error as error:
        raise CodeError(f"{file}, line {rows.line_num}: {error}") from None
    if not places:
        raise CodeError(f"{file} has no boid")
    return given_start(places, file)


def _place(file: str, line: int, row: list[str], order: list[int]) -> tuple[float, ...]:
    try:
        numbers = tuple(float(row[index]) for index in order)
        if len(row) == len(order) and all(map(math.isfinite, numbers)):
            return numbers
    except (ValueError, IndexError):
        pass
    raise CodeError(
        f"{file}, line {line}: {', '.join(row)[:80]}: not {len(order)} finite numbers"
    )
