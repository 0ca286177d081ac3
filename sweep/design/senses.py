"""Requirements of sensing on parameters, and on the model."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.design.points import Points
from sweep.design.published_steps import check_published
from sweep.spec import Mistakes, Place, Study

MOST_BYTES = 2**28
"""Bound of the messages in transit in one trial."""
MOST_STEPS = 2.0**53
"""Bound of a time in steps: a double cannot represent each larger integer."""
NEARLY = 1e-9
"""Tolerance of an integer number of steps: in steps, and relative to the number."""
NOISES = "position_noise", "velocity_noise"
Mask = NDArray[np.bool_]


def check_senses(study: Study, points: Points) -> None:
    """Raise SpecError if sensing is not consistent or not supported by the model.

    The error covers all mistakes and names the first point of each mistake.
    """
    mistakes = Mistakes()

    def refuse(names: Sequence[str], wrong: Mask, say: Callable[..., str]) -> None:
        mistakes.read(_refuse, study, points, names, wrong=wrong, say=say)

    times = [name for name, setting in study.settings.items() if setting.whole_steps]
    for name in (*NOISES, *times):
        refuse((name,), np.isinf(points.column(name)), _infinite)
    for name in times:
        finite = np.isfinite(points.column(name))
        many = finite & ~np.isfinite(_steps(points, name))
        refuse((name, "dt"), many, _too_many)
        off = _few_steps(points, name)
        apart = np.abs(off - np.rint(off)) > NEARLY * np.maximum(1.0, off)
        refuse((name, "dt"), apart, _between_steps)
    size = 32.0 * points.column("n") * (_few_steps(points, "sensing_delay") + 1.0)
    refuse(
        ("sensing_delay", "dt", "n"),
        size > MOST_BYTES,
        _too_large,
    )
    noisy_position = _above(points, "position_noise")
    noisy_velocity = _above(points, "velocity_noise")
    coupled = points.column("noise_form") == "coupled"
    incomplete = ~(noisy_position & noisy_velocity & _above(points, "noise_time"))
    needed = ("noise_form", "position_noise", "velocity_noise", "noise_time")
    noisy = noisy_position | noisy_velocity
    refuse(needed, coupled & noisy & incomplete, _half_coupled)
    hides = np.isin(points.column("occlusion"), ("boids", "both"))
    bodiless = hides & ~_above(points, "body_radius")
    refuse(("occlusion", "body_radius"), bodiless, _bodiless)
    mistakes.read(_check_model, study, points)
    mistakes.check()


def _above(points: Points, name: str) -> Mask:
    """Return a mask of the points where a parameter is above 0."""
    above: Mask = points.column(name) > 0.0
    return above


def _steps(points: Points, name: str) -> NDArray[np.float64]:
    """Return a time in steps at each point; infinity beyond MOST_STEPS."""
    with np.errstate(over="ignore"):
        steps: NDArray[np.float64] = points.column(name) / points.column("dt")
    return np.where(steps <= MOST_STEPS, steps, np.inf)


def _few_steps(points: Points, name: str) -> NDArray[np.float64]:
    """Return a time in steps at each point; 0 for infinity, a separate error."""
    steps = _steps(points, name)
    return np.where(np.isfinite(steps), steps, 0.0)


def _refuse(
    study: Study,
    points: Points,
    names: Sequence[str],
    wrong: Mask,
    say: Callable[..., str],
) -> None:
    """Raise SpecError for the first point where the mask `wrong` is true.

    `say` gets the first name and the values of the named parameters at this point.
    """
    if wrong.any():
        first = int(np.argmax(wrong))
        values = [points.column(name)[first] for name in names]
        message = f"{say(names[0], *values)}{points.describe(first, names)}"
        raise study.document.error(_place(study, names), message)


def _place(study: Study, names: Sequence[str]) -> Place:
    """Return the key of the first of these parameters that the spec contains."""
    return next(filter(None, map(study.place_of, names)), None) or ("model",)


def _infinite(name: str, _value: float) -> str:
    return f"{name} must be finite"


def _too_many(name: str, value: float, dt: float) -> str:
    most = MOST_STEPS * dt
    return f"{name} must be at most 2^53 steps of dt, {most:.12g}, not {value:.12g}"


def _between_steps(name: str, value: float, dt: float) -> str:
    below = int(value // dt)
    return (
        f"{name} = {value:.12g} is not a multiple of dt"
        f" (use {below * dt:.12g} or {(below + 1) * dt:.12g})"
    )


def _too_large(_name: str, _value: float, dt: float, n: int) -> str:
    most = int(MOST_BYTES // (32 * n)) - 1
    return (
        f"messages in transit between {n} boids need more than"
        f" {MOST_BYTES // 2**20} MiB; allowed: sensing_delay up to {most * dt:.12g}"
    )


def _half_coupled(*_values: Any) -> str:
    return (
        "coupled errors need position_noise, velocity_noise and noise_time above 0: the"
        " position error is the integral of the velocity error"
    )


def _bodiless(*_values: Any) -> str:
    return "occlusion by boids needs a body_radius above 0"


def _check_model(study: Study, points: Points) -> None:
    """Raise SpecError if boids sense, and the model does not support sensing."""
    for name, on in (
        ("position_noise", _above(points, "position_noise")),
        ("velocity_noise", _above(points, "velocity_noise")),
        ("sensing_delay", _above(points, "sensing_delay")),
        ("sensing_period", _few_steps(points, "sensing_period") > 1.5),
        ("radio_range", ~np.isinf(points.column("radio_range"))),
        ("packet_loss", _above(points, "packet_loss")),
        ("occlusion", points.column("occlusion") != "none"),
    ):
        if on.any():
            check_published(study, name, "with sensing and communication")
