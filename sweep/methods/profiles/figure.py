"""The figure of profiles: means along the axis, with bands for the whole curve."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
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
    FigureMarks,
    MarkedAxis,
    MarkedPanel,
    Planned,
    as_text,
    legend,
    make_logarithmic,
    named,
    note,
    select,
)
from sweep.methods.profiles.analysis import (
    MeanProfile,
    chosen_profiles,
    mean_profiles,
    profile_units,
    rows_by_point,
    with_unit,
)
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
    chosen_profiles(study, [profile])
    _check_lines(study, profile)
    return draw_profile(study, mean_profiles(study, [profile]))


def _check_lines(study: Results, profile: str) -> None:
    """Raise ChoiceError if there are more points than colours."""
    parts = stored_parts(study)
    lines = sum(len(rows_by_point(part, profile)) for part in parts)
    if lines > MOST_LINES:
        raise ChoiceError(
            f"has {lines:,} points; allowed: up to {MOST_LINES} lines; choose with"
            " where",
            study.name,
            "profiles",
        )


def draw_profile(study: Results, lines: Sequence[MeanProfile]) -> Figure:
    """Draw the figure of a profile, with one line per point of each study."""
    first = lines[0]
    with style.context(STYLE):
        figure = Figure(figsize=(4.8, 3.9))
        axes = figure.subplots()
        for number, line in enumerate(lines):
            _draw_line(axes, line, number, apart=number - 0.5 * (len(lines) - 1))
        if _is_logarithmic(lines):
            make_logarithmic(axes, "x")
            make_logarithmic(axes, "y")
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
    finite = np.isfinite(line.value)
    at = line.at[finite]
    if line.axis == "individual":
        at = at + SIDE_BY_SIDE * apart
    low = line.low[finite]
    high = line.high[finite]
    look = LINE_STYLES[number % len(LINE_STYLES)]
    if line.axis == "individual":
        axes.vlines(at, low, high, color=colour, lw=0.8)
    else:
        axes.fill_between(at, low, high, color=colour, alpha=0.2, lw=0)
    axes.plot(
        at,
        line.value[finite],
        color=colour,
        marker=MARKERS[number % len(MARKERS)],
        linestyle="none" if line.axis == "individual" else look,
        markersize=3.0,
        linewidth=0.9,
        label=named(line.settings.items()),
    )


def _note(study: Results, lines: Sequence[MeanProfile]) -> str:
    drawn = "lines" if lines[0].axis == "individual" else "bands"
    text = (
        f"{lines[0].text}; means over {study.averaged} of {{n}} trials per point;"
        f" {drawn}: 95 % confidence intervals that hold for all positions together"
    )
    return select(study).note(text, [len(line.values) for line in lines], shown=[])


def plan(study: Results, _choices: Choices) -> list[Planned]:
    """Return a figure per profile.

    Raises ChoiceError without profiles, without a profile of all joined studies, or for
    too many points.
    """
    return [
        Planned(name, partial(_draw, study, name)) for name in _drawn_profiles(study)
    ]


def _draw(study: Results, name: str) -> Figure:
    return draw_profile(study, _lines(study, name))


def _drawn_profiles(study: Results) -> list[str]:
    """Return the profiles that all joined studies have in equal units.

    An individual of a study is none of another study.
    """
    first, *joined = stored_parts(study)
    profiles = [
        name
        for name in chosen_profiles(first)
        if all(_is_shared(first, part, name) for part in joined)
    ]
    if not profiles:
        raise ChoiceError(
            "no profile is in equal units in all studies; individuals of a study are"
            " not those of another study",
            study.name,
        )
    for name in profiles:
        _check_lines(study, name)
    return profiles


def _is_shared(first: StoredStudy, other: StoredStudy, name: str) -> bool:
    return (
        name in chosen_profiles(other)
        and profile_units(first, name) == profile_units(other, name)
        and first.known.profiles[name].axis != "individual"
    )


def _lines(study: Results, name: str) -> list[MeanProfile]:
    """Return the mean of a profile at each point of each joined study."""
    if not isinstance(study, JoinedStudies):
        (study,) = stored_parts(study)
        return mean_profiles(study, [name])
    return [
        replace(mean, settings={STUDY: study.labels[part.name]} | mean.settings)
        for part in study.parts
        for mean in mean_profiles(part, [name])
    ]


def marks(study: StoredStudy, _choices: Choices) -> FigureMarks:
    """Return a panel per profile as marks; individuals only without other profiles."""
    drawn = _drawn_profiles(study)
    along = [name for name in drawn if study.known.profiles[name].axis != "individual"]
    profiles = {name: _lines(study, name) for name in along or drawn}
    points = dict.fromkeys(line.point for lines in profiles.values() for line in lines)
    colours = {point: number for number, point in enumerate(points)}
    settings = {
        line.point: named(line.settings.items())
        for lines in profiles.values()
        for line in lines
    }
    left_out = [name for name in drawn if name not in profiles]
    by_command = f"; only in `sweep plot`: {', '.join(left_out)}" if left_out else ""
    text = (
        f"means over {study.averaged} of {{n}} trials per point; bands: 95 %"
        f" confidence intervals that hold for all positions together{by_command}"
    )
    counts = [len(line.values) for lines in profiles.values() for line in lines]
    return FigureMarks(
        "lines" if along else "points",
        (),
        [_panel(lines, colours) for lines in profiles.values()],
        select(study).note(text, counts, shown=[]),
        by="point" if study.varied else "",
        values=tuple(settings[point] for point in points if study.varied),
    )


def _panel(lines: Sequence[MeanProfile], colours: Mapping[str, int]) -> MarkedPanel:
    first = lines[0]
    is_logarithmic = _is_logarithmic(lines)
    # Lines of a recording may have different individuals.
    individuals = tuple(
        dict.fromkeys(name for line in lines for name in line.individuals)
    )
    places = {name: place for place, name in enumerate(individuals)}
    rows = [
        pd.DataFrame(
            {
                "x": [places[name] for name in line.individuals]
                if individuals
                else line.at,
                "y": line.value,
                "low": line.low,
                "high": line.high,
                "n": np.isfinite(line.values).sum(axis=0),
                "colour": colours[line.point],
                "point": line.point,
            }
        )
        for line in lines
    ]
    return MarkedPanel(
        first.name.replace("_", " "),
        MarkedAxis(
            first.axis,
            with_unit(first.axis, first.axis_unit),
            is_logarithmic,
            names=individuals,
        ),
        MarkedAxis(
            first.name,
            with_unit(first.name.replace("_", " "), first.unit),
            is_logarithmic,
        ),
        pd.concat(rows, ignore_index=True),
    )


def _is_logarithmic(lines: Sequence[MeanProfile]) -> bool:
    """Return whether axes are logarithmic, so that an exponent is a slope."""
    is_positive = any((line.value > 0.0).any() for line in lines)
    return lines[0].exponent is not None and is_positive


KIND = FigureKind(
    "a profile along its axis, with a line per point",
    (),
    plan,
    of_several=True,
    marks=marks,
)
