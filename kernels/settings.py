"""The named settings of a study, each described once: what it is, its unit, its range
or its choices; and what they must fulfil together.

Every model has its own `Params`; the groups here are common to all: Schedule,
WorldSettings, Sensing, StartSettings and Observation. A setting with `choices` is
stored in these tuples as the index of its choice. Units are written with the words
length and time, which a model gives their meaning: px and step, or m and s.
"""

import math
from typing import Annotated, Any, Literal, NamedTuple, get_args

Unit = Literal[
    "",
    "length",
    "time",
    "length/time",
    "length/time^2",
    "length^2/time^2",
    "1/time",
    "1/time^2",
    "degrees",
    "radians",
    "pixels",
    "boids",
    "%",
]
"""Of settings and of metrics."""
UNITS: tuple[Unit, ...] = get_args(Unit)


class About(NamedTuple):
    """What a user must know of one setting; `exclusive` says that `low` itself is not
    allowed.

    `rule` names the rule whose weight it is, and `to_goal` says that this rule leads
    boids to the goal. `in_steps` says that it is counted in steps, so that with a
    shorter time step a larger value is the same time.
    """

    text: str
    unit: Unit = ""
    low: float = -math.inf
    high: float = math.inf
    exclusive: bool = False
    choices: tuple[str, ...] = ()
    rule: str = ""
    to_goal: bool = False
    in_steps: bool = False


EachStep = Literal["", "time", "share", "noise"]


class InParts(NamedTuple):
    """Stands after the About of a setting, and says what becomes of its value where a
    step is cut into k shorter ones, so that equations in continuous time stay the same.

    time    the length of a step, of a model whose equations are continuous in time:
            it is divided by k
    share   a share that is lost in each step: what is left after k steps stays
    noise   the width of a random number that is drawn in each step and multiplied by
            its length: it grows with the square root of k, and the variance that the
            noise adds in a time stays

    A model none of whose settings has "time" is a map: its step is what it is.
    """

    each_step: EachStep


class OnlyWhere(NamedTuple):
    """Stands after the About of a setting that changes something only where another
    `setting` has this `choice`.
    """

    setting: str
    choice: str


class Demand(NamedTuple):
    """A condition on the settings of every point, and what to say where it does not
    hold.

    The condition is an expression as specs have them; kernels only carry it.
    """

    condition: str
    message: str


SEQUENTIAL, SYNCHRONOUS = 0, 1
UPDATE = About(
    "sequential: boid after boid, later ones see the new state of earlier ones;"
    " synchronous: all read the old state",
    choices=("sequential", "synchronous"),
)
SYNCHRONOUSLY = {"update": UPDATE.choices[SYNCHRONOUS]}
"""With it a model with the setting UPDATE updates all boids at once."""
INTERACTION_RANGE = About(
    "distance up to which boids act on each other; infinite in the paper",
    "length",
    low=0,
)
METRIC, NEAREST, VORONOI = 0, 1, 2
NEIGHBOURS = About(
    "who counts of those in sight. metric: all; nearest: the nearest ones; voronoi: the"
    " ones whose Voronoi cells share a side with its own",
    choices=("metric", "nearest", "voronoi"),
)
ALL_IN_SIGHT = NEIGHBOURS.choices[METRIC]
OPEN, TORUS, BOUNDED = 0, 1, 2
CONTINUOUS, INTEGER = 0, 1
HEADING, COMPONENTS = 0, 1
DISC, STAMP = 0, 1


class Schedule(NamedTuple):
    """How many boids for how long."""

    n: Annotated[int, About("number of boids", low=1, high=10_000_000)]
    steps: Annotated[int, About("number of updates", low=1, high=10**9, in_steps=True)]


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


class Sensing(NamedTuple):
    """With whom of those that it sees a boid interacts; see kernels.topology."""

    neighbours: Annotated[int, NEIGHBOURS]
    nearest: Annotated[
        int,
        About(
            "how many of those in sight count at most where neighbours is nearest",
            "boids",
            low=1,
            high=10_000_000,
        ),
        OnlyWhere("neighbours", NEIGHBOURS.choices[NEAREST]),
    ]


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
        int, About("how the flock is drawn: which entry of kernels.starts.STARTS")
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
            low=1,
            high=10**9,
            in_steps=True,
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
    "neighbours": ALL_IN_SIGHT,
    "nearest": 7,
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

MOST_PIXELS = 10**8
PIXELS = (
    Demand(
        f"width / pixel * (height / pixel) <= {MOST_PIXELS}",
        f"coverage is counted by pixels, and the world has more than {MOST_PIXELS:,} of"
        " them",
    ),
    Demand(
        "pixel <= min(width, height)",
        "coverage is counted by pixels, and the world has no room for one",
    ),
)
"""Of whatever counts visits by pixel."""
SPEEDS = Demand(
    "min_speed <= max_speed", "the lower limit of the speed is above the upper one"
)
"""Of models with both limits."""
