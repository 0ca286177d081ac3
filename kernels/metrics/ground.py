"""What a metric is, and what it gets to see besides the recorded frames."""

from collections.abc import Callable
from typing import Literal, NamedTuple

from kernels.model import PairPotential
from kernels.recording import Frames
from kernels.settings import Demand, Observation, Unit
from kernels.state import Floats, World

Better = Literal["high", "low"]
X, Y, VX, VY, PREVIOUS_VX, PREVIOUS_VY = range(6)


class Ground(NamedTuple):
    """The world and the number of boids, of traversable pixels and of all pixels, the
    time of a step, the potential.
    """

    world: World
    boids: int
    traversable: int
    pixels: int
    dt: float
    potential: PairPotential


class Metric(NamedTuple):
    """A metric looks at the bodies, or at what was counted during the trial.

    `better` says which values are, where nothing else is said. `pairwise` says that it
    compares boids with each other, which takes longer. `covers`, `counts` and `pairs`
    say that it needs, instead of the bodies: the visited pixels; escapes, collisions
    and arrivals; contacts between boids. `potential` says that it needs a model with a
    pair potential. `demands` are conditions on the settings of whoever records it.
    `short` is what the figure of visits calls it, which shows no metric without one.
    """

    measure: Callable[[Frames, int, Ground, Observation, Floats], None]
    unit: Unit
    text: str
    source: str
    better: Better = "high"
    pairwise: bool = False
    covers: bool = False
    counts: bool = False
    pairs: bool = False
    potential: bool = False
    demands: tuple[Demand, ...] = ()
    short: str = ""

    @property
    def looks(self) -> bool:
        """Whether the metric looks at the bodies."""
        return not (self.covers or self.counts or self.pairs)
