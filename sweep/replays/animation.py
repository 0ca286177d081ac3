"""A trial as pictures: one frame, or all of them as an animation.

Boids are triangles that point in their direction of flight; where they are of several
kinds, each kind has a colour. Those that have failed have a cross. In an animation
lines show whence they come. The picture shows the world with its obstacles, the goal if
boids are drawn to it, and where boids have been if the trial records coverage. What
does not change is drawn once: obstacles too, unless they move.
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

from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.figures import GREEN, STYLE, draw_flock, draw_map, note, words
from sweep.figures.drawing import colours_of_kinds, draw_obstacles, number_goals
from sweep.replays.flight import Report, seen
from sweep.replays.video import FRAMES_A_SECOND, write_gif, write_mp4
from sweep.tables.outputs import unfinished
from sweep.trial.kinds import kinds_of
from sweep.trial.robots import failures_of
from sweep.trial.world import world_of

MOST_FRAMES = 600
WIDTH_INCHES, DPI = 6.4, 110
TRIANGLES = 45
"""The size of a boid: so many triangles, one behind the other, are as long as the
longer side of the world.
"""

BOIDS = "0.1"
"""Their colour, where there are no kinds."""
TRAIL, TRAIL_COLOUR = 15, "0.75"
"""How many pictures a trail goes back in an animation."""

VISITED, OPACITY = (0.94, 0.73, 0.25), 0.45
"""The colour of pixels that boids have visited."""
ON_WHITE = 248, 224, 169
"""The same on a white ground, as a picture of 8 bits has it."""

NO_ROWS = np.empty((0, 5))
"""Of obstacles: those that move are drawn in each frame."""

Picture = NDArray[np.uint8]
"""Pixels (rows, columns, 3): red, green and blue."""


class Scene:
    """The world of a trial as a figure. Frames are drawn into it, one after the other;
    with trails where they are `every` so many steps of an animation.
    """

    def __init__(self, study: str, job: Job, every: int | None = None) -> None:
        self.job, self.world, self.model = (
            job,
            world_of(job),
            job.known.models[job.model],
        )
        self.failures = failures_of(job)
        self.length = max(self.world.width, self.world.height) / TRIANGLES
        with style.context(STYLE):
            self.figure = Figure(figsize=self._size(), dpi=DPI)
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
            self.figure.suptitle(
                f"{job.model}, {words(job.preset)}: {words(job.settings['map'])}"
            )
            pace = (
                f"; {every * FRAMES_A_SECOND:,} steps a second, lines: the last"
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
            self.title = self.axes.set_title(" ", animated=True)
            self.canvas.draw()
        self.figure.set_layout_engine("none")
        self.still = self.canvas.copy_from_bbox(self.figure.bbox)

    def draw(
        self,
        step: int,
        bodies: NDArray[np.float64],
        visits: NDArray[np.int32] | None = None,
    ) -> Picture:
        """The picture of one frame; `bodies` (4, N) are x, y, vx and vy, and `visits`
        those of pixels (rows, columns), -1 in obstacles.
        """
        with style.context(STYLE):
            self.canvas.restore_region(self.still)
            if visits is not None:
                self._draw_visits(visits)
            self.past.append(bodies[:2])
            self.trail.set_data(*self._ways())
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
            self.title.set_text(self._words(step, bodies) + _covered(visits))
            self.axes.draw_artist(self.title)
        return np.array(self.canvas.buffer_rgba())[:, :, :3]

    def _draw_obstacles(self, step: int) -> None:
        """Obstacles that move, where they are after so many steps."""
        for layer in draw_obstacles(self.axes, self.world.at(step)):
            self.axes.draw_artist(layer)
            layer.remove()

    def _draw_ground(self) -> AxesImage:
        """Room for the visits of pixels, a pixel about the point that it stands for."""
        ground = self.axes.imshow(
            np.zeros((1, 1, 4)), origin="lower", zorder=0.5, animated=True
        )
        width, height = self.world.width, self.world.height
        upside_down = self.world.y_down
        self.axes.set(
            xlim=(0.0, width), ylim=(height, 0.0) if upside_down else (0.0, height)
        )
        return ground

    def _draw_visits(self, visits: NDArray[np.int32]) -> None:
        pixel = float(self.job.settings["pixel"])
        rows, columns = visits.shape
        ends = ((columns - 0.5) * pixel, (rows - 0.5) * pixel)
        self.ground.set_extent((-0.5 * pixel, ends[0], -0.5 * pixel, ends[1]))
        self.ground.set_data(
            np.where((visits > 0)[:, :, None], (*VISITED, OPACITY), 0.0)
        )
        self.axes.draw_artist(self.ground)

    def _ways(self) -> NDArray[np.float64]:
        """The ways of boids in the last pictures as one line (2, K), broken by NaN. A
        border may be joined to the opposite one; jumps across it are left out.
        """
        past = np.stack(self.past)
        steps = np.stack([past[:-1], past[1:], np.full_like(past[1:], np.nan)])
        size = np.array([self.world.width, self.world.height])[:, None]
        jumps = (np.abs(steps[1] - steps[0]) > size / 2).any(axis=1)
        return steps.transpose(2, 1, 3, 0)[:, ~jumps].reshape(2, -1)

    def _size(self) -> tuple[float, float]:
        """Width and height in inches. They give even numbers of pixels, which MP4
        needs, and leave room for titles and labels.
        """
        height = (
            WIDTH_INCHES * min(max(self.world.height / self.world.width, 0.25), 1.5)
            + 0.75
        )
        return WIDTH_INCHES, 2 * round(height * DPI / 2) / DPI

    def _colours(self) -> str | list[str]:
        """The colour of boids; where there are kinds one for each, and a legend."""
        found, names = list[str](), kinds_of(self.job)
        for name, colour in colours_of_kinds(names).items():
            self.axes.plot([], [], ">", color=colour, label=f"{names[name]:,} {name}")
            found += names[name] * [colour]
        return found or BOIDS

    def _draw_crosses(self) -> Line2D:
        """Room for the crosses below boids that have failed, which the legend explains;
        a white edge lets them be seen on any colour.
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
        """The title of a frame: its step, its time, the number of boids, and how many
        of them are outside of the picture.
        """
        settings, (x, y) = self.job.settings, bodies[:2]
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
            f"step {step:,} of {settings['steps']:,}{clock}; {len(x):,} boids{beyond}"
        )


def _covered(visits: NDArray[np.int32] | None) -> str:
    """How much of the ground outside obstacles has been visited, in words."""
    if visits is None:
        return ""
    return f"; coverage {100.0 * np.mean(visits[visits >= 0] > 0):.1f} %"


def check_frame(job: Job, frame: int) -> None:
    """Raise ChoiceError if a trial has no such frame."""
    steps = int(job.settings["steps"])
    if not 0 <= frame <= steps:
        raise ChoiceError(
            f"trial {job.trial_id}: there is no frame {frame:,};"
            f" it has frames 0 to {steps:,}"
        )


def write_picture(study: str, job: Job, frame: int, path: Path, report: Report) -> None:
    """Write one frame as PNG.

        study   the name of the study
        job     the trial
        frame   the step of the frame
        path    the new file
        report  is told how many of how many steps are done

    Raises ChoiceError if the trial ends before that frame.
    """
    from PIL import Image

    check_frame(job, frame)
    flown = seen(job, max(1, frame), report)
    found = next((one for one in flown if one.step == frame), None)
    if found is None:
        raise ChoiceError(f"trial {job.trial_id}: it diverged before frame {frame:,}")
    with unfinished(path) as file:
        Image.fromarray(Scene(study, job).draw(*found)).save(file, "png")


def frames_apart(job: Job) -> int:
    """The default number of steps between two frames of an animation. It gives at most
    MOST_FRAMES frames.
    """
    return max(1, -(-int(job.settings["steps"]) // (MOST_FRAMES - 1)))


def write_animation(
    study: str, job: Job, path: Path, every: int, report: Report
) -> None:
    """Write an animation as GIF or MP4.

    study   the name of the study
    job     the trial
    path    the new file; its ending says which format
    every   steps between two frames
    report  is told how many of how many steps are done
    """
    scene = Scene(study, job, every)
    pictures = (scene.draw(*one) for one in seen(job, every, report))
    with unfinished(path) as file:
        if path.suffix == ".gif":
            write_gif(pictures, file, [ON_WHITE])
        else:
            write_mp4(pictures, file)
