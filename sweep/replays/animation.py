"""Figures of a trial: one frame, or an animation of all frames.

Boids are triangles that point in the direction of motion, with one colour per kind.
Failed boids have a cross. In an animation, lines show the last positions. The figure
shows the world with obstacles, goals that attract boids, and visited pixels if the
trial records coverage. Everything that does not change is drawn once, including
obstacles that do not move.
"""

from collections import deque
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib import style
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.patheffects import Normal, withStroke
from numpy.typing import NDArray

from sweep.design import Job
from sweep.errors import ChoiceError
from sweep.figures import (
    BLUE,
    DOTS,
    GREEN,
    MILLIMETRES,
    STYLE,
    PrintSize,
    colours_of_kinds,
    draw_flock,
    draw_map,
    draw_obstacles,
    fit,
    note,
    number_goals,
    words,
)
from sweep.replays.flight import Report, shown_frames
from sweep.replays.video import FRAMES_A_SECOND, write_gif, write_mp4
from sweep.tables import unfinished
from sweep.trial import failures_of, kinds_of, world_of

MOST_FRAMES = 600
WIDTH_INCHES = 6.4
DPI = 110
COLUMN = PrintSize(89.0)
"""The size of a single frame: a column of a journal."""
TRIANGLES = 45
"""The number of boids that fit in a row along the longer side of the world."""

BOIDS = BLUE
"""The colour of boids without kinds."""
TRAIL = 15
"""The number of earlier figures that a trail shows in an animation."""
TRAIL_COLOUR = "0.75"

VISITED = (0.94, 0.73, 0.25)
"""The colour of pixels that boids have visited: red, green and blue."""
OPACITY = 0.45
ON_WHITE = 248, 224, 169
"""The colour of visited pixels on white, in a figure of 8 bits."""

NO_ROWS = np.empty((0, 5))
"""An empty table of obstacles: the map is drawn without obstacles that move."""

Picture = NDArray[np.uint8]
"""Pixels (rows, columns, 3): red, green and blue."""


class Scene:
    """A figure of the world of a trial, into which frames are drawn in order.

    `every` is the number of steps between two frames of an animation, which has trails;
    None for one frame, which has the size of a column of a journal.
    """

    def __init__(self, study: str, job: Job, every: int | None = None) -> None:
        self.job = job
        self.world = world_of(job)
        self.model = job.catalogue.models[job.model]
        self.failures = failures_of(job)
        self.length = max(self.world.width, self.world.height) / TRIANGLES
        with style.context(STYLE):
            self.figure = (
                Figure(figsize=self._size(WIDTH_INCHES), dpi=DPI)
                if every
                else Figure(figsize=self._size(COLUMN.width / MILLIMETRES), dpi=DOTS)
            )
            self.canvas = cast(Any, FigureCanvasAgg(self.figure))
            self.axes = self.figure.subplots()
            still = self.world.paths is None
            draw_map(
                self.axes,
                self.world if still else self.world._replace(obstacles=NO_ROWS),
                self.model.length,
                downwards=self.world.y_down,
            )
            self._draw_goals()
            self.colour = self._colours()
            self.name = (
                f"{job.model}, {words(job.preset)}: {words(job.settings['map'])}"
            )
            pace = (
                f"; {every * FRAMES_A_SECOND:,} steps per second, lines: the last"
                f" {every * TRAIL:,}"
                if every
                else ""
            )
            note(self.figure, f"{study}, trial {job.trial_id}{pace}")
            self.past = deque[NDArray[np.float64]](maxlen=TRAIL + 1 if every else 1)
            (self.trail,) = self.axes.plot(
                [], [], color=TRAIL_COLOUR, linewidth=0.8, zorder=2, animated=True
            )
            self.crosses = self._draw_crosses()
            self.ground = self._draw_ground()
            self.title = self.axes.set_title(" \n \n ", animated=True)
            if not every:
                fit(self.figure, COLUMN)
            self.canvas.draw()
        self.figure.set_layout_engine("none")
        self.still = self.canvas.copy_from_bbox(self.figure.bbox)

    def draw(
        self,
        step: int,
        bodies: NDArray[np.float64],
        visits: NDArray[np.int32] | None = None,
    ) -> Picture:
        """Draw one frame and return the figure.

        Parameters
        ----------
        step : int
            The step of the frame.
        bodies : ndarray of float64, shape (4, N)
            x, y, vx and vy.
        visits : ndarray of int32, shape (rows, columns), optional
            The visits of pixels, -1 in obstacles.
        """
        with style.context(STYLE):
            self.canvas.restore_region(self.still)
            if visits is not None:
                self._draw_visits(visits)
            self.past.append(bodies[:2])
            self.trail.set_data(*self._trails())
            self.axes.draw_artist(self.trail)
            if self.world.paths is not None:
                self._draw_obstacles(step)
            failed = self.failures.boids[self.failures.steps <= step]
            self.crosses.set_data(*bodies[:2, failed])
            self.axes.draw_artist(self.crosses)
            draw_flock(self.axes, bodies, self.length, self.colour)
            flock = self.axes.collections[-1]
            self.axes.draw_artist(flock)
            flock.remove()
            shown = self._words(step, bodies) + _coverage_words(visits)
            self.title.set_text(f"{self.name}\n{shown}")
            self.axes.draw_artist(self.title)
        return np.array(self.canvas.buffer_rgba())[:, :, :3]

    def _draw_obstacles(self, step: int) -> None:
        """Draw moving obstacles at the positions after `step` steps."""
        for layer in draw_obstacles(self.axes, self.world.at(step)):
            self.axes.draw_artist(layer)
            layer.remove()

    def _draw_ground(self) -> AxesImage:
        """Add an image for the visits of pixels, with each pixel centred on a point."""
        ground = self.axes.imshow(
            np.zeros((1, 1, 4)), origin="lower", zorder=0.5, animated=True
        )
        height = self.world.height
        limits = (height, 0.0) if self.world.y_down else (0.0, height)
        self.axes.set(xlim=(0.0, self.world.width), ylim=limits)
        return ground

    def _draw_visits(self, visits: NDArray[np.int32]) -> None:
        pixel = float(self.job.settings["pixel"])
        rows, columns = visits.shape
        right = (columns - 0.5) * pixel
        top = (rows - 0.5) * pixel
        self.ground.set_extent((-0.5 * pixel, right, -0.5 * pixel, top))
        self.ground.set_data(
            np.where((visits > 0)[:, :, None], (*VISITED, OPACITY), 0.0)
        )
        self.axes.draw_artist(self.ground)

    def _trails(self) -> NDArray[np.float64]:
        """Return the trails of boids in the last frames as one line, broken by NaN.

        The line has the shape (2, K). Jumps across a periodic boundary are left out.
        """
        past = np.stack(self.past)
        steps = np.stack([past[:-1], past[1:], np.full_like(past[1:], np.nan)])
        size = np.array([self.world.width, self.world.height])[:, None]
        jumps = (np.abs(steps[1] - steps[0]) > size / 2).any(axis=1)
        return steps.transpose(2, 1, 3, 0)[:, ~jumps].reshape(2, -1)

    def _size(self, width: float) -> tuple[float, float]:
        """Return width and height in inches, with room for titles and labels.

        The height of an animation is an even number of pixels, as MP4 needs.
        """
        shape = min(max(self.world.height / self.world.width, 0.25), 1.5)
        return width, 2 * round((width * shape + 0.75) * DPI / 2) / DPI

    def _colours(self) -> str | list[str]:
        """Return the colour of all boids, or of each boid if there are kinds.

        The legend gets an entry for each kind.
        """
        colours = list[str]()
        counts = kinds_of(self.job)
        for name, colour in colours_of_kinds(counts).items():
            self.axes.plot([], [], ">", color=colour, label=f"{counts[name]:,} {name}")
            colours += counts[name] * [colour]
        return colours or BOIDS

    def _draw_crosses(self) -> Line2D:
        """Add a line for the crosses of failed boids, and the legend.

        Crosses have a white edge, which contrasts with any colour.
        """
        (crosses,) = self.axes.plot(
            *([], [], "x"),
            markersize=11,
            markeredgewidth=1.4,
            color="black",
            path_effects=[withStroke(linewidth=3.2, foreground="white"), Normal()],
            animated=True,
        )
        if count := self.failures.boids.size:
            shown = f"{count:,} failing: {self.failures.how}"
            self.axes.plot([], [], "x", color="black", label=shown)
        if self.axes.get_legend_handles_labels()[1]:
            self.axes.legend(loc="upper right")
        return crosses

    def _draw_goals(self) -> None:
        if not self.world.goal:
            return
        radius = self.world.goal[2]
        for x, y in self.world.goals:
            self.axes.plot(x, y, marker="x", markersize=8, color=GREEN, zorder=2)
            self.axes.add_patch(
                Circle(
                    (x, y),
                    radius,
                    fill=False,
                    edgecolor=GREEN,
                    linestyle="--",
                )
            )
        number_goals(self.axes, self.world, GREEN)

    def _words(self, step: int, bodies: NDArray[np.float64]) -> str:
        """Return step and time of a frame, and below them the numbers of boids.

        The numbers are all boids, and boids outside the figure.
        """
        settings = self.job.settings
        x, y = bodies[:2]
        time = float(settings.get("dt", 1.0)) * step
        clock = (
            ""
            if self.model.time == "step" and time == step
            else f", t = {time:.6g} {self.model.time}"
        )
        inside = (
            (x >= 0) & (x <= self.world.width) & (y >= 0) & (y <= self.world.height)
        )
        beyond = f", {np.sum(~inside):,} outside" if not inside.all() else ""
        return (
            f"step {step:,} of {settings['steps']:,}{clock}\n{len(x):,} boids{beyond}"
        )


def _coverage_words(visits: NDArray[np.int32] | None) -> str:
    """Return the visited fraction of the world outside obstacles, in words."""
    if visits is None:
        return ""
    return f"; coverage {100.0 * np.mean(visits[visits >= 0] > 0):.1f} %"


def check_frame(job: Job, frame: int) -> None:
    """Raise ChoiceError if a trial does not have a frame."""
    steps = int(job.settings["steps"])
    if not 0 <= frame <= steps:
        raise ChoiceError(
            f"trial {job.trial_id}: there is no frame {frame:,};"
            f" allowed: 0 to {steps:,}"
        )


def write_picture(study: str, job: Job, frame: int, path: Path, report: Report) -> None:
    """Write one frame as PNG.

    Parameters
    ----------
    study : str
        The name of the study.
    job : Job
        The trial.
    frame : int
        The step of the frame.
    path : Path
        The new file.
    report : Report
        The callback that reports progress in steps.

    Raises
    ------
    ChoiceError
        The trial does not have the frame, or diverges before it.
    """
    from PIL import Image

    check_frame(job, frame)
    frames = shown_frames(job, max(1, frame), report)
    shown = next((candidate for candidate in frames if candidate.step == frame), None)
    if shown is None:
        raise ChoiceError(f"trial {job.trial_id} diverged before frame {frame:,}")
    with unfinished(path) as file:
        picture = Image.fromarray(Scene(study, job).draw(*shown))
        picture.save(file, "png", dpi=(DOTS, DOTS))


def frames_apart(job: Job) -> int:
    """Return the default number of steps between two frames of an animation.

    An animation has at most MOST_FRAMES frames.
    """
    return max(1, -(-int(job.settings["steps"]) // (MOST_FRAMES - 1)))


def write_animation(
    study: str, job: Job, path: Path, every: int, report: Report
) -> None:
    """Write an animation as GIF or MP4.

    Parameters
    ----------
    study : str
        The name of the study.
    job : Job
        The trial.
    path : Path
        The new file. The ending, .gif or .mp4, determines the format.
    every : int
        Steps between two frames.
    report : Report
        The callback that reports progress in steps.
    """
    scene = Scene(study, job, every)
    pictures = (scene.draw(*frame) for frame in shown_frames(job, every, report))
    with unfinished(path) as file:
        if path.suffix == ".gif":
            write_gif(pictures, file, [ON_WHITE])
        else:
            write_mp4(pictures, file)
