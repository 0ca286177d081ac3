"""The posterior of a calibrated study: each parameter, and each pair of parameters."""

from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures import (
    BLUE,
    MOST_COLOURS,
    STYLE,
    Choices,
    FigureKind,
    FigureMarks,
    MarkedAxis,
    MarkedPanel,
    Planned,
    note,
    quantity,
)
from sweep.methods.calibration.analysis import (
    Posterior,
    StoredSimulations,
    check_is_calibrated,
    is_number,
    posterior,
)
from sweep.tables import StoredStudy
from sweep.text import installing, so_many

SIDE = 1.6
"""Width and height of a panel, in inches."""
MARGIN = 1.0
"""Width and height of the margins together, in inches."""
BINS = 20
ENDS = (0.025, 0.5, 0.975)


def posterior_figure(study: StoredStudy) -> Figure:
    """Plot the posterior of the parameters of a calibrated study.

    The diagonal has the distribution of each parameter, with the median and the 95 %
    credible interval as lines. Below are the kept draws by pairs of parameters. The
    axes span the prior, and the distributions are weighted. Needs the package corner.

    Raises
    ------
    ChoiceError
        The spec has no `calibrate`, no parameter has numbers, or corner is not
        installed.

    Examples
    --------
    >>> study = sweep.load("my/fit")
    >>> posterior_figure(study).savefig("posterior.pdf")
    """
    return draw_posterior(study, posterior(study))


def _lacks() -> str:
    """Return what to install before a posterior can be drawn; "" if nothing."""
    if find_spec("corner") is None:
        return f"the figure needs the package corner: {installing('calibrate')}"
    return ""


def draw_posterior(study: StoredStudy, outcome: Posterior) -> Figure:
    """Draw the figure of a posterior. Raises ChoiceError as `posterior_figure`.

    Parameters
    ----------
    study : StoredStudy
    outcome : Posterior
    """
    lacking = _lacks()
    if lacking:
        raise ChoiceError(lacking, study.name, "posterior")
    import corner

    if outcome.parameters.empty:
        raise ChoiceError(
            "no parameter of the calibration has numbers", study.name, "posterior"
        )
    parameters = outcome.parameters["parameter"].tolist()
    inches = SIDE * len(parameters) + MARGIN
    # The library places the panels.
    with style.context([STYLE, {"figure.constrained_layout.use": False}]):
        figure = Figure(figsize=(inches, inches))
        corner.corner(
            outcome.draws[parameters].to_numpy(np.float64),
            bins=BINS,
            range=_ranges(outcome),
            weights=outcome.draws["weight"].to_numpy(),
            color=BLUE,
            labels=[quantity(study, name) for name in parameters],
            quantiles=ENDS,
            plot_contours=False,
            plot_density=False,
            no_fill_contours=True,
            data_kwargs={"alpha": 0.3, "ms": 2},
            fig=figure,
        )
        left = 0.7 * MARGIN / inches
        figure.subplots_adjust(
            left=left, bottom=left + 0.3 / inches, right=0.98, top=0.98
        )
        note(figure, _note(outcome))
    return figure


def _ranges(outcome: Posterior) -> list[tuple[float, float]]:
    """Return the ends of each axis: 95 % of the prior, and all kept draws."""
    ranges = []
    for row in outcome.parameters.to_dict("records"):
        values = outcome.draws[row["parameter"]]
        low = min(float(values.min()), row["prior_low"])
        high = max(float(values.max()), row["prior_high"])
        ranges.append((low, high if high > low else low + 1.0))
    return ranges


def _note(outcome: Posterior) -> str:
    checked = "not checked" if outcome.checks.empty else "checked"
    simulations = so_many(len(outcome.draws), "simulation")
    return (
        f"{outcome.study} given {outcome.rule.to}: {simulations} of"
        f" {outcome.simulations:,}, as good as {outcome.effective:,.0f} draws;"
        " median and 95 % credible interval;"
        f" {checked}"
    )


def _check_metrics(study: StoredStudy, choices: Choices) -> None:
    if choices.metrics:
        raise ChoiceError(
            "shows parameters, and takes no metric", study.name, "posterior"
        )


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure. Raises ChoiceError as `posterior_figure`, and for metrics."""
    outcome = posterior(study)
    _check_metrics(study, choices)
    return [Planned("", partial(draw_posterior, study, outcome))]


def marks(study: StoredStudy, choices: Choices) -> FigureMarks:
    """Return a panel per parameter: the distance from the data by its value.

    The colours are the generations, and the kept simulations are marked as best.
    Raises ChoiceError as `posterior_figure`, and for metrics.
    """
    _check_metrics(study, choices)
    check_is_calibrated(study)
    simulations = StoredSimulations(study)
    target = simulations.targets()[0]
    table = simulations.every(target)
    population = target.population
    nearest = np.zeros(len(table), np.bool_)
    nearest[population.nearest] = True
    most = min(len(population.generations), MOST_COLOURS) - 1
    points = simulations.points.iloc[simulations.places(target)]
    distance = population.distances
    columns = {
        "y": distance,
        "low": distance,
        "high": distance,
        "n": simulations.rule.replicates,
        "colour": table["generation"].clip(upper=most).to_numpy(),
        "point": points.to_numpy(),
        "best": nearest,
    }
    within = np.isfinite(distance)
    generations = ["prior", *map(str, range(1, most + 1))]
    if most + 1 < len(population.generations):
        generations[-1] = f"from {most}"
    return FigureMarks(
        "points",
        (),
        [
            _panel(study, name, table[name], pd.DataFrame(columns)[within])
            for name in simulations.rule.priors
        ],
        f"{len(table):,} simulations of {study.name}, and their distance from"
        f" {simulations.rule.to}; ringed: the {len(population.nearest):,} nearest;"
        " sweep posterior prints the estimates",
        by="generation",
        values=tuple(generations),
    )


def _panel(
    study: StoredStudy, name: str, values: "pd.Series[Any]", table: pd.DataFrame
) -> MarkedPanel:
    numbers = is_number(values)
    names = () if numbers else tuple(dict.fromkeys(map(str, values)))
    places = values if numbers else values.map(str).map(names.index)
    table = table.assign(x=places[table.index].astype(float))
    label = quantity(study, name)
    return MarkedPanel(
        "",
        MarkedAxis(name, label, names=names),
        MarkedAxis("distance", "distance from the data", low=0.0),
        table,
    )


KIND = FigureKind(
    "the posterior of a calibrated study, by parameter",
    (),
    plan,
    marks=marks,
    lacks=_lacks,
)
