"""Where boids were: the mean visits of each pixel of the map, a panel a point."""

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
from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]

DARKEST = 0.99


class CoverageLayout(NamedTuple):
    """What a figure of visits shows: a panel a point."""

    selection: Selection
    facets: list[Facet]


class Visits(NamedTuple):
    """The mean visits of the pixels of a point, and the trials that they are of.

    `mean` (rows, columns) is NaN where every trial has an obstacle; it has no pixel
    where no trial is done. `same_obstacles` says whether all trials have the same
    obstacles.
    """

    mean: Floats
    same_obstacles: bool
    trials: list[str]


def coverage_figure(
    study: StoredStudy,
) -> Figure:
    """The mean visits of each pixel, a panel a point, on a common scale of colours.

    A title gives the coverage and its CV, if they are recorded. Obstacles are outlined
    where all trials of a point have the same ones. A panel without done trials says so.
    Raises ChoiceError where no heatmaps are stored, and for more than twelve points.
    """
    return draw_coverage(coverage_layout(study))


def coverage_layout(
    study: StoredStudy,
) -> CoverageLayout:
    """What `coverage_figure` will show. Raises ChoiceError as it does."""
    selection = select(study)
    if (
        "visits"
        not in study.store.read(
            "heatmaps", trial_ids=pa.array([], pa.string())
        ).column_names
    ):
        raise ChoiceError(
            "has no heatmaps; record: {heatmaps: true} keeps them", study.name
        )
    names = [*selection.apart(selection.sampled), *selection.sampled]
    return CoverageLayout(selection, selection.panels(names, "coverage"))


def draw_coverage(layout: CoverageLayout) -> Figure:
    """The figure of a layout."""
    selection, facets = layout
    visits = _visits(selection, facets)
    known = [one.mean[one.mean > 0.0] for one in visits]
    most = max(
        (float(np.quantile(means, DARKEST)) for means in known if len(means)),
        default=1.0,
    )
    height = max(one.mean.shape[0] / one.mean.shape[1] for one in visits if one.trials)
    with style.context(STYLE):
        across = min(3, len(facets))
        down = -(-len(facets) // across)
        width = 4.8 if across == 1 else 7.2
        figure = Figure(
            figsize=(width, 1.1 + down * (0.75 + height * (width - 1.6) / across))
        )
        panels = figure.subplots(down, across, sharex=True, sharey=True, squeeze=False)
        for axes, facet, one in zip(
            tidy_grid(panels, len(facets)), facets, visits, strict=True
        ):
            if one.trials:
                image = _panel(axes, selection, one, most)
            else:
                without_trials(axes)
            title_panel(
                axes,
                [
                    *facet.title.split(", "),
                    *(_said(selection, facet) if one.trials else []),
                ],
                across,
            )
        figure.colorbar(
            image,
            ax=list(panels.ravel()),
            label="mean visits a pixel",
            extend="max",
            shrink=0.9,
            pad=0.02,
        )
        note(figure, _note(selection, visits))
    return figure


def _panel(axes: Axes, selection: Selection, visits: Visits, most: float) -> AxesImage:
    pixel = selection.trials.set_index("trial_id")["pixel"][visits.trials[0]]
    world = selection.study.world(visits.trials[0])
    if not visits.same_obstacles:
        world = world._replace(obstacles=np.empty((0, 5)))
    unit = selection.study.units.get("width", "")
    return draw_visits(axes, visits.mean, world, most, unit, float(pixel))


def _visits(selection: Selection, facets: list[Facet]) -> list[Visits]:
    """The mean visits of each point over its trials that are done. Raises StoreError
    where one of them has no heatmap.
    """
    done = selection.trials[selection.trials["status"] == "done"]
    found = [among(done, facet.points)["trial_id"].tolist() for facet in facets]
    wanted = pa.array([trial for trials in found for trial in trials], pa.string())
    stored = selection.study.read("heatmaps", wanted)
    place = {
        trial: number for number, trial in enumerate(stored["trial_id"].to_pylist())
    }
    if not set(wanted.to_pylist()) <= place.keys():
        raise StoreError(
            "a trial that is done has no heatmap; choose with where",
            selection.study.name,
        )
    return [
        _mean([_counts(stored, place[trial]) for trial in trials], trials)
        for trials in found
    ]


def _counts(stored: pa.Table, number: int) -> NDArray[np.int32]:
    shape = stored["rows"][number].as_py(), stored["columns"][number].as_py()
    return np.asarray(stored["visits"][number].values).reshape(shape)


def _mean(visits: list[NDArray[np.int32]], trials: list[str]) -> Visits:
    if not trials:
        return Visits(np.full((0, 0), np.nan), True, trials)
    free = np.sum([one >= 0 for one in visits], axis=0)
    total = np.sum([np.maximum(one, 0) for one in visits], axis=0)
    mean = np.where(free > 0, total / np.maximum(free, 1), np.nan)
    return Visits(mean, bool(np.isin(free, (0, len(visits))).all()), trials)


def _said(selection: Selection, facet: Facet) -> list[str]:
    """Coverage and CV of a point with intervals, in words, as far as recorded."""
    trials = among(selection.trials, facet.points)
    lines = []
    for metric, short in _named(selection).items():
        confidence = selection.study.repeated.get(metric, CONFIDENCE)
        value, low, high, _ = mean_interval(
            trials[metric].to_numpy(np.float64),
            confidence,
            distribution=selection.study.distributions[metric],
        )
        unit = selection.study.units.get(metric, "")
        lines.append(f"{short} {estimated(value, low, high)} {unit}".rstrip())
    return lines


def _named(selection: Selection) -> dict[str, str]:
    """The short names of the recorded metrics that have one."""
    return {
        name: about.short
        for name, about in selection.study.known.metrics.items()
        if about.short and name in selection.study.metrics
    }


def _note(selection: Selection, visits: list[Visits]) -> str:
    counts = [len(one.trials) for one in visits]
    named = _named(selection).values()
    interval = f"{' and '.join(named)} with 95 % interval" if named else ""
    same = all(one.same_obstacles for one in visits if one.trials)
    obstacles = "blue: obstacles" if same else "obstacles differ between trials"
    said = selection.about(
        "mean of {n} trials a panel", counts, interval, selection.study.metrics
    )
    return f"{said}; white: never visited; {obstacles}"


def plan(study: StoredStudy, _: Choices) -> list[Planned]:
    """One figure of all points. Raises ChoiceError where the study has none."""
    return [Planned("", partial(draw_coverage, coverage_layout(study)))]


KIND = FigureKind("visits of each pixel of the map", (), plan)
