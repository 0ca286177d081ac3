"""Initial flocks: the choices of the setting `start_draws`.

To add one, write a function that draws a flock and enter it in STARTS.
"""

from collections.abc import Callable
from typing import NamedTuple

from numpy.random import Generator

from kernels.settings import Demand, StartSettings
from kernels.starts import start
from kernels.state import Flock, World
from kernels.worlds import Reach

Draw = Callable[[int, StartSettings, World, Reach, Generator, int], Flock]
"""`draw(n, settings, world, contact, rng, seed)` gives the positions and velocities of
`n` boids in `world`.

`rng` has the random numbers of the start of this trial, and `seed` is a number for
other generators. `contact` tells quickly whether a place is inside an obstacle, see
`kernels.worlds.inside_any`. It raises RuntimeError where no free place is found, and
the trial fails with that error.
"""


class Start(NamedTuple):
    """A way to draw the initial flock: its function, what it is and where it comes
    from, and what it demands of the other settings.
    """

    draw: Draw
    text: str
    source: str
    demands: tuple[Demand, ...] = ()


# The function of the kernels tells its two starts apart by their places here.
STARTS: dict[str, Start] = {
    "numpy": Start(start, "NumPy's generator", "boidsweep"),
    "python_random": Start(
        start,
        "Python's random.Random in the order of aziel_chen2025",
        "aziel_chen2025, its program",
        (
            Demand(
                "start_radius == 0",
                "start_draws: python_random draws in the whole world:"
                " it needs start_radius 0",
            ),
        ),
    ),
}
"""By their names in specs."""
