"""The section `recording`: tracked individuals in place of a model.

The section describes files with positions over time, from which each event becomes a
trial. `sweep.recordings` reads the files.
"""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from kernels.metrics import Metric
from kernels.model import Model
from kernels.playback import parameters_of
from kernels.settings import Actuation, Breakdowns, Medium, Sensing, StartSettings
from sweep.spec.contents import ListOf, Number, OneOf, Text
from sweep.spec.document import Entry, Place
from sweep.spec.expressions import Expression
from sweep.spec.keys import Key, SectionOf
from sweep.spec.mistakes import Mistakes
from sweep.spec.settings import TORUS
from sweep.text import so_many

Velocities = Literal["given", "central", "backward"]
Delimiter = Literal["comma", "semicolon", "tab"]
Coordinates = Literal["plane", "degrees"]
VELOCITIES = OneOf("scheme of velocities", get_args(Velocities))
DELIMITER = OneOf("delimiter", get_args(Delimiter))
COORDINATES = OneOf("kind of coordinates", get_args(Coordinates))
COLUMN = Text("the name of a column")
NO_EFFECT = (Sensing, Actuation, Breakdowns, Medium, StartSettings)
"""Groups of parameters that steer boids, which a recording does not."""
ANY = "*"
"""The names of individuals in a name of columns: x* is x1, x2 and so on."""
FILE = "FILE"
"""Name of a column that every file has: the name of the file without its ending."""
RECORDING = "recording"
"""Key of the section, and name of the model that plays the recording."""


@dataclass(frozen=True)
class TrackColumns:
    """Names of the columns of a recording, as trackdf writes them by default."""

    individual: Annotated[
        str,
        Key(
            COLUMN,
            "name of the individual; FILE: each file is an individual",
            example="animal",
        ),
    ] = "id"
    time: Annotated[
        str,
        Key(
            COLUMN,
            "time in seconds, or date and time, unless `frame` is given",
            example="time",
        ),
    ] = "t"
    frame: Annotated[
        str | None,
        Key(
            COLUMN,
            "number of the frame, instead of `time`",
            otherwise="none",
            example="frame",
        ),
    ] = None
    x: Annotated[
        str,
        Key(
            COLUMN,
            "position along x, or longitude; `x*`: a column per individual, and `*` is"
            " the name",
            example="x_cm",
        ),
    ] = "x"
    y: Annotated[
        str,
        Key(COLUMN, "position along y, or latitude; `y*` as `x*`", example="y_cm"),
    ] = "y"
    vx: Annotated[
        str | None,
        Key(
            COLUMN,
            "velocity along x, for `velocities: given`",
            otherwise="none",
            example="vx",
        ),
    ] = None
    vy: Annotated[
        str | None,
        Key(
            COLUMN,
            "velocity along y, for `velocities: given`",
            otherwise="none",
            example="vy",
        ),
    ] = None
    event: Annotated[
        str | None,
        Key(
            COLUMN,
            "name of the event, which is a trial",
            otherwise="each file is an event, or with `individual: FILE` all files",
            example="drive",
        ),
    ] = None
    kind: Annotated[
        str | None,
        Key(
            COLUMN,
            "kind of the individual, such as sheep or dog",
            otherwise="one kind",
            example="species",
        ),
    ] = None


@dataclass(frozen=True)
class WorldCorner:
    """Lower left corner of the world, in the coordinates of the files after `scale`."""

    x: Annotated[float, Key(Number(), "x of the corner", example="-2")] = 0.0
    y: Annotated[float, Key(Number(), "y of the corner", example="-2")] = 0.0


@dataclass(frozen=True)
class RecordingSpec:
    """Files with tracked individuals, and the way from rows to frames."""

    files: Annotated[
        tuple[str, ...],
        Key(
            ListOf(Text("a path or a pattern"), "paths or patterns"),
            "files with one row per individual and time, or patterns: .csv, .parquet,"
            " .nc of movement, .npz of TRex",
            example="[tracks/*.csv]",
        ),
    ]
    time_step: Annotated[
        float,
        Key(
            Number(above=0),
            "time between two frames, in s or in the unit `time`",
            example="0.1",
        ),
    ]
    columns: Annotated[
        TrackColumns,
        Key(
            SectionOf(TrackColumns),
            "names of the columns",
            otherwise="id, t, x and y",
            example="{individual: animal, time: seconds}",
        ),
    ] = TrackColumns()
    kinds: Annotated[
        tuple[str, ...],
        Key(
            ListOf(Text("a kind"), "kinds"),
            "kinds that are read, in this order; individuals of other kinds are left"
            " out",
            otherwise="all kinds, in alphabetical order",
            example="[sheep, dog]",
        ),
    ] = ()
    length: Annotated[
        str, Key(Text("a unit of length"), "unit of length of the study", example="cm")
    ] = "m"
    time: Annotated[
        str,
        Key(
            Text("a unit of time"),
            "unit of time of the study, in which are `time_step`, `gaps` and all times",
            example="step",
        ),
    ] = "s"
    scale: Annotated[
        float,
        Key(
            Number(above=0),
            "factor from the lengths of the files to the unit of length",
            example="0.01",
        ),
    ] = 1.0
    coordinates: Annotated[
        Coordinates,
        Key(
            COORDINATES,
            "degrees: x is longitude and y is latitude, projected to m before `scale`",
            example="degrees",
        ),
    ] = "plane"
    origin: Annotated[
        WorldCorner | None,
        Key(
            SectionOf(WorldCorner),
            "lower left corner of the world; positions are measured from the corner",
            otherwise="(0, 0), or the least positions if they are negative or far away",
            example="{x: -2, y: 0}",
        ),
    ] = None
    gaps: Annotated[
        float,
        Key(
            Number(least=0),
            "longest time between two rows of an individual that is interpolated",
            otherwise="0, which interpolates nothing",
            example="0.5",
        ),
    ] = 0.0
    velocities: Annotated[
        Velocities,
        Key(
            VELOCITIES,
            "source of velocities: columns of the files, central differences or"
            " backward differences of positions",
            example="given",
        ),
    ] = "central"
    smoothing: Annotated[
        float,
        Key(
            Number(least=0),
            "time over which positions are smoothed by a moving parabola, before"
            " differences become velocities",
            otherwise="0, which smooths nothing",
            example="0.5",
        ),
    ] = 0.0
    fastest: Annotated[
        float | None,
        Key(
            Number(above=0),
            "largest speed between two rows of an individual; a larger one is an error",
            otherwise="no limit",
            example="12",
        ),
    ] = None
    delimiter: Annotated[
        Delimiter, Key(DELIMITER, "delimiter of CSV files", example="semicolon")
    ] = "comma"
    source: Annotated[
        str,
        Key(
            Text("a reference, with the DOI"),
            "reference of the data, which `sweep cite` prints",
            otherwise="none",
            example='"A. Author (2024), Title, doi.org/10.1000/1"',
        ),
    ] = ""


def check_of_recording(
    section: Entry,
    model: Model,
    set_here: Mapping[str, Collection[object]],
    places: Mapping[str, Place],
    expressions: Mapping[Place, Expression],
    strategies: Iterable[str],
) -> None:
    """Raise SpecError for values of parameters that a recording cannot have.

    The parameters are measured or have no effect, or contradict differences.

    Parameters
    ----------
    section : Entry
        The section `recording`.
    model : Model
        Model of a recording.
    set_here : mapping
        Values of the parameters that have a value in the spec.
    places : mapping
        Places of these values in the spec.
    expressions : mapping
        Expressions over points, by place in the spec.
    strategies : iterable of str
        Keys of the sections that add trials or points.
    """
    measured = {"n", "steps", *model.params._fields}
    idle = {name for group in NO_EFFECT for name in group._fields}
    mistakes = Mistakes()
    for name in set_here:
        with mistakes.noted():
            if name in measured:
                message = f'the recording gives the value of "{name}"; remove the key'
                raise section.document.error(places[name], message)
            if name in idle:
                message = f'"{name}" has no effect on recorded individuals'
                message += "; remove the key"
                raise section.document.error(places[name], message)
    by_event = parameters_of(model.events[0], model.kinds)
    for place, expression in expressions.items():
        with mistakes.noted():
            for name in sorted(expression.names & by_event.keys()):
                message = f'"{name}" differs from event to event'
                message += f'; remove it from "{expression.text}"'
                raise section.document.error(place, message)
    for key in strategies:
        with mistakes.noted():
            message = f'"{key}" adds trials, and each event of a recording is one trial'
            raise section.document.error((key,), f'{message}; remove "{key}"')
    with mistakes.noted():
        scheme = section.value.get("velocities", "central")
        if TORUS in set_here.get("borders", ()) and scheme != "given":
            message = "differences of positions are no velocities at periodic borders"
            message += "; use `velocities: given`"
            raise section.document.error(places["borders"], message)
    mistakes.check()


def check_measurable(
    root: Entry,
    model: Model,
    *,
    tables: Iterable[str],
    metrics: Mapping[str, Metric],
    set_here: Collection[str],
) -> None:
    """Raise SpecError for data that need all individuals in each frame, or a range.

    The usual ranges of metrics are those of models in pixels.

    Counts of visits, of events and of contacts, and sums over all steps, include each
    step. An individual without a position would count at its last position.

    Parameters
    ----------
    root : Entry
        The whole spec.
    model : Model
        Model of a recording.
    tables : iterable of str
        Recorded tables that need all individuals.
    metrics : mapping of Metric
        Recorded metrics by name.
    set_here : collection of str
        Parameters with a value in the spec.
    """
    mistakes = Mistakes()
    for name, metric in metrics.items():
        needed = (metric.within, "pixel" if metric.covers else "")
        for parameter in needed:
            with mistakes.noted():
                if parameter and parameter not in set_here:
                    reason = f'metric "{name}" needs "{parameter}" under "fixed"'
                    raise root.document.error(
                        ("record",), f"{reason}, in {model.length}"
                    )
    mistakes.check()
    absent = [event for event in model.events if event.absent > 0.0]
    if not absent:
        return
    first = absent[0]
    why = (
        f"positions are absent in {so_many(len(absent), 'event')}, such as"
        f' "{first.name}" ({100 * first.absent:.2g} %); `gaps` fills short gaps'
    )
    for name, metric in metrics.items():
        with mistakes.noted():
            if not metric.looks:
                reason = f'metric "{name}" needs each individual in each frame'
                raise root.document.error(("record",), f"{reason}; {why}")
    for table in tables:
        with mistakes.noted():
            reason = f"{table} need each individual in each frame"
            raise root.document.error(("record", table), f"{reason}; {why}")
    mistakes.check()
