"""What a metric is, and what it gets to see besides the recorded frames."""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

from kernels.model import PairPotential
from kernels.moving import Motion
from kernels.recording import FIRST_STATE, Frames
from kernels.settings import Demand, Observation, Unit
from kernels.state import Floats, Kinds, World

Better = Literal["high", "low", "neither"]
Range = Literal["", "flock_range", "contact_distance", "goal_radius"]
Distribution = Literal["normal", "skewed", "count", "proportion", "percentage"]
X, Y, VX, VY, PREVIOUS_VX, PREVIOUS_VY = range(FIRST_STATE)


class Ground(NamedTuple):
    """The world and the number of boids, of traversable pixels and of all pixels, the
    time of a step, the potential, and of each boid the index of its kind (N,). Where
    `motion` is not None obstacles move, and a metric of them calls
    `place_obstacles(ground.motion, frames.step[f])` before it looks at frame f.
    """

    world: World
    boids: int
    traversable: int
    pixels: int
    dt: float
    potential: PairPotential
    kind: Kinds
    motion: Motion | None = None


class Metric(NamedTuple):
    """A metric looks at the bodies, or at what was counted during the trial.

    `better` says which values are, where nothing else is said: "neither" of what a
    flock is like, apart from any task. `distribution` says how its values, one a trial,
    are distributed: about "normal"; "skewed", with a long
    tail; as a "count" of events; as a "proportion" from 0 to 1 or a "percentage" from 0
    to 100. Its mean then has the interval that holds for these; where nothing is
    declared, that of normal ones, and tables say so. No value is below `low`
    or above `high`, in the unit of the metric, so no interval reaches there; what
    follows from the distribution need not be said again. Only of such a range is there
    an interval where values are equal, but for one at most, and no events. Intervals
    hold less often than in 93 of 100 studies for few values that pile up at an end, for
    counts in clusters, for long tails, and for rare regimes
    (docs/explanations/intervals.md). `pairwise` says that it
    compares boids with each other, which takes longer, and `cubic` that the time of a
    frame grows with the cube of the number of boids. `covers`, `counts` and `pairs` say
    that it needs, instead of the bodies: the visited pixels; escapes, collisions and
    arrivals; contacts between boids. So do `integrates`, sums over all steps of what
    boids do, and `follows`, flocks that are followed from frame to frame. `part` is the
    part of the boids that alone is measured, see kernels.metrics.parts; "" for all.
    `potential` says that it needs a model with a pair potential; `state` and `kinds`,
    that it needs one whose rows of state, and whose kinds of boids, begin with these,
    in this order. Row k of the state is `frames.bodies[f, FIRST_STATE + k]`, and
    `ground.kind[i]` is the index of the kind of boid i. `demands` are conditions on the
    settings of whoever records it. `short` is what the figure of visits calls it, which
    shows no metric without one. `per_step` says that it measures what one step changes,
    so that values with another time step are of something else. `within` is the setting
    that is its range, as flock_range; "" for none.
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
    state: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    demands: tuple[Demand, ...] = ()
    short: str = ""
    distribution: Distribution | None = None
    per_step: bool = False
    low: float = -math.inf
    high: float = math.inf
    cubic: bool = False
    integrates: bool = False
    follows: bool = False
    part: str = ""
    within: Range = ""

    @property
    def looks(self) -> bool:
        """Whether the metric looks at the bodies."""
        counted = self.covers or self.counts or self.pairs
        return not (counted or self.integrates or self.follows)
