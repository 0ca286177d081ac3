"""Curves of several sizes, scaled so that they become one."""

from functools import partial

from matplotlib import style
from matplotlib.figure import Figure

from sweep.analysis.notation import with_interval
from sweep.errors import ChoiceError
from sweep.figures.drawing import legend, note, quantity
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.selection import select
from sweep.figures.style import STYLE
from sweep.methods.scaling.analysis import LENGTHS, Scaling, finite_size_scaling
from sweep.methods.scaling.figure import chosen, looks
from sweep.tables.stored_study import StoredStudy


def collapse_figure(
    study: StoredStudy, metric: str | None = None, by: str | None = None
) -> Figure:
    """The mean of an order parameter, times L^(beta/nu), against the distance of a
    setting from its critical value, times L^(1/nu), with a mark for each size.

    The exponents, with their intervals, and the quality of the collapse stand below.
    Raises ChoiceError as `sweep.methods.scaling.finite_size_scaling`, and where the
    curves cannot be collapsed.
    """
    return draw_collapse(
        study, collapsed(study, finite_size_scaling(study, metric, by))
    )


def collapsed(study: StoredStudy, found: Scaling) -> Scaling:
    """The same, where its curves can be collapsed."""
    if found.collapse.why:
        raise ChoiceError(
            f"cannot be collapsed: {found.collapse.why}", study.name, "collapse"
        )
    return found


def draw_collapse(study: StoredStudy, found: Scaling) -> Figure:
    """The figure of curves that can be collapsed."""
    one = found.collapse
    place, inverse_nu, beta_nu = one.place[0], one.inverse_nu[0], one.beta_nu[0]
    with style.context(STYLE):
        figure = Figure(figsize=(6.4, 4.4))
        axes = figure.subplots()
        for number, curve in enumerate(found.curves):
            factor = curve.length**beta_nu
            low, high = curve.order.bounds(found.confidence)
            axes.errorbar(
                (curve.x - place) * curve.length**inverse_nu,
                curve.order.value * factor,
                (high - low) / 2.0 * factor,
                label=f"n = {curve.n:,}",
                **(looks(number) | {"linestyle": "none"}),
            )
        control, order = found.control.replace("_", " "), quantity(study, found.metric)
        axes.set_xlabel(f"({control} - critical {control}) L^(1/nu)")
        axes.set_ylabel(f"mean {order} L^(beta/nu)")
        legend(figure, axes)
        note(figure, _note(study, found))
    return figure


def _note(study: StoredStudy, found: Scaling) -> str:
    one = found.collapse
    values = (one.place, one.inverse_nu, one.beta_nu)
    names = (f"critical {found.control}", "1/nu", "beta/nu")
    said = [
        f"{name} = {with_interval(*of)}" for name, of in zip(names, values, strict=True)
    ]
    text = (
        f"{LENGTHS[found.length]}; {', '.join(said)}; S = {one.quality:.2g}, about 1"
        " where curves differ by their errors alone; {n} trials a point, 95 % intervals"
    )
    return select(study).note(text, found.states["trials"])


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """One figure. Raises ChoiceError where the curves cannot be collapsed."""
    found = collapsed(study, chosen(study, choices))
    return [Planned(found.metric, partial(draw_collapse, study, found))]


KIND = FigureKind(
    "the order of several sizes, scaled so that curves become one", ("x",), plan
)
