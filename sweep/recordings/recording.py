"""From the section `recording` of a spec to the facts and the kept frames."""

import hashlib
import json
import logging
import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from kernels.identity import package_sha
from kernels.model import Event
from sweep.errors import StoreError
from sweep.recordings.facts import SUFFIX, as_model
from sweep.recordings.files import TrackFile
from sweep.recordings.frames import EventFrames
from sweep.recordings.kept_frames import (
    are_kept,
    forget_oldest,
    frames_folder,
    working_folder,
)
from sweep.recordings.row_errors import RowErrors
from sweep.recordings.rows import check_columns, track_files
from sweep.recordings.tracks import Tracks
from sweep.spec import (
    ANY,
    FILE,
    Entry,
    Mistakes,
    RecordingSpec,
    TrackColumns,
    read_section,
)
from sweep.text import installing, so_many

LOG = logging.getLogger("sweep")
FAR = 10.0
"""Distance from (0, 0), in extents of the positions, from which the corner moves."""
FEWEST_SMOOTHED = 4
"""Fewest time steps of the window that smooths: five frames."""
LARGE = 100_000_000
"""Bytes of files whose reading takes several seconds."""


class Individual(NamedTuple):
    """Name and kind of an individual."""

    name: str
    kind: str


def described(entry: Entry) -> str:
    """Return the text of a recording, and keep the frames of its events.

    Parameters
    ----------
    entry : Entry
        The section `recording` of a spec.

    Raises
    ------
    SpecError
        With all mistakes, if the section is wrong or a file cannot be used.
    StoreError
        If the frames cannot be written.
    """
    spec = read_section(RecordingSpec, entry)
    _check_named(entry, spec)
    if ANY in spec.columns.x:
        spec = replace(spec, columns=replace(spec.columns, individual=ANY))
    files = track_files(entry, spec)
    mistakes = Mistakes()
    columns = Tracks(files, spec, RowErrors(entry)).columns
    for file in files:
        with mistakes.noted():
            check_columns(entry, file, columns)
    mistakes.check()
    note = frames_folder() / f"{_key(files, spec)}{SUFFIX}"
    with suppress(OSError, ValueError):
        text = note.read_text("utf-8")
        if all(map(are_kept, as_model(text).events)):
            return text
    size = sum(file.path.stat().st_size for file in files)
    if size > LARGE:
        LOG.warning(
            "reading %s, %.0f MB, once", so_many(len(files), "file"), size / 1e6
        )
    try:
        text = _read(entry, spec, files)
        with working_folder() as folder:
            (folder / "text").write_text(text, "utf-8")
            (folder / "text").replace(note)
    except OSError as error:
        message = f"frames of the recording cannot be written: {error}"
        raise StoreError(message) from None
    return text


def _key(files: Iterable[TrackFile], spec: RecordingSpec) -> str:
    """Return a hash of the state of the files, the section and the reader.

    A changed file has another size or time.
    """
    stamps = [(str(file.path.resolve()), *_state(file.path)) for file in files]
    reader = package_sha(Path(__file__).parent)
    content = json.dumps([reader, stamps, asdict(spec)])
    return hashlib.sha256(content.encode()).hexdigest()


def _state(path: Path) -> tuple[int, int]:
    state = path.stat()
    return state.st_size, state.st_mtime_ns


def _read(entry: Entry, spec: RecordingSpec, files: list[TrackFile]) -> str:
    """Read the files, keep the frames and return the text."""
    errors = RowErrors(entry)
    tracks = Tracks(files, spec, errors)
    tracks.count()
    errors.check()
    low = [math.inf, math.inf]
    high = [-math.inf, -math.inf]
    with working_folder() as folder:
        every_event = list[tuple[EventFrames, list[Individual]]]()
        for number, own in enumerate(tracks.sort_into(folder)):
            errors.check()
            place = folder / f"event-{number}"
            place.mkdir()
            event = EventFrames(own, tracks, place, errors)
            if not errors:
                individuals = [Individual(row.individual, row.kind) for row in own]
                every_event.append((event, individuals))
                low = list(map(min, low, event.low))
                high = list(map(max, high, event.high))
        errors.check()
        if not every_event:
            raise entry.error("the files have no rows")
        origin = _origin(spec, low, high)
        size = [
            max(1.0, math.ceil(end - begin))
            for end, begin in zip(high, origin, strict=True)
        ]
        events = [_kept(event, own, tracks.kinds, origin) for event, own in every_event]
    forget_oldest([event.sha for event in events])
    return json.dumps(
        {
            "source": spec.source,
            "length": spec.length,
            "time": spec.time,
            "dt": spec.time_step,
            "width": size[0],
            "height": size[1],
            "origin": origin,
            "kinds": tracks.kinds,
            "events": events,
            "files": {file.name: file.sha() for file in files},
        }
    )


def _origin(
    spec: RecordingSpec, low: Sequence[float], high: Sequence[float]
) -> list[float]:
    """Return the corner of the world.

    By default the corner is (0, 0), or at or below the least x and y if positions are
    negative, or far away, as in a geographic projection.
    """
    if spec.origin is not None:
        return [spec.origin.x, spec.origin.y]
    extent = max(end - begin for begin, end in zip(low, high, strict=True))
    is_far = max(low) > FAR * extent
    corner = [float(math.floor(value)) for value in low]
    return corner if is_far else [min(0.0, value) for value in corner]


def _kept(
    event: EventFrames,
    own: Sequence[Individual],
    kinds: Sequence[str],
    origin: Sequence[float],
) -> Event:
    if any(origin):
        event.moved(*origin)
    frames = event.steps + 1
    boids = len(own)
    own_kinds = [individual.kind for individual in own]
    return Event(
        name=event.name,
        sha=event.keep(),
        boids=boids,
        steps=frames - 1,
        kinds=tuple(own_kinds.count(kind) for kind in kinds),
        interpolated=event.interpolated / (frames * boids),
        absent=1.0 - event.present / (frames * boids),
        individuals=tuple(individual.name for individual in own),
    )


def _check_named(entry: Entry, spec: RecordingSpec) -> None:
    """Raise SpecError for keys that miss columns, have no effect or contradict."""
    mistakes = Mistakes()
    for key, message in _contradictions(spec):
        with mistakes.noted():
            raise (entry.child(key) if key else entry).error(message)
    mistakes.check()


def _contradictions(spec: RecordingSpec) -> Iterator[tuple[str, str]]:
    """Yield mistakes, each with the key of the section, "" for the section."""
    columns = asdict(spec.columns)
    has_velocities = spec.velocities == "given"
    for key, name in columns.items():
        if name == FILE and key not in ("individual", "event"):
            message = f"{FILE} is allowed for individual and event, not for {key}"
            yield "columns", message
    measured = [columns[key] or "" for key in ("x", "y", "vx", "vy")]
    starred = [name for name in measured if ANY in name]
    if starred and (
        len(starred) != (4 if has_velocities else 2)
        or any(name.count(ANY) > 1 for name in starred)
    ):
        present = ", ".join(filter(None, measured))
        message = f"each column of positions and velocities has one {ANY}, or none has"
        yield "columns", f"{message}; the columns are {present}"
    if starred and spec.columns.individual != TrackColumns.individual:
        message = f"columns with {ANY} name the individuals; remove `individual`"
        yield "columns", message
    if spec.kinds and spec.columns.kind is None:
        yield "kinds", "kinds need a column; write `columns: {kind: NAME}`"
    if spec.coordinates == "degrees" and not find_spec("pyproj"):
        message = f"degrees need pyproj; {installing('geo')} installs the package"
        yield "coordinates", message
    if spec.smoothing and has_velocities:
        message = "smoothing changes positions, not given velocities; use differences"
        yield "smoothing", message
    if 0.0 < spec.smoothing < FEWEST_SMOOTHED * spec.time_step:
        least = FEWEST_SMOOTHED * spec.time_step
        message = f"{spec.smoothing:g} is too short for a parabola; allowed: 0, or"
        yield "smoothing", f"{message} {least:g} and more, {FEWEST_SMOOTHED} time steps"
    named = [key for key in ("vx", "vy") if columns[key] is not None]
    if has_velocities and len(named) < 2:
        yield "", "`velocities: given` needs the columns vx and vy"
    if named and not has_velocities:
        message = f"the column {named[0]} has no effect with"
        message += f" `velocities: {spec.velocities}`; write `velocities: given`"
        yield "columns", message
