"""The messages of the page, a class each; sweep.web.protocol has the conversation."""

from dataclasses import dataclass, field
from typing import Annotated

from sweep.spec import Value
from sweep.web.state import Shape

Whole = Annotated[int, "from 0"]
Names = tuple[str, ...]
Yaml = Annotated[str, "the text of a spec"]


@dataclass(frozen=True)
class Request:
    """The base of all messages.

    Attributes
    ----------
    id : str
        Identifier that the answer repeats.
    side : int
        Number of the run, among two runs side by side: 0 or 1.
    """

    id: str = field(default="", kw_only=True)
    side: Whole = field(default=0, kw_only=True)


@dataclass(frozen=True)
class Hello(Request):
    """The first message of a page, which has a name.

    A page that comes back finds the session by this name. If the session has ended, a
    new session begins with the content that the page has kept. The content is a run,
    two runs side by side, or a stored trial `kept_trial` of the study `kept_study`.

    With a `trial` the session plays this stored trial of `study`. `beside` names a
    second trial of the study, which is played next to the first trial.
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
        """The kept second run, as a single run."""
        return Hello(
            self.page, self.yaml_beside, self.point_beside, self.replicate_beside
        )


@dataclass(frozen=True)
class Set(Request):
    """A new value of a parameter. With `part` the gesture continues."""

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
    """The point of the opened spec at which a varying parameter has this value."""

    name: str
    value: Value


@dataclass(frozen=True)
class StartRun(Request):
    """A request to run without a message for each step."""


@dataclass(frozen=True)
class Pause(Request):
    """A request to take no more steps."""


@dataclass(frozen=True)
class Step(Request):
    """A request to take `count` steps."""

    count: Whole = 1


@dataclass(frozen=True)
class Reset(Request):
    """A request to go back to the start, with the present parameters."""


@dataclass(frozen=True)
class Continue(Request):
    """A request to make the run twice as long."""


@dataclass(frozen=True)
class Speed(Request):
    """The speed of the run in steps per second; 0 is as fast as possible."""

    steps_per_second: float


@dataclass(frozen=True)
class Shapes(Request):
    """The obstacles that replace all present obstacles.

    With `part` the gesture continues.
    """

    shapes: list[Shape]
    part: bool = False


@dataclass(frozen=True)
class Goal(Request):
    """The position of a goal: the first goal, or the goal of this index.

    With `part` the gesture continues.
    """

    x: float
    y: float
    index: Whole = 0
    part: bool = False


@dataclass(frozen=True)
class Select(Request):
    """The selected boid, or None."""

    boid: Whole | None


@dataclass(frozen=True)
class Overlays(Request):
    """The overlays that are drawn with the boids."""

    names: Names


@dataclass(frozen=True)
class Metrics(Request):
    """The metrics that are plotted."""

    names: Names


@dataclass(frozen=True)
class Sweep(Request):
    """A range over which the copied spec sweeps a parameter; `off` ends the sweep."""

    name: str
    low: float = 0.0
    high: float = 0.0
    points: Whole = 0
    off: bool = False


@dataclass(frozen=True)
class Spec(Request):
    """A request for the spec of the run on the screen."""


@dataclass(frozen=True)
class Keep(Request):
    """A request for the run that a page keeps to resume after the end of a session."""


@dataclass(frozen=True)
class Export(Request):
    """A request for a file."""

    kind: str


@dataclass(frozen=True)
class StopExport(Request):
    """A request to stop making a file."""


@dataclass(frozen=True)
class Origin(Request):
    """A request for the names and the metadata of an image of this frame."""


@dataclass(frozen=True)
class Ready(Request):
    """The report that the last frame is drawn."""


@dataclass(frozen=True)
class Seek(Request):
    """A step to go to, of the past of a run or of a stored trial."""

    frame: Whole


@dataclass(frozen=True)
class Undo(Request):
    """A request to take the last edit back."""


@dataclass(frozen=True)
class Redo(Request):
    """A request to repeat the edit that was undone last."""


@dataclass(frozen=True)
class Beside(Request):
    """A request for a second run next to this run, with an equal seed.

    With a `preset` the second run has this preset of the model, and the two runs begin
    at the start. Otherwise the second run has equal parameters, and continues from
    here.
    """

    preset: str = ""


@dataclass(frozen=True)
class Alone(Request):
    """A request to show only this run of two runs."""


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
"""The classes by the `type` of the message."""
