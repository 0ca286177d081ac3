"""Figures 1 and 2a of Vicsek et al. (1995), what is exact, and whether the transition
jumps: with vectorial noise, and with scalar noise at a small speed.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sweep.analysis import (
    binder_values,
    order_parameters,
    order_samples,
    susceptibility_values,
)
from sweep.figures import (
    BLUE,
    COLOURS,
    GREY,
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    draw_map,
    draw_values,
    hysteresis_figure,
    legend,
    note,
    scaling_figure,
)
from sweep.methods.hysteresis import FoundLoop, find_loops
from sweep.methods.scaling import finite_size_scaling
from sweep.published.definitions import as_defined
from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]
Studies = Mapping[str, StoredStudy]

PROGRAMS = Path(__file__).with_name("programs.csv")
"""Orders with standard errors over runs from programs that were written from the
equations alone and share no code with this one.
"""
BURN_IN = {"vectorial": 3000, "coexistence": 3000, "scalar": 3000}
"""Steps before the first one that counts, by study."""
DISORDER, ORDER = 1 / 3, 2 / 3
"""Binder's cumulant of the order of independent headings, and of perfect order."""
BANDS = (0.15, 0.35, 0.55, 0.75)
"""The edges of the bands of the order whose shares of time are compared."""
PEAKS = {40: 4.5, 100: 4.0, 400: 3.75}
"""By size, the noise at which trials with another seed had the largest susceptibility.
"""
JUMP = (0.6, 0.62)
"""Noises before and after the fall of the order with vectorial noise."""
NOISE = "noise η"


def _samples(studies: Studies, spec: str, noise: float) -> Floats:
    """The order at one noise after the burn-in, (k, T) of k trials."""
    study = studies[spec]
    trials = study.trials
    (point,) = set(trials.loc[np.isclose(trials["noise"], noise), "point"])
    return order_samples(study, "polarization", BURN_IN[spec])[point]


def _binder(studies: Studies, spec: str, noise: float) -> Floats:
    """The jackknife's pseudo-values of Binder's cumulant at one noise."""
    return binder_values(_samples(studies, spec, noise))


binder_vectorial = partial(_binder, spec="vectorial")
binder_scalar = partial(_binder, spec="scalar")


def _counted(studies: Studies, spec: str, n: int, noise: float) -> Floats:
    """The frames (k, T) of the order at one point that `sweep scaling` counts."""
    curves = {
        one.n: one for one in finite_size_scaling(studies[spec], "polarization").curves
    }
    (place,) = np.flatnonzero(np.isclose(curves[n].x, noise))
    return curves[n].samples[place]


def size_order(studies: Studies, n: int, noise: float) -> Floats:
    """The order with scalar noise, by trial."""
    return _counted(studies, "scaling_scalar", n, noise).mean(axis=1)


def size_susceptibility(studies: Studies, n: int, noise: float) -> Floats:
    """The jackknife's pseudo-values of the susceptibility with scalar noise."""
    return susceptibility_values(_counted(studies, "scaling_scalar", n, noise), n)


def size_binder(studies: Studies, n: int, noise: float) -> Floats:
    """The jackknife's pseudo-values of Binder's cumulant with scalar noise."""
    return binder_values(_counted(studies, "scaling_scalar", n, noise))


def _smaller(n: int) -> int:
    """The next smaller size."""
    return max(size for size in PEAKS if size < n)


def susceptibility_growth(studies: Studies, n: int) -> tuple[Floats, Floats]:
    """The susceptibility at its peak, and that of the next smaller size at its own."""
    first, second = (
        size_susceptibility(studies, size, PEAKS[size]) for size in (n, _smaller(n))
    )
    return first, second


def binder_change(studies: Studies, n: int, noise: float) -> tuple[Floats, Floats]:
    """The cumulant, and that of the next smaller size at the same noise."""
    first, second = (size_binder(studies, size, noise) for size in (n, _smaller(n)))
    return first, second


def fall_growth(studies: Studies, n: int) -> tuple[Floats, Floats]:
    """By how much the order falls between two vectorial noises, by pairs of independent
    trials; the same of a quarter of the boids.
    """
    falls = []
    for size in (n, n // 4):
        before, after = (
            _counted(studies, "scaling_vectorial", size, noise).mean(axis=1)
            for noise in JUMP
        )
        falls.append(before - after)
    return falls[0], falls[1]


def _loop(studies: Studies) -> FoundLoop:
    """The order of each chain with slowly changed vectorial noise."""
    (one,) = find_loops(studies["hysteresis"], "polarization", half=True)
    return one


def loop_area(studies: Studies) -> Floats:
    """The area between the order on the way down and on the way up, by chain."""
    one = _loop(studies)
    return np.trapezoid(one.down - one.up, one.values, axis=1)


def _on_the_way(studies: Studies, noise: float, way: str) -> Floats:
    """The order of each chain at one noise, on the way `up` or `down`."""
    one = _loop(studies)
    (place,) = np.flatnonzero(np.isclose(one.values, noise))
    values: Floats = getattr(one, way)
    return values[:, place]


order_up = partial(_on_the_way, way="up")
order_down = partial(_on_the_way, way="down")


def programs(noise_type: str, moves_with: str, n: int) -> pd.DataFrame:
    """What independent programs found with such noise: noise, order and order_se."""
    rows = pd.read_csv(PROGRAMS)
    chosen = (rows["noise_type"] == noise_type) & (rows["moves_with"] == moves_with)
    return rows[chosen & (rows["n"] == n)]


def figure1(studies: Studies) -> Figure:
    """300 boids at the start and at the end, in worlds of three sizes."""
    study = studies["figure1"]
    panels = (("a", 2.0, 7.0, 0), ("b", 0.1, 25.0, -1), ("c", 2.0, 7.0, -1))
    panels += (("d", 0.1, 5.0, -1),)
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 7.4))
        for axes, (name, noise, side, frame) in zip(
            figure.subplots(2, 2).ravel(), panels, strict=True
        ):
            trials = study.trials
            at = trials[(trials["noise"] == noise) & (trials["width"] == side)]
            trial = at.sort_values("replicate").iloc[0]
            frames, bodies = study.trajectory(trial["trial_id"])
            draw_map(axes, study.world(trial["trial_id"]), "r", downwards=False)
            draw_flock(axes, bodies[frame], side / 40)
            axes.set_title(
                f"({name}) side {side:g}, η = {noise:g}, after {frames[frame]:,} steps",
                loc="left",
                fontsize=8,
            )
        note(figure, f"{study.name}: one trial each of 300 boids; lengths in ranges r")
    return figure


def figure2a(studies: Studies) -> Figure:
    """Order against noise at density 4 for four sizes, and what independent programs
    and the exact law of full noise say.
    """
    study = studies["figure2a"]
    table = study.means(["polarization_mean"], ["n", "noise"])
    with style.context(STYLE):
        figure = Figure(figsize=(6.4, 4.2))
        axes = figure.subplots()
        for colour, (n, curve) in zip(COLOURS, table.groupby("n"), strict=False):
            size = int(np.float64(n))  # type: ignore[arg-type]
            axes.plot(curve["noise"], curve["polarization_mean"], color=colour, lw=0.8)
            ends = ("", "_low", "_high")
            values = tuple(curve[f"polarization_mean{end}"] for end in ends)
            _draw_upright(axes, curve["noise"], values, colour, f"N = {size:,}")
            known = programs("scalar", "old_heading", size)
            axes.plot(known["noise"], known["order"], "x", color="0.1", ms=9, zorder=4)
            exact = np.sqrt(np.pi / 4 / size)
            axes.plot(2 * np.pi, exact, "D", color=colour, ms=5, zorder=4)
        axes.set(xlabel=f"{NOISE} (radians)", ylabel="order", ylim=(0, 1.02))
        axes.set_xticks([0, 1, 2, 3, 4, 5, 2 * np.pi], ["0", *"12345", "2π"])
        legend(figure, axes)
        counts = study.trials.groupby("point").size()
        note(
            figure,
            f"{study.name}: {counts.max()} trials a value, mean of the last half, 95 %"
            " interval; crosses: independent programs; diamonds: sqrt(pi / 4N)",
        )
    return figure


def _draw_upright(
    axes: Axes,
    places: "pd.Series[float]",
    values: tuple["pd.Series[float]", ...],
    colour: str,
    label: str,
) -> None:
    """Values with intervals above the places on the horizontal axis."""
    mean, low, high = values
    axes.errorbar(
        places,
        mean,
        np.maximum([mean - low, high - mean], 0.0),
        fmt="o",
        ms=4,
        color=colour,
        label=label,
    )


def exact(studies: Studies) -> Figure:
    """The mean order, and N times its mean square, of flocks with noise over the whole
    circle, by what they are of independent headings.
    """
    study = studies["full_noise"]
    columns = ["polarization_mean", "square_mean"]
    table = study.means(columns, ["n"])
    laws = np.sqrt(np.pi / 4 / table["n"]), np.ones(len(table))
    words = (
        "mean order, in units of sqrt(π / 4N)",
        "mean of N times the squared order",
    )
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 2.6))
        panels = figure.subplots(1, 2, sharey=True)
        for axes, column, law, text in zip(panels, columns, laws, words, strict=True):
            rows = tuple(table[f"{column}{end}"] / law for end in ("", "_low", "_high"))
            axes.axvline(1.0, color=GREY, lw=0.8)
            draw_values(axes, range(len(table)), rows, BLUE)
            axes.set_xlabel(text)
        names = [f"N = {int(n):,}" for n in table["n"]]
        panels[0].set_yticks(range(len(table)), names)
        panels[0].invert_yaxis()
        count = study.trials.groupby("point").size().max()
        note(
            figure, f"{study.name}: {count} trials a value, 95 % interval; line: exact"
        )
    return figure


def transition(studies: Studies) -> Figure:
    """Vectorial noise above, scalar noise at a small speed below: order, Binder's
    cumulant, and how often the order has which value where it is half-way.
    """
    rows = (
        ("vectorial", "coexistence", 0.616, "vectorial, speed 0.5", VERMILION),
        ("scalar", "scalar", 3.4, "scalar, speed 0.1", BLUE),
    )
    with style.context(STYLE):
        figure = Figure(figsize=(9.6, 5.6))
        for panels, (spec, other, half_way, text, colour) in zip(
            figure.subplots(2, 3), rows, strict=True
        ):
            study = studies[spec]
            table = order_parameters(study, "polarization", BURN_IN[spec])
            for axes, name in zip(panels, ("order", "binder"), strict=False):
                ends = ("", "_low", "_high")
                values = tuple(table[f"{name}{end}"] for end in ends)
                axes.plot(table["noise"], table[name], color=colour, lw=0.8)
                _draw_upright(axes, table["noise"], values, colour, text)
                axes.set_xlabel(f"{NOISE}, {text}")
            panels[0].set(ylabel="order", ylim=(0, 1))
            panels[1].set_ylabel("Binder's cumulant")
            for bound in (DISORDER, ORDER):
                panels[1].axhline(bound, color=GREY, lw=0.8)
            _draw_distribution(panels[2], studies, other, half_way, colour)
        large = studies["vectorial_large"].means(["polarization_mean"], ["noise"])
        first = figure.axes[0]
        first.plot(large["noise"], large["polarization_mean"], "s", color="0.1", ms=4)
        known = programs("vectorial", "new_heading", 2048)
        first.plot(known["noise"], known["order"], "x", color="0.1", ms=8)
        note(
            figure,
            f"{studies['vectorial'].name} (N = 512, side 16; squares: N = 2048, side"
            f" 32; crosses: independent programs for these) and\n"
            f"{studies['scalar'].name} (N = 400, side 10); 95 % intervals; lines:"
            " disorder 1/3 and order 2/3; shaded: the band in the middle",
        )
    return figure


def _draw_distribution(
    axes: Axes, studies: Studies, spec: str, noise: float, colour: str
) -> None:
    """How often the order has which value at one noise, over all trials and frames."""
    samples = _samples(studies, spec, noise)
    axes.axvspan(*BANDS[1:3], color="0.93", lw=0, zorder=0)
    axes.hist(samples.ravel(), np.linspace(0, 1, 41), density=True, color=colour)
    axes.set(
        xlabel=f"order at η = {noise:g}, {len(samples)} trials",
        ylabel="density",
        xlim=(0, 1),
    )


def scaling_scalar(studies: Studies) -> Figure:
    """Order, susceptibility and cumulant of three sizes with scalar noise."""
    return scaling_figure(studies["scaling_scalar"], "polarization")


def scaling_vectorial(studies: Studies) -> Figure:
    """The same of two sizes with vectorial noise."""
    return scaling_figure(studies["scaling_vectorial"], "polarization")


def hysteresis(studies: Studies) -> Figure:
    """Order against vectorial noise that increases, and then decreases."""
    return hysteresis_figure(studies["hysteresis"], "polarization", half=True)


recorded_as_defined = partial(as_defined, spec="figure1")

FIGURES = {
    "figure1": Drawing(
        figure1,
        ("figure1",),
        "Figure 1: boids at the start, and later in three worlds.",
    ),
    "figure2a": Drawing(
        figure2a, ("figure2a",), "Figure 2a: order against noise for four sizes."
    ),
    "exact": Drawing(
        exact, ("full_noise",), "Flocks at full noise against what is exact."
    ),
    "transition": Drawing(
        transition,
        ("vectorial", "coexistence", "scalar", "vectorial_large"),
        "A jump with vectorial noise, and a gradual change with scalar noise.",
    ),
    "scaling_scalar": Drawing(
        scaling_scalar,
        ("scaling_scalar",),
        "What three sizes tell of the transition with scalar noise.",
    ),
    "scaling_vectorial": Drawing(
        scaling_vectorial,
        ("scaling_vectorial",),
        "What two sizes tell of the transition with vectorial noise.",
    ),
    "hysteresis": Drawing(
        hysteresis,
        ("hysteresis",),
        "Order against vectorial noise on the way up and on the way down.",
    ),
}
