"""The figure of curves of several sizes, scaled to a single curve."""

from functools import partial

from matplotlib import style
from matplotlib.figure import Figure

from sweep.analysis import with_interval
from sweep.errors import ChoiceError
from sweep.figures import (
    STYLE,
    Choices,
    FigureKind,
    Planned,
    legend,
    note,
    quantity,
    select,
)
from sweep.methods.scaling.analysis import LENGTHS, Scaling, finite_size_scaling
from sweep.methods.scaling.figure import chosen, looks
from sweep.tables import StoredStudy


def collapse_figure(
    study: StoredStudy, metric: str | None = None, by: str | None = None
) -> Figure:
    """Plot the collapse of the mean order of several sizes.

    The mean of the order parameter, times L^(beta/nu), is plotted against the distance
    of the control parameter from its critical value, times L^(1/nu). Each size has a
    mark. The note has the exponents with confidence intervals, and the quality of the
    collapse.

    Parameters
    ----------
    study : StoredStudy
    metric : str, optional
        The order parameter, a recorded series; by default the first series.
    by : str, optional
        The control parameter; by default the only number that varies in addition to n.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        The study has no sizes (see `sweep.methods.scaling.finite_size_scaling`), or
        the curves cannot be collapsed.
    """
    return draw_collapse(
        study, collapsed(study, finite_size_scaling(study, metric, by))
    )


def collapsed(study: StoredStudy, scaling: Scaling) -> Scaling:
    """Return the analysis. ChoiceError if the curves cannot be collapsed."""
    if scaling.collapse.why:
        raise ChoiceError(
            f"cannot be collapsed: {scaling.collapse.why}", study.name, "collapse"
        )
    return scaling


def draw_collapse(study: StoredStudy, scaling: Scaling) -> Figure:
    """Draw the figure of curves that can be collapsed."""
    collapse = scaling.collapse
    place = collapse.place[0]
    inverse_nu = collapse.inverse_nu[0]
    beta_nu = collapse.beta_nu[0]
    with style.context(STYLE):
        figure = Figure(figsize=(6.4, 4.4))
        axes = figure.subplots()
        for number, curve in enumerate(scaling.curves):
            factor = curve.length**beta_nu
            low, high = curve.order.bounds(scaling.confidence)
            axes.errorbar(
                (curve.x - place) * curve.length**inverse_nu,
                curve.order.value * factor,
                (high - low) / 2.0 * factor,
                label=f"n = {curve.n:,}",
                **(looks(number) | {"linestyle": "none"}),
            )
        control = scaling.control.replace("_", " ")
        order = quantity(study, scaling.metric)
        axes.set_xlabel(f"({control} - critical {control}) L^(1/nu)")
        axes.set_ylabel(f"mean {order} L^(beta/nu)")
        legend(figure, axes)
        note(figure, _note(study, scaling))
    return figure


def _note(study: StoredStudy, scaling: Scaling) -> str:
    collapse = scaling.collapse
    values = (collapse.place, collapse.inverse_nu, collapse.beta_nu)
    labels = (f"critical {scaling.control}", "1/nu", "beta/nu")
    estimates = [
        f"{name} = {with_interval(*value)}"
        for name, value in zip(labels, values, strict=True)
    ]
    text = (
        f"{LENGTHS[scaling.length]}; {', '.join(estimates)};"
        f" S = {collapse.quality:.2g}, about 1"
        " if curves differ by errors alone; {n} trials per point, 95 % confidence"
        " intervals"
    )
    return select(study).note(text, scaling.states["trials"])


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure. ChoiceError if the curves cannot be collapsed."""
    scaling = collapsed(study, chosen(study, choices))
    return [Planned(scaling.metric, partial(draw_collapse, study, scaling))]


KIND = FigureKind("the order of several sizes, scaled to a single curve", ("x",), plan)
