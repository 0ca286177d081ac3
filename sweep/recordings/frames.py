"""Frames: positions and velocities of all individuals of an event at regular times."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sweep.recordings.kept_frames import FRAMES, frames_folder, sha_of_frames
from sweep.recordings.row_errors import RowErrors
from sweep.recordings.tracks import (
    TIME,
    VX,
    VY,
    Floats,
    TrackRows,
    Tracks,
    X,
    Y,
    reserve,
)

ON_TIME = 1e-3
"""Largest distance of a row from the time of a frame, in time steps.

The positions of the row are then those of the frame. An individual moves by a
thousandth of a step in this time.
"""
LEAST_PRESENT = 0.01
"""Least share of positions that are measured; a smaller share is a wrong time step."""
FEW = (
    f"less than {100 * LEAST_PRESENT:g} % of the positions have a row; check the units"
    " of time_step and times"
)
DEGREE = 2
"""Degree of the polynomial that smooths positions."""
MOST_VALUES = 2 * 10**9
"""Largest number of positions of an event, which take 64 GB."""
Places = NDArray[np.int64]


class EventFrames:
    """Frames of one event, in a file of a working folder.

    Attributes
    ----------
    path : Path
    low, high : list of float
        Least and largest x and y.
    steps : int
        Number of frames after the first.
    interpolated, present : int
        Numbers of positions.
    """

    def __init__(
        self,
        tracks: Sequence[TrackRows],
        every: Tracks,
        folder: Path,
        errors: RowErrors,
    ) -> None:
        self._spec = every.spec
        self._errors = errors
        self._every = every
        self.name = tracks[0].event
        self.interpolated = 0
        self.present = 0
        self.path = folder / "frames"
        begins = [np.nanmin(track.numbers[TIME]) for track in tracks]
        ends = [np.nanmax(track.numbers[TIME]) for track in tracks]
        self.begin = float(min(begins))
        length = (float(max(ends)) - self.begin) / self._spec.time_step
        self.steps = math.floor(min(length + ON_TIME, MOST_VALUES))
        count = (self.steps + 1) * len(tracks)
        if self.steps < 1:
            message = "all rows have equal times; an event has at least two frames"
            errors.note("an event of one frame", f'event "{self.name}"', message)
        elif count > MOST_VALUES:
            message = (
                f"{self.steps + 1:,} frames; check the units of time_step and times"
            )
            errors.note("too many frames", f'event "{self.name}"', message)
        rows = sum(track.rows.size for track in tracks)
        most = rows * (1.0 + self._spec.gaps / self._spec.time_step)
        if not errors and most < LEAST_PRESENT * count:
            errors.note("few positions", f'event "{self.name}"', FEW)
        if errors:
            return
        shape = (self.steps + 1, 4, len(tracks))
        frames = np.lib.format.open_memmap(self.path, "w+", np.float64, shape)
        reserve(self.path)
        for boid, track in enumerate(tracks):
            frames[:, :, boid] = self._frames_of(track)
        self.low = [float(np.fmin.reduce(frames[:, row], axis=None)) for row in (0, 1)]
        self.high = [float(np.fmax.reduce(frames[:, row], axis=None)) for row in (0, 1)]
        if not errors and self.present < LEAST_PRESENT * count:
            errors.note("few positions", f'event "{self.name}"', FEW)

    def _frames_of(self, track: TrackRows) -> Floats:
        """Return x, y, vx and vy of a track in each frame, shape (F, 4)."""
        has_velocities = self._spec.velocities == "given"
        needed = [X, Y, VX, VY] if has_velocities else [X, Y]
        is_measured = np.isfinite(track.numbers[needed]).all(axis=0)
        values = track.numbers[:, is_measured]
        rows = track.rows[is_measured]
        frames = np.full((self.steps + 1, 4), np.nan)
        times = (values[TIME] - self.begin) / self._spec.time_step
        self._check(track, times, values, rows)
        if self._errors or not times.size:
            return frames
        first, last = self._ends(times)
        numbers = np.arange(first, last + 1)
        before = np.searchsorted(times, numbers + ON_TIME, side="right") - 1
        after = np.minimum(before + 1, times.size - 1)
        exact = np.abs(times[before] - numbers) <= ON_TIME
        gap = (times[after] - times[before]) * self._spec.time_step
        filled = ~exact & (gap <= self._spec.gaps * (1.0 + ON_TIME))
        width = np.where(filled, times[after] - times[before], 1.0)
        share = np.where(exact, 0.0, (numbers - times[before]) / width)
        measured = values[needed]
        between = measured[:, before] + share * (
            measured[:, after] - measured[:, before]
        )
        here = np.where(exact, measured[:, before], between)
        here[:, ~(exact | filled)] = np.nan
        frames[first : last + 1, : len(here)] = here.T
        if self._spec.smoothing:
            frames[:, :2] = self._smoothed(frames[:, :2])
        if not has_velocities:
            frames[:, 2:] = self._differences(frames[:, :2])
            frames[np.isnan(frames[:, 2])] = np.nan
        self.interpolated += int(np.count_nonzero(filled))
        self.present += int(np.count_nonzero(np.isfinite(frames[:, 0])))
        return frames

    def _ends(self, times: Floats) -> tuple[int, int]:
        """Return the first and the last frame between the first and the last row."""
        first = int(np.ceil(times[0] - ON_TIME))
        return first, int(np.floor(times[-1] + ON_TIME))

    def _check(
        self, track: TrackRows, times: Floats, values: Floats, rows: Places
    ) -> None:
        """Note rows that go back in time, are double, too fast or beside a frame."""

        def note(wrong: NDArray[np.bool_], kind: str, message: str) -> None:
            if wrong.any():
                place = self._every.place(int(rows[np.argmax(wrong)]))
                whose = f'individual "{track.individual}"'
                count = int(np.count_nonzero(wrong))
                self._errors.note(kind, place, f"{whose} {message}", count)

        passed = np.diff(times, prepend=-np.inf)
        earlier = (
            "has an earlier time than before; if a file has several events, name the"
            " column of events under `event`"
        )
        note(passed < -ON_TIME, "times out of order", earlier)
        note(np.abs(passed) <= ON_TIME, "double rows", "has two rows with equal times")
        if self._spec.gaps == 0.0:
            message = (
                f"is not at a multiple of time_step ({self._spec.time_step:g}) after"
                " the first row of the event; `gaps` allows interpolation"
            )
            beside = np.abs(times - np.round(times)) > ON_TIME
            note(beside, "times between frames", message)
        if self._spec.fastest is not None and times.size > 1 and (passed > 0).all():
            way = np.hypot(*np.diff(values[[X, Y]], axis=1))
            speed = way / (np.diff(times) * self._spec.time_step)
            message = (
                f"moves at {speed.max(initial=0.0):.4g}"
                f" {self._spec.length}/{self._spec.time}; the largest speed allowed is"
                f" {self._spec.fastest:g}"
            )
            fast = np.concatenate([[False], speed > self._spec.fastest])
            note(fast, "jumps", message)

    def _differences(self, positions: Floats) -> Floats:
        """Return velocities (F, 2) from positions, NaN without a neighbouring frame.

        The difference is central where both neighbouring frames have positions, and
        one-sided at an end. Backward differences use the next frame only at a
        beginning.
        """
        ahead = np.full_like(positions, np.nan)
        behind = ahead.copy()
        steps = np.diff(positions, axis=0) / self._spec.time_step
        ahead[:-1] = behind[1:] = steps
        one_sided = np.where(np.isnan(behind), ahead, behind)
        if self._spec.velocities == "backward":
            return one_sided
        central = np.full_like(positions, np.nan)
        central[1:-1] = (positions[2:] - positions[:-2]) / (2 * self._spec.time_step)
        has_both = np.isfinite(ahead) & np.isfinite(behind)
        return np.where(has_both, central, one_sided)

    def _smoothed(self, positions: Floats) -> Floats:
        """Return positions (F, 2), each on a parabola through the frames around it.

        The filter is that of Savitzky and Golay. A run of frames between two gaps that
        is shorter than `smoothing` has a shorter window; less than five frames stay.
        """
        from scipy.signal import savgol_filter  # 0.3 s to import

        frames = round(self._spec.smoothing / self._spec.time_step)
        window = frames + 1 - frames % 2
        smoothed = positions.copy()
        present = np.isfinite(positions[:, 0])
        edges = np.flatnonzero(np.diff(present, prepend=False, append=False))
        for begin, end in edges.reshape(-1, 2):
            fitting = min(window, end - begin - (end - begin + 1) % 2)
            if fitting > DEGREE + 1:
                run = positions[begin:end]
                smoothed[begin:end] = savgol_filter(run, fitting, DEGREE, axis=0)
        return smoothed

    def moved(self, x: float, y: float) -> None:
        """Move the origin of positions to (x, y).

        Parameters
        ----------
        x, y : float
            The new origin, in the present coordinates.
        """
        frames = np.load(self.path, mmap_mode="r+")
        frames[:, 0] -= x
        frames[:, 1] -= y
        frames.flush()

    def keep(self) -> str:
        """Move the frames into the folder of the user; return their sha256."""
        sha = sha_of_frames(np.load(self.path, mmap_mode="r"))
        self.path.replace(frames_folder() / f"{sha}{FRAMES}")
        return sha
