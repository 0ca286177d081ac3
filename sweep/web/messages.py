"""The messages of the page, a class each; sweep.web.protocol has the whole
conversation.
"""

from dataclasses import dataclass, field
from typing import Annotated

from sweep.spec.settings import Value
from sweep.web.state import Shape

Whole = Annotated[int, "from 0"]
Names = tuple[str, ...]


@dataclass(frozen=True)
class Request:
    """What all messages have: `id`, which the answer repeats."""

    id: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class Hello(Request):
    """The page is there. `page` is its name: a page that comes back finds its session
    by it.
    """

    page: str


@dataclass(frozen=True)
class Set(Request):
    """A setting gets another value."""

    name: str
    value: Value


@dataclass(frozen=True)
class ChooseModel(Request):
    """Another model or preset."""

    model: str
    preset: str


@dataclass(frozen=True)
class StartRun(Request):
    """Go on without being asked for each step."""


@dataclass(frozen=True)
class Pause(Request):
    """Take no more steps."""


@dataclass(frozen=True)
class Step(Request):
    """Take `count` steps."""

    count: Whole = 1


@dataclass(frozen=True)
class Reset(Request):
    """Go back to the start, with the settings as they are."""


@dataclass(frozen=True)
class Continue(Request):
    """Make the run twice as long."""


@dataclass(frozen=True)
class Speed(Request):
    """How fast to run; 0 is as fast as possible."""

    steps_per_second: float


@dataclass(frozen=True)
class Shapes(Request):
    """Replace all obstacles."""

    shapes: list[Shape]


@dataclass(frozen=True)
class Goal(Request):
    """Where the goal is."""

    x: float
    y: float


@dataclass(frozen=True)
class Select(Request):
    """Select a boid, or none."""

    boid: Whole | None


@dataclass(frozen=True)
class Overlays(Request):
    """Choose what is drawn besides the boids."""

    names: Names


@dataclass(frozen=True)
class Metrics(Request):
    """Choose what is plotted."""

    names: Names


@dataclass(frozen=True)
class Sweep(Request):
    """Let the copied spec sweep a setting over a range; `off` ends that."""

    name: str
    low: float = 0.0
    high: float = 0.0
    points: Whole = 0
    off: bool = False


@dataclass(frozen=True)
class Spec(Request):
    """Ask for the spec of what is on the screen."""


@dataclass(frozen=True)
class Export(Request):
    """Ask for a file."""

    kind: str


@dataclass(frozen=True)
class Ready(Request):
    """The last frame is drawn."""


@dataclass(frozen=True)
class Seek(Request):
    """Ask for a frame of a stored trial."""

    frame: Whole


Message = (
    Hello
    | Set
    | ChooseModel
    | StartRun
    | Pause
    | Step
    | Reset
    | Continue
    | Speed
    | Shapes
    | Goal
    | Select
    | Overlays
    | Metrics
    | Sweep
    | Spec
    | Export
    | Ready
    | Seek
)
MESSAGES: dict[str, type[Message]] = {
    "hello": Hello,
    "set": Set,
    "model": ChooseModel,
    "run": StartRun,
    "pause": Pause,
    "step": Step,
    "reset": Reset,
    "continue": Continue,
    "speed": Speed,
    "shapes": Shapes,
    "goal": Goal,
    "select": Select,
    "overlays": Overlays,
    "metrics": Metrics,
    "sweep": Sweep,
    "spec": Spec,
    "export": Export,
    "ready": Ready,
    "seek": Seek,
}
"""What a message calls itself in its `type`."""
