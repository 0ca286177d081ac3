"""The messages of the page, a class each; sweep.web.protocol has the whole
conversation.
"""

from dataclasses import dataclass, field
from typing import Annotated

from sweep.spec.settings import Value
from sweep.web.state import Shape

Whole = Annotated[int, "from 0"]
Names = tuple[str, ...]
Yaml = Annotated[str, "the text of a spec"]


@dataclass(frozen=True)
class Request:
    """What all messages have: `id`, which the answer repeats, and `side`: which one of
    two runs side by side it is about, 0 or 1.
    """

    id: str = field(default="", kw_only=True)
    side: Whole = field(default=0, kw_only=True)


@dataclass(frozen=True)
class Hello(Request):
    """The page is there. `page` is its name: a page that comes back finds its session
    by it. Where there is none any more, the session begins with what the page has kept:
    of one run, of two side by side, or of a stored trial, `kept_trial`, of a study.
    With a `trial` it is that of a stored trial of a study; `beside` names another one
    of it that is played beside that one.
    """

    page: str
    yaml: Yaml = ""
    point: str = ""
    replicate: Whole = 0
    yaml_beside: Yaml = ""
    point_beside: str = ""
    replicate_beside: Whole = 0
    kept_study: str = ""
    kept_trial: str = ""
    study: str = ""
    trial: str = ""
    beside: str = ""

    @property
    def of_second(self) -> "Hello":
        """What was kept of the second run, as if it were the only one."""
        return Hello(
            self.page, self.yaml_beside, self.point_beside, self.replicate_beside
        )


@dataclass(frozen=True)
class Set(Request):
    """A setting gets another value. `part`: more of the same gesture comes."""

    name: str
    value: Value
    part: bool = False


@dataclass(frozen=True)
class ChooseModel(Request):
    """Another model or preset."""

    model: str
    preset: str


@dataclass(frozen=True)
class ShowTrial(Request):
    """Another trial of the opened spec."""

    point: Whole
    replicate: Whole


@dataclass(frozen=True)
class ShowValue(Request):
    """The point of the opened spec at which a setting that varies has this value."""

    name: str
    value: Value


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
    """Replace all obstacles. `part`: more of the same gesture comes."""

    shapes: list[Shape]
    part: bool = False


@dataclass(frozen=True)
class Goal(Request):
    """Where a goal is: the first one, or that of this index among several. `part`: more
    of the same gesture comes.
    """

    x: float
    y: float
    index: Whole = 0
    part: bool = False


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
class Keep(Request):
    """Ask for what a page needs to go on when its session is gone."""


@dataclass(frozen=True)
class Export(Request):
    """Ask for a file."""

    kind: str


@dataclass(frozen=True)
class StopExport(Request):
    """The file that is being made is not wanted any more."""


@dataclass(frozen=True)
class Origin(Request):
    """Ask what a picture of this frame says of itself."""


@dataclass(frozen=True)
class Ready(Request):
    """The last frame is drawn."""


@dataclass(frozen=True)
class Seek(Request):
    """Go to a step that was shown before, or of a stored trial."""

    frame: Whole


@dataclass(frozen=True)
class Undo(Request):
    """Take the last edit back."""


@dataclass(frozen=True)
class Redo(Request):
    """Make the edit again that was undone last."""


@dataclass(frozen=True)
class Beside(Request):
    """Show a second run beside this one, with the same seed: of another preset of the
    model, from the start of both; or where none is named of the same settings, from
    here on.
    """

    preset: str = ""


@dataclass(frozen=True)
class Alone(Request):
    """Of two runs side by side show only this one."""


Message = (
    Hello
    | Set
    | ChooseModel
    | ShowTrial
    | ShowValue
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
    | Keep
    | Export
    | StopExport
    | Origin
    | Ready
    | Seek
    | Undo
    | Redo
    | Beside
    | Alone
)
MESSAGES: dict[str, type[Message]] = {
    "hello": Hello,
    "set": Set,
    "model": ChooseModel,
    "trial": ShowTrial,
    "value": ShowValue,
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
    "keep": Keep,
    "export": Export,
    "stop": StopExport,
    "origin": Origin,
    "ready": Ready,
    "seek": Seek,
    "undo": Undo,
    "redo": Redo,
    "beside": Beside,
    "alone": Alone,
}
"""What a message calls itself in its `type`."""
