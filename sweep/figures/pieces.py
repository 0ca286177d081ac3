"""Pieces of figures that belong to no one study: maps with obstacles, flocks, visits, values with intervals.

Each draws into given axes, within the house style. Positions are in the world's unit of length; images and pixel
worlds have y downwards from the top left, as the published programs do.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Circle, Patch, Rectangle
from numpy.typing import ArrayLike, NDArray

from sweep.figures.style import BLUE, GREY
from sweep.study import StoredWorld


def draw_map(
    axes: Axes, world: StoredWorld, unit: str, *, face: str = "0.6", edge: str = "none", downwards: bool = True
) -> None:
    """The frame of `world`, in `unit` of length on both axes, and its obstacles, filled with `face`."""
    shapes = [_shape(row) for row in world.obstacles]
    axes.add_collection(PatchCollection(shapes, facecolor=face, edgecolor=edge, linewidth=0.7, zorder=1.5))
    axes.set(xlim=(0.0, world.width), ylim=(world.height, 0.0) if downwards else (0.0, world.height))
    axes.set(aspect="equal", xlabel=f"x ({unit})", ylabel=f"y ({unit})")
    axes.grid(visible=False)
    axes.spines[["top", "right"]].set_visible(True)


def _shape(row: NDArray[np.float64]) -> Patch:
    x, y, half_width, half_height, is_round = (float(number) for number in row)
    if is_round:
        return Circle((x, y), half_width)
    return Rectangle((x - half_width, y - half_height), 2.0 * half_width, 2.0 * half_height)


def draw_flock(axes: Axes, bodies: NDArray[np.float64], length: float, colour: str = "0.1") -> None:
    """Boids as triangles that point where they fly; `bodies` (4, N) are x, y, vx and vy, one at rest points along x."""
    x, y, vx, vy = bodies
    heading = np.arctan2(vy, vx)
    along, across = np.array([2.0, -1.0, -1.0]) * length / 3.0, np.array([0.0, 1.0, -1.0]) * length / 3.0
    cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
    corners = np.stack([x[:, None] + along * cos - across * sin, y[:, None] + along * sin + across * cos], axis=2)
    axes.add_collection(PolyCollection(list(corners), facecolor=colour, edgecolor="none", zorder=2.5))


def draw_visits(axes: Axes, visits: NDArray[np.int32], world: StoredWorld, most: float) -> AxesImage:
    """How often each pixel was visited, white for never and darkest from `most` on; obstacles are outlined in blue.

    `visits` (rows, columns) is -1 in obstacles. Pixel (row, column) reaches from (column, row) half a pixel each way.
    """
    rows, columns = visits.shape
    extent = (-0.5, columns - 0.5, rows - 0.5, -0.5)
    image = axes.imshow(
        np.ma.masked_less(visits, 1), cmap="YlOrRd", vmin=0, vmax=most, extent=extent, interpolation="antialiased"
    )
    draw_map(axes, world, "px", face="none", edge=BLUE)
    return image


def draw_values(
    axes: Axes,
    places: ArrayLike,
    table: tuple[ArrayLike, ArrayLike, ArrayLike],
    colour: str,
    marker: str = "o",
    label: str = "",
) -> None:
    """Values at heights `places` as markers, each with its interval as a line; `table` is value, low, high, (k,) each.

    An interval that is not known, NaN, is not drawn.
    """
    value, low, high = (np.asarray(column, np.float64) for column in table)
    axes.hlines(places, low, high, color=colour, linewidth=1.4)
    axes.plot(value, places, linestyle="none", marker=marker, markersize=4.5, color=colour, label=label)


def name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Rows 0, 1, ... of `axes` from the top, with their names and a little room around them."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
    axes.grid(visible=False, axis="y")
    axes.spines["left"].set_visible(False)


def note(figure: Figure, text: str) -> None:
    """What the figure rests on, small below it: the study, the number of trials, the kind of interval."""
    figure.supxlabel(text, fontsize=7.5, color=GREY)


def legend(figure: Figure, axes: Axes, columns: int = 4) -> None:
    """The legend of `axes`, above the whole figure."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=columns)
