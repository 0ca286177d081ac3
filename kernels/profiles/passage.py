"""Profiles, and the inputs of profiles: the positions of boids over a trial."""

import math
from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

from kernels.settings import UNITS
from kernels.state import Floats

Axis = Literal["distance", "lag", "wave number", "box side", "individual"]
"""Quantity along which a profile has values."""
AXIS_UNITS: Mapping[Axis, str] = {
    "distance": "length",
    "lag": "time",
    "wave number": "1/length",
    "box side": "length",
    "individual": "",
}
"""Units of the positions along each axis."""
BINNED: tuple[Axis, ...] = ("distance", "wave number")
"""Axes whose values are for bins; a kernel gets the edges of the bins."""
PROFILE_UNITS = (*UNITS, "length^2")
"""Units of profiles. Stamps of custom code cover UNITS, which thus stay as they are."""


class Passage(NamedTuple):
    """Positions and velocities of N boids in F frames.

    Attributes
    ----------
    x, y, vx, vy : array of float, shape (F, N)
        NaN for a boid without a position, or outside the part of the flock that is
        measured.
    width, height : float
        Size of the world.
    periodic : bool
        Whether the borders are periodic, so distances are the shortest ones.
    """

    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    width: float
    height: float
    periodic: bool


class Profile(NamedTuple):
    """Metric of a trial that has a value at each position along an axis.

    Attributes
    ----------
    measure : callable
        Kernel `(passage, axis, values)`. The kernel reads the `passage` (Passage) and
        the `axis`, an array of float, and writes `values`, an array of float of shape
        (K,). The axis has K + 1 edges of bins for a distance or a wave number. It has K
        values for the others: lags in frames, numbers of boxes along a side. For an
        individual the axis has the lags in frames, and K is the number of boids.
    axis : Axis
    unit : str
        One of PROFILE_UNITS, "" for none.
    text : str
        Description in a few words.
    source : str
        Publication that defines the profile, or "ours".
    formula : str
        Definition for a paper: Markdown, with LaTeX between dollar signs.
    exponent : float
        Factor from the slope of the logarithm of the values, against the logarithm of
        the axis, to the exponent that reports state; 0 if a report states none.
    zero : bool
        Whether reports state the smallest position at which a value is 0.
    in_time : bool
        Whether the kernel writes values in frames, which reports have in time.
    low, high : float
        Bounds of the values.
    part : str
        Part of the boids that the profile measures, see kernels.metrics.parts; "" for
        all.
    """

    measure: Callable[[Passage, Floats, Floats], None]
    axis: Axis
    unit: str
    text: str
    source: str
    formula: str = ""
    exponent: float = 0.0
    zero: bool = False
    in_time: bool = False
    low: float = -math.inf
    high: float = math.inf
    part: str = ""

    @property
    def axis_unit(self) -> str:
        """Unit of the positions along the axis."""
        return AXIS_UNITS[self.axis]
