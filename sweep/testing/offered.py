"""What the metrics, maps, starts and samplers of a file promise."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.metrics import Metric
from kernels.shapes import boxes_of, numbers_of
from sweep.spec.recorded import declaration_of
from sweep.testing.compiled import check_compiled
from sweep.testing.elsewhere import run_elsewhere
from sweep.testing.entrants import Entrant
from sweep.testing.flights import in_words
from sweep.testing.given import POINTS, SIDES, Given, flight_of, given, measured, read
from sweep.trial.scenery import obstacles

BEYOND = 3
"""Values after those of frames, which a metric leaves alone."""
BLANKS = (1.5, -2.5)
"""What stands in values before a metric writes."""
PROGRAM = "sweep.testing.given"
OTHER_SEED = 1
ROUNDING = 1e-9
"""Values may lie outside of their range by this part of them."""

Floats = NDArray[np.float64]


def described(one: Entrant) -> None:
    """An entry has a text, and a source where its kind has one."""
    for field in ("text", "source"):
        if not getattr(one.entry, field, "none").strip():
            raise AssertionError(f"{one.place}: {one.words} has no {field}")


def allocation(one: Entrant) -> None:
    """`measure` is compiled by `kernels.jit.jit`, which refuses what allocates."""
    check_compiled(one.entry.measure, "measure")


def values(one: Entrant) -> None:
    """A metric writes a number for each frame, whatever stood there, the same whatever
    other frames it gets; and it writes nothing else. The number lies in the range that
    the metric declares.
    """
    for job in one.jobs():
        for said in _wrong_values(flight_of(job), one.entry):
            raise AssertionError(
                f"{one.place}: {said} ({in_words(job)}); write values[f] once for each"
                " f in range(filled), from frame f alone, and nothing else"
            )
        if said := _beyond(flight_of(job), one.entry):
            raise AssertionError(
                f"{one.place}: {said} ({in_words(job)}); let low and high of the metric"
                " be such that all values lie between them"
            )


def _beyond(flight: Any, metric: Metric) -> str:
    """Which value lies outside of what a metric declares; "" where none does, but for
    rounding.
    """
    found = measured(flight, metric, np.full(flight.filled, BLANKS[0]))
    low, high = declaration_of(metric).support
    slack = ROUNDING * np.abs(found)
    beyond = np.flatnonzero((found < low - slack) | (found > high + slack))
    if not len(beyond):
        return ""
    first = int(beyond[0])
    said = f"frame {first} has the value {float(found[first])!r}"
    return f"{said}, and {declaration_of(metric).support.words} is declared"


def _wrong_values(flight: Any, metric: Any) -> Iterator[str]:
    filled, before = flight.filled, _read_by_metrics(flight)
    first, second = (
        measured(flight, metric, np.full(filled + BEYOND, blank)) for blank in BLANKS
    )
    if _read_by_metrics(flight) != before:
        yield "it changes the frames, the ground or the world that it reads"
    if (first[filled:] != BLANKS[0]).any() or (second[filled:] != BLANKS[1]).any():
        yield "it writes values beyond those of the frames"
    for f in range(filled):
        if first[f : f + 1].tobytes() != second[f : f + 1].tobytes():
            yield f"it does not write the value of frame {f} of {filled}"
    record = flight.record
    for f in range(filled):
        alone = record.frames._replace(
            **{
                name: array[f : f + 1].copy()
                for name, array in record.frames._asdict().items()
            }
        )
        value = np.full(1, BLANKS[0])
        metric.measure(alone, 1, flight.ground, flight.observation, value)
        if value.tobytes() != first[f : f + 1].tobytes():
            yield (
                f"frame {f} has the value {float(first[f])!r} among {filled}, and"
                f" {float(value[0])!r} alone"
            )


def _read_by_metrics(flight: Any) -> list[bytes]:
    """All arrays that a metric gets but its values, as bytes."""
    ground = flight.ground
    parts = (*flight.record.frames, *ground, *ground.world)
    return [part.tobytes() for part in parts if isinstance(part, np.ndarray)]


def interpreter(one: Entrant) -> None:
    """Compiled, a metric has the bits of plain Python."""
    _same_elsewhere(
        one,
        "in plain Python",
        "write x * x * x for x**3, loops for NumPy's sums, and integers below 2**63",
        NUMBA_DISABLE_JIT="1",
    )


def repeats(one: Entrant) -> None:
    """What is drawn has the same bits the second time, and in another process."""
    way = "draw only from the random numbers that it gets, and keep nothing in globals"
    for first, again in zip(given(one), given(one), strict=True):
        if first.numbers.tobytes() != again.numbers.tobytes():
            where = f"{one.place}: {one.words} draws something else the second time"
            raise AssertionError(f"{where} ({first.where}); {way}")
    _same_elsewhere(one, "in another process", way, PYTHONHASHSEED="7")


def _same_elsewhere(one: Entrant, where: str, way: str, **environment: str) -> None:
    here = list(given(one))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "numbers.npz"
        names = str(one.file), one.kind, one.name, str(file)
        run_elsewhere(where, PROGRAM, *names, **environment)
        there = read(file)
    for mine, theirs in zip(here, there, strict=True):
        if mine.numbers.tobytes() != theirs.tobytes():
            raise AssertionError(
                f"{one.place}: {one.words} gives other numbers {where}"
                f"{_first(mine.numbers, theirs)} ({mine.where}); {way}"
            )


def _first(mine: Floats, theirs: Floats) -> str:
    """The first number that differs, in words."""
    if mine.shape != theirs.shape:
        return f", as many as {theirs.shape} and here {mine.shape}"
    unlike = np.flatnonzero(mine.view(np.uint64) != theirs.view(np.uint64))[0]
    pair = float(theirs.ravel()[unlike]), float(mine.ravel()[unlike])
    return f", {pair[0]!r} for {pair[1]!r}"


def bounds(one: Entrant) -> None:
    """What is drawn lies where it must: obstacles and boids in the world, points in the
    unit cube.
    """
    said = {"maps": _wrong_obstacles, "starts": _wrong_flock, "samplers": _wrong_cube}
    for found in given(one):
        if wrong := said[one.kind](found):
            raise AssertionError(f"{one.place}: {wrong} ({found.where})")


def _wrong_obstacles(found: Given) -> str | None:
    """Of finite numbers, which a trial itself asks for."""
    assert found.job is not None
    width, height = _sides(found)
    boxes = boxes_of(obstacles(found.job), width, height)
    x, y, wide, high, disc = boxes.T
    if ((wide < 0) | (high < 0)).any():
        return "an obstacle has a negative half width or height; give all from 0 on"
    if not np.isin(disc, (0.0, 1.0)).all():
        return "the last column is 1 for a disc and 0 for a rectangle, and nothing else"
    beyond = (x + wide < 0) | (x - wide > width) | (y + high < 0) | (y - high > height)
    for row in boxes[beyond][:1].tolist():
        return (
            f"an obstacle about ({row[0]:g}, {row[1]:g}) lies outside the world of"
            f" {width:g} by {height:g}; place all within settings.width and height"
        )
    return None


def _wrong_flock(found: Given) -> str | None:
    assert found.job is not None
    n, (width, height) = int(found.job.settings["n"]), _sides(found)
    if found.numbers.shape != (4, n):
        return f"it gives {found.numbers.shape[1]} boids, and n is {n}"
    if not np.isfinite(found.numbers).all():
        return "a position or a velocity is not finite; empty_flock(n) begins with 0"
    x, y = found.numbers[:2]
    for i in np.flatnonzero((x < 0) | (x > width) | (y < 0) | (y > height))[:1]:
        return (
            f"boid {i} begins at ({x[i]:g}, {y[i]:g}), outside the world of {width:g}"
            f" by {height:g}; place all within world.width and height"
        )
    return None


def _sides(found: Given) -> tuple[float, float]:
    assert found.job is not None
    return float(found.job.settings["width"]), float(found.job.settings["height"])


def _wrong_cube(found: Given) -> str | None:
    numbers = found.numbers
    if len(numbers) not in [len(SIDES) * points for points in POINTS]:
        return f"it gives {len(numbers)} numbers; give cube.points for each of names"
    if not ((numbers >= 0) & (numbers < 1)).all():
        return "its numbers are to be at least 0 and below 1"
    return None


def seeds(one: Entrant) -> None:
    """A map that draws other obstacles for another seed says `random=True`."""
    if one.entry.random:
        return
    for found in given(one):
        assert found.job is not None
        job = replace(found.job, seed=found.job.seed + OTHER_SEED)
        if numbers_of(obstacles(job)).tobytes() != found.numbers.tobytes():
            raise AssertionError(
                f"{one.place}: {one.words} draws other obstacles for another seed;"
                " write Map(..., random=True), else all trials have the same ones"
            )
