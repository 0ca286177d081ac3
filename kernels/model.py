"""Declaration of a model.

A model declares its parameters, its presets, the perception range of its boids, and the
kernel that advances a flock.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, get_args, get_type_hints

import numpy as np

from kernels.settings import (
    UNITS,
    About,
    Actuation,
    Breakdowns,
    Demand,
    Medium,
    Observation,
    Schedule,
    Sensing,
    StartSettings,
    WorldSettings,
)


class Sight(NamedTuple):
    """View of a boid: range, field of view in degrees, and the boundary.

    A boid perceives boids up to `range`, within a cone of `fov` degrees in total. With
    `inclusive` the range itself is included. The cells of the search are at least as
    large as the range.
    """

    range: float
    fov: float = 360.0
    inclusive: bool = False


class Rule(NamedTuple):
    """Steering rule, and the parameter that weights the rule.

    Weight 0 switches the rule off. A rule with `to_goal` leads boids to the goal.
    """

    name: str
    weight: str
    to_goal: bool


class PairPotential(NamedTuple):
    """The potential behind linear separation and cohesion; see kernels.metrics.energy.

    Separation gives boid i the acceleration strength * sum(x_i - x_j) over the boids
    nearer than the separation range. Cohesion gives boid i the acceleration strength *
    (mean x_j - x_i) over the boids nearer than the cohesion range. With
    `cohesion_outside` cohesion leaves out the boids within the separation range.
    """

    separation: float
    separation_range: float
    cohesion: float
    cohesion_range: float
    cohesion_outside: bool


NO_POTENTIAL = PairPotential(0.0, 0.0, 0.0, 0.0, False)
NARROW_POTENTIAL = (
    "the pair potential that is recorded needs a separation_range within that of"
    " cohesion"
)
"""Error message if cohesion has the shorter range: see kernels.metrics.energy."""


class Event(NamedTuple):
    """Event of a recording, which is a trial.

    Attributes
    ----------
    name : str
        Name in the recording.
    sha : str
        sha256 of the measured frames.
    boids, steps : int
        Number of individuals, and of steps from the first frame to the last.
    kinds : tuple of int
        Number of individuals of each kind; () for a recording without kinds.
    interpolated, absent : float
        Shares of positions that were interpolated, and that are missing.
    individuals : tuple of str
        Names of the individuals in the recording.
    """

    name: str
    sha: str
    boids: int
    steps: int
    kinds: tuple[int, ...]
    interpolated: float
    absent: float
    individuals: tuple[str, ...]

    @classmethod
    def read(cls, fields: Sequence[Any]) -> "Event":
        """Return the event of its fields, which JSON keeps as lists."""
        event = cls(*fields)
        return event._replace(
            kinds=tuple(event.kinds), individuals=tuple(event.individuals)
        )


class OccupancySettings(NamedTuple):
    """Settings of the grid on which a model looks for obstacles.

    `cell` is the side of a cell, and `inflation` the distance from an obstacle up to
    which cells are occupied.
    """

    cell: float
    inflation: float


WORKING = "working"
"""Name that metrics give boids that have not failed; see kernels.metrics.parts."""
MOST_CELLS = 10**7
"""Largest number of cells of an occupancy grid."""


BODY_COLUMNS = (
    *("trial_id", "frame", "boid", "x", "y", "vx", "vy", "kind", "index"),
    *("trial", "point", "replicate", "seed", "provenance"),
)
"""Further columns of tables with one row per boid, in all formats."""
NO_STATE: Mapping[str, About] = {}


def only_surfaces(_params: Any) -> float:
    """Return 0, the `obstacle_reach` of a model without obstacle forces."""
    return 0.0


def everyone(_params: Any, n: int) -> int:
    """Return `n`, the `goal_seekers` of a model in which all boids know the goal."""
    return n


Symmetry = Literal[
    "translation", "rotation", "quarter_turn", "reflection", "permutation"
]
"""Transformations without any effect in a world without obstacles.

The goal is in the middle of the world. A translation moves all boids, in an unbounded
world or on a torus. A rotation turns all boids about the middle, by any angle in an
unbounded world, or by a quarter of a turn in a square world. A reflection mirrors all
boids. A permutation changes the order of boids, in updates in which no boid perceives
new states of the step.
"""
NONE_DECLARED: Mapping[Symmetry, Mapping[str, Any]] = {}


class Model(NamedTuple):
    """Published model.

    `presets` gives every parameter a value, choices by name. Only `minimum_image` may
    be missing, see `preset_values`. `metrics` are the default metrics of a study. Some
    fields are functions of the Params of the model. `sight(params)` returns the view of
    a boid. `obstacle_reach(params)` returns the distance from the surface up to which
    an obstacle acts. `goal_seekers(params, n)` returns the number of boids that know
    the goal. `pair_potential(params)` and `occupancy(params)` are for models with a
    pair potential or an occupancy grid. With `faces_heading` a boid at rest looks along
    its last velocity; without, a boid at rest looks all round.

    `symmetries` are the symmetries of the model, each with the required parameters:
    `{"translation": {"wall_weight": 0.0}}`. `sweep check` tests the symmetries.

    `update_order` describes the order in which a step updates boids, for a model
    without the parameter `UPDATE`.

    `state` names the state rows of a boid, in addition to position and velocity; see
    kernels.workspace. `begin_state(params, flock, kind, rng, state)` fills the rows (S,
    N), which are 0 before, for an initial flock. `vectors` are the pairs of rows that
    are components of a vector, and so turn with the flock.

    `kinds` names the kinds of boids. `count_kinds(params, n)` returns the number of
    boids of each kind. The first boids are of the first kind, the next boids of the
    second kind.

    `publishes`, `drives`, `goals_in_turn` and `shared` declare the abilities of the
    robots; see kernels.robots.abilities.

    `at_once` has no effect any more. Models for earlier versions have this field.

    `demands` are conditions on the parameters, and `potential_demands` conditions of
    metrics of the potential. `length` and `time` are the units of the model. With
    `y_down` the y axis of figures points down.

    `equations` describes a step for a paper: Markdown, with LaTeX between dollar signs.

    `events` are the events of a recording; see kernels.playback. A model has none.
    """

    name: str
    source: str
    params: type[Any]
    presets: dict[str, dict[str, Any]]
    metrics: tuple[str, ...]
    sight: Callable[[Any], Sight]
    advance: Callable[..., bool]
    obstacle_reach: Callable[[Any], float] = only_surfaces
    goal_seekers: Callable[[Any, int], int] = everyone
    pair_potential: Callable[[Any], PairPotential] | None = None
    occupancy: Callable[[Any], OccupancySettings] | None = None
    faces_heading: bool = False
    symmetries: Mapping[Symmetry, Mapping[str, Any]] = NONE_DECLARED
    update_order: str = ""
    state: Mapping[str, About] = NO_STATE
    begin_state: Callable[..., None] | None = None
    kinds: tuple[str, ...] = ()
    count_kinds: Callable[[Any, int], tuple[int, ...]] | None = None
    demands: tuple[Demand, ...] = ()
    potential_demands: tuple[Demand, ...] = ()
    length: str = "px"
    time: str = "step"
    y_down: bool = True
    at_once: Mapping[str, Any] | None = None
    vectors: tuple[tuple[str, str], ...] = ()
    publishes: bool | None = None
    drives: bool | None = None
    goals_in_turn: bool | None = None
    shared: tuple[str, ...] | None = None
    equations: str = ""
    events: tuple[Event, ...] = ()

    @property
    def rules(self) -> tuple[Rule, ...]:
        """Rules of the model, in the order of their weights among the parameters."""
        hints = get_type_hints(self.params, include_extras=True)
        settings: dict[str, About] = {
            name: get_args(hint)[1] for name, hint in hints.items()
        }
        return tuple(
            Rule(about.rule, name, about.to_goal)
            for name, about in settings.items()
            if about.rule
        )

    def preset_values(self, preset: str) -> dict[str, Any]:
        """Return the values of a preset.

        Without `minimum_image` in the preset, the value is True on a torus: boids
        perceive boids across the borders.
        """
        values = self.presets[preset]
        return {"minimum_image": values.get("borders") == "torus"} | values

    def seeks_goal(self, params: Any, n: int) -> bool:
        """Return whether a rule with a positive weight leads boids to the goal.

        Parameters
        ----------
        params : Params
            Parameters of the model.
        n : int
            Number of boids; some of them must know the goal.
        """
        return self.goal_seekers(params, n) > 0 and any(
            getattr(params, rule.weight) > 0 for rule in self.rules if rule.to_goal
        )


def kind_counts(model: Model, params: Any, n: int) -> tuple[int, ...]:
    """Return the numbers of boids of each kind, `n` in total; (n,) without kinds.

    Parameters
    ----------
    model : Model
    params : Params
        Parameters of the model.
    n : int
        Number of boids.

    Returns
    -------
    tuple of int
        One count per kind; their sum is `n`.

    Raises
    ------
    RuntimeError
        If `count_kinds` of the model returns an invalid value.
    """
    if model.count_kinds is None:
        return (n,)
    found: object = model.count_kinds(params, n)
    counts = found if isinstance(found, tuple) else ()
    whole = all(isinstance(one, int | np.integer) and one >= 0 for one in counts)
    if not whole or len(counts) != len(model.kinds) or sum(counts) != n:
        raise RuntimeError(
            f"model {model.name}: count_kinds gives {found} for the kinds"
            f" {', '.join(model.kinds)}: it must give a whole number from 0 for each"
            f" kind, and {n} in all"
        )
    return tuple(map(int, counts))


def flaw(model: Model) -> str:
    """Return a description of an error in a model's state and kinds, or ""."""
    return next(_flaws(model), "")


def _flaws(model: Model) -> Iterator[str]:
    if isinstance(model.state, Mapping):
        yield from _flaws_of_state(model)
    else:
        yield "state is no mapping from names to Abouts"
    if model.begin_state and not model.state:
        yield "there is a begin_state, but no state that it could fill"
    pairs = model.vectors if isinstance(model.vectors, tuple) else (None,)
    if not all(_is_pair(pair, list(model.state or ())) for pair in pairs):
        yield "vectors is no tuple of pairs of names of rows of state"
    if not isinstance(model.update_order, str):
        yield "update_order is no text"
    texts = isinstance(model.kinds, tuple) and all(map(_is_text, model.kinds))
    if not texts or len(model.kinds) > len(set(model.kinds)):
        yield "kinds is no tuple of different names"
    elif WORKING in model.kinds:
        yield f'no kind can be called "{WORKING}": so are all that have not failed'
    if bool(model.kinds) != bool(model.count_kinds):
        yield "kinds and count_kinds belong together, and there is only one of them"
    for name in ("begin_state", "count_kinds"):
        if not (getattr(model, name) is None or callable(getattr(model, name))):
            yield f"{name} is no function"


def _flaws_of_state(model: Model) -> Iterator[str]:
    groups = (
        model.params,
        Schedule,
        WorldSettings,
        Sensing,
        Actuation,
        Breakdowns,
        Medium,
        StartSettings,
        Observation,
    )
    settings = {name for group in groups for name in getattr(group, "_fields", ())}
    for name, about in model.state.items():
        refused = f'no state can be called "{name}": '
        if not _is_text(name) or not (name.isascii() and name.isidentifier()):
            yield f"{refused}its name has letters, digits and _"
        elif name.startswith("_") or name != name.lower():
            yield f"{refused}its name has small letters, and begins with one"
        elif name in BODY_COLUMNS:
            yield f"{refused}tables have a column of that name"
        elif name in settings:
            yield f"{refused}there is a setting of that name"
        if not isinstance(about, About) or about.unit not in UNITS:
            yield f'state "{name}" needs an About with a unit of settings'


def _is_pair(pair: object, names: list[str]) -> bool:
    if not isinstance(pair, tuple) or len(pair) != 2:
        return False
    return all(one in names for one in pair)


def _is_text(name: object) -> bool:
    return isinstance(name, str) and name != ""
