"""Visits of boids: the mean of each pixel of the map, with a panel per point."""

from functools import partial
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from sweep.analysis import CONFIDENCE, mean_interval
from sweep.errors import ChoiceError, StoreError
from sweep.figures.drawing import (
    draw_visits,
    estimated,
    note,
    tidy_grid,
    title_panel,
    without_trials,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.selection import Facet, Selection, among, select
from sweep.figures.style import STYLE
from sweep.tables import StoredStudy, stored_parts

Floats = NDArray[np.float64]

DARKEST = 0.99


class CoverageLayout(NamedTuple):
    """The contents of a figure of visits: a panel per point."""

    selection: Selection
    facets: list[Facet]


class Visits(NamedTuple):
    """The mean visits of the pixels of a point, and the ids of its done trials.

    `mean` (rows, columns) is NaN where every trial has an obstacle, and has no pixels
    if no trial is done. `same_obstacles` is true if all trials have equal obstacles.
    """

    mean: Floats
    same_obstacles: bool
    trials: list[str]


def coverage_figure(
    study: StoredStudy,
) -> Figure:
    """Draw the mean visits of each pixel, with a panel per point.

    All panels have a common colour scale. Titles show the coverage and the coefficient
    of variation (CV), if recorded. Obstacles are outlined if all trials of a point have
    equal obstacles. A panel without done trials shows a note.

    Parameters
    ----------
    study : StoredStudy
        A study with stored heatmaps.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If no heatmaps are stored, or there are more than twelve points.
    StoreError
        If a done trial has no heatmap.

    Examples
    --------
    >>> study = sweep.load("my/map").where(cohesion_weight=0.01)
    >>> panel, colour_bar = coverage_figure(study).axes
    >>> panel.get_title(), colour_bar.get_ylabel()
    ('coverage 3.02 [2.71, 3.34] %', 'mean visits per pixel')
    """
    return draw_coverage(coverage_layout(study))


def coverage_layout(
    study: StoredStudy,
) -> CoverageLayout:
    """Return the layout of `coverage_figure`, or raise ChoiceError."""
    selection = select(study)
    if (
        "visits"
        not in study.store.read(
            "heatmaps", trial_ids=pa.array([], pa.string())
        ).column_names
    ):
        raise ChoiceError(
            "has no heatmaps; record: {heatmaps: true} stores heatmaps", study.name
        )
    settings = [*selection.apart(selection.sampled), *selection.sampled]
    return CoverageLayout(selection, selection.panels(settings, "coverage"))


def draw_coverage(layout: CoverageLayout) -> Figure:
    """Draw the figure of a layout."""
    selection, facets = layout
    panel_visits = _visits(selection, facets)
    visited = [visits.mean[visits.mean > 0.0] for visits in panel_visits]
    most = max(
        (float(np.quantile(means, DARKEST)) for means in visited if len(means)),
        default=1.0,
    )
    height = max(
        visits.mean.shape[0] / visits.mean.shape[1]
        for visits in panel_visits
        if visits.trials
    )
    with style.context(STYLE):
        across = min(3, len(facets))
        down = -(-len(facets) // across)
        width = 4.8 if across == 1 else 7.2
        figure = Figure(
            figsize=(width, 1.1 + down * (0.75 + height * (width - 1.6) / across))
        )
        panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for axes, facet, visits in zip(
            tidy_grid(panels, len(facets)), facets, panel_visits, strict=True
        ):
            if visits.trials:
                image = _panel(axes, selection, visits, most)
            else:
                without_trials(axes)
            title_panel(
                axes,
                [
                    *facet.title.split(", "),
                    *(_estimates(selection, facet) if visits.trials else []),
                ],
                across,
            )
        figure.colorbar(
            image,
            ax=list(panels.ravel()),
            label="mean visits per pixel",
            extend="max",
            shrink=0.9,
            pad=0.02,
        )
        note(figure, _note(selection, panel_visits))
    return figure


def _panel(axes: Axes, selection: Selection, visits: Visits, most: float) -> AxesImage:
    pixel = selection.trials.set_index("trial_id")["pixel"][visits.trials[0]]
    (stored,) = stored_parts(selection.study)
    world = stored.world(visits.trials[0])
    if not visits.same_obstacles:
        world = world._replace(obstacles=np.empty((0, 5)))
    unit = selection.study.units.get("width", "")
    return draw_visits(axes, visits.mean, world, most, unit=unit, pixel=float(pixel))


def _visits(selection: Selection, facets: list[Facet]) -> list[Visits]:
    """Return the mean visits of each point over its done trials.

    Raises StoreError if a done trial has no heatmap.
    """
    done = selection.trials[selection.trials["status"] == "done"]
    panel_trials = [among(done, facet.points)["trial_id"].tolist() for facet in facets]
    trial_ids = pa.array(
        [trial for trials in panel_trials for trial in trials], pa.string()
    )
    (study,) = stored_parts(selection.study)
    stored = study.read("heatmaps", trial_ids)
    row_of = {
        trial: number for number, trial in enumerate(stored["trial_id"].to_pylist())
    }
    if not set(trial_ids.to_pylist()) <= row_of.keys():
        raise StoreError(
            "a done trial has no heatmap; select other trials with where",
            selection.study.name,
        )
    return [
        _mean([_counts(stored, row_of[trial]) for trial in trials], trials)
        for trials in panel_trials
    ]


def _counts(stored: pa.Table, number: int) -> NDArray[np.int32]:
    shape = stored["rows"][number].as_py(), stored["columns"][number].as_py()
    return np.asarray(stored["visits"][number].values).reshape(shape)


def _mean(counts: list[NDArray[np.int32]], trials: list[str]) -> Visits:
    if not trials:
        return Visits(np.full((0, 0), np.nan), True, trials)
    free = np.sum([count >= 0 for count in counts], axis=0)
    total = np.sum([np.maximum(count, 0) for count in counts], axis=0)
    mean = np.where(free > 0, total / np.maximum(free, 1), np.nan)
    return Visits(mean, bool(np.isin(free, (0, len(counts))).all()), trials)


def _estimates(selection: Selection, facet: Facet) -> list[str]:
    """Return coverage and CV of a point with confidence intervals, as strings.

    Metrics that are not recorded are left out.
    """
    trials = among(selection.trials, facet.points)
    lines = []
    for metric, short in _short_names(selection).items():
        confidence = selection.study.repeated.get(metric, CONFIDENCE)
        value, low, high, _ = mean_interval(
            trials[metric].to_numpy(np.float64),
            confidence,
            distribution=selection.study.distributions[metric],
        )
        unit = selection.study.units.get(metric, "")
        lines.append(f"{short} {estimated(value, low, high)} {unit}".rstrip())
    return lines


def _short_names(selection: Selection) -> dict[str, str]:
    """Return the short names of the recorded metrics that have a short name."""
    return {
        name: metric.short
        for name, metric in selection.study.known_metrics.items()
        if metric.short and name in selection.study.metrics
    }


def _note(selection: Selection, panel_visits: list[Visits]) -> str:
    counts = [len(visits.trials) for visits in panel_visits]
    metrics = _short_names(selection).values()
    interval = (
        f"{' and '.join(metrics)} with 95 % confidence interval" if metrics else ""
    )
    same = all(visits.same_obstacles for visits in panel_visits if visits.trials)
    obstacles = "blue: obstacles" if same else "obstacles differ between trials"
    trials = selection.note(
        "mean of {n} trials per panel", counts, interval, selection.study.metrics
    )
    return f"{trials}; white: never visited; {obstacles}"


def plan(study: StoredStudy, _: Choices) -> list[Planned]:
    """Plan one figure of all points. Raises ChoiceError if the kind does not suit."""
    return [Planned("", partial(draw_coverage, coverage_layout(study)))]


KIND = FigureKind("visits of each pixel of the map", (), plan)
