"""Parameters and settings of a study, each described once.

A description gives the text, the unit, and the range or the choices. Some demands are
on several of them together.

Every model has its own `Params`. The groups here are common to all models: Schedule,
WorldSettings, Sensing, Actuation, Breakdowns, Medium, StartSettings and Observation. A
setting with `choices` is stored in these tuples as the index of its choice. Units are
written with the words length and time, which a model gives their meaning: px and step,
or m and s.
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
    "length^2/time^3",
    "1/time",
    "1/time^2",
    "degrees",
    "degrees/time",
    "radians",
    "pixels",
    "boids",
    "%",
]
"""Units of parameters and of metrics."""
UNITS: tuple[Unit, ...] = get_args(Unit)


class About(NamedTuple):
    """Description of one parameter or setting for users.

    `exclusive` is True if `low` itself is not allowed. `rule` names the rule whose
    weight the parameter is. `to_goal` is True if this rule leads boids to the goal.
    `in_steps` is True for a number of steps, so with a shorter time step a larger value
    is the same time. `whole_steps` is True for a time that must be an integer number of
    steps. `symbol` is the symbol of the parameter in equations, in LaTeX.
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
    whole_steps: bool = False
    symbol: str = ""


EachStep = Literal["", "time", "share", "noise"]
"""Conversion of a value where a step is cut into shorter ones; see InParts."""


class InParts(NamedTuple):
    """Conversion of a parameter where a step is cut into k shorter ones.

    It follows the About of the parameter, and keeps equations in continuous time the
    same.

    time    the length of a step, of a model whose equations are continuous in time:
            it is divided by k
    share   a fraction that is lost in each step: it becomes 1 - (1 - value)^(1/k), so
            that the fraction left after k steps stays
    noise   the width of a random number that is drawn in each step and multiplied by
            its length: it grows with the square root of k, and the variance that the
            noise adds in a time stays

    A model without a parameter marked "time" is a map: its step is no part of a
    continuous time.
    """

    each_step: EachStep


class OnlyWhere(NamedTuple):
    """Condition under which a setting changes anything; it follows the About.

    The `condition` on other settings is an expression as specs have them.
    """

    condition: str


class Demand(NamedTuple):
    """Condition on the settings of every point, and the message where it does not hold.

    The condition is an expression as specs have them; kernels only carry it.
    """

    condition: str
    message: str


SEQUENTIAL, SYNCHRONOUS = 0, 1
"""Indices of the choices of UPDATE."""
UPDATE = About(
    "sequential: boid after boid, later ones see the new state of earlier ones;"
    " synchronous: all read the old state",
    choices=("sequential", "synchronous"),
)
TIME_STEP = About("time of one update", "time", low=0, exclusive=True)
"""Description of the parameter `dt` of every model."""
INTERACTION_RANGE = About(
    "distance up to which boids act on each other; infinite in the paper",
    "length",
    low=0,
)
METRIC, NEAREST, VORONOI = 0, 1, 2
"""Indices of the choices of `neighbours`."""
NEIGHBOURS = About(
    "who counts of those in sight. metric: all; nearest: the nearest ones; voronoi: the"
    " ones whose Voronoi cells share a side with its own",
    choices=("metric", "nearest", "voronoi"),
)
ALL_IN_SIGHT = NEIGHBOURS.choices[METRIC]
OPEN, TORUS, BOUNDED = 0, 1, 2
"""Indices of the choices of `borders`."""
CONTINUOUS, INTEGER = 0, 1
"""Indices of the choices of `start_positions` and of `obstacle_positions`."""
HEADING, COMPONENTS = 0, 1
"""Indices of the choices of `start_velocities`."""
DISC, STAMP = 0, 1
"""Indices of the choices of `footprint`."""


Places = tuple[tuple[float, float], ...]
"""Points (x, y) in the order in which they are listed."""


class Schedule(NamedTuple):
    """Number of boids and number of steps."""

    n: Annotated[int, About("number of boids", low=1, high=10_000_000)]
    steps: Annotated[int, About("number of updates", low=1, high=10**9, in_steps=True)]


class WorldSettings(NamedTuple):
    """World of the boids: size, borders, obstacles and goals.

    `map` names an entry of kernels.worlds.MAPS.
    """

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
        bool,
        About("boids see each other across the borders of a torus"),
        OnlyWhere("borders == 'torus'"),
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
    next_goals: Annotated[
        Places,
        About("where boids are to go from the goal on, one after the other", "length"),
    ]
    goals_repeat: Annotated[
        bool,
        About("after the last goal boids go to the first one again"),
        OnlyWhere("next_goals != ''"),
    ]
    obstacle_speed: Annotated[
        float,
        About(
            "speed of obstacles that have no velocity of their own, each in a random"
            " direction",
            "length/time",
            low=0,
        ),
    ]


OWN_NOISES = ("none", "shared", "independent")
NO_OWN_NOISE, OWN_SHARED, OWN_INDEPENDENT = range(3)
NOISE_FORMS = ("independent", "coupled")
INDEPENDENT, COUPLED = range(2)
OCCLUSION = ("none", "obstacles", "boids", "both")
NOTHING_HIDES, HIDDEN_BY_OBSTACLES, HIDDEN_BY_BOIDS, HIDDEN_BY_BOTH = range(4)
NOISY = "position_noise > 0 or velocity_noise > 0"
"""Condition under which measurements have errors."""
SOME_FAIL = "failing_share > 0"
"""Condition under which boids fail."""
LIMITED = (
    "motor_lag > 0 or motor_min_speed > 0"
    " or min(motor_acceleration, motor_turn_rate, motor_max_speed) < 1e299"
)
"""Condition under which motors have a lag or a limit."""
FAILURES = ("stop", "drift", "silent", "blind")


class Sensing(NamedTuple):
    """Sensing model: the neighbours of a boid, and its knowledge of them and of itself.

    See kernels.topology for the neighbours, and kernels.robots.sensing for the
    knowledge.
    """

    neighbours: Annotated[int, NEIGHBOURS]
    nearest: Annotated[
        int,
        About(
            "how many of those in sight count at most where neighbours is nearest",
            "boids",
            low=1,
            high=10_000_000,
        ),
        OnlyWhere(f"neighbours == '{NEIGHBOURS.choices[NEAREST]}'"),
    ]
    position_noise: Annotated[
        float,
        About(
            "standard deviation of the error of each coordinate of a measured place",
            "length",
            low=0,
        ),
    ]
    velocity_noise: Annotated[
        float,
        About(
            "standard deviation of the error of each component of a measured velocity",
            "length/time",
            low=0,
        ),
    ]
    noise_time: Annotated[
        float,
        About(
            "time in which an error of measurement falls to 1/e of itself in the mean;"
            " 0: errors of different samples are independent",
            "time",
            low=0,
        ),
        OnlyWhere(NOISY),
    ]
    noise_form: Annotated[
        int,
        About(
            "independent: those of place and velocity; coupled: the error of the place"
            " is the integral of that of the velocity, held by a spring",
            choices=NOISE_FORMS,
        ),
        OnlyWhere(NOISY),
    ]
    own_noise: Annotated[
        int,
        About(
            "errors of what a boid knows of itself. none: it has no error; shared: the"
            " errors that others see; independent: others of the same size",
            choices=OWN_NOISES,
        ),
        OnlyWhere(NOISY),
    ]
    sensing_delay: Annotated[
        float,
        About("age of what a boid knows of others", "time", low=0, whole_steps=True),
    ]
    sensing_period: Annotated[
        float,
        About(
            "time between two samples of what a boid knows of others; 0: each step",
            "time",
            low=0,
            whole_steps=True,
        ),
    ]
    radio_range: Annotated[
        float, About("distance up to which a boid hears of others", "length", low=0)
    ]
    packet_loss: Annotated[
        float,
        About(
            "probability that a boid does not hear of one at packet_loss_range in a"
            " sample; at other distances it goes as their square, up to 1",
            low=0,
            high=1,
        ),
    ]
    packet_loss_range: Annotated[
        float,
        About(
            "distance at which packet_loss holds; infinite: it holds at any distance",
            "length",
            low=0,
            exclusive=True,
        ),
        OnlyWhere("packet_loss > 0"),
    ]
    occlusion: Annotated[
        int,
        About("what hides those behind it from a boid", choices=OCCLUSION),
    ]
    body_radius: Annotated[
        float,
        About("radius of a boid that hides others", "length", low=0),
        OnlyWhere("occlusion == 'boids' or occlusion == 'both'"),
    ]


class Actuation(NamedTuple):
    """Motors of a boid, which follow the velocity that the model commands.

    See kernels.robots.actuation.
    """

    motor_lag: Annotated[
        float,
        About(
            "time in which the difference from the wanted velocity falls to 1/e",
            "time",
            low=0,
        ),
    ]
    motor_acceleration: Annotated[
        float,
        About(
            "greatest change of the velocity", "length/time^2", low=0, exclusive=True
        ),
    ]
    motor_turn_rate: Annotated[
        float,
        About("greatest change of the heading", "degrees/time", low=0, exclusive=True),
    ]
    motor_min_speed: Annotated[
        float, About("lower limit of the speed", "length/time", low=0)
    ]
    motor_max_speed: Annotated[
        float, About("upper limit of the speed", "length/time", low=0, exclusive=True)
    ]
    motor_noise: Annotated[
        float,
        About(
            "standard deviation of what noise adds to each component of the velocity"
            " in one unit of time",
            "length/time",
            low=0,
        ),
    ]
    wheels: Annotated[
        bool, About("a boid moves only where it heads, and turns to change that")
    ]
    motor_spread: Annotated[
        float,
        About(
            "standard deviation of the logarithms of factors that each robot has of its"
            " own, of its lag and of each limit",
            low=0,
        ),
        OnlyWhere(LIMITED),
    ]


class Breakdowns(NamedTuple):
    """Failures of boids: how many fail, when and how; see kernels.robots.breakdowns."""

    failing_share: Annotated[float, About("part of the boids that fail", low=0, high=1)]
    failing_time: Annotated[
        float, About("when they fail", "time", low=0), OnlyWhere(SOME_FAIL)
    ]
    failing_how: Annotated[
        int,
        About(
            "stop: they stand; drift: they fly straight on; silent: nobody sees them;"
            " blind: they see nobody",
            choices=FAILURES,
        ),
        OnlyWhere(SOME_FAIL),
    ]


class Medium(NamedTuple):
    """Motion of the medium that carries boids; see kernels.robots.wind."""

    wind_x: Annotated[
        float, About("mean velocity of the medium, which carries boids", "length/time")
    ]
    wind_y: Annotated[
        float, About("mean velocity of the medium, which carries boids", "length/time")
    ]
    gust: Annotated[
        float,
        About(
            "standard deviation of each component of the gusts, which add to the wind"
            " and are the same for all boids",
            "length/time",
            low=0,
        ),
    ]
    gust_time: Annotated[
        float,
        About(
            "time in which a gust falls to 1/e of itself in the mean; 0: gusts of"
            " different steps are independent; infinite: a trial has one gust",
            "time",
            low=0,
        ),
        OnlyWhere("gust > 0"),
    ]


class Spread(NamedTuple):
    """Variability of a parameter of a model from robot to robot.

    `deviation` is the standard deviation of the logarithm of the factors. A value
    beyond `low` or `high` becomes that bound.
    """

    parameter: str
    deviation: float
    low: float
    high: float


class RobotSettings(NamedTuple):
    """Non-idealities of boids and their medium, and differences from boid to boid."""

    sensing: Sensing
    actuation: Actuation
    breakdowns: Breakdowns
    medium: Medium
    spreads: tuple[Spread, ...] = ()


ROBOT_GROUPS = Sensing, Actuation, Breakdowns, Medium
"""Groups of RobotSettings that are settings of every model."""


class StartSettings(NamedTuple):
    """Way to draw the initial flock."""

    start_positions: Annotated[
        int,
        About(
            "boids start uniformly in the world, or on its integer points",
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
    start_distance: Annotated[
        float,
        About(
            "initial positions nearer than this to an earlier one are drawn again",
            "length",
            low=0,
        ),
    ]
    start_draws: Annotated[
        int, About("how the flock is drawn: which entry of kernels.starts.STARTS")
    ]


class Observation(NamedTuple):
    """Parameters of the metrics."""

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
    "n_obstacles": 0,
    "obstacle_radius": 25.0,
    "obstacle_margin": 100.0,
    "obstacle_positions": "continuous",
    "goal_x": 0.0,
    "goal_y": 0.0,
    "obstacle_speed": 0.0,
    "next_goals": "",
    "goals_repeat": False,
    "neighbours": ALL_IN_SIGHT,
    "nearest": 7,
    "position_noise": 0.0,
    "velocity_noise": 0.0,
    "noise_time": 0.0,
    "noise_form": NOISE_FORMS[0],
    "own_noise": OWN_NOISES[0],
    "sensing_delay": 0.0,
    "sensing_period": 0.0,
    "radio_range": math.inf,
    "packet_loss": 0.0,
    "packet_loss_range": math.inf,
    "occlusion": OCCLUSION[0],
    "body_radius": 0.0,
    "motor_lag": 0.0,
    "motor_acceleration": math.inf,
    "motor_turn_rate": math.inf,
    "motor_min_speed": 0.0,
    "motor_max_speed": math.inf,
    "motor_noise": 0.0,
    "wheels": False,
    "motor_spread": 0.0,
    "failing_share": 0.0,
    "failing_time": 0.0,
    "failing_how": FAILURES[0],
    "wind_x": 0.0,
    "wind_y": 0.0,
    "gust": 0.0,
    "gust_time": 0.0,
    "start_positions": "continuous",
    "start_velocities": "heading",
    "start_margin": 0.0,
    "start_center_x": 0.0,
    "start_center_y": 0.0,
    "start_radius": 0.0,
    "start_free": True,
    "start_distance": 0.0,
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
"""Values of the settings that most models leave alone.

Without `minimum_image` a preset has a torus that is periodic: see
`Model.preset_values`.
"""

MOST_PIXELS = 10**8
"""Maximum number of pixels of a world whose visits are counted."""
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
"""Demands of all that counts visits by pixel."""
SPEEDS = Demand(
    "min_speed <= max_speed", "the lower limit of the speed is above the upper one"
)
"""Demand of models with a lower and an upper limit of the speed."""
