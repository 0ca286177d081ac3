"""Parts of figures: maps with obstacles, flocks, visits, confidence intervals.

Each function draws into given axes; the caller applies the style of all figures.
Positions are in the unit of length of the world. In images and pixel worlds, y points
downwards from the top left, as in the published programs.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from itertools import cycle
from textwrap import wrap

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PatchCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.legend import Legend
from matplotlib.patches import Circle, Patch, PathPatch, Rectangle
from matplotlib.path import Path
from numpy.typing import ArrayLike, NDArray

from kernels.shapes import Obstacle, Polygon
from sweep.figures.style import BLUE, COLOURS, GREY
from sweep.spec import Column
from sweep.tables import Results
from sweep.text import harmless, shortened
from sweep.trial import TrialWorld

LETTERS_AN_INCH = 18.0
LETTERS_OF_AN_AXIS = 32
LETTERS_OF_A_TITLE = 104
PALE = 0.45
"""Opacity of single trials."""
MOST_COLUMNS = 8
ROOM = 0.96
"""The fraction of the width of a figure that its legend may take."""
NAMES_PART = 0.9
"""The least fraction of the width of a one-column legend that the names take."""
ROW = 0.5
"""The height that a layout reserves for the legend, a title and one row, in inches."""
OUTLINE = 1.8
"""The width of an outline in points. The obstacle inside covers half of the outline."""
SEAM = 0.5
"""The width of a seam in points.

A seam closes the gap between obstacles that touch, such as the pieces of an image.
"""


def number_goals(axes: Axes, world: TrialWorld, colour: str) -> None:
    """Write the number of each goal next to the goal, if there are several.

    Parameters
    ----------
    axes : Axes
    world : TrialWorld
    colour : str
        Colour of the numbers.
    """
    if len(world.goals) > 1:
        for number, position in enumerate(world.goals, start=1):
            axes.annotate(
                str(number),
                position,
                xytext=(5, 5),
                textcoords="offset points",
                fontsize=8,
                color=colour,
                zorder=5,
            )


def draw_map(
    axes: Axes,
    world: TrialWorld,
    unit: str,
    *,
    face: str = "0.6",
    outline: str | None = None,
    downwards: bool = True,
) -> None:
    """Draw the frame of a world and its obstacles.

    Parameters
    ----------
    axes : Axes
    world : TrialWorld
    unit : str
        Unit of length, for the labels of both axes.
    face : str, default "0.6"
        Colour that fills the obstacles.
    outline : str, optional
        Colour of the outline. Obstacles that touch or overlap have a common outline. By
        default obstacles have no outline.
    downwards : bool, default True
        Let y increase downwards.

    Examples
    --------
    >>> study = sweep.load("my/map")
    >>> world = study.world(study.trials["trial_id"][0])
    >>> _, axes = plt.subplots()
    >>> draw_map(axes, world, "px")
    >>> axes.get_xlabel(), len(axes.collections[0].get_paths())
    ('x (px)', 18)
    """
    draw_obstacles(axes, world, face=face, outline=outline)
    axes.set(
        xlim=(0.0, world.width),
        ylim=(world.height, 0.0) if downwards else (0.0, world.height),
    )
    axes.set(aspect="equal", xlabel=f"x ({unit})", ylabel=f"y ({unit})")
    axes.grid(visible=False)
    axes.spines[["top", "right"]].set_visible(True)


def draw_obstacles(
    axes: Axes, world: TrialWorld, *, face: str = "0.6", outline: str | None = None
) -> list[PatchCollection]:
    """Draw the obstacles of a world, and return the layers.

    Parameters
    ----------
    axes : Axes
    world : TrialWorld
    face, outline : str
        Colours as in `draw_map`.
    """
    shapes = [_shape(obstacle, world) for obstacle in world.shapes]
    layers = [(face, SEAM)] if outline is None else [(outline, OUTLINE), (face, SEAM)]
    drawn = [
        PatchCollection(
            shapes,
            color=colour,
            linewidth=width,
            antialiased=outline is None,
            zorder=1.5,
        )
        for colour, width in layers
    ]
    for layer in drawn:
        axes.add_collection(layer)
    return drawn


def _shape(obstacle: Obstacle, world: TrialWorld) -> Patch:
    """Return the filled shape of an obstacle.

    The shape of an arena is the area around the arena, up to one world beyond each
    side.
    """
    if isinstance(obstacle, Polygon):
        within = np.array(obstacle.vertices)
        if not obstacle.is_arena:
            return PathPatch(_closed(within))
        size = world.width, world.height
        low = np.minimum(within.min(axis=0), 0.0) - size
        high = np.maximum(within.max(axis=0), 2.0 * np.array(size))
        around = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
        clockwise = _area(within) < 0.0
        return PathPatch(
            Path.make_compound_path(
                _closed(around), _closed(within if clockwise else within[::-1])
            )
        )
    x, y, half_width, half_height, is_round = obstacle[:5]
    if is_round:
        return Circle((x, y), half_width)
    return Rectangle(
        (x - half_width, y - half_height), 2.0 * half_width, 2.0 * half_height
    )


def _closed(vertices: NDArray[np.float64]) -> Path:
    return Path(np.concatenate([vertices, vertices[:1]]), closed=True)


def _area(vertices: NDArray[np.float64]) -> float:
    """Return the area of a polygon, positive if the vertices turn from x towards y."""
    x, y = vertices.T
    next_x, next_y = np.roll(vertices, -1, axis=0).T
    return float((x * next_y - next_x * y).sum() / 2.0)


def draw_flock(
    axes: Axes,
    bodies: NDArray[np.float64],
    length: float,
    colour: str | list[str] = "0.1",
) -> None:
    """Draw boids as triangles that point along their velocities.

    Parameters
    ----------
    axes : Axes
    bodies : ndarray, shape (4, N)
        x, y, vx and vy of each boid. A boid at rest points along x.
    length : float
        Length of a triangle, in the unit of the positions.
    colour : str or list of str, default "0.1"
        One colour for all boids, or a colour per boid.

    Examples
    --------
    >>> study = sweep.load("my/map")
    >>> frames, bodies = study.trajectory(study.trials["trial_id"][0])
    >>> _, axes = plt.subplots()
    >>> draw_flock(axes, bodies[-1], length=15)
    >>> len(axes.collections[0].get_paths())
    20
    """
    x, y, vx, vy = bodies
    heading = np.arctan2(vy, vx)
    along = np.array([2.0, -1.0, -1.0]) * length / 3.0
    across = np.array([0.0, 1.0, -1.0]) * length / 3.0
    cos = np.cos(heading)[:, None]
    sin = np.sin(heading)[:, None]
    corners = np.stack(
        [
            x[:, None] + along * cos - across * sin,
            y[:, None] + along * sin + across * cos,
        ],
        axis=2,
    )
    axes.add_collection(
        PolyCollection(list(corners), facecolor=colour, edgecolor="none", zorder=2.5)
    )


def colours_of_kinds(kinds: Iterable[str]) -> dict[str, str]:
    """Return the colour of each kind of boids, by name."""
    return dict(zip(kinds, cycle(COLOURS), strict=False))


def draw_visits(
    axes: Axes,
    visits: ArrayLike,
    world: TrialWorld,
    most: float,
    unit: str = "px",
    pixel: float = 1.0,
) -> AxesImage:
    """Draw the number of visits of each pixel, white for none.

    Obstacles have blue outlines. Pixel (row, column) extends half a pixel each way from
    (column, row).

    Parameters
    ----------
    axes : Axes
    visits : array_like, shape (rows, columns)
        Counts or mean counts, negative in obstacles.
    world : TrialWorld
    most : float
        Number of visits from which pixels are darkest.
    unit : str, default "px"
        Unit of length.
    pixel : float, default 1.0
        Side of a pixel in `unit`.

    Returns
    -------
    AxesImage
        The image, for example for a colour bar.

    Examples
    --------
    >>> study = sweep.load("my/map")
    >>> trial, visits = study.heatmaps.iloc[0]
    >>> figure, axes = plt.subplots()
    >>> image = draw_visits(axes, visits, study.world(trial), most=3)
    >>> figure.colorbar(image, label="visits").ax.get_ylabel()
    'visits'
    >>> image.get_extent()
    [-0.5, 799.5, 599.5, -0.5]
    """
    rows, columns = np.shape(visits)
    extent = (-0.5 * pixel, (columns - 0.5) * pixel, (rows - 0.5) * pixel, -0.5 * pixel)
    image = axes.imshow(
        np.ma.masked_less_equal(visits, 0),
        cmap="YlOrRd",
        vmin=0,
        vmax=most,
        extent=extent,
        interpolation="antialiased",
    )
    draw_map(axes, world, unit, face="white", outline=BLUE, downwards=world.y_down)
    return image


def draw_values(
    axes: Axes,
    places: ArrayLike,
    table: tuple[ArrayLike, ArrayLike, ArrayLike],
    colour: str,
    marker: str = "o",
    label: str = "",
) -> None:
    """Draw values as markers, with confidence intervals as horizontal lines.

    Parameters
    ----------
    axes : Axes
    places : array_like, shape (k,)
        Heights of the markers.
    table : tuple of three array_like, shape (k,)
        Value, low and high. An interval that is NaN is not drawn.
    colour : str
        Colour of markers and lines.
    marker : str, default "o"
        Marker of Matplotlib.
    label : str, default ""
        Name of the markers in a legend.

    Examples
    --------
    >>> table = sweep.load("my/first").table("speed")
    >>> means = table["speed"], table["speed_low"], table["speed_high"]
    >>> _, axes = plt.subplots()
    >>> draw_values(axes, [0, 1, 2], means, BLUE)
    >>> axes.lines[0].get_xdata().round(2).tolist()
    [1.86, 0.38, 2.61]
    """
    value, low, high = (np.asarray(column, np.float64) for column in table)
    axes.hlines(places, low, high, color=colour, linewidth=1.4)
    axes.plot(
        value,
        places,
        linestyle="none",
        marker=marker,
        markersize=4.5,
        color=colour,
        label=label,
    )


def name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows 0, 1, ... of axes, the first at the top, with a small margin.

    Parameters
    ----------
    axes : Axes
    names : sequence of str
        A name per row.

    Examples
    --------
    >>> _, axes = plt.subplots()
    >>> draw_values(axes, [0, 1], ([0.4, 0.7], [0.3, 0.6], [0.5, 0.8]), BLUE)
    >>> name_rows(axes, ["with noise", "without noise"])
    >>> [label.get_text() for label in axes.get_yticklabels()]
    ['with noise', 'without noise']
    """
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)


def note(figure: Figure, text: str) -> None:
    """Write a note in small letters below a figure.

    The note names the study, the number of trials and the kind of interval. A line that
    is wider than the figure is broken.

    Parameters
    ----------
    figure : Figure
    text : str
        The note, of one or several lines.

    Examples
    --------
    >>> figure, axes = plt.subplots()
    >>> note(figure, "my/first: 10 trials per point, mean with 95 % interval")
    >>> figure.get_supxlabel()
    'my/first: 10 trials per point, mean with 95 % interval'
    """
    letters = int(LETTERS_AN_INCH * figure.get_size_inches()[0])
    lines = [part for line in text.split("\n") for part in wrap(line, letters)]
    figure.supxlabel("\n".join(lines), fontsize=7.5, color=GREY)


def legend(figure: Figure, axes: Axes, columns: int = 4) -> None:
    """Put the legend of axes above the whole figure.

    Parameters
    ----------
    figure : Figure
    axes : Axes
        Axes with labelled lines and markers.
    columns : int, default 4
        The most columns of the legend.

    Examples
    --------
    >>> figure, axes = plt.subplots()
    >>> draw_values(axes, [0], ([0.4], [0.3], [0.5]), BLUE, label="torus")
    >>> draw_values(axes, [1], ([0.7], [0.6], [0.8]), GREEN, "s", label="bounded")
    >>> legend(figure, axes)
    >>> [text.get_text() for text in figure.legends[0].get_texts()]
    ['torus', 'bounded']
    """
    legend_of(figure, *axes.get_legend_handles_labels(), columns=columns)


def legend_of(
    figure: Figure,
    handles: Sequence[Artist],
    labels: Sequence[str],
    title: str | None = None,
    columns: int = MOST_COLUMNS,
) -> None:
    """Put a legend above the whole figure, in as many columns as fit the width.

    Labels that are too long for one column are broken. Rows of the legend after the
    first make the figure higher, so that panels keep a constant size.

    Parameters
    ----------
    figure : Figure
    handles : sequence of Artist
    labels : sequence of str
        A label per handle.
    title : str, optional
    columns : int, default 8
        The most columns.
    """
    width, height = figure.get_size_inches()
    room = ROOM * width
    longest = max(map(len, labels), default=0)

    def drawn(number: int, letters: int) -> Legend:
        names = ["\n".join(wrap(label, letters)) for label in labels]
        return figure.legend(
            handles, names, title=title, loc="outside upper center", ncols=number
        )

    number = min(columns, len(labels)) or 1
    box = drawn(number, longest or 1)
    while (taken := _inches(figure, box)[0]) > room and number > 1:
        box.remove()
        number -= 1
        box = drawn(number, longest)
    if taken > room:
        box.remove()
        box = drawn(1, int(longest * room / taken * NAMES_PART))
    more = _inches(figure, box)[1] - ROW
    figure.set_size_inches(width, height + max(more, 0.0))


def _inches(figure: Figure, box: Legend) -> tuple[float, float]:
    """Return the width and the height of a legend in inches."""
    renderer = FigureCanvasAgg(figure).get_renderer()  # type: ignore[no-untyped-call]
    extent = box.get_window_extent(renderer)
    return extent.width / figure.dpi, extent.height / figure.dpi


def quantity(study: Results, name: str) -> str:
    """Return a metric or a parameter in words, with the unit: `flock radius (px)`.

    Parameters
    ----------
    study : Results
    name : str
        A metric, a parameter, or a column `<metric>_mean`. Such a column is the mean of
        a metric over the second half of a trial, or over an event of a recording.

    Returns
    -------
    str
        The words; a quantity without a unit has no brackets.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> quantity(study, "separation_weight")
    'separation weight'
    >>> quantity(study, "speed_mean")
    'speed, second half (px/step)'
    """
    column = Column.read(name)
    averaged = column.half and column.metric in study.metrics
    half = f", {study.averaged.removeprefix('the ')}" if averaged else ""
    unit = study.units.get(name, "").replace("^2", "²")
    return (
        (column.metric if half else name).replace("_", " ")
        + half
        + (f" ({unit})" if unit else "")
    )


def y_label(text: str) -> str:
    """Return a label in lines that are no longer than a y axis."""
    return "\n".join(wrap(text, LETTERS_OF_AN_AXIS))


def words(value: object) -> str:
    """Return the value of a parameter in words, such as `yes`, `0.5` or `in margin`.

    Parameters
    ----------
    value : object
        A value, or a tuple of values.

    Returns
    -------
    str
        Infinity is `unlimited`, "" is `unchanged`, and several values are `50 or 100`.

    Examples
    --------
    >>> words(True), words(math.inf), words("in_margin")
    ('yes', 'unlimited', 'in margin')
    >>> words((50, 100))
    '50 or 100'
    """
    if isinstance(value, tuple):
        return " or ".join(map(words, value))
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, float):
        return "unlimited" if np.isinf(value) else f"{value:g}"
    return as_text(shortened(str(value))).replace("_", " ") or "unchanged"


def as_text(text: str) -> str:
    """Return a string that matplotlib shows literally.

    Matplotlib reads text between two `$` as mathematics, so each `$` is escaped.
    """
    return re.sub(r"(?<!\\)\$", r"\\$", harmless(text))


def named(settings: Iterable[tuple[str, object]]) -> str:
    """Return parameters and values in words: map = cafeteria, n = 50."""
    return ", ".join(
        f"{name.replace('_', ' ')} = {words(value)}" for name, value in settings
    )


def span(numbers: Iterable[int]) -> str:
    """Return the smallest and the largest of some counts in words: 3, or 18 to 20."""
    counts = sorted({int(number) for number in numbers}) or [0]
    return f"{counts[0]:,}" if len(counts) == 1 else f"{counts[0]:,} to {counts[-1]:,}"


def estimated(value: float, low: float, high: float) -> str:
    """Return a value and its interval as a string with two decimals: 0.52 [0.48, 0.56].

    Parameters
    ----------
    value : float
    low, high : float
        Bounds of the interval. An interval with a NaN is left out.
    """
    numbers = [f"{number:.2f}" for number in (value, low, high)]
    first, *bounds = [
        ("0.00" if number == "-0.00" else number).replace("-", "\N{MINUS SIGN}")
        for number in numbers
    ]
    return first if np.isnan([low, high]).any() else f"{first} [{', '.join(bounds)}]"


def title_panel(axes: Axes, lines: Iterable[str], across: int) -> None:
    """Write a title above a panel.

    Parameters
    ----------
    axes : Axes
    lines : iterable of str
        A line that is wider than the panel is broken.
    across : int
        Number of panels side by side.
    """
    letters = LETTERS_OF_A_TITLE // max(across, 2)
    axes.set_title(
        "\n".join(part for line in lines for part in wrap(line, letters)), fontsize=7.5
    )


def draw_trials(
    axes: Axes, trials: pd.DataFrame, colour_of: Callable[[int], str]
) -> None:
    """Draw single trials as small pale dots behind means.

    Parameters
    ----------
    axes : Axes
    trials : DataFrame
        A row per trial, with the columns x, y and colour.
    colour_of : callable
        Function that returns the colour of a number in the column `colour`.
    """
    for number in sorted(set(trials["colour"])):
        own = trials[trials["colour"] == number]
        axes.plot(
            own["x"],
            own["y"],
            color=colour_of(int(number)),
            alpha=PALE,
            linestyle="none",
            marker="o",
            markersize=3.4,
            markeredgewidth=0,
            zorder=1.5,
        )


def without_trials(axes: Axes) -> None:
    """Write "no trial done" in the middle of a panel, and remove the axes."""
    axes.set_axis_off()
    axes.text(
        0.5,
        0.5,
        "no trial done",
        transform=axes.transAxes,
        ha="center",
        va="center",
        color=GREY,
    )


def tidy_grid(panels: NDArray[np.object_], number: int) -> list[Axes]:
    """Return the first `number` panels of a grid with common scales.

    Labels remain only at the edges of the grid. The remaining panels become invisible.
    """
    across = panels.shape[1]
    used = list(panels.ravel()[:number])
    unused = list(panels.ravel()[number:])
    for axes in unused:
        axes.set_axis_off()
    for place, axes in enumerate(used):
        lowest = place + across >= number
        axes.tick_params(labelbottom=lowest, labelleft=place % across == 0)
        axes.xaxis.label.set_visible(lowest)
        axes.yaxis.label.set_visible(place % across == 0)
    return used
