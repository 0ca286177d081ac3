"""From the section `recording` of a spec to a model with events, by way of a text.

The text has all facts of a recording except the frames. The store keeps the text like
the text of custom code, so that tables need no files.
"""

import json
import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from kernels.model import Event, Model
from kernels.playback import recorded_model
from sweep.errors import StoreError
from sweep.recordings.frames import (
    EventFrames,
    are_kept,
    forget_oldest,
    working_folder,
)
from sweep.recordings.row_errors import RowErrors
from sweep.recordings.rows import TrackFile, check_columns, track_files
from sweep.recordings.tracks import UNNAMED, Tracks
from sweep.spec import RECORDING, Entry, RecordingSpec, read_section

SUFFIX = ".recording"
"""Ending of the text in the list of the files of a study."""


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
    files = track_files(entry, spec)
    _check_velocities(entry, spec)
    for file in files:
        check_columns(entry, file, Tracks(files, spec, RowErrors(entry)).columns)
    stamps = tuple((file.path, *_stamp(file.path)) for file in files)
    text = _described(stamps, spec, _Unhashed((entry, files)))
    if not all(map(are_kept, as_model(text).events)):
        _described.cache_clear()
        text = _described(stamps, spec, _Unhashed((entry, files)))
    return text


class _Unhashed(tuple[Any, ...]):
    """Arguments on which no result depends, besides those that are hashed."""

    __slots__ = ()

    def __hash__(self) -> int:
        return 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Unhashed)


def _stamp(path: Path) -> tuple[int, int]:
    about = path.stat()
    return about.st_size, about.st_mtime_ns


@lru_cache(maxsize=16)
def _described(_stamps: tuple[Any, ...], spec: RecordingSpec, read: _Unhashed) -> str:
    """Read the files, keep the frames and return the text."""
    entry: Entry
    files: list[TrackFile]
    entry, files = read
    errors = RowErrors(entry)
    tracks = Tracks(files, spec, errors)
    tracks.count()
    errors.check()
    low = math.inf, math.inf
    high = -math.inf, -math.inf
    try:
        with working_folder() as folder:
            made = list[tuple[EventFrames, tuple[str, ...]]]()
            for number, own in enumerate(tracks.sort_into(folder)):
                errors.check()
                place = folder / f"event-{number}"
                place.mkdir()
                event = EventFrames(own, tracks, place, errors)
                if not errors:
                    made.append((event, tuple(track.kind for track in own)))
                    corner = event.frames[:, :2]
                    low = tuple(map(min, low, _over(corner, "min")))
                    high = tuple(map(max, high, _over(corner, "max")))
            errors.check()
            if not made:
                raise entry.error("the files have no rows")
            origin = _origin(spec, low)
            size = [
                max(1.0, math.ceil(end - begin))
                for end, begin in zip(high, origin, strict=True)
            ]
            kinds = sorted({kind for _, own in made for kind in own} - {UNNAMED})
            events = [_kept(event, own, kinds, origin) for event, own in made]
    except OSError as error:
        raise StoreError(
            f"frames of the recording cannot be written: {error}"
        ) from None
    forget_oldest([event.sha for event in events])
    return json.dumps(
        {
            "source": spec.source,
            "length": spec.length,
            "dt": spec.time_step,
            "width": size[0],
            "height": size[1],
            "origin": origin,
            "kinds": kinds,
            "events": events,
            "files": {file.name: file.sha() for file in files},
        }
    )


def _origin(spec: RecordingSpec, low: Sequence[float]) -> list[float]:
    """Return the corner of the world, at or below the least x and y by default."""
    if spec.origin is not None:
        return [spec.origin.x, spec.origin.y]
    return [min(0.0, math.floor(value)) for value in low]


def _over(corner: Any, which: str) -> list[float]:
    """Return the least or the largest x and y of frames (F, 2, N), without NaN."""
    import numpy as np

    reduce = {"min": np.fmin, "max": np.fmax}[which].reduce
    return [float(reduce(reduce(corner[:, axis]))) for axis in (0, 1)]


def _kept(
    event: EventFrames, own: tuple[str, ...], kinds: list[str], origin: list[float]
) -> Event:
    if any(origin):
        event.moved(*origin)
    frames, _, boids = event.frames.shape
    return Event(
        name=event.name,
        sha=event.keep(),
        boids=boids,
        steps=frames - 1,
        kinds=tuple(own.count(kind) for kind in kinds),
        interpolated=event.interpolated / (frames * boids),
        absent=1.0 - event.present / (frames * boids),
    )


def _check_velocities(entry: Entry, spec: RecordingSpec) -> None:
    """Raise SpecError if columns of velocities are missing, or have no effect."""
    columns = spec.columns
    named = [name for name in ("vx", "vy") if getattr(columns, name) is not None]
    if spec.velocities == "given" and len(named) < 2:
        raise entry.error("`velocities: given` needs the columns vx and vy")
    if spec.velocities != "given" and named:
        words = (
            f"the column {named[0]} has no effect with `velocities: {spec.velocities}`"
        )
        raise entry.error(f"{words}; write `velocities: given`")


@lru_cache(maxsize=64)
def as_model(text: str) -> Model:
    """Return the model that plays a recording, from the text of the recording.

    Raises ValueError if the text is not valid.
    """
    try:
        facts: Mapping[str, Any] = json.loads(text)
        events = tuple(
            Event(*(tuple(one) if isinstance(one, list) else one for one in event))
            for event in facts["events"]
        )
        return recorded_model(
            RECORDING,
            source=str(facts["source"]),
            events=events,
            preset={name: facts[name] for name in ("dt", "width", "height")},
            kinds=tuple(facts["kinds"]),
            length=str(facts["length"]),
        )
    except (TypeError, KeyError, IndexError) as error:
        raise ValueError(f"the text of a recording is not valid: {error}") from None
