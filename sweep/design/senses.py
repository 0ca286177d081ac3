"""What the settings of sensing must fulfil together, and the model that has them."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sweep.design.points import Points
from sweep.design.published_steps import check_published
from sweep.spec.document import Place
from sweep.spec.mistakes import Mistakes
from sweep.spec.study import Study

MOST_BYTES = 2**28
"""Of the messages that are under way in one trial."""
MOST_STEPS = 2.0**53
"""Of a time: a double beyond does not tell one step from the next."""
NEARLY = 1e-9
"""So much of a step may a time be off a whole number of steps, and of this number."""
NOISES = "position_noise", "velocity_noise"
Mask = NDArray[np.bool_]


def check_senses(study: Study, points: Points) -> None:
    """Raise SpecError where boids cannot sense as wanted, and for a model that does not
    let its boids measure and hear. Of each thing that is wrong it names the first
    point.
    """
    mistakes = Mistakes()

    def refuse(names: Sequence[str], wrong: Mask, say: Callable[..., str]) -> None:
        mistakes.read(_refuse, study, points, names, wrong, say)

    times = [name for name, one in study.settings.items() if one.whole_steps]
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
    noisy = _above(points, "position_noise"), _above(points, "velocity_noise")
    coupled = points.column("noise_form") == "coupled"
    incomplete = ~(noisy[0] & noisy[1] & _above(points, "noise_time"))
    needed = ("noise_form", "position_noise", "velocity_noise", "noise_time")
    some = noisy[0] | noisy[1]
    refuse(needed, coupled & some & incomplete, _half_coupled)
    hides = np.isin(points.column("occlusion"), ("boids", "both"))
    bodiless = hides & ~_above(points, "body_radius")
    refuse(("occlusion", "body_radius"), bodiless, _bodiless)
    mistakes.read(_check_model, study, points)
    mistakes.check()


def _above(points: Points, name: str) -> Mask:
    """Where a setting is above 0."""
    found: Mask = points.column(name) > 0.0
    return found


def _steps(points: Points, name: str) -> NDArray[np.float64]:
    """How many steps a time is at each point; infinitely many beyond MOST_STEPS."""
    with np.errstate(over="ignore"):
        found: NDArray[np.float64] = points.column(name) / points.column("dt")
    return np.where(found <= MOST_STEPS, found, np.inf)


def _few_steps(points: Points, name: str) -> NDArray[np.float64]:
    """The same, with none where they are infinitely many: that is refused by itself."""
    found = _steps(points, name)
    return np.where(np.isfinite(found), found, 0.0)


def _refuse(
    study: Study,
    points: Points,
    names: Sequence[str],
    wrong: Mask,
    say: Callable[..., str],
) -> None:
    """Raise SpecError for the first point that is wrong, with what to say of its
    values of the named settings.
    """
    if wrong.any():
        first = int(np.argmax(wrong))
        values = [points.column(name)[first] for name in names]
        said = f"{say(names[0], *values)}{points.describe(first, names)}"
        raise study.document.error(_place(study, names), said)


def _place(study: Study, names: Sequence[str]) -> Place:
    """Where the first of these settings stands that the spec has."""
    return next(filter(None, map(study.place_of, names)), None) or ("model",)


def _infinite(name: str, _value: float) -> str:
    return f"{name} must be finite"


def _too_many(name: str, value: float, dt: float) -> str:
    most = MOST_STEPS * dt
    return f"{name} must be at most 2^53 steps of dt, {most:.12g}, not {value:.12g}"


def _between_steps(name: str, value: float, dt: float) -> str:
    below = int(value // dt)
    return (
        f"{name} must be a whole number of steps of dt:"
        f" {below * dt:.12g} or {(below + 1) * dt:.12g}, not {value:.12g}"
    )


def _too_large(_name: str, _value: float, dt: float, n: int) -> str:
    most = int(MOST_BYTES // (32 * n)) - 1
    return (
        f"the messages of {n} boids that are under way need more than"
        f" {MOST_BYTES // 2**20} MiB: a sensing_delay up to {most * dt:.12g} fits"
    )


def _half_coupled(*_values: Any) -> str:
    return (
        "coupled errors need position_noise, velocity_noise and noise_time above 0: the"
        " error of the place is the integral of that of the velocity"
    )


def _bodiless(*_values: Any) -> str:
    return "boids that hide others need a body_radius above 0"


def _check_model(study: Study, points: Points) -> None:
    """Refuse boids that are to measure and hear, of a model that does not let them."""
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
            check_published(study, name, "whose boids measure and hear")
