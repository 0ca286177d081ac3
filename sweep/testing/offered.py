"""The promises of the metrics, maps, initial conditions and samplers of a file."""

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.metrics import Metric
from kernels.shapes import boxes_of, numbers_of
from sweep.spec import declaration_of
from sweep.testing.compiled import check_compiled
from sweep.testing.elsewhere import run_elsewhere
from sweep.testing.entrants import Entrant
from sweep.testing.flights import in_words
from sweep.testing.given import POINTS, SIDES, Given, flight_of, given, measured, read
from sweep.trial import obstacles

BEYOND = 3
"""Number of values after the values of frames, which a metric may not change."""
BLANKS = (1.5, -2.5)
"""Content of the values before a metric writes."""
PROGRAM = "sweep.testing.given"
OTHER_SEED = 1
ROUNDING = 1e-9
"""Relative tolerance of values outside of the range."""

Floats = NDArray[np.float64]


def described(entrant: Entrant) -> None:
    """Check that an entry has a text, and a source if entries of the kind have one."""
    for field in ("text", "source"):
        if not getattr(entrant.entry, field, "none").strip():
            raise AssertionError(f"{entrant.place}: {entrant.words} has no {field}")


def allocation(entrant: Entrant) -> None:
    """Check that `kernels.jit.jit` compiles `measure`.

    This compiler rejects code that allocates.
    """
    check_compiled(entrant.entry.measure, "measure")


def values(entrant: Entrant) -> None:
    """Check the values that a metric writes.

    A metric writes one number per frame, and nothing else. The number depends neither
    on the earlier content nor on other frames. The number is in the range that the
    metric declares.
    """
    for job in entrant.jobs():
        for error in _wrong_values(flight_of(job), entrant.entry):
            raise AssertionError(
                f"{entrant.place}: {error} ({in_words(job)}); write values[f] once for"
                " each f in range(filled), from frame f only, and nothing else"
            )
        if error := _beyond(flight_of(job), entrant.entry):
            raise AssertionError(
                f"{entrant.place}: {error} ({in_words(job)}); choose low and high of"
                " the metric so that the range contains all values"
            )


def _beyond(flight: Any, metric: Metric) -> str:
    """Return the first value outside of the range that a metric declares, in words.

    Return "" without such a value. Rounding does not count.
    """
    numbers = measured(flight, metric, np.full(flight.filled, BLANKS[0]))
    low, high = declaration_of(metric).support
    slack = ROUNDING * np.abs(numbers)
    beyond = np.flatnonzero((numbers < low - slack) | (numbers > high + slack))
    if not len(beyond):
        return ""
    first = int(beyond[0])
    return (
        f"frame {first} has the value {float(numbers[first])!r}, but"
        f" {declaration_of(metric).support.words} is declared"
    )


def _wrong_values(flight: Any, metric: Any) -> Iterator[str]:
    filled = flight.filled
    before = _read_by_metrics(flight)
    first, second = (
        measured(flight, metric, np.full(filled + BEYOND, blank)) for blank in BLANKS
    )
    if _read_by_metrics(flight) != before:
        yield "the metric changes frames, ground or world, which are read-only"
    if (first[filled:] != BLANKS[0]).any() or (second[filled:] != BLANKS[1]).any():
        yield "the metric writes values beyond the last frame"
    for f in range(filled):
        if first[f : f + 1].tobytes() != second[f : f + 1].tobytes():
            yield f"the metric does not write the value of frame {f} of {filled}"
    record = flight.record
    for f in range(filled):
        alone = record.frames._replace(
            **{
                name: array[f : f + 1].copy()
                for name, array in record.frames._asdict().items()
            }
        )
        value = np.full(1, BLANKS[0])
        arguments = (alone, 1, flight.ground, flight.observation)
        metric.measure(*arguments, value)
        if value.tobytes() != first[f : f + 1].tobytes():
            yield (
                f"frame {f} has the value {float(first[f])!r} among {filled} frames,"
                f" but {float(value[0])!r} alone"
            )


def _read_by_metrics(flight: Any) -> list[bytes]:
    """Return all arrays that a metric reads, as bytes."""
    ground = flight.ground
    parts = (*flight.record.frames, *ground, *ground.world)
    return [part.tobytes() for part in parts if isinstance(part, np.ndarray)]


def interpreter(entrant: Entrant) -> None:
    """Check that a compiled metric is bitwise identical to plain Python."""
    _same_elsewhere(
        entrant,
        "in plain Python",
        "write x * x * x for x**3, loops for sums of NumPy, and integers below 2**63",
        NUMBA_DISABLE_JIT="1",
    )


def repeats(entrant: Entrant) -> None:
    """Check that a repeated draw of an entry is bitwise identical.

    The draw is repeated in this process and in another process.
    """
    way = "draw only from the given random numbers, and keep nothing in globals"
    for first, again in zip(given(entrant), given(entrant), strict=True):
        if first.numbers.tobytes() != again.numbers.tobytes():
            where = (
                f"{entrant.place}: {entrant.words} draws other values the second time"
            )
            raise AssertionError(f"{where} ({first.where}); {way}")
    _same_elsewhere(entrant, "in another process", way, PYTHONHASHSEED="7")


def _same_elsewhere(entrant: Entrant, where: str, way: str, **environment: str) -> None:
    here = list(given(entrant))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "numbers.npz"
        names = str(entrant.file), entrant.kind, entrant.name, str(file)
        run_elsewhere(where, PROGRAM, *names, **environment)
        numbers = read(file)
    for mine, theirs in zip(here, numbers, strict=True):
        if mine.numbers.tobytes() != theirs.tobytes():
            raise AssertionError(
                f"{entrant.place}: {entrant.words} gives other numbers {where}"
                f"{_first(mine.numbers, theirs)} ({mine.where}); {way}"
            )


def _first(mine: Floats, theirs: Floats) -> str:
    """Return the first number that differs, in words."""
    if mine.shape != theirs.shape:
        return f", in an array of shape {theirs.shape}, not {mine.shape}"
    unlike = np.flatnonzero(mine.view(np.uint64) != theirs.view(np.uint64))[0]
    pair = float(theirs.ravel()[unlike]), float(mine.ravel()[unlike])
    return f", {pair[0]!r} instead of {pair[1]!r}"


def bounds(entrant: Entrant) -> None:
    """Check that an entry draws within the bounds of its kind.

    Obstacles and boids are in the world, and points are in the unit cube.
    """
    checks = {"maps": _wrong_obstacles, "starts": _wrong_flock, "samplers": _wrong_cube}
    for sample in given(entrant):
        if error := checks[entrant.kind](sample):
            raise AssertionError(f"{entrant.place}: {error} ({sample.where})")


def _wrong_obstacles(sample: Given) -> str | None:
    """Return the error in the obstacles of a map; None for valid obstacles.

    A trial rejects numbers that are not finite.
    """
    assert sample.job is not None
    width, height = _sides(sample)
    boxes = boxes_of(obstacles(sample.job), width, height)
    x, y, wide, high, disc = boxes.T
    if ((wide < 0) | (high < 0)).any():
        return (
            "an obstacle has a negative half-width or half-height; allowed: at least 0"
        )
    if not np.isin(disc, (0.0, 1.0)).all():
        return "the last column is neither 0 nor 1; use 1 for a disc, 0 for a rectangle"
    beyond = (x + wide < 0) | (x - wide > width) | (y + high < 0) | (y - high > height)
    for row in boxes[beyond][:1].tolist():
        return (
            f"an obstacle about ({row[0]:g}, {row[1]:g}) is outside the world of"
            f" {width:g} by {height:g}; use settings.width and settings.height"
        )
    return None


def _wrong_flock(sample: Given) -> str | None:
    assert sample.job is not None
    n = int(sample.job.settings["n"])
    width, height = _sides(sample)
    if sample.numbers.shape != (4, n):
        return f"the flock has {sample.numbers.shape[1]} boids, but n is {n}"
    if not np.isfinite(sample.numbers).all():
        return "a position or a velocity is not finite; empty_flock(n) begins with 0"
    x, y = sample.numbers[:2]
    for i in np.flatnonzero((x < 0) | (x > width) | (y < 0) | (y > height))[:1]:
        return (
            f"boid {i} begins at ({x[i]:g}, {y[i]:g}), outside the world of {width:g}"
            f" by {height:g}; use world.width and world.height"
        )
    return None


def _sides(sample: Given) -> tuple[float, float]:
    assert sample.job is not None
    return float(sample.job.settings["width"]), float(sample.job.settings["height"])


def _wrong_cube(sample: Given) -> str | None:
    numbers = sample.numbers
    if len(numbers) not in [len(SIDES) * points for points in POINTS]:
        return f"draw gives {len(numbers)} numbers; give cube.points per name"
    if not ((numbers >= 0) & (numbers < 1)).all():
        return "a number is outside the unit cube; allowed: from 0 to below 1"
    return None


def seeds(entrant: Entrant) -> None:
    """Check that a map whose obstacles depend on the seed has `random=True`."""
    if entrant.entry.random:
        return
    for sample in given(entrant):
        assert sample.job is not None
        job = replace(sample.job, seed=sample.job.seed + OTHER_SEED)
        if numbers_of(obstacles(job)).tobytes() != sample.numbers.tobytes():
            raise AssertionError(
                f"{entrant.place}: {entrant.words} draws other obstacles for another"
                " seed; write Map(..., random=True), otherwise all trials share a map"
            )
