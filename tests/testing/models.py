"""A good model in a file of its own, and files in which one line of it is changed."""

import re
from pathlib import Path

LINE = "# here"
"""Marks the line that a sentence must name."""
GOOD = '''"""Boids that are drawn to those they see."""

import math
from typing import Annotated, NamedTuple

import numpy as np

from kernels.jit import jit, jit_with_memory
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, cone, move, move_all, search, square_range
from kernels.recording import observe
from kernels.rules.borders import confine
from kernels.rules.obstacles import repulsion_linear
from kernels.settings import COMMON, SEQUENTIAL, UPDATE, About, Demand
from kernels.state import remember

TABLE = np.zeros(3)
WORDS = {"a": 1.0}
PULLED_TO = 0.0


class Params(NamedTuple):
    """The settings."""

    gain: Annotated[float, About("strength of the pull", "1/time^2", low=0)]
    push: Annotated[float, About("strength of obstacles", "1/time^2", low=0)]
    range: Annotated[float, About("how far boids see", "length", low=0)]
    fov: Annotated[float, About("field of view", "degrees", low=0, high=360)]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, About("time of one update", "time", low=0, exclusive=True)]


PRESET = COMMON | {
    "gain": 0.01,
    "push": 0.02,
    "range": 50.0,
    "fov": 360.0,
    "update": "synchronous",
    "dt": 1.0,
    "n": 50,
    "steps": 100,
    "map": "empty",
    "width": 400.0,
    "height": 400.0,
    "start_speed": 2.0,
}


def sight(params):
    """Up to the range, within the field of view."""
    return Sight(params.range, params.fov)


def obstacle_reach(params):
    """Half as far."""
    return params.range / 2


def plain(x):
    """A function that is not compiled."""
    return x + 1.0


@jit
def pull(near, found):
    """The sum of the ways to the others."""
    x, y = 0.0, 0.0
    for k in range(found):
        x += near.dx[k]
        y += near.dy[k]
    return x, y


@jit
def advance(flock, world, params, work, record, rng, steps):
    """Advance the flock."""
    range2, view = square_range(params.range, False), cone(params.fov)
    sequential = params.update == SEQUENTIAL
    seen = flock if sequential else work.before
    for step in range(steps):
        remember(flock, seen)
        for i in range(flock.x.size):
            x, y, vx, vy = seen.x[i], seen.y[i], seen.vx[i], seen.vy[i]
            found = search(seen, world, work.grid, i, range2, view, vx, vy, work.near)
            ax, ay = pull(work.near, found)
            bx, by = repulsion_linear(world, work.reach, params.range / 2, x, y)
            vx += (params.gain * ax + params.push * bx) * params.dt
            vy += (params.gain * ay + params.push * by) * params.dt
            pass
            x, vx = confine(x + vx * params.dt, vx, world.width, world.borders)
            y, vy = confine(y + vy * params.dt, vy, world.height, world.borders)
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = x, y, vx, vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="drawn",
    source="made up for a test",
    params=Params,
    presets={"as_run": PRESET},
    metrics=("speed",),
    sight=sight,
    advance=advance,
    obstacle_reach=obstacle_reach,
    symmetries={"translation": {}, "quarter_turn": {}, "permutation": {}},
)
'''


def written(folder: Path, *edits: tuple[str, str]) -> tuple[Path, int]:
    """The file of the good model with some texts replaced, each of which it has once,
    and the number of the marked line, 0 where none is.
    """
    text = GOOD
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = folder / "drawn.py"
    path.write_text(text, encoding="utf-8")
    lines = text.splitlines()
    marked = [number for number, line in enumerate(lines, 1) if line.endswith(LINE)]
    return path, marked[0] if marked else 0


def doing(code: str) -> tuple[str, str]:
    """The edit that puts code into the step of a boid."""
    return ("            pass\n", f"            {code}\n")


def inside(code: str) -> tuple[str, str]:
    """The same, with the line marked."""
    return doing(f"{code}  {LINE}")


def promise_of(line: str) -> str:
    """The promise that a line of `sweep check` is about, after words of its status."""
    return re.split(r"\s{2,}|\s(?=\w+\s{2,})", line)[1]
