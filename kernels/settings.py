"""The named settings of a study, each described once: what it is, its unit, its range
or its choices.

Every model has its own `Params`; the groups here are common to all: Schedule,
WorldSettings, StartSettings and Observation. A setting with `choices` is stored in
these tuples as the index of its choice. Units are written with the words length and
time, which a model gives their meaning: px and step, or m and s.
"""

import math
from collections.abc import Callable
from typing import Annotated, Any, NamedTuple


class About(NamedTuple):
    """What a user must know of one setting; `exclusive` says that `low` itself is not
    allowed.
    """

    text: str
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    exclusive: bool = False
    choices: tuple[str, ...] = ()


SEQUENTIAL, SYNCHRONOUS = 0, 1
UPDATE = About(
    "sequential: boid after boid, later ones see the new state of earlier ones;"
    " synchronous: all read the old state",
    choices=("sequential", "synchronous"),
)
OPEN, TORUS, BOUNDED = 0, 1, 2
CONTINUOUS, INTEGER = 0, 1
HEADING, COMPONENTS = 0, 1
NUMPY, PYTHON_RANDOM = 0, 1
DISC, STAMP = 0, 1


class Schedule(NamedTuple):
    """How many boids for how long."""

    n: Annotated[int, About("number of boids", low=1, high=10_000_000)]
    steps: Annotated[int, About("number of updates", low=1, high=10**9)]


class WorldSettings(NamedTuple):
    """Where the boids are; `map` names an entry of kernels.worlds.MAPS."""

    map: Annotated[str, About("environment map: which obstacles there are")]
    width: Annotated[
        float, About("width of the world", "length", low=0, exclusive=True)
    ]
    height: Annotated[
        float, About("height of the world", "length", low=0, exclusive=True)
    ]
    borders: Annotated[
        int,
        About(
            "open: none; torus: positions wrap; bounded: positions and velocities are"
            " mirrored at the border",
            choices=("open", "torus", "bounded"),
        ),
    ]
    minimum_image: Annotated[
        bool, About("boids see each other across the borders of a torus")
    ]
    n_obstacles: Annotated[
        int, About("number of obstacles of map random_obstacles", low=0, high=100_000)
    ]
    obstacle_radius: Annotated[float, About("their radius", "length", low=0)]
    obstacle_margin: Annotated[
        float,
        About("least distance of their centres from the borders", "length", low=0),
    ]
    obstacle_positions: Annotated[
        int,
        About(
            "uniform in the world, or on its integer points",
            choices=("continuous", "integer"),
        ),
    ]
    goal_x: Annotated[float, About("where boids are to go", "length")]
    goal_y: Annotated[float, About("where boids are to go", "length")]


class StartSettings(NamedTuple):
    """How the initial flock is drawn."""

    start_positions: Annotated[
        int,
        About(
            "uniform in the world, or on its integer points",
            choices=("continuous", "integer"),
        ),
    ]
    start_velocities: Annotated[
        int,
        About(
            "heading: start_speed in a uniform direction; components: each uniform"
            " within +-start_speed",
            choices=("heading", "components"),
        ),
    ]
    start_speed: Annotated[
        float, About("initial speed, or bound of its components", "length/time", low=0)
    ]
    start_margin: Annotated[
        float,
        About("least distance of initial positions from the borders", "length", low=0),
    ]
    start_center_x: Annotated[
        float, About("centre of the disc in which boids start", "length")
    ]
    start_center_y: Annotated[
        float, About("centre of the disc in which boids start", "length")
    ]
    start_radius: Annotated[
        float, About("its radius; 0: boids start all over the world", "length", low=0)
    ]
    start_free: Annotated[
        bool, About("initial positions inside obstacles are drawn again")
    ]
    start_draws: Annotated[
        int,
        About(
            "numpy: NumPy's generator; python_random: Python's random.Random in the"
            " order of aziel_chen2025",
            choices=("numpy", "python_random"),
        ),
    ]


class Observation(NamedTuple):
    """What the metrics need to know."""

    flock_range: Annotated[
        float, About("boids nearer than this are of one flock", "length", low=0)
    ]
    goal_radius: Annotated[
        float, About("boids nearer than this to the goal have arrived", "length", low=0)
    ]
    contact_distance: Annotated[
        float, About("boids nearer than this have collided", "length", low=0)
    ]
    equilibrium_tolerance: Annotated[
        float,
        About(
            "neighbours whose velocities differ by less than this part of the speed are"
            " synchronised",
            low=0,
        ),
    ]
    equilibrium_steps: Annotated[
        int,
        About(
            "steps of synchrony with all neighbours that make an equilibrium",
            "",
            low=1,
            high=10**9,
        ),
    ]
    pixel: Annotated[
        float, About("side of a pixel of the coverage", "length", low=0, exclusive=True)
    ]
    footprint: Annotated[
        int,
        About(
            "pixels a boid visits. disc: those whose centre is within footprint_radius;"
            " stamp: the same about its position truncated to integers",
            choices=("disc", "stamp"),
        ),
    ]
    footprint_radius: Annotated[
        float, About("radius of the footprint", "pixels", low=0, high=50)
    ]
    coverage_cv_ddof: Annotated[
        int, About("delta degrees of freedom of coverage_cv", low=0, high=1)
    ]


COMMON: dict[str, Any] = {
    "borders": "open",
    "minimum_image": False,
    "n_obstacles": 0,
    "obstacle_radius": 25.0,
    "obstacle_margin": 100.0,
    "obstacle_positions": "continuous",
    "goal_x": 0.0,
    "goal_y": 0.0,
    "start_positions": "continuous",
    "start_velocities": "heading",
    "start_margin": 0.0,
    "start_center_x": 0.0,
    "start_center_y": 0.0,
    "start_radius": 0.0,
    "start_free": True,
    "start_draws": "numpy",
    "flock_range": 50.0,
    "goal_radius": 50.0,
    "contact_distance": 5.0,
    "equilibrium_tolerance": 0.1,
    "equilibrium_steps": 30,
    "pixel": 1.0,
    "footprint": "disc",
    "footprint_radius": 2.0,
    "coverage_cv_ddof": 0,
}
"""Values for the settings that most models leave alone."""


class PairPotential(NamedTuple):
    """The potential behind linear separation and cohesion; see kernels.metrics.energy.

    Separation gives boid i the acceleration strength * sum(x_i - x_j) over the boids
    nearer than its range; cohesion gives it strength * (mean x_j - x_i) over those
    nearer than its own, less the crowding ones if `cohesion_outside`.
    """

    separation: float
    separation_range: float
    cohesion: float
    cohesion_range: float
    cohesion_outside: bool


NO_POTENTIAL = PairPotential(0.0, 0.0, 0.0, 0.0, False)


class OccupancySettings(NamedTuple):
    """The grid on which a model looks for obstacles: side of a cell, and how far from
    an obstacle cells are taken.
    """

    cell: float
    inflation: float


MOST_CELLS = 10**7
"""Of an occupancy grid."""


class Model(NamedTuple):
    """A published model: its settings, what its authors wrote and ran, and the kernel
    that advances a flock.

    `presets` gives every setting a value, choices by name; `metrics` are those recorded
    unless a study says otherwise. `interaction_range(params)` is the longest distance
    at which boids act on each other. `length` and `time` are the units of the model.
    `pair_potential(params)` and `occupancy(params)` are for models that have one.
    """

    name: str
    source: str
    params: type[Any]
    presets: dict[str, dict[str, Any]]
    metrics: tuple[str, ...]
    interaction_range: Callable[[Any], float]
    advance: Callable[..., bool]
    length: str = "px"
    time: str = "step"
    pair_potential: Callable[[Any], PairPotential] | None = None
    occupancy: Callable[[Any], OccupancySettings] | None = None
