"""Metrics, and the inputs of metrics besides recorded frames."""

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
    """World and constants of a trial, as metrics read them.

    Attributes
    ----------
    world : World
    boids, traversable, pixels : int
        Number of boids, of traversable pixels and of all pixels.
    dt : float
        Time of a step.
    potential : PairPotential
    kind : array of int, shape (N,)
        Index of the kind of each boid.
    motion : Motion or None
        Motion of the obstacles; None if obstacles are at rest. A metric of obstacles
        calls `place_obstacles(ground.motion, frames.step[f])` before it reads frame f.
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
    """Metric of the bodies of a frame, or of counts and integrals of the trial.

    No confidence interval extends below `low` or above `high`. If all values but at
    most one are equal, or no event occurred, a confidence interval needs this range.
    The coverage of confidence intervals is below 93 % in four cases: few values that
    accumulate at an end, counts in clusters, long tails, and rare regimes
    (docs/explanations/intervals.md).

    Attributes
    ----------
    measure : callable
        Kernel `(frames, filled, ground, observation, values)`. The kernel reads the
        `filled` first of F `frames` (Frames), the constants of the trial in `ground`
        (Ground) and the parameters of the `observation` (Observation). The kernel
        writes one value per frame into `values`, an array of float of shape (filled,).
        The names of unused parameters begin with an underscore.
    unit : str
        Unit, "" for none.
    text : str
        Description in a few words.
    source : str
        Publication that defines the metric, or "ours".
    better : {"high", "low", "neither"}
        Direction of better values, unless a study states the direction; "neither" for a
        property of the flock that is independent of any task.
    pairwise : bool
        Whether the metric compares pairs of boids, which takes longer.
    covers, counts, pairs : bool
        Whether the metric needs, instead of the bodies: visited pixels; escapes,
        collisions and arrivals; contacts between boids.
    potential : bool
        Whether the metric needs a model with a pair potential.
    state, kinds : tuple of str
        First state rows and first kinds of boids that the model must have, in this
        order. Row k of the state is `frames.bodies[f, FIRST_STATE + k]`, and
        `ground.kind[i]` is the index of the kind of boid i.
    demands : tuple of Demand
        Conditions on the settings of a study that records the metric.
    short : str
        Name in the figure of visits, which shows only metrics with a short name.
    distribution : Distribution or None
        Distribution of the values, one per trial. "normal" is approximately normal, and
        "skewed" has a long tail. "count" is a number of events, "proportion" is from 0
        to 1, and "percentage" from 0 to 100. The mean has the confidence interval for
        this distribution. With None the confidence interval is for normal values, and
        tables report this choice.
    per_step : bool
        Whether the metric measures the change in one step, so that values with
        different time steps are not comparable.
    low, high : float
        Bounds of the values, in the unit of the metric. Bounds that follow from the
        distribution need not be repeated.
    cubic : bool
        Whether the time per frame grows with the cube of the number of boids.
    integrates : bool
        Whether the metric needs sums over all steps of the motion of boids.
    follows : bool
        Whether the metric needs flocks that are followed from frame to frame.
    part : str
        Part of the boids that the metric measures, see kernels.metrics.parts; "" for
        all.
    within : Range
        Parameter that is the range of the metric, such as flock_range; "" without a
        range.
    reads : tuple of str
        Further parameters of the observation that the metric reads.
    formula : str
        Definition for a paper: Markdown, with LaTeX between dollar signs.
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
    reads: tuple[str, ...] = ()
    formula: str = ""

    @property
    def parameters(self) -> tuple[str, ...]:
        """Parameters of the observation that affect the values."""
        of_range = (self.within,) if self.within else ()
        of_coverage = ("pixel", "footprint", "footprint_radius") if self.covers else ()
        return (*of_range, *self.reads, *of_coverage)

    @property
    def looks(self) -> bool:
        """Return whether the metric reads the bodies."""
        counted = self.covers or self.counts or self.pairs
        return not (counted or self.integrates or self.follows)
