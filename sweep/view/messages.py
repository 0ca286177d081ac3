"""What the page may say, each message with its keys; sweep.view.protocol has the whole conversation."""

from dataclasses import dataclass
from typing import Annotated, get_args

from sweep.fields import Value
from sweep.view.state import Shape

Whole = Annotated[int, "from 0"]
Names = tuple[str, ...]


@dataclass(frozen=True)
class Hello:
    """The page is there; `page` tells pages apart, so that one that comes back finds its session."""

    page: str


@dataclass(frozen=True)
class Set:
    """A setting gets another value."""

    name: str
    value: Value


@dataclass(frozen=True)
class Model:
    """Another model or preset."""

    model: str
    preset: str


@dataclass(frozen=True)
class Run:
    """Go on by itself."""


@dataclass(frozen=True)
class Pause:
    """Stand still."""


@dataclass(frozen=True)
class Step:
    """Take so many steps."""

    count: Whole = 1


@dataclass(frozen=True)
class Reset:
    """Go back to the start, with the settings as they are."""


@dataclass(frozen=True)
class Continue:
    """Make the run twice as long."""


@dataclass(frozen=True)
class Speed:
    """How fast to run; 0 is as fast as it goes."""

    steps_per_second: float


@dataclass(frozen=True)
class Shapes:
    """All obstacles."""

    shapes: list[Shape]


@dataclass(frozen=True)
class Goal:
    """Where the goal is."""

    x: float
    y: float


@dataclass(frozen=True)
class Select:
    """Which boid is looked at."""

    boid: Whole | None


@dataclass(frozen=True)
class Overlays:
    """What is drawn besides the boids."""

    names: Names


@dataclass(frozen=True)
class Metrics:
    """What is plotted."""

    names: Names


@dataclass(frozen=True)
class Sweep:
    """A range of a setting, or none."""

    name: str
    low: float = 0.0
    high: float = 0.0
    points: Whole = 0
    off: bool = False


@dataclass(frozen=True)
class Spec:
    """The spec of what is on the screen is wanted."""


@dataclass(frozen=True)
class Export:
    """A file is wanted."""

    kind: str


@dataclass(frozen=True)
class Ready:
    """The last frame is drawn."""


@dataclass(frozen=True)
class Seek:
    """A frame of a stored trial is wanted."""

    frame: Whole


Message = (
    Hello | Set | Model | Run | Pause | Step | Reset | Continue | Speed | Shapes | Goal | Select | Overlays | Metrics
    | Sweep | Spec | Export | Ready | Seek
)  # fmt: skip
MESSAGES: dict[str, type[Message]] = {kind.__name__.lower(): kind for kind in get_args(Message)}
