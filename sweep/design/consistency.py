"""Requirements on combinations of parameters that hold in every study."""

import math
from collections.abc import Iterator

import numpy as np

from kernels.settings import PIXELS, Demand
from sweep.design.goals import check_goals
from sweep.design.medium import MEDIUM_DEMANDS, check_medium
from sweep.design.motors import MOTOR_DEMANDS, check_motors
from sweep.design.obstacles import check_obstacles
from sweep.design.points import SIDES, Points
from sweep.design.senses import check_senses
from sweep.design.spreads import check_spreads
from sweep.spec import Mistakes, Study, parse

MOST_SIDE = 1e15
ROUNDING = 1e-9
"""Relative error of a product of the time step that is allowed in a comparison."""
DEMANDS = (
    Demand(
        f"max(width, height) <= {MOST_SIDE}",
        f"the world is larger than {MOST_SIDE:g} (positions would have no decimals)",
    ),
    Demand(
        "2 * start_margin < min(width, height)",
        "start_margin leaves boids no room:"
        " the margin must be less than half of width and of height",
    ),
    Demand(
        "map != 'random_obstacles' or n_obstacles == 0 or 2 * obstacle_margin <="
        " min(width, height)",
        "obstacle_margin leaves obstacles no room:"
        " the margin must be at most half of width and of height",
    ),
    Demand(
        "start_radius == 0 or start_margin <= start_center_x <= width - start_margin"
        " and start_margin <= start_center_y <= height - start_margin",
        "the centre of the start is outside the world, or in the start_margin",
    ),
    Demand(
        "not minimum_image or borders == 'torus'",
        "minimum_image needs periodic boundaries, borders: torus",
    ),
)


def check_consistency(study: Study, points: Points) -> None:
    """Raise SpecError if the parameters of a point are not consistent.

    The error covers all mistakes and names the first point of each mistake.
    """
    mistakes = Mistakes()
    for demand in dict.fromkeys(_demands(study)):
        mistakes.read(_check_demand, study, points, demand)
    mistakes.read(check_motors, study, points)
    mistakes.read(check_senses, study, points)
    mistakes.read(check_medium, study, points)
    mistakes.read(check_obstacles, study, points)
    mistakes.read(check_spreads, study, points)
    mistakes.read(check_goals, study, points)
    mistakes.read(_check_flocks, study, points)
    mistakes.check()


def _check_demand(study: Study, points: Points, demand: Demand) -> None:
    condition = parse(demand.condition, study.settings)
    # The map comes last, because the map defines width and height.
    named = [
        *sorted(condition.names),
        *(["map"] if condition.names & set(SIDES) else []),
    ]
    place = next(filter(None, map(study.place_of, named)), None)
    holds = points.evaluate(study, condition, place or ("model",))
    if not holds.all():
        where = points.describe(int(np.argmin(holds)), condition.names)
        raise study.document.error(place or ("model",), demand.message + where)


def _check_flocks(study: Study, points: Points) -> None:
    """Raise SpecError if a start with one flock per replicate does not fit the study.

    The start needs a study with `replicates` and a design, no `seeds`, and enough
    flocks.
    """
    for name, start in study.catalogue.starts.items():
        if not start.by_replicate:
            continue
        place = study.place_of("start_draws") or ("model",)
        condition = parse(f"start_draws != '{name}'", study.settings)
        if points.evaluate(study, condition, place).all():
            continue
        count = len(start.by_replicate)
        flocks = f"{start.source} has the flocks of {count} replicates"
        if study.seeds or not study.has_design:
            raise study.document.error(
                place, f"{flocks}: use a sweep with `replicates`, without `seeds`"
            )
        if study.trials_per_point > count:
            raise study.document.error(
                ("replicates",),
                f"{flocks}, but a point may have {study.trials_per_point}",
            )


def _profile_demands(study: Study) -> Iterator[Demand]:
    """Yield the requirements of the axes of recorded profiles."""
    every = study.record.every
    events = study.catalogue.models[study.model].events
    if study.record.profiles and not events:
        yield Demand(
            f"steps >= {every}",
            f"profiles need a frame in the second half: `every` is {every}, beyond the"
            " last step",
        )
    for recorded in study.record.profiles:
        name = recorded.name
        axis = study.catalogue.profiles[name].axis
        if recorded.to is None:
            continue
        if axis in ("lag", "individual"):
            yield Demand(
                f"{recorded.to} >= {every} * dt * {1.0 - ROUNDING}",
                f"{name} goes to a lag of {recorded.to:g}, below the time between two"
                " frames",
            )
            longest = max((event.steps for event in events), default=None)
            yield Demand(
                f"{recorded.to} <= {longest} * dt"
                if longest
                else f"2 * {recorded.to} <= steps * dt",
                f"{name} goes to a lag of {recorded.to:g}, beyond"
                f" {'each event' if longest else 'the second half of the trial'}",
            )
        if axis == "wave number":
            yield Demand(
                f"{recorded.to} * max(width, height) > {math.pi}",
                f"{name} goes to a wave number of {recorded.to:g}, below that of the"
                " longest wave in the world, 2 pi / max(width, height)",
            )
        if axis == "distance":
            yield Demand(
                f"borders != 'torus' or 2 * {recorded.to} <= min(width, height)",
                f"{name} goes to {recorded.to:g}; with periodic borders a distance is"
                " at most half of the shorter side of the world",
            )


def _demands(study: Study) -> Iterator[Demand]:
    """Yield the requirements of starts, every study, recorded metrics and the model."""
    metrics = [study.catalogue.metrics[name] for name in study.record.metrics]
    model = study.catalogue.models[study.model]
    for name, start in study.catalogue.starts.items():
        for demand in start.demands:
            condition = f"start_draws != '{name}' or ({demand.condition})"
            yield demand._replace(condition=condition)
    yield from DEMANDS
    yield from MOTOR_DEMANDS
    yield from MEDIUM_DEMANDS
    if study.record.heatmaps:
        yield from PIXELS
    for metric in metrics:
        yield from metric.demands
    yield from _profile_demands(study)
    yield from model.demands
    if any(metric.potential for metric in metrics):
        yield from model.potential_demands
