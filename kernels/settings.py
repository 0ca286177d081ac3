"""Parameters and settings of a study, with one description each.

A description gives the text, the unit, and the range or the choices. Some demands
concern several parameters together.

Every model has a class `Params`. The groups here are common to all models: Schedule,
WorldSettings, Sensing, Actuation, Breakdowns, Medium, StartSettings and Observation.
The tuples store a setting with `choices` as the index of the choice. Units are written
with the words length and time. A model defines the units of length and time: px and
step, or m and s.
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
    """Description of a parameter or setting for users.

    `exclusive` is True if `low` itself is not allowed. `rule` names the rule whose
    weight the parameter is. `to_goal` is True if this rule leads boids to the goal.
    `in_steps` is True for a number of steps, so a shorter time step needs a larger
    value for an equal time. `whole_steps` is True for a time that must be an integer
    number of steps. `symbol` is the symbol of the parameter in equations, in LaTeX.
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

    The conversion follows the About of the parameter, and preserves equations in
    continuous time.

    time    the length of a step, of a model with equations in continuous time: the
            value is divided by k
    share   a fraction that is lost in each step: the value becomes
            1 - (1 - value)^(1/k), so the fraction left after k steps is equal
    noise   the width of a random number that is drawn in each step and multiplied by
            the length of the step: the width grows with the square root of k. The
            variance that the noise adds in a given time is equal.

    A model without a parameter marked "time" is a map in discrete time.
    """

    each_step: EachStep


class OnlyWhere(NamedTuple):
    """Condition under which a setting has an effect; placed after the About.

    The `condition` on further settings is an expression in the syntax of specs.
    """

    condition: str


class Demand(NamedTuple):
    """Condition on the settings of every point, and the message if the condition fails.

    The condition is an expression in the syntax of specs; kernels do not evaluate the
    expression.
    """

    condition: str
    message: str


SEQUENTIAL, SYNCHRONOUS = 0, 1
"""Indices of the choices of UPDATE."""
UPDATE = About(
    "sequential: boids are updated one after another, and later boids perceive the new"
    " states of earlier boids; synchronous: all boids perceive the states before the"
    " step",
    choices=("sequential", "synchronous"),
)
TIME_STEP = About("duration of a time step", "time", low=0, exclusive=True)
"""Description of the parameter `dt` of every model."""
INTERACTION_RANGE = About(
    "maximum distance at which boids interact, inclusive; infinite in the paper",
    "length",
    low=0,
)
METRIC, NEAREST, VORONOI = 0, 1, 2
"""Indices of the choices of `neighbours`."""
NEIGHBOURS = About(
    "interaction neighbourhood. metric: all perceived boids; nearest: the nearest"
    " perceived boids; voronoi: perceived boids whose Voronoi cells share a side with"
    " the cell of the boid",
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


RANDOM_OBSTACLES = "map == 'random_obstacles'"
"""Condition under which a spec describes the obstacles."""
IN_A_DISC = "start_radius > 0"
"""Condition under which boids start in a disc."""


Places = tuple[tuple[float, float], ...]
"""Points (x, y), in the order of the list."""


class Schedule(NamedTuple):
    """Number of boids and number of steps."""

    n: Annotated[int, About("number of boids", low=1, high=10_000_000)]
    steps: Annotated[
        int, About("number of time steps", low=1, high=10**9, in_steps=True)
    ]


class WorldSettings(NamedTuple):
    """World of the boids: size, borders, obstacles and goals.

    `map` names an entry of kernels.worlds.MAPS.
    """

    map: Annotated[str, About("environment map, which defines the obstacles")]
    width: Annotated[
        float, About("width of the world", "length", low=0, exclusive=True)
    ]
    height: Annotated[
        float, About("height of the world", "length", low=0, exclusive=True)
    ]
    borders: Annotated[
        int,
        About(
            "boundary condition. open: unbounded; torus: periodic; bounded:"
            " reflecting, positions and velocities are mirrored at the border",
            choices=("open", "torus", "bounded"),
        ),
    ]
    minimum_image: Annotated[
        bool,
        About("whether boids perceive each other across periodic boundaries"),
        OnlyWhere("borders == 'torus'"),
    ]
    n_obstacles: Annotated[
        int,
        About("number of obstacles of map random_obstacles", low=0, high=100_000),
        OnlyWhere(RANDOM_OBSTACLES),
    ]
    obstacle_radius: Annotated[
        float,
        About("radius of the obstacles of map random_obstacles", "length", low=0),
        OnlyWhere(RANDOM_OBSTACLES),
    ]
    obstacle_margin: Annotated[
        float,
        About(
            "minimum distance of the centres of random obstacles from the borders",
            "length",
            low=0,
        ),
        OnlyWhere(RANDOM_OBSTACLES),
    ]
    obstacle_positions: Annotated[
        int,
        About(
            "positions of random obstacles. continuous: uniform in the world; integer:"
            " uniform on the integer points of the world",
            choices=("continuous", "integer"),
        ),
        OnlyWhere(RANDOM_OBSTACLES),
    ]
    goal_x: Annotated[float, About("x coordinate of the first goal", "length")]
    goal_y: Annotated[float, About("y coordinate of the first goal", "length")]
    next_goals: Annotated[
        Places,
        About(
            "positions of further goals, in the order in which boids visit the goals",
            "length",
        ),
    ]
    goals_repeat: Annotated[
        bool,
        About("whether boids go to the first goal again after the last goal"),
        OnlyWhere("next_goals != ''"),
    ]
    obstacle_speed: Annotated[
        float,
        About(
            "speed of obstacles without a velocity in the map, each in a random"
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
    """Sensing model: the neighbours of a boid, and the states that the boid knows.

    See kernels.topology for the neighbours, and kernels.robots.sensing for the known
    states.
    """

    neighbours: Annotated[int, NEIGHBOURS]
    nearest: Annotated[
        int,
        About(
            "maximum number of neighbours if neighbours is nearest (topological"
            " interaction)",
            "boids",
            low=1,
            high=10_000_000,
        ),
        OnlyWhere(f"neighbours == '{NEIGHBOURS.choices[NEAREST]}'"),
    ]
    position_noise: Annotated[
        float,
        About(
            "standard deviation of the measurement error of each position coordinate",
            "length",
            low=0,
        ),
    ]
    velocity_noise: Annotated[
        float,
        About(
            "standard deviation of the measurement error of each velocity component",
            "length/time",
            low=0,
        ),
    ]
    noise_time: Annotated[
        float,
        About(
            "correlation time of the measurement errors; 0: independent errors in"
            " every step",
            "time",
            low=0,
        ),
        OnlyWhere(NOISY),
    ]
    noise_form: Annotated[
        int,
        About(
            "independent: errors of position and velocity are independent; coupled:"
            " the position error is the integral of the velocity error, with a"
            " restoring spring",
            choices=NOISE_FORMS,
        ),
        OnlyWhere(NOISY),
    ]
    own_noise: Annotated[
        int,
        About(
            "measurement errors in the own state that a boid knows. none: no errors;"
            " shared: the errors in the messages of the boid; independent: separate"
            " errors of the same size",
            choices=OWN_NOISES,
        ),
        OnlyWhere(NOISY),
    ]
    sensing_delay: Annotated[
        float,
        About(
            "latency: age of the received states of other boids",
            "time",
            low=0,
            whole_steps=True,
        ),
    ]
    sensing_period: Annotated[
        float,
        About(
            "time between two updates of the received states of other boids; 0: every"
            " step",
            "time",
            low=0,
            whole_steps=True,
        ),
    ]
    radio_range: Annotated[
        float, About("maximum communication distance", "length", low=0)
    ]
    packet_loss: Annotated[
        float,
        About(
            "probability that a message is lost at the distance packet_loss_range; the"
            " probability is proportional to the squared distance, up to 1",
            low=0,
            high=1,
        ),
    ]
    packet_loss_range: Annotated[
        float,
        About(
            "distance at which packet_loss holds; infinite: packet_loss holds at every"
            " distance",
            "length",
            low=0,
            exclusive=True,
        ),
        OnlyWhere("packet_loss > 0"),
    ]
    occlusion: Annotated[
        int,
        About("objects that block the line of sight between boids", choices=OCCLUSION),
    ]
    body_radius: Annotated[
        float,
        About("radius of a boid that blocks the line of sight", "length", low=0),
        OnlyWhere("occlusion == 'boids' or occlusion == 'both'"),
    ]


class Actuation(NamedTuple):
    """Actuation of a boid: limits and errors in following the commanded velocity.

    See kernels.robots.actuation.
    """

    motor_lag: Annotated[
        float,
        About(
            "time constant of a first-order lag: the difference from the commanded"
            " velocity falls to 1/e in this time",
            "time",
            low=0,
        ),
    ]
    motor_acceleration: Annotated[
        float,
        About(
            "upper limit of the acceleration", "length/time^2", low=0, exclusive=True
        ),
    ]
    motor_turn_rate: Annotated[
        float,
        About("upper limit of the turn rate", "degrees/time", low=0, exclusive=True),
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
            "standard deviation of the noise that each velocity component receives in"
            " one unit of time",
            "length/time",
            low=0,
        ),
    ]
    wheels: Annotated[
        bool,
        About(
            "whether boids have a differential drive (unicycle) and move only along"
            " their heading"
        ),
    ]
    motor_spread: Annotated[
        float,
        About(
            "log-normal variability of the actuators between robots: standard"
            " deviation of the logarithms of the factors of the lag and of the limits",
            low=0,
        ),
        OnlyWhere(LIMITED),
    ]


class Breakdowns(NamedTuple):
    """Failures of boids: number, time and kind; see kernels.robots.breakdowns."""

    failing_share: Annotated[
        float, About("fraction of the boids that fail", low=0, high=1)
    ]
    failing_time: Annotated[
        float, About("time of the failure", "time", low=0), OnlyWhere(SOME_FAIL)
    ]
    failing_how: Annotated[
        int,
        About(
            "stop: failed boids halt; drift: failed boids keep their velocity; silent:"
            " other boids receive no messages from failed boids; blind: failed boids"
            " perceive no other boids",
            choices=FAILURES,
        ),
        OnlyWhere(SOME_FAIL),
    ]


class Medium(NamedTuple):
    """Motion of the medium that carries boids; see kernels.robots.wind."""

    wind_x: Annotated[
        float,
        About(
            "x component of the mean velocity of the wind, a flow that carries all"
            " boids",
            "length/time",
        ),
    ]
    wind_y: Annotated[
        float,
        About(
            "y component of the mean velocity of the wind, a flow that carries all"
            " boids",
            "length/time",
        ),
    ]
    gust: Annotated[
        float,
        About(
            "standard deviation of each velocity component that gusts add to the wind,"
            " the same for all boids",
            "length/time",
            low=0,
        ),
    ]
    gust_time: Annotated[
        float,
        About(
            "correlation time of the gusts; 0: independent gusts in every step;"
            " infinite: one constant gust per trial",
            "time",
            low=0,
        ),
        OnlyWhere("gust > 0"),
    ]


class Spread(NamedTuple):
    """Variability of a model parameter from robot to robot.

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
    """Initial condition of the flock."""

    start_positions: Annotated[
        int,
        About(
            "continuous: initial positions are uniform in the world; integer: initial"
            " positions are uniform on the integer points of the world",
            choices=("continuous", "integer"),
        ),
    ]
    start_velocities: Annotated[
        int,
        About(
            "heading: initial velocities have the speed start_speed and a uniform"
            " random direction; components: each component is uniform within"
            " +-start_speed",
            choices=("heading", "components"),
        ),
    ]
    start_speed: Annotated[
        float,
        About(
            "initial speed, or bound of the initial velocity components",
            "length/time",
            low=0,
        ),
    ]
    start_margin: Annotated[
        float,
        About(
            "minimum distance of initial positions from the borders", "length", low=0
        ),
    ]
    start_center_x: Annotated[
        float,
        About("x coordinate of the centre of the disc of initial positions", "length"),
        OnlyWhere(IN_A_DISC),
    ]
    start_center_y: Annotated[
        float,
        About("y coordinate of the centre of the disc of initial positions", "length"),
        OnlyWhere(IN_A_DISC),
    ]
    start_radius: Annotated[
        float,
        About(
            "radius of the disc of initial positions; 0: initial positions in the"
            " whole world",
            "length",
            low=0,
        ),
    ]
    start_free: Annotated[
        bool, About("whether initial positions inside obstacles are drawn again")
    ]
    start_distance: Annotated[
        float,
        About(
            "minimum distance between initial positions; nearer positions are drawn"
            " again",
            "length",
            low=0,
        ),
    ]
    start_draws: Annotated[
        int,
        About("initial condition: method that draws the positions and velocities"),
    ]


class Observation(NamedTuple):
    """Parameters of the metrics."""

    flock_range: Annotated[
        float,
        About(
            "distance below which two boids are linked in one flock", "length", low=0
        ),
    ]
    goal_radius: Annotated[
        float,
        About(
            "distance from a goal below which a boid has reached the goal",
            "length",
            low=0,
        ),
    ]
    contact_distance: Annotated[
        float, About("distance below which two boids collide", "length", low=0)
    ]
    equilibrium_tolerance: Annotated[
        float,
        About(
            "velocity difference of neighbours below which the neighbours are"
            " synchronised, as a fraction of the larger speed",
            low=0,
        ),
    ]
    equilibrium_steps: Annotated[
        int,
        About(
            "number of time steps of synchrony with all neighbours that make an"
            " equilibrium",
            low=1,
            high=10**9,
            in_steps=True,
        ),
    ]
    pixel: Annotated[
        float,
        About(
            "side length of a pixel of the coverage", "length", low=0, exclusive=True
        ),
    ]
    footprint: Annotated[
        int,
        About(
            "pixels that a boid visits. disc: pixels whose centre is within"
            " footprint_radius of the position; stamp: the same disc around the"
            " position truncated to integers",
            choices=("disc", "stamp"),
        ),
    ]
    footprint_radius: Annotated[
        float, About("radius of the footprint of a boid", "pixels", low=0, high=50)
    ]
    coverage_cv_ddof: Annotated[
        int,
        About("delta degrees of freedom of the variance in coverage_cv", low=0, high=1),
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
"""Values of the settings that most models do not change.

A preset without `minimum_image` uses minimum images on a torus: see
`Model.preset_values`.
"""

MOST_PIXELS = 10**8
"""Maximum number of pixels of a world with counted visits."""
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
"""Demands of all counts of visits by pixel."""
SPEEDS = Demand(
    "min_speed <= max_speed", "the lower limit of the speed is above the upper one"
)
"""Demand of models with a lower and an upper limit of the speed."""
