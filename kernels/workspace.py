"""What a model's `advance` works with, besides the flock, its world and its parameters."""

from typing import NamedTuple

from kernels.neighbours import Grid, Near
from kernels.state import Flock
from kernels.worlds import Reach


class Workspace(NamedTuple):
    """`grid` and `near` find neighbours, `reach` finds obstacles, `before` is the flock before a synchronous step."""

    grid: Grid
    near: Near
    reach: Reach
    before: Flock
