"""The figure of profiles: means along the axis, with bands for the whole curve."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from sweep.errors import ChoiceError
from sweep.figures import (
    COLOURS,
    GREY,
    LINE_STYLES,
    MARKERS,
    STYLE,
    Choices,
    FigureKind,
    Planned,
    as_text,
    legend,
    named,
    note,
    select,
)
from sweep.methods.profiles.analysis import MeanProfile, mean_profiles, with_unit
from sweep.tables import STUDY, JoinedStudies, Results, StoredStudy, stored_parts

MOST_LINES = len(COLOURS)
MOST_UPRIGHT = 16
"""Number of individuals up to which their names are not turned."""
MOST_NAMED = 60
"""Number of individuals up to which each has a tick."""
SIDE_BY_SIDE = 0.12
"""Distance of the lines of two points, in distances of individuals."""


def profile_figure(study: StoredStudy, profile: str) -> Figure:
    """Plot the mean of a profile along its axis, with a line per point.

    Bands are simultaneous 95 % confidence intervals over trials.

    Parameters
    ----------
    study : StoredStudy
    profile : str
        Name of a recorded profile.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If the profile is not stored, or the study has more points than colours.
    """
    return draw_profile(study, _lines(study, mean_profiles(study, [profile])))


def _lines(study: Results, means: Sequence[MeanProfile]) -> Sequence[MeanProfile]:
    if len(means) > MOST_LINES:
        raise ChoiceError(
            f"has {len(means):,} points; allowed: up to {MOST_LINES} lines; choose"
            " with where",
            study.name,
            "profiles",
        )
    return means


def draw_profile(study: Results, lines: Sequence[MeanProfile]) -> Figure:
    """Draw the figure of a profile, with one line per point of each study."""
    first = lines[0]
    with style.context(STYLE):
        figure = Figure(figsize=(4.8, 3.9))
        axes = figure.subplots()
        for number, line in enumerate(lines):
            _draw_line(axes, line, number, apart=number - 0.5 * (len(lines) - 1))
        positive = any((line.value > 0.0).any() for line in lines)
        if first.exponent is not None and positive:
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter("{x:g}")
            axes.xaxis.set_minor_formatter("")
        if first.axis == "individual" and len(first.at) <= MOST_NAMED:
            axes.set_xticks(first.at, list(map(as_text, first.positions)))
            axes.tick_params("x", rotation=90 if len(first.at) > MOST_UPRIGHT else 0)
        elif axes.get_yscale() == "linear":
            _keep_means_in_view(axes, lines)
        if first.zero is not None:
            axes.axhline(0.0, color=GREY, lw=0.8, zorder=0)
        axes.set_xlabel(with_unit(first.axis, first.axis_unit))
        axes.set_ylabel(with_unit(first.name.replace("_", " "), first.unit))
        if len(lines) > 1:
            legend(figure, axes)
        note(figure, _note(study, lines))
    return figure


def _keep_means_in_view(axes: Axes, lines: Sequence[MeanProfile]) -> None:
    """Cut bands that are wider than most bands, and than the means vary."""
    means = np.concatenate([line.value for line in lines])
    widths = np.concatenate([line.high - line.low for line in lines])
    means = means[np.isfinite(means)]
    widths = widths[np.isfinite(widths)]
    if not (means.size and widths.size):
        return
    room = max(np.ptp(means), np.median(widths))
    low, high = axes.get_ylim()
    axes.set_ylim(max(low, means.min() - room), min(high, means.max() + room))


def _draw_line(axes: Axes, line: MeanProfile, number: int, apart: float) -> None:
    """Draw the means of a profile; individuals of several lines are side by side."""
    colour = COLOURS[number % len(COLOURS)]
    known = np.isfinite(line.value)
    at = line.at[known]
    if line.axis == "individual":
        at = at + SIDE_BY_SIDE * apart
    low = line.low[known]
    high = line.high[known]
    if line.axis == "individual":
        axes.vlines(at, low, high, color=colour, lw=0.8)
    else:
        axes.fill_between(at, low, high, color=colour, alpha=0.2, lw=0)
    axes.plot(
        at,
        line.value[known],
        color=colour,
        marker=MARKERS[number % len(MARKERS)],
        linestyle="none" if line.axis == "individual" else _style(number),
        markersize=3.0,
        linewidth=0.9,
        label=named(line.settings.items()),
    )


def _style(number: int) -> str:
    return str(LINE_STYLES[number % len(LINE_STYLES)])


def _note(study: Results, lines: Sequence[MeanProfile]) -> str:
    drawn = "lines" if lines[0].axis == "individual" else "bands"
    text = (
        f"{lines[0].text}; means over {study.averaged} of {{n}} trials per point;"
        f" {drawn}: 95 % confidence intervals that hold for all positions together"
    )
    return select(study).note(text, [len(line.values) for line in lines], shown=[])


def plan(study: Results, choices: Choices) -> list[Planned]:
    """Return a figure per profile.

    Raises ChoiceError without profiles, or without a profile of all joined studies.
    """
    by_name = _by_name(study, choices.metrics)
    return [
        Planned(name, partial(draw_profile, study, _lines(study, lines)))
        for name, lines in by_name.items()
    ]


def _by_name(study: Results, names: Sequence[str]) -> dict[str, list[MeanProfile]]:
    """Return the means of the profiles that all joined studies share, by name."""
    parts = stored_parts(study)
    by_name = defaultdict[str, list[MeanProfile]](list)
    for part in parts:
        of_study = {}
        if isinstance(study, JoinedStudies):
            of_study = {STUDY: study.labels[part.name]}
        for mean in mean_profiles(part, names):
            line = replace(mean, settings=of_study | mean.settings)
            by_name[mean.name].append(line)
    if len(parts) == 1:
        return by_name
    shared = {
        name: lines
        for name, lines in by_name.items()
        if len({line.settings[STUDY] for line in lines}) == len(parts)
        and len({(line.unit, line.axis_unit) for line in lines}) == 1
        and lines[0].axis != "individual"
    }
    if not shared:
        raise ChoiceError(
            "no profile is in equal units in all studies; individuals of a study are"
            " not those of another study",
            study.name,
        )
    return shared


KIND = FigureKind(
    "a profile along its axis, with a line per point", (), plan, of_several=True
)
