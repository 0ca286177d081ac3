"""What the page may say, each message with its keys; sweep.web.protocol has the whole
conversation.
"""

from dataclasses import dataclass, field
from typing import Annotated, get_args

from sweep.spec.settings import Value
from sweep.web.state import Shape

Whole = Annotated[int, "from 0"]
Names = tuple[str, ...]


@dataclass(frozen=True)
class Asked:
    """What all messages have: `id`, which the state that answers it repeats."""

    id: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class Hello(Asked):
    """The page is there; `page` tells pages apart, so that one that comes back finds
    its session.
    """

    page: str


@dataclass(frozen=True)
class Set(Asked):
    """A setting gets another value."""

    name: str
    value: Value


@dataclass(frozen=True)
class Model(Asked):
    """Another model or preset."""

    model: str
    preset: str


@dataclass(frozen=True)
class Run(Asked):
    """Go on by itself."""


@dataclass(frozen=True)
class Pause(Asked):
    """Stand still."""


@dataclass(frozen=True)
class Step(Asked):
    """Take so many steps."""

    count: Whole = 1


@dataclass(frozen=True)
class Reset(Asked):
    """Go back to the start, with the settings as they are."""


@dataclass(frozen=True)
class Continue(Asked):
    """Make the run twice as long."""


@dataclass(frozen=True)
class Speed(Asked):
    """How fast to run; 0 is as fast as it goes."""

    steps_per_second: float


@dataclass(frozen=True)
class Shapes(Asked):
    """All obstacles."""

    shapes: list[Shape]


@dataclass(frozen=True)
class Goal(Asked):
    """Where the goal is."""

    x: float
    y: float


@dataclass(frozen=True)
class Select(Asked):
    """Which boid is looked at."""

    boid: Whole | None


@dataclass(frozen=True)
class Overlays(Asked):
    """What is drawn besides the boids."""

    names: Names


@dataclass(frozen=True)
class Metrics(Asked):
    """What is plotted."""

    names: Names


@dataclass(frozen=True)
class Sweep(Asked):
    """A range of a setting, or none."""

    name: str
    low: float = 0.0
    high: float = 0.0
    points: Whole = 0
    off: bool = False


@dataclass(frozen=True)
class Spec(Asked):
    """The spec of what is on the screen is wanted."""


@dataclass(frozen=True)
class Export(Asked):
    """A file is wanted."""

    kind: str


@dataclass(frozen=True)
class Ready(Asked):
    """The last frame is drawn."""


@dataclass(frozen=True)
class Seek(Asked):
    """A frame of a stored trial is wanted."""

    frame: Whole


Message = (
    Hello | Set | Model | Run | Pause | Step | Reset | Continue | Speed | Shapes | Goal | Select | Overlays | Metrics
    | Sweep | Spec | Export | Ready | Seek
)  # fmt: skip
MESSAGES: dict[str, type[Message]] = {
    kind.__name__.lower(): kind for kind in get_args(Message)
}
