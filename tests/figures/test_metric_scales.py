"""Scales of metrics that few values would press together, in both drawings."""

from copy import copy

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import Normalize, SymLogNorm
from matplotlib.figure import Figure

from sweep.figures import KINDS, Choices, FigureMarks, heatmap_figure, scatter_figure
from sweep.figures.scales import linear_part, number_text
from sweep.methods.ablation.figure import effects_figure
from tests.plotted import made_up, study

ROWS = "n: [3, 4, 5, 6, 7, 8], cohesion_weight: [0, 1]"
LABEL = "speed (px/step), log scale beyond ±10"


def with_large_row(settings: pd.DataFrame) -> np.ndarray:
    """From 5 to 27, and 2,500 in the row of the largest n."""
    values = 5.0 + 2.0 * np.arange(len(settings))
    return np.where(settings["n"] == 8, 2500.0, values)


def even(settings: pd.DataFrame) -> np.ndarray:
    return np.arange(len(settings), dtype=float)


def marks(kind: str, function: object) -> FigureMarks:
    part = made_up(ROWS, function)  # type: ignore[arg-type]
    shown = KINDS[kind].marks(part, Choices(("speed",), x="n"))  # type: ignore[misc]
    assert isinstance(shown, FigureMarks)
    return shown


@pytest.mark.parametrize(
    ("values", "end"),
    [
        ([5, 10, 20, 30, 2500], 10.0),
        ([-5, 10, -20, 30, -2500], 10.0),  # sizes, without the sign
        ([0.05, 0.1, 0.2, 0.3, 25], 0.1),
        ([5, 10, 20, 30, 299], 0.0),  # 30 is above a tenth
        ([5, 10, 20, 2500, 2600], 0.0),  # two of five
        ([5, 10, 20, 2500], 0.0),  # too few
        ([1000, 1001, 1002, 1003, 3500], 0.0),  # far from 0: a logarithm helps not
        ([0, 0, 0, 0, 0, 0, 2500], 0.0),  # zeros are not pressed
        ([1e-17, 1e-17, 1e-17, 1e-17, 1e-17, 0.5], 0.0),  # nor is rounding
        ([5, 10, 20, 30, 2500, np.nan, np.inf], 10.0),
        ([], 0.0),
    ],
)
def test_a_scale_is_linear_unless_few_values_press_the_others(
    values: list[float], end: float
) -> None:
    assert linear_part(values) == end


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (6.0, "6"),
        (0.001, "0.001"),
        (10000.0, "10000"),
        (1e-5, "10⁻⁵"),
        (2e-7, "2\N{MULTIPLICATION SIGN}10⁻⁷"),
        (-1e6, "\N{MINUS SIGN}10⁶"),
        (-30.0, "\N{MINUS SIGN}30"),
        (0.0, "0"),
    ],
)
def test_numbers_of_logarithmic_ticks(value: float, text: str) -> None:
    assert number_text(value) == text


def test_one_row_does_not_press_a_scatter_together() -> None:
    figure = scatter_figure(made_up(ROWS, with_large_row), "speed", "n")
    (axes,) = figure.axes
    assert axes.get_yscale() == "symlog"
    assert axes.get_ylabel().replace("\n", " ") == LABEL
    assert 0.0 <= axes.get_ylim()[0] <= 5.0
    bottom, large, top = axes.transAxes.inverted().transform(
        axes.transData.transform([(3, 5), (3, 27), (3, 2500)])
    )[:, 1]
    assert large - bottom > 0.2 * (top - bottom)
    (panel,) = marks("scatter", with_large_row).panels
    assert (panel.y.label, panel.y.linear) == (LABEL, 10.0)


def test_even_values_have_a_linear_scale() -> None:
    (axes,) = scatter_figure(made_up(ROWS, even), "speed", "n").axes
    assert (axes.get_yscale(), axes.get_ylabel()) == ("linear", "speed (px/step)")
    shown = marks("scatter", even)
    assert [panel.y.linear for panel in shown.panels] == [0.0]
    assert marks("heatmap", even).linear == 0.0
    figure = heatmap_figure(made_up(ROWS, even), "speed", "n")
    assert type(figure.axes[0].collections[0].norm) is Normalize


def test_one_row_does_not_press_the_colours_of_a_heatmap_together() -> None:
    figure = heatmap_figure(made_up(ROWS, with_large_row), "speed", "n")
    norm = figure.axes[0].collections[0].norm
    assert isinstance(norm, SymLogNorm)
    assert norm.linthresh == 10.0
    assert float(norm(27.0) - norm(5.0)) > 0.2
    bar = figure.axes[1]
    assert bar.get_ylabel().replace("\n", " ") == LABEL
    shown = marks("heatmap", with_large_row)
    assert (shown.by, shown.linear) == (LABEL, 10.0)


def test_one_effect_does_not_press_the_others_together() -> None:
    ablated = copy(study("ablated"))
    details = ablated.details("as_written")
    names = [name for name in details.unique() if name]
    sizes = {name: 4.0 + number for number, name in enumerate(names)}
    changes = details.map(sizes | {"": 0.0, names[0]: 2500.0}).to_numpy()
    ablated.trials = ablated.trials.assign(speed=changes)

    def drawn() -> Figure:
        return effects_figure(ablated, "as_written", {"speed": "speed"})

    (axes,) = drawn().axes
    assert axes.get_xscale() == "symlog"
    assert axes.get_xlabel() == "change (px/step), log\nscale beyond ±10"
    ablated.trials = ablated.trials.assign(speed=np.minimum(changes, 30.0))
    (axes,) = drawn().axes
    assert (axes.get_xscale(), axes.get_xlabel()) == ("linear", "change (px/step)")
